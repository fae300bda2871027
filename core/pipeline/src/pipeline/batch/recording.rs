//! Recordings of a batch: their names, their order, and what they change in a pipeline.

use std::{
    cmp::Ordering,
    collections::HashMap,
    path::{Path, PathBuf},
};

use toml::{Value, de::DeValue};

use super::super::document::{ConfigError, Document, Sources};
use crate::atomic_file::resolved;
use runout_error::{Error, ErrorKind, Result};

/// A recording: a file, or a folder with the files that the loader names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recording {
    /// Its name in the data set: that of the file without its extension, or of the folder.
    pub name: String,
    /// Where it is, absolute.
    pub path: PathBuf,
}

impl Recording {
    /// An error of its run. Where a file is missing in a folder, the folder may have been meant as a collection of recordings.
    pub(super) fn explained(&self, error: Error) -> Error {
        if error.kind() != ErrorKind::MissingFile || error.advice().is_some() || !self.path.is_dir() {
            return error;
        }
        let folder = self.path.display();
        error.help(format!(
            "a folder is one recording, in which the files of [load] are looked up; to take each of its files as a recording, give {folder}/*"
        ))
    }
}

/// The recordings of these paths in the order of their names; a file that is given twice is one recording. The last `folders`
/// folders of a path belong to the name.
///
/// # Errors
/// When two recordings have the same name, or a path has no name or one that is not UTF-8.
pub fn recordings(paths: &[PathBuf], folders: usize) -> Result<Vec<Recording>> {
    let mut known: HashMap<String, (PathBuf, PathBuf)> = HashMap::new();
    for given in paths {
        let path = std::path::absolute(given)
            .map_err(|error| Error::caused("find", given.display().to_string(), error).of(ErrorKind::Configuration))?;
        let (name, place) = (name(&path, folders)?, resolved(&path));
        match known.get(&name) {
            Some((_, other)) if *other == place => {}
            Some((other, _)) => {
                let problem = format!("{} has the same name, `{name}`", other.display());
                return Err(Error::new("distinguish", path.display().to_string(), problem)
                    .of(ErrorKind::Configuration)
                    .help("rename one, or take folders of the path into the name: `--name-folders 1`"));
            }
            None => {
                known.insert(name, (path, place));
            }
        }
    }
    let mut recordings: Vec<_> = known.into_iter().map(|(name, (path, _))| Recording { name, path }).collect();
    recordings.sort_by(|a, b| by_name(&a.name, &b.name));
    Ok(recordings)
}

fn name(path: &Path, folders: usize) -> Result<String> {
    let last = if path.is_dir() { path.file_name() } else { path.file_stem() };
    let above = path.ancestors().skip(1).filter_map(Path::file_name).take(folders);
    let mut parts = Vec::with_capacity(folders + 1);
    for part in last.into_iter().chain(above) {
        parts.push(part.to_str().ok_or_else(|| {
            Error::new("name", path.display().to_string(), "expected a name in UTF-8")
                .of(ErrorKind::Configuration)
                .help("rename it")
        })?);
    }
    if last.is_none() {
        let error = Error::new("name", path.display().to_string(), "the path ends in no name");
        return Err(error.of(ErrorKind::Configuration).help("name a file or a folder"));
    }
    parts.reverse();
    Ok(parts.join("/"))
}

/// The order of names, in which numbers count by their size: `part-2` before `part-10`.
#[must_use]
pub fn by_name(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a, b);
    while let (Some(x), Some(y)) = (left.chars().next(), right.chars().next()) {
        let (digits_x, digits_y) = (digits(left), digits(right));
        let (order, [used_x, used_y]) = if digits_x > 0 && digits_y > 0 {
            let number = |text: &str, count: usize| text[..count].trim_start_matches('0').to_owned();
            let (n, m) = (number(left, digits_x), number(right, digits_y));
            (n.len().cmp(&m.len()).then(n.cmp(&m)), [digits_x, digits_y])
        } else {
            (x.cmp(&y), [x.len_utf8(), y.len_utf8()])
        };
        if order != Ordering::Equal {
            return order;
        }
        (left, right) = (&left[used_x..], &right[used_y..]);
    }
    // What differs by leading zeros only is in a fixed order too.
    left.len().cmp(&right.len()).then_with(|| a.cmp(b))
}

fn digits(text: &str) -> usize {
    text.bytes().take_while(u8::is_ascii_digit).count()
}

