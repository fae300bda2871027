//! Several files that get their names together.
//!
//! All of them are written and synced under temporary names first. A journal `.runout-….journal` that names them all is the point of no
//! return: before it nothing has changed, from it on the publication is completed, by the next run where this one is killed. A rename that
//! the file system refuses undoes those before it.

use std::{
    ffi::{OsStr, OsString},
    fs::{self, File},
    io::{self, Write},
    path::{Path, PathBuf},
};

use runout_error::{Error, ErrorKind, Result};
use serde::{Deserialize, Serialize};

use super::{PARTIAL, durable, faults, folder_of, is_alive, unpredictable};

const PREFIX: &str = ".runout-";
const SUFFIX: &str = ".journal";
/// What was there before, until all is done.
const PREVIOUS: &str = ".previous";
/// Bytes of a journal, at most.
const LONGEST: u64 = 1 << 20;

/// A file on its way to its name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Entry {
    /// `None` for the folder of the journal. Names are those of the system: they need not be UTF-8.
    folder: Option<OsString>,
    temporary: OsString,
    name: OsString,
}

/// What a journal says.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Journal {
    /// The files of a publication.
    Files(Vec<Entry>),
    /// Where the journal of a publication lies that has files here too.
    SeeAlso(OsString),
}

impl Entry {
    fn folder<'a>(&'a self, home: &'a Path) -> &'a Path {
        self.folder.as_ref().map_or(home, Path::new)
    }

    /// Gives it its name, where this is still to be done. A journal that somebody made up can name nothing but temporary files.
    fn finish(&self, home: &Path) -> io::Result<()> {
        let plain = |name: &OsStr| Path::new(name).file_name() == Some(name);
        let is_temporary = self.temporary.to_str().is_some_and(|name| name.ends_with(PARTIAL));
        if !plain(&self.name) || !plain(&self.temporary) || !is_temporary {
            return Ok(());
        }
        let folder = self.folder(home);
        match fs::rename(folder.join(&self.temporary), folder.join(&self.name)) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            outcome => outcome,
        }
    }
}

/// Gives synced temporary files their names, `(temporary, destination)`: all of them, or none.
pub(super) fn publish(files: &[(&Path, &Path)]) -> Result<()> {
    let [(_, first), ..] = files else { return Ok(()) };
    if let [(temporary, destination)] = files {
        return single(temporary, destination).map_err(|error| failed(destination, error));
    }
    let home = folder_of(first);
    let journals = write_journals(files, home)?;
    let mut done: Vec<(&Path, &Path, Option<PathBuf>)> = Vec::new();
    let mut failure = None;
    for (temporary, destination) in files {
        let previous = match keep(destination) {
            Ok(previous) => previous,
            Err(error) => {
                failure = Some((destination, error));
                break;
            }
        };
        done.push((temporary, destination, previous));
    }
    if failure.is_none() {
        let renamed = done.iter().position(|(temporary, destination, _)| {
            let outcome = faults::step().and_then(|()| fs::rename(temporary, destination));
            outcome.map_err(|error| failure = Some((destination, error))).is_err()
        });
        if let Some(renamed) = renamed {
            for (temporary, destination, previous) in done[..renamed].iter().rev() {
                // What cannot be undone stays new; the error names the place.
                let _ = fs::rename(destination, temporary);
                let _ = previous.as_ref().map(|previous| fs::rename(previous, destination));
            }
        }
    }
    let synced = match &failure {
        None => folders(files).into_iter().try_for_each(durable::folder),
        Some(_) => Ok(()),
    };
    for path in journals.iter().rev().chain(done.iter().filter_map(|(.., previous)| previous.as_ref())) {
        // What stays is removed by the next run.
        let _ = faults::step().and_then(|()| fs::remove_file(path));
    }
    match failure {
        Some((destination, error)) => Err(failed(destination, error)),
        None => synced.map_err(|error| failed(first, error)),
    }
}

