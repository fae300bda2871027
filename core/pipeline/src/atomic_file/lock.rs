//! One run at a time in a folder of results.

use std::{
    fs::{self, File, TryLockError},
    io::{Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use runout_error::{Error, ErrorKind, Result};

use super::{make, publication, resolved, under_way::UnderWay};

const NAME: &str = ".runout.lock";
/// Bytes of a holder's name that are read, at most.
const LONGEST: u64 = 512;

/// Folders in which no other run publishes while it lives: each has a file `.runout.lock` that names its holder.
///
/// The system gives a lock back when its process ends, however it ends. What a killed run left is cleaned up first: a publication that
/// had begun is completed, everything else is removed.
#[derive(Debug)]
pub struct FolderLock {
    held: Vec<(PathBuf, File)>,
}

impl FolderLock {
    /// Takes the folders of these files.
    ///
    /// # Errors
    /// When another run holds one of them, or the file system refuses.
    pub fn of<'a>(files: impl IntoIterator<Item = &'a Path>) -> Result<Self> {
        // Each folder once, in the spelling in which it was made.
        let mut folders: Vec<(PathBuf, &Path)> = Vec::new();
        for file in files {
            let folder = super::folder_of(file);
            make(folder).map_err(|error| super::no_folder(folder, error))?;
            let place = resolved(folder);
            if folders.iter().all(|(known, _)| *known != place) {
                folders.push((place, folder));
            }
        }
        let mut lock = Self { held: Vec::new() };
        for (_, folder) in folders {
            let path = folder.join(NAME);
            let taken = take(&path)?;
            let locked = taken.is_some();
            if let Some(file) = taken {
                UnderWay::now().locks.push(path.clone());
                lock.held.push((path, file));
            }
            publication::recover(folder, locked)?;
        }
        Ok(lock)
    }
}

impl FolderLock {
    /// Takes none of the folders of these files: a lock that is held already covers them. What killed runs left there is cleaned up.
    ///
    /// # Errors
    /// When the publication of a killed run cannot be completed.
    pub fn covering<'a>(files: impl IntoIterator<Item = &'a Path>) -> Result<Self> {
        files.into_iter().try_for_each(|file| publication::recover(super::folder_of(file), true))?;
        Ok(Self { held: Vec::new() })
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        for (path, file) in self.held.drain(..) {
            // Removed while it is held: whoever opens it later finds out that it is another one.
            let _ = fs::remove_file(&path);
            let mut under_way = UnderWay::now();
            under_way.locks.retain(|lock| *lock != path);
            under_way.remove_made_folders(&path);
            drop(file);
        }
    }
}

/// Takes one lock; `None` on a file system without locks.
fn take(path: &Path) -> Result<Option<File>> {
    let shown = path.display().to_string();
    let failure = |error: std::io::Error| Error::caused("lock", &shown, error);
    loop {
        // A link in its place is somebody else's file.
        if fs::symlink_metadata(path).is_ok_and(|found| !found.is_file()) {
            return Err(Error::new("lock", &shown, "what is there is no file").of(ErrorKind::Io).help("remove it"));
        }
        let mut file =
            File::options().read(true).write(true).create(true).truncate(false).open(path).map_err(failure)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(held(path, &mut file)),
            Err(TryLockError::Error(error)) if error.kind() == std::io::ErrorKind::Unsupported => {
                // Nobody can hold it.
                let _ = fs::remove_file(path);
                return Ok(None);
            }
            Err(TryLockError::Error(error)) => return Err(failure(error)),
        }
        // Whoever held it before has removed the file: it is no longer the one that others see.
        if !is_at(&file, path) {
            continue;
        }
        // Names of files need not be UTF-8.
        let words: Vec<_> = std::env::args_os().take(4).map(|word| word.to_string_lossy().into_owned()).collect();
        let holder = format!("process {} ({})", std::process::id(), words.join(" "));
        file.set_len(0).and_then(|()| file.write_all(holder.as_bytes())).map_err(failure)?;
        return Ok(Some(file));
    }
}

#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |found: fs::Metadata| (found.dev(), found.ino());
    match (file.metadata(), fs::symlink_metadata(path)) {
        (Ok(one), Ok(other)) => identity(one) == identity(other),
        _ => false,
    }
}

#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

/// Another run has it.
fn held(path: &Path, file: &mut File) -> Error {
    let mut holder = String::new();
    let read = file.seek(SeekFrom::Start(0)).and_then(|_| file.take(LONGEST).read_to_string(&mut holder));
    let holder = if read.is_ok() && !holder.is_empty() { holder } else { "another process".to_owned() };
    let folder = path.parent().unwrap_or(path).display().to_string();
    Error::new("write to", folder, format!("{holder} publishes its results there"))
        .of(ErrorKind::Io)
        .help("wait until it ends, or export to another folder")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn a_second_run_hears_who_holds_the_folder_and_nothing_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let [one, other] = ["out/form.parquet", "out/deep/result.h5"].map(|name| folder.path().join(name));
        let lock = FolderLock::of([one.as_path(), other.as_path()]).unwrap();
        let error = FolderLock::of([other.as_path()]).unwrap_err();
        assert!(error.to_string().contains(&format!("process {} (", std::process::id())), "{error}");
        drop(lock);
        assert!(!folder.path().join("out").exists());
        drop(FolderLock::of([other.as_path()]).unwrap());
    }

    #[test]
    #[cfg(unix)]
    fn a_link_in_the_place_of_the_lock_is_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let precious = folder.path().join("precious");
        fs::write(&precious, "text").unwrap();
        std::os::unix::fs::symlink(&precious, folder.path().join(NAME)).unwrap();
        assert!(FolderLock::of([folder.path().join("x").as_path()]).is_err());
        assert_eq!(fs::read_to_string(&precious).unwrap(), "text");
    }
}
