//! A file under its name for messages.

use std::{fs::File, io::Read, path::Path};

use runout_core::{Result, input_file::InputFile};

use crate::map::failed;

/// A file that is read.
pub(crate) struct Input {
    pub file: InputFile,
    /// Its path for messages.
    pub shown: String,
    /// Its size.
    pub bytes: u64,
}

impl Input {
    pub(crate) fn new(path: &Path) -> Result<Self> {
        let file = InputFile::new(path)?;
        Ok(Self { shown: path.display().to_string(), bytes: file.bytes(), file })
    }

    pub(crate) fn open(&self) -> Result<File> {
        self.file.open()
    }

    /// Its first bytes, at most so many.
    pub(crate) fn start(&self, bytes: u64) -> Result<Vec<u8>> {
        let mut start = Vec::new();
        self.open()?.take(bytes).read_to_end(&mut start).map_err(|error| failed(&self.shown, error))?;
        Ok(start)
    }
}