/// Gives synced temporary files their names without a journal: the last one when all others have theirs and these last.
pub(super) fn publish_last_after_others(files: &[(&Path, &Path)]) -> Result<()> {
    let Some((last, others)) = files.split_last() else { return Ok(()) };
    let named = |(temporary, destination): &(&Path, &Path)| {
        let outcome = faults::step().and_then(|()| fs::rename(temporary, destination));
        outcome.map_err(|error| failed(destination, error))
    };
    let sync = |files: &[(&Path, &Path)]| {
        let failed = |folder: &Path, error| Error::caused("write to", folder.display().to_string(), error);
        folders(files).into_iter().try_for_each(|folder| durable::folder(folder).map_err(|error| failed(folder, error)))
    };
    let sync_all = |files: &[(&Path, &Path)]| {
        let is_done = durable::all_in(folders(files)).map_err(|error| failed(last.1, error))?;
        if is_done { Ok(()) } else { sync(files) }
    };
    let mut renamed = 0;
    let outcome = others.iter().try_for_each(|file| {
        named(file)?;
        renamed += 1;
        Ok(())
    });
    if let Err(error) = outcome.and_then(|()| sync_all(others)).and_then(|()| named(last)) {
        for (temporary, destination) in others[..renamed].iter().rev() {
            // What cannot be undone stays, without the last file.
            let _ = fs::rename(destination, temporary);
        }
        return Err(error);
    }
    sync(&[*last])
}

fn failed(destination: &Path, error: io::Error) -> Error {
    Error::caused("write", destination.display().to_string(), error)
}

fn single(temporary: &Path, destination: &Path) -> io::Result<()> {
    faults::step()?;
    fs::rename(temporary, destination)?;
    durable::folder(folder_of(destination))
}

/// Keeps what is at a place under a second name.
fn keep(destination: &Path) -> io::Result<Option<PathBuf>> {
    let name = destination.file_name().unwrap_or_default().to_string_lossy();
    let previous = destination.with_file_name(format!(".{name}.{}{PREVIOUS}", unpredictable()));
    faults::step()?;
    match fs::hard_link(destination, &previous) {
        Ok(()) => Ok(Some(previous)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        // A file system without hard links.
        Err(_) => fs::copy(destination, &previous).map(|_| Some(previous)),
    }
}

fn folders<'a>(files: &[(&Path, &'a Path)]) -> Vec<&'a Path> {
    let mut folders: Vec<&Path> = files.iter().map(|(_, destination)| folder_of(destination)).collect();
    folders.sort_unstable();
    folders.dedup();
    folders
}

/// The journal at home, the last one; before it, in each other folder one that leads to it.
fn write_journals(files: &[(&Path, &Path)], home: &Path) -> Result<Vec<PathBuf>> {
    let journal = |folder: &Path| folder.join(format!("{PREFIX}{}{SUFFIX}", unpredictable()));
    let at_home = journal(home);
    let absolute = |path: &Path| std::path::absolute(path);
    let mut written = Vec::new();
    let mut write = |path: PathBuf, journal: &Journal| {
        let attempt = || -> io::Result<()> {
            faults::step()?;
            let mut file = File::options().write(true).create_new(true).open(&path)?;
            file.write_all(&serde_json::to_vec(journal)?)?;
            file.sync_all()?;
            durable::folder(folder_of(&path))
        };
        let outcome = attempt();
        written.push(path);
        outcome
    };
    let mut all = || -> io::Result<()> {
        for folder in folders(files).into_iter().filter(|folder| *folder != home) {
            write(journal(folder), &Journal::SeeAlso(absolute(&at_home)?.into()))?;
        }
        let name = |path: &Path| path.file_name().unwrap_or_default().to_owned();
        let entries = files.iter().map(|(temporary, destination)| {
            let folder = folder_of(destination);
            let folder = if folder == home { None } else { Some(absolute(folder)?.into()) };
            Ok(Entry { folder, temporary: name(temporary), name: name(destination) })
        });
        let entries = entries.collect::<io::Result<Vec<Entry>>>()?;
        write(at_home.clone(), &Journal::Files(entries))
    };
    match all() {
        Ok(()) => Ok(written),
        Err(error) => {
            written.iter().for_each(|path| drop(fs::remove_file(path)));
            Err(Error::caused("write", at_home.display().to_string(), error))
        }
    }
}

