//! Work that is abandoned. In a process of its own, as it ends all files under way.
#![allow(clippy::unwrap_used, reason = "tests")]

use std::{fs, io::Write};

use runout_core::{
    ErrorKind,
    atomic_file::{PendingFile, abandon_all, commit_all},
};

#[test]
fn what_is_abandoned_goes_and_work_can_begin_again() {
    let folder = tempfile::tempdir().unwrap();
    let begin = |name: &str| PendingFile::new(folder.path().join(name));
    let files = [begin("a.csv").unwrap(), begin("new/b.csv").unwrap()];
    for file in &files {
        file.create().unwrap().write_all(b"half").unwrap();
    }
    let abandoned = abandon_all();
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "files and the folder made for them are gone");
    assert_eq!(begin("c.csv").unwrap_err().kind(), ErrorKind::Interrupted);
    let error = commit_all(files.into()).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Interrupted);
    assert!(error.to_string().contains("a.csv") && error.to_string().contains("abandoned"), "{error}");
    // Two interrupts: the first one's end does not end the second.
    let again = abandon_all();
    drop(abandoned);
    assert!(begin("c.csv").is_err());
    drop(again);
    let file = begin("c.csv").unwrap();
    file.create().unwrap();
    file.commit().unwrap();
    assert!(folder.path().join("c.csv").exists());
}
