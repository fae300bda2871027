//! Files that appear whole or not at all, one by one or together.

mod durable;
mod faults;
mod full_disk;
mod lock;
mod publication;
mod under_way;

use std::{
    fs,
    io::{ErrorKind as ErrorKindOfSystem, Write},
    path::{Component, Path, PathBuf},
};

pub use lock::FolderLock;
use runout_error::{Error, ErrorKind, Result};
use runout_numerics::threads;
use under_way::{ABANDONED, UnderWay};
pub use under_way::{Abandoned, abandon_all};

/// A file being written under a temporary name beside its final one.
///
/// [`commit`](Self::commit) renames it; dropped without, it is removed, and with it the folders that were made for it, where
/// nothing else came into them. Whatever was there before stays until then.
#[derive(Debug)]
pub struct PendingFile {
    temporary: PathBuf,
    destination: PathBuf,
    committed: bool,
}

impl PendingFile {
    /// Reserves a temporary name beside `destination`, creating its folder.
    ///
    /// # Errors
    /// When the folder cannot be made, `destination` is a folder, or all work is [abandoned](abandon_all).
    pub fn new(destination: impl Into<PathBuf>) -> Result<Self> {
        let destination = destination.into();
        let shown = destination.display().to_string();
        // A rename would put a file in the place of a folder, a device or a pipe.
        if fs::metadata(&destination).is_ok_and(|found| !found.is_file()) {
            return Err(Error::new("write", shown, "what is there is no file").of(ErrorKind::Io).help("name a file"));
        }
        let name = destination
            .file_name()
            .ok_or_else(|| Error::new("write", &shown, "the path ends in no file name").of(ErrorKind::Configuration))?
            .to_string_lossy()
            .into_owned();
        let folder = folder_of(&destination);
        let is_new = make(folder).map_err(|error| no_folder(folder, error))?;
        if !is_new {
            remove_stale(folder, &name);
        }
        let temporary = folder.join(format!(".{name}.{}{PARTIAL}", unpredictable()));
        let mut under_way = UnderWay::now();
        if under_way.abandoning > 0 {
            return Err(Error::new("write", &shown, ABANDONED).of(ErrorKind::Interrupted));
        }
        under_way.files.push(temporary.clone());
        Ok(Self { temporary, destination, committed: false })
    }

    /// Where to write now.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.temporary
    }

    /// Where the file will appear.
    #[must_use]
    pub fn destination(&self) -> &Path {
        &self.destination
    }

    /// Creates the temporary file for writing.
    ///
    /// # Errors
    /// When the file system refuses.
    pub fn create(&self) -> Result<fs::File> {
        // Neither a file nor a link may be there already.
        let create = || fs::File::options().read(true).write(true).create_new(true).open(&self.temporary);
        faults::step().and_then(|()| create()).map_err(|error| self.caused(error))
    }

    /// Creates the temporary file with these contents.
    ///
    /// # Errors
    /// When the file system refuses.
    pub fn write(&self, contents: &[u8]) -> Result<()> {
        self.create()?.write_all(contents).map_err(|error| self.caused(error))
    }

    /// Refuses to begin what may not fit: a library that the disk fails in the middle of a file may not survive it.
    ///
    /// # Errors
    /// When fewer bytes are free where it will lie.
    pub fn room_for(&self, bytes: u64) -> Result<()> {
        let folder = self.temporary.parent().filter(|folder| !folder.as_os_str().is_empty());
        match fs4::available_space(folder.unwrap_or(Path::new("."))) {
            Ok(free) if free < bytes => {
                let [wanted, free] = [bytes, free].map(|bytes| bytes as f64 / 1e6);
                let problem = format!("it may take {wanted:.1} MB, and {free:.1} MB are free there");
                Err(self.failure(problem).of(ErrorKind::Io).help("make room, or write elsewhere"))
            }
            // Where the system does not report free space, the attempt decides.
            _ => Ok(()),
        }
    }

    /// An error about this file, named by its final name: what is to be written cannot be.
    pub fn failure(&self, problem: impl ToString) -> Error {
        Error::new("write", self.destination.display().to_string(), problem)
    }

    /// The error of an attempt to write this file, named by its final name.
    pub fn caused(&self, error: impl std::error::Error + Send + Sync + 'static) -> Error {
        if full_disk::is_cause(&error) {
            return self.failure("no space is left there").of(ErrorKind::Io).help(full_disk::HELP);
        }
        Error::caused("write", self.destination.display().to_string(), error)
    }

    /// Gives the file its final name, replacing what was there.
    ///
    /// # Errors
    /// When the file system refuses the rename, or the file was [abandoned](abandon_all).
    pub fn commit(self) -> Result<PathBuf> {
        let destination = self.destination.clone();
        commit_all(vec![self]).map(|_| destination)
    }
}

impl Drop for PendingFile {
    fn drop(&mut self) {
        if !self.committed {
            UnderWay::now().remove(&self.temporary);
        }
    }
}

