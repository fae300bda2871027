//! Files of a part of a data set: the last of them has its name when all others have theirs.
#![allow(clippy::unwrap_used, reason = "tests")]

use std::{fs, path::Path};

use runout_core::atomic_file::{FolderLock, PendingFile, commit_last_after_others};

const NAMES: [&str; 3] = ["form/x/0.parquet", "values/x/0.parquet", "summaries/x/summary.json"];

fn written(folder: &Path) -> Vec<PendingFile> {
    let file = |name: &&str| {
        let file = PendingFile::new(folder.join(name)).unwrap();
        file.write(name.as_bytes()).unwrap();
        file
    };
    NAMES.iter().map(file).collect()
}

/// Every file below a folder, hidden ones too.
fn files(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.push(path.to_string_lossy().into_owned());
        }
    }
    found
}

#[test]
fn all_files_have_their_names_and_nothing_else_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let named = commit_last_after_others(written(folder.path())).unwrap();
    assert_eq!(named, NAMES.map(|name| folder.path().join(name)));
    assert!(NAMES.iter().all(|name| fs::read_to_string(folder.path().join(name)).unwrap() == *name));
    assert_eq!(files(folder.path()).len(), 3, "neither journals nor locks");
}

#[test]
fn a_name_that_cannot_be_given_takes_back_all_others() {
    for blocked in NAMES {
        let folder = tempfile::tempdir().unwrap();
        let pending = written(folder.path());
        // What cannot be replaced: a folder with something in it.
        fs::create_dir_all(folder.path().join(blocked).join("in the way")).unwrap();
        let error = commit_last_after_others(pending).unwrap_err();
        assert!(error.to_string().contains(blocked), "{error}");
        assert_eq!(files(folder.path()), [""; 0], "{blocked}");
    }
}

#[test]
fn what_a_killed_run_left_below_a_lock_is_cleaned_up() {
    let folder = tempfile::tempdir().unwrap();
    let part = folder.path().join("form/x");
    fs::create_dir_all(&part).unwrap();
    // No process has this number.
    fs::write(part.join(".0.parquet.4194999-0123456789abcdef.partial"), "half").unwrap();
    fs::write(part.join(".runout-4194999-0123456789abcdef.journal"), "").unwrap();
    let lock = FolderLock::covering([part.join("0.parquet").as_path(), Path::new("no/such/folder/file")]).unwrap();
    assert_eq!(fs::read_dir(&part).unwrap().count(), 0, "no lock of its own either");
    drop(lock);
    assert!(part.exists());
}
