//! A file that is read: the same one from its first opening to its checksum.

use std::{
    fs::{File, Metadata},
    io::{self, Read},
    path::{Path, PathBuf},
    time::SystemTime,
};

use runout_error::{Error, ErrorKind, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A file that was read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Input {
    /// Its path, as it was opened.
    pub path: String,
    /// Its size in bytes.
    pub bytes: u64,
    /// BLAKE3 of its contents, in hexadecimal (`b3sum` prints the same).
    pub blake3: String,
}

impl Input {
    /// Reads the file once for its checksum.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn of(path: &Path) -> Result<Self> {
        InputFile::new(path)?.checksum()
    }
}

/// A regular file as it was when it was first opened.
///
/// Readers [open](Self::open) it as often as they like: each opening is refused when another file, or other contents, are in its place.
/// [`check`](Self::check) looks once more at the end. What is compared is device, inode, size and time of modification.
#[derive(Debug, Clone, PartialEq)]
pub struct InputFile {
    path: PathBuf,
    identity: Identity,
}

/// What distinguishes two states of files.
#[derive(Debug, Clone, PartialEq)]
struct Identity {
    /// Device and inode, where the system has them.
    place: Option<(u64, u64)>,
    bytes: u64,
    modified: Option<SystemTime>,
}

impl Identity {
    fn of(found: &Metadata) -> Self {
        #[cfg(unix)]
        let place = {
            use std::os::unix::fs::MetadataExt;
            Some((found.dev(), found.ino()))
        };
        #[cfg(not(unix))]
        let place = None;
        Self { place, bytes: found.len(), modified: found.modified().ok() }
    }
}

impl InputFile {
    /// Remembers a file as it is now.
    ///
    /// # Errors
    /// When it is not there, cannot be read, or is no regular file: a pipe or a device has no end.
    pub fn new(path: &Path) -> Result<Self> {
        let file = open_regular(path).map_err(|error| opening(path, error))?;
        let found = file.metadata().map_err(|error| opening(path, error))?;
        Ok(Self { path: path.to_owned(), identity: Identity::of(&found) })
    }

    /// Its path, as it was given.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its size in bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.identity.bytes
    }

    /// Opens it for reading.
    ///
    /// # Errors
    /// When it cannot be read, or is not the file that it was.
    pub fn open(&self) -> Result<File> {
        let file = open_regular(&self.path).map_err(|error| opening(&self.path, error))?;
        self.compare(&file.metadata().map_err(|error| opening(&self.path, error))?)?;
        Ok(file)
    }

    /// Looks whether its path still leads to the same, unchanged file.
    ///
    /// # Errors
    /// When it does not.
    pub fn check(&self) -> Result<()> {
        self.compare(&std::fs::metadata(&self.path).map_err(|error| opening(&self.path, error))?)
    }

    /// Its checksum.
    ///
    /// # Errors
    /// When it cannot be read, or changed since it was first opened.
    pub fn checksum(&self) -> Result<Input> {
        let shown = self.path.display().to_string();
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(self.open()?).map_err(|error| Error::caused("checksum", &shown, error))?;
        self.check()?;
        Ok(Input { path: shown, bytes: self.identity.bytes, blake3: hasher.finalize().to_hex().to_string() })
    }

    fn compare(&self, found: &Metadata) -> Result<()> {
        let found = Identity::of(found);
        let problem = match &self.identity {
            known if *known == found => return Ok(()),
            known if known.place != found.place => "another file took its place while it was read",
            known if known.bytes != found.bytes => "its size changed while it was read",
            _ => "it was written to while it was read",
        };
        Err(Error::new("read", self.path.display().to_string(), problem)
            .of(ErrorKind::Io)
            .help("read it when nothing writes to it"))
    }
}

fn opening(path: &Path, error: io::Error) -> Error {
    Error::caused("open", path.display().to_string(), error)
}

/// Opens a regular file for reading; anything else may wait for ever, or never end.
///
/// # Errors
/// When it cannot be opened, or is a folder, a pipe, a device or a socket.
pub fn open_regular(path: &Path) -> io::Result<File> {
    // A pipe waits for a writer when it is opened: it is examined before.
    regular(&std::fs::metadata(path)?)?;
    let file = File::open(path)?;
    regular(&file.metadata()?)?;
    Ok(file)
}

/// Reads a regular file as text.
///
/// # Errors
/// When it cannot be read, is no regular file, or is not UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    open_regular(path)?.read_to_string(&mut text).map(|_| text)
}

fn regular(found: &Metadata) -> io::Result<()> {
    if found.is_file() {
        return Ok(());
    }
    if found.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "expected a file, found a folder"));
    }
    let problem = "expected a file, found a pipe, a device or a socket; copy what it gives to a file";
    Err(io::Error::new(io::ErrorKind::InvalidInput, problem))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use std::fs;

    use super::*;

    #[test]
    fn a_file_that_was_replaced_or_written_to_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let [path, other] = ["a", "b"].map(|name| folder.path().join(name));
        fs::write(&path, "1234").unwrap();
        let file = InputFile::new(&path).unwrap();
        assert_eq!(file.checksum().unwrap().blake3, blake3::hash(b"1234").to_hex().to_string());
        fs::write(&other, "5678").unwrap();
        fs::rename(&other, &path).unwrap();
        for error in [file.checksum().unwrap_err(), file.check().unwrap_err(), file.open().map(|_| ()).unwrap_err()] {
            assert!(error.to_string().contains("another file took its place"), "{error}");
        }
        let file = InputFile::new(&path).unwrap();
        fs::write(&path, "56789").unwrap();
        assert!(file.check().unwrap_err().to_string().contains("its size changed"));
        let file = InputFile::new(&path).unwrap();
        let later = SystemTime::now() + std::time::Duration::from_secs(2);
        File::options().write(true).open(&path).unwrap().set_modified(later).unwrap();
        assert!(file.check().unwrap_err().to_string().contains("written to"));
        fs::remove_file(&path).unwrap();
        assert_eq!(file.check().unwrap_err().kind(), ErrorKind::MissingFile);
    }

    #[test]
    #[cfg(unix)]
    fn what_is_no_file_is_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        for (path, word) in [(pipe.as_path(), "pipe"), (Path::new("/dev/zero"), "device"), (folder.path(), "folder")] {
            let error = InputFile::new(path).unwrap_err();
            assert!(error.to_string().contains(word), "{error}");
        }
    }
}