/// What temporary names end in.
const PARTIAL: &str = ".partial";

/// A part of a name that nobody knows before: this process and a random number.
fn unpredictable() -> String {
    format!("{}-{:016x}", std::process::id(), rand::random::<u64>())
}

/// Whether there is a process of this number that has not ended; where the system does not say (no /proc), there may be.
fn is_alive(process: u32) -> bool {
    if !Path::new("/proc/self").exists() {
        return true;
    }
    match fs::read(format!("/proc/{process}/stat")) {
        // A process that has ended keeps its number until its parent asks for it: state Z behind the name, which may hold brackets.
        Ok(about) => {
            let state = about.rsplit(|byte| *byte == b')').next().and_then(|rest| rest.trim_ascii_start().first());
            !matches!(state, Some(b'Z' | b'X'))
        }
        Err(error) => error.kind() != ErrorKindOfSystem::NotFound,
    }
}

/// The folder that a file lies in.
fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Why a folder cannot be made.
fn no_folder(folder: &Path, error: std::io::Error) -> Error {
    let file = folder.ancestors().find(|above| above.exists() && !above.is_dir());
    let failure = Error::caused("create the folder", folder.display().to_string(), error);
    match file {
        Some(file) => failure.help(format!("{} is no folder; name another one", file.display())),
        None => failure,
    }
}

/// Makes a folder, and remembers which of those on the way to it are new. Whether it is new itself.
fn make(folder: &Path) -> std::io::Result<bool> {
    // Most often the folder is there, or the one above it.
    match fs::create_dir(folder) {
        Ok(()) => {
            UnderWay::now().folders.insert(folder.to_path_buf());
            return Ok(true);
        }
        Err(error) if error.kind() == ErrorKindOfSystem::AlreadyExists && folder.is_dir() => return Ok(false),
        Err(_) => {}
    }
    let missing = folder.ancestors().take_while(|above| !above.as_os_str().is_empty() && !above.exists());
    let missing: Vec<PathBuf> = missing.map(Path::to_path_buf).collect();
    fs::create_dir_all(folder)?;
    let is_new = !missing.is_empty();
    UnderWay::now().folders.extend(missing);
    Ok(is_new)
}

/// Removes what runs that were killed left of the same file: temporary files of processes that are no more. Where the
/// system does not list processes (no /proc), they stay.
fn remove_stale(folder: &Path, name: &str) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let found = entry.file_name();
        let process = found
            .to_str()
            .and_then(|found| found.strip_prefix('.')?.strip_prefix(name)?.strip_prefix('.')?.strip_suffix(PARTIAL))
            .and_then(|rest| rest.split_once('-')?.0.parse::<u32>().ok());
        if process.is_some_and(|process| !is_alive(process)) {
            // Another run may have removed it just now.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Gives finished files their names: all of them, or none. Their contents are synced before, the folders after it.
///
/// # Errors
/// When the file system refuses a rename; those before it are undone.
pub fn commit_all(files: Vec<PendingFile>) -> Result<Vec<PathBuf>> {
    commit(files, sync_each, publication::publish)
}

/// Gives finished files their names, the last of them when all others have theirs and these last: whoever finds the last file finds all.
/// There is no journal. A part of a data set is published so: nothing else is at its place, and without its last file it is
/// incomplete.
///
/// # Errors
/// When the file system refuses a rename; those before it are undone.
pub fn commit_last_after_others(files: Vec<PendingFile>) -> Result<Vec<PathBuf>> {
    let sync = |files: &[PendingFile]| match durable::all_in(files.iter().map(|file| folder_of(&file.temporary))) {
        Ok(true) => Ok(()),
        Ok(false) => sync_each(files),
        Err(error) => Err(Error::caused("sync", "the file system of the results", error)),
    };
    commit(files, sync, publication::publish_last_after_others)
}

/// One after the other, each would wait for the disk by itself.
fn sync_each(files: &[PendingFile]) -> Result<()> {
    let sync = |file: &PendingFile| durable::file(&file.temporary).map_err(|error| file.caused(error));
    threads::each(files, sync).into_iter().collect()
}

fn commit(
    mut files: Vec<PendingFile>,
    sync: impl FnOnce(&[PendingFile]) -> Result<()>,
    publish: impl FnOnce(&[(&Path, &Path)]) -> Result<()>,
) -> Result<Vec<PathBuf>> {
    let _publishing = UnderWay::now().publish(&files)?;
    sync(&files)?;
    let names: Vec<_> = files.iter().map(|file| (file.temporary.as_path(), file.destination.as_path())).collect();
    publish(&names)?;
    let mut under_way = UnderWay::now();
    for file in &mut files {
        under_way.committed(&file.temporary);
        file.committed = true;
    }
    Ok(files.iter().map(|file| file.destination.clone()).collect())
}

/// Completes a publication whose run was killed, before a file that it may have replaced is read as a result.
///
/// # Errors
/// When a run publishes there now, or the publication cannot be completed: files beside each other may then be of two runs.
pub fn complete_publication(file: &Path) -> Result<()> {
    if !publication::is_under_way(folder_of(file)) {
        return Ok(());
    }
    FolderLock::of([file]).map(drop).map_err(|error| {
        let problem = format!("results beside it were not published as a whole: {error}");
        Error::new("read", file.display().to_string(), problem)
            .of(ErrorKind::Io)
            .help("wait for the run that publishes them, or make the folder writable, or run the pipeline again")
    })
}

/// One spelling of a path, the same for all paths to the same file, whether or not it exists yet.
#[must_use]
pub fn resolved(path: &Path) -> PathBuf {
    if let Ok(found) = path.canonicalize() {
        return found;
    }
    let mut spelled = PathBuf::new();
    for component in std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf()).components() {
        match component {
            Component::ParentDir => {
                spelled.pop();
            }
            other => spelled.push(other),
        }
    }
    // Links are followed as far as there is something.
    match (spelled.parent().and_then(|parent| parent.canonicalize().ok()), spelled.file_name()) {
        (Some(parent), Some(name)) => parent.join(name),
        _ => spelled,
    }
}