/// The pipeline with a recording in the place of what `[load]` names, and without `[[export]]`. A file takes the place of `path`, or
/// of the only entry of `files`; in a folder, the paths that `[load]` has are looked up.
///
/// # Errors
/// When `[load]` has no such path.
pub(crate) fn of_recording(sources: &Sources, recording: &Path) -> std::result::Result<Sources, ConfigError> {
    let document = Document::parse(sources)?;
    let load = document.root().get_ref().get("load").and_then(|load| load.get_ref().as_table());
    let text = |key: &str| load.and_then(|load| load.get(key)).and_then(|value| value.get_ref().as_str());
    let files: Vec<&str> = load
        .and_then(|load| load.get("files"))
        .and_then(|files| files.get_ref().as_array())
        .into_iter()
        .flatten()
        .filter_map(|file| match file.get_ref() {
            DeValue::Table(file) => file.get("path").and_then(|path| path.get_ref().as_str()),
            _ => None,
        })
        .collect();
    let mut changed = sources.clone();
    let mut set = |key: &str, path: &Path| {
        let path = path.to_string_lossy().into_owned();
        changed.set(key, &Value::String(path).to_string());
    };
    if recording.is_dir() {
        for key in ["path", "pattern"] {
            if let Some(path) = text(key) {
                set(&format!("load.{key}"), &recording.join(path));
            }
        }
        for (index, path) in files.iter().enumerate() {
            set(&format!("load.files.{index}.path"), &recording.join(path));
        }
    } else {
        match files[..] {
            [] if text("pattern").is_none() => set("load.path", recording),
            [_] => set("load.files.0.path", recording),
            _ => {
                let (problem, help) = if files.is_empty() {
                    let help = "give the folder that contains them, or name one file by `files` in [load], in whose place a file can be read";
                    ("[load] names its files by `pattern`, which a file cannot replace", help)
                } else {
                    ("[load] names several files, which one file cannot replace", "give the folder that contains them")
                };
                let error = Error::new("load", recording.display().to_string(), problem);
                return Err(error.of(ErrorKind::Configuration).help(help).into());
            }
        }
    }
    changed.set("export", "[]");
    Ok(changed)
}

/// A configuration as a recording does not change it: two that are equal give the same results of the same data.
pub(super) fn without_recording(configuration: &str) -> Option<toml::Table> {
    let mut table: toml::Table = configuration.parse().ok()?;
    table.remove("export");
    if let Some(load) = table.get_mut("load").and_then(Value::as_table_mut) {
        load.remove("path");
        load.remove("pattern");
        for file in load.get_mut("files").and_then(Value::as_array_mut).into_iter().flatten() {
            file.as_table_mut().map(|file| file.remove("path"));
        }
    }
    Some(table)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use std::fs;

    #[test]
    fn numbers_in_names_count_by_their_size() {
        let mut names = ["p-10", "p-9", "p-009b", "p-9a", "q", "p", "p-010", "ä-1", "p-99999999999999999999999", "p-1"];
        names.sort_by(|a, b| by_name(a, b));
        let expected = ["p", "p-1", "p-9", "p-9a", "p-009b", "p-010", "p-10", "p-99999999999999999999999", "q", "ä-1"];
        assert_eq!(names, expected);
        assert_eq!((by_name("", "a"), by_name("a", "a")), (Ordering::Less, Ordering::Equal));
    }

    #[test]
    fn a_file_given_twice_is_one_and_two_of_one_name_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a", "b"] {
            fs::create_dir(folder.path().join(name)).unwrap();
            fs::write(folder.path().join(name).join("x.1.h5"), "").unwrap();
        }
        let path = |name: &str| folder.path().join(name);
        let twice = recordings(&[path("a/x.1.h5"), path("b/../a/x.1.h5"), path("a/x.1.h5")], 0).unwrap();
        assert_eq!(twice.len(), 1);
        assert_eq!(twice[0].name, "x.1");
        let error = recordings(&[path("a/x.1.h5"), path("b/x.1.h5")], 0).unwrap_err();
        assert!(error.to_string().contains("same name, `x.1`") && error.advice().is_some(), "{error}");
        let both = recordings(&[path("b/x.1.h5"), path("a/x.1.h5")], 1).unwrap();
        assert_eq!(both.iter().map(|one| one.name.as_str()).collect::<Vec<_>>(), ["a/x.1", "b/x.1"]);
        assert_eq!(recordings(&[path("a"), path("b")], 0).unwrap()[1].name, "b");
        assert!(recordings(&[PathBuf::from("/")], 0).is_err());
    }

    #[test]
    fn a_folder_that_lacks_the_file_of_the_loader_says_how_to_take_its_files() {
        let folder = tempfile::tempdir().unwrap();
        let missing = || Error::new("open", "it", "missing").of(ErrorKind::MissingFile);
        let advice = |path: &Path, error: Error| {
            let recording = Recording { name: "it".into(), path: path.to_owned() };
            recording.explained(error).advice().map(str::to_owned)
        };
        let said = advice(folder.path(), missing()).unwrap();
        assert!(said.contains(&format!("{}/*", folder.path().display())), "{said}");
        assert_eq!(advice(&folder.path().join("x.h5"), missing()), None);
        assert_eq!(advice(folder.path(), missing().help("its own")).as_deref(), Some("its own"));
        assert_eq!(advice(folder.path(), Error::new("open", "it", "damaged")), None);
    }

    #[test]
    fn the_place_of_a_recording_does_not_count() {
        let text = |path: &str| format!("load = {{ plugin = 'hdf5', path = '{path}' }}\nexport = []\ntitle = 'x'");
        assert_eq!(without_recording(&text("a")), without_recording(&text("b")));
        assert_ne!(without_recording(&text("a")), without_recording(&text("a").replace("'x'", "'y'")));
    }
}
