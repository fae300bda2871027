//! The files of a recording.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use runout_core::{Result, input_file::InputFile};

use crate::{channel::ChannelFile, formats};

/// The files that were opened.
pub(crate) struct Files {
    folder: PathBuf,
    /// As they were when they were first opened.
    inputs: Mutex<Vec<InputFile>>,
    last: Mutex<Option<(PathBuf, Arc<dyn ChannelFile>)>>,
}

impl Files {
    pub(crate) fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), inputs: Mutex::default(), last: Mutex::default() }
    }

    /// What names of files start from.
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Opens a file; the last one is kept.
    pub(crate) fn open(&self, path: &Path, format: Option<&str>) -> Result<Arc<dyn ChannelFile>> {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((known, file)) = &*last
            && known == path
        {
            return Ok(Arc::clone(file));
        }
        let input = {
            let mut inputs = self.inputs.lock().unwrap_or_else(PoisonError::into_inner);
            let known = inputs.iter().find(|input| input.path() == path).cloned();
            if let Some(input) = known {
                input
            } else {
                let input = InputFile::new(path)?;
                inputs.push(input.clone());
                input
            }
        };
        let file: Arc<dyn ChannelFile> = formats::open(&input, format)?.into();
        *last = Some((path.to_owned(), Arc::clone(&file)));
        Ok(file)
    }

    pub(crate) fn inputs(&self) -> Vec<InputFile> {
        self.inputs.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}