/// Whether a publication into a folder is under way, or was when its run was killed.
pub(super) fn is_under_way(folder: &Path) -> bool {
    let Ok(mut entries) = fs::read_dir(folder) else { return false };
    entries.any(|entry| entry.is_ok_and(|entry| entry.file_name().to_str().is_some_and(is_named_as_journal)))
}

/// Completes publications in a folder whose run was killed, and removes what such runs left otherwise. Where the caller holds the
/// folder's lock, no journal is that of a run that lives, whichever process has its number by now.
pub(super) fn recover(folder: &Path, locked: bool) -> Result<()> {
    let Ok(entries) = fs::read_dir(folder) else { return Ok(()) };
    let (mut journals, mut debris) = (Vec::new(), Vec::new());
    for entry in entries.flatten() {
        let name = entry.file_name();
        let Some(name) = name.to_str() else { continue };
        if is_named_as_journal(name) {
            if locked || is_left(name) {
                journals.push(entry.path());
            }
        } else if name.starts_with('.') && is_left(name) && (name.ends_with(PARTIAL) || name.ends_with(PREVIOUS)) {
            debris.push(entry.path());
        }
    }
    for journal in &journals {
        complete(journal, locked).map_err(|error| {
            let problem =
                format!("an earlier run was killed while it published its results, which cannot be completed: {error}");
            Error::new("write to", folder.display().to_string(), problem)
                .of(ErrorKind::Io)
                .help(format!("remove what is in the way, or {} to give up those results", journal.display()))
        })?;
    }
    for path in debris {
        // Those that a journal named have their names by now.
        let _ = fs::remove_file(path);
    }
    Ok(())
}

/// Whether the process that a temporary name belongs to is no more.
fn is_left(name: &str) -> bool {
    let stem = [PARTIAL, SUFFIX, PREVIOUS].iter().find_map(|suffix| name.strip_suffix(suffix));
    let process = stem.and_then(|stem| stem.rsplit(['.', '-']).nth(1)?.parse().ok());
    process.is_some_and(|process| !is_alive(process))
}

fn complete(journal: &Path, locked: bool) -> io::Result<()> {
    let home = folder_of(journal);
    match read(journal) {
        Some(Journal::Files(files)) => {
            files.iter().try_for_each(|entry| entry.finish(home))?;
            for entry in &files {
                durable::folder(entry.folder(home))?;
            }
        }
        Some(Journal::SeeAlso(other)) if is_journal(Path::new(&other), locked) && Path::new(&other).exists() => {
            let other = Path::new(&other);
            if let Some(Journal::Files(files)) = read(other) {
                files.iter().try_for_each(|entry| entry.finish(folder_of(other)))?;
            }
            fs::remove_file(other)?;
        }
        // Cut short: what it names has not begun.
        _ => {}
    }
    fs::remove_file(journal)
}

fn is_named_as_journal(name: &str) -> bool {
    name.starts_with(PREFIX) && name.ends_with(SUFFIX)
}

fn is_journal(path: &Path, locked: bool) -> bool {
    let name = path.file_name().and_then(|name| name.to_str());
    name.is_some_and(|name| is_named_as_journal(name) && (locked || is_left(name)))
}

fn read(journal: &Path) -> Option<Journal> {
    let found = fs::symlink_metadata(journal).ok()?;
    let small = found.is_file() && found.len() <= LONGEST;
    small.then(|| serde_json::from_slice(&fs::read(journal).ok()?).ok())?
}
