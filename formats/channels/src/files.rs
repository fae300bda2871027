//! The files of a recording, and their signals read side by side.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use runout_core::{Result, input_file::InputFile};

use crate::{
    capture::{Conversion, Signal},
    channel::{ChannelFile, Samples},
    formats,
};

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

/// Reads the signals of one capture side by side.
pub(crate) struct Readers {
    parts: Vec<Part>,
}

/// What is read of one file.
struct Part {
    samples: Box<dyn Samples>,
    /// Which of the signals.
    signals: Vec<usize>,
    columns: Vec<Vec<f64>>,
}

impl Readers {
    pub(crate) fn open(signals: &[(Signal, Conversion)]) -> Result<Self> {
        let mut parts: Vec<(&Signal, Vec<usize>)> = Vec::new();
        for (number, (signal, _)) in signals.iter().enumerate() {
            match parts.iter_mut().find(|(other, _)| Arc::ptr_eq(&other.file, &signal.file)) {
                Some((_, numbers)) => numbers.push(number),
                None => parts.push((signal, vec![number])),
            }
        }
        let open = |(signal, numbers): (&Signal, Vec<usize>)| {
            let channels: Vec<usize> = numbers.iter().map(|number| signals[*number].0.index).collect();
            let samples = signal.file.read(&channels)?;
            Ok(Part { samples, columns: vec![Vec::new(); numbers.len()], signals: numbers })
        };
        Ok(Self { parts: parts.into_iter().map(open).collect::<Result<_>>()? })
    }

    /// Hands on up to `most` samples of each signal: its number and they.
    pub(crate) fn next(&mut self, most: usize, mut take: impl FnMut(usize, &[f64])) -> Result<()> {
        for Part { samples, signals, columns } in &mut self.parts {
            columns.iter_mut().for_each(Vec::clear);
            // A reader may give fewer at a time.
            let mut left = most;
            while left > 0 {
                match samples.next(left, columns)? {
                    0 => break,
                    taken => left = left.saturating_sub(taken),
                }
            }
            for (signal, column) in signals.iter().zip(&*columns) {
                take(*signal, column);
            }
        }
        Ok(())
    }
}
