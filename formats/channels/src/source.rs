//! Where the bytes of a format are: the file itself, or what was packed in it.

use std::{
    fs::File,
    io::{Read, Write},
    sync::Arc,
};

use runout_core::{Error, ErrorKind, Result, input_file::InputFile};
use tempfile::NamedTempFile;

/// Bytes that can be read from any place, by several readers at a time.
#[derive(Clone)]
pub(crate) enum Source {
    File(InputFile),
    /// A temporary file, which is removed when the last reader is done.
    Unpacked(Arc<Unpacked>),
}

/// What was unpacked.
pub(crate) struct Unpacked {
    file: NamedTempFile,
    bytes: u64,
    shown: String,
}

/// Unpacks to a temporary file, so that memory does not grow with what is packed.
pub(crate) struct Unpacking {
    file: NamedTempFile,
    bytes: u64,
    shown: String,
}

impl Unpacking {
    pub(crate) fn of(shown: &str) -> Result<Self> {
        let file = NamedTempFile::new().map_err(|error| Error::caused("unpack", shown, error))?;
        Ok(Self { file, bytes: 0, shown: shown.to_owned() })
    }

    /// Appends what a reader gives, and says where it begins and ends.
    pub(crate) fn append(&mut self, from: &mut dyn Read) -> Result<(u64, u64)> {
        let begin = self.bytes;
        let copied = std::io::copy(from, &mut self.file).map_err(|error| {
            // So decompressors report a damaged stream.
            let damaged = matches!(error.kind(), std::io::ErrorKind::InvalidInput | std::io::ErrorKind::Other);
            let error = Error::caused("unpack", &self.shown, error);
            if damaged { error.of(ErrorKind::DamagedData) } else { error }
        })?;
        self.bytes += copied;
        Ok((begin, self.bytes))
    }

    pub(crate) fn finish(mut self) -> Result<Source> {
        self.file.flush().map_err(|error| Error::caused("unpack", &self.shown, error))?;
        let Self { file, bytes, shown } = self;
        Ok(Source::Unpacked(Arc::new(Unpacked { file, bytes, shown })))
    }
}

impl Source {
    pub(crate) fn open(&self) -> Result<File> {
        match self {
            Self::File(input) => input.open(),
            Self::Unpacked(unpacked) => {
                unpacked.file.reopen().map_err(|error| Error::caused("read", &unpacked.shown, error))
            }
        }
    }

    pub(crate) fn bytes(&self) -> u64 {
        match self {
            Self::File(input) => input.bytes(),
            Self::Unpacked(unpacked) => unpacked.bytes,
        }
    }

    /// Its name, for messages.
    pub(crate) fn shown(&self) -> String {
        match self {
            Self::File(input) => input.path().display().to_string(),
            Self::Unpacked(unpacked) => unpacked.shown.clone(),
        }
    }
}

impl From<&InputFile> for Source {
    fn from(input: &InputFile) -> Self {
        Self::File(input.clone())
    }
}