/// Writes `contents` whole or not at all.
///
/// # Errors
/// When the folder or the file cannot be written.
pub fn write(destination: impl Into<PathBuf>, contents: &[u8]) -> Result<PathBuf> {
    let pending = PendingFile::new(destination)?;
    pending.write(contents)?;
    pending.commit()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    /// A process that was killed, and that its parent has not asked for yet, holds no temporary files.
    #[test]
    fn a_process_that_has_ended_is_not_alive() {
        if !Path::new("/proc/self").exists() {
            return;
        }
        assert!(is_alive(std::process::id()) && !is_alive(u32::MAX));
        let mut child = std::process::Command::new("sleep").arg("60").spawn().unwrap();
        assert!(is_alive(child.id()));
        child.kill().unwrap();
        // The system may take a moment to end it.
        let ended = (0..200).any(|_| {
            std::thread::sleep(std::time::Duration::from_millis(5));
            !is_alive(child.id())
        });
        assert!(ended && Path::new(&format!("/proc/{}", child.id())).exists(), "it was not asked for");
        child.wait().unwrap();
    }

    #[test]
    fn what_cannot_fit_is_refused_and_a_file_in_a_folder_s_place_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let pending = PendingFile::new(folder.path().join("big.h5")).unwrap();
        assert!(pending.room_for(1).is_ok());
        let error = pending.room_for(u64::MAX).unwrap_err();
        assert!(error.to_string().contains("MB are free there") && error.advice().is_some(), "{error}");
        fs::write(folder.path().join("file"), "").unwrap();
        let error = PendingFile::new(folder.path().join("file/deeper/x.csv")).unwrap_err();
        assert!(error.advice().is_some_and(|advice| advice.contains("file is no folder")), "{error:?}");
    }

    #[test]
    fn files_get_their_names_together_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let names = ["a", "deep/b", "c"].map(|name| folder.path().join(name));
        let written = |text: &str| -> Vec<PendingFile> {
            let file = |name: &PathBuf| {
                let file = PendingFile::new(name).unwrap();
                file.write(text.as_bytes()).unwrap();
                file
            };
            names.iter().map(file).collect()
        };
        commit_all(written("old")).unwrap();
        let pending = written("new");
        // What cannot be replaced: a folder with something in it.
        fs::remove_file(&names[2]).unwrap();
        fs::create_dir_all(names[2].join("in the way")).unwrap();
        assert!(commit_all(pending).unwrap_err().to_string().contains("/c"));
        let left = |path: &Path| fs::read_dir(path).unwrap().count();
        assert_eq!([0, 1].map(|place: usize| fs::read_to_string(&names[place]).unwrap()), ["old", "old"]);
        assert_eq!((left(folder.path()), left(&folder.path().join("deep"))), (3, 1));
        fs::remove_dir_all(&names[2]).unwrap();
        commit_all(written("new")).unwrap();
        assert!(names.iter().all(|name| fs::read_to_string(name).unwrap() == "new"));
        assert_eq!((left(folder.path()), left(&folder.path().join("deep"))), (3, 1));
    }

    #[test]
    fn folders_made_for_nothing_go_again() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("old")).unwrap();
        let reserve = |name: &str| PendingFile::new(folder.path().join(name)).unwrap();
        let files = ["old/a", "new/deep/b", "new/c", "new/kept/d"].map(reserve);
        for file in &files {
            file.create().unwrap();
        }
        let [old, deep, new, kept] = files;
        drop(old);
        drop(new);
        kept.commit().unwrap();
        assert!(folder.path().join("new/deep").exists());
        drop(deep);
        assert!(!folder.path().join("new/deep").exists() && folder.path().join("new/kept/d").exists());
        assert!(folder.path().join("old").exists(), "somebody else made it");
        drop(reserve("other/e"));
        assert!(!folder.path().join("other").exists());
    }
}
