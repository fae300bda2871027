//! Measured data for tests, from the folder that `RUNOUT_DATA` names (relative to the workspace) and from `target/data`, where
//! `cargo xtask data` puts it. A test without its data says so, and in the file that `RUNOUT_SKIPS` names, which
//! `cargo xtask test` counts.

use std::{
    env,
    fs::OpenOptions,
    io::Write,
    path::{Path, PathBuf},
};

/// A file that every folder of data holds.
#[allow(dead_code, reason = "not every test takes one")]
pub(crate) fn file(place: &str) -> Option<PathBuf> {
    find(place, "skipped")
}

/// A file that some folders hold: a test without it is counted apart.
#[allow(dead_code, reason = "not every test takes one")]
pub(crate) fn optional_file(place: &str) -> Option<PathBuf> {
    find(place, "not compared")
}

#[allow(clippy::print_stderr, reason = "a skipped test has to say so")]
fn find(place: &str, outcome: &str) -> Option<PathBuf> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = here.ancestors().find(|folder| folder.join("Cargo.lock").is_file()).unwrap_or(here);
    let named = env::var_os("RUNOUT_DATA").map(|folder| root.join(folder));
    let folders: Vec<PathBuf> = named.into_iter().chain([root.join("target/data")]).collect();
    if let Some(found) = folders.iter().map(|folder| folder.join(place)).find(|path| path.is_file()) {
        return Some(found);
    }
    let line = format!("{outcome}: {}: {place} is not there; `cargo xtask data` fetches it\n", test());
    eprint!("{line}");
    if let Some(list) = env::var_os("RUNOUT_SKIPS") {
        let written = OpenOptions::new().create(true).append(true).open(&list);
        if let Err(error) = written.and_then(|mut list| list.write_all(line.as_bytes())) {
            panic!("{}: {error}", Path::new(&list).display());
        }
    }
    None
}

/// The test's name: that of its thread, or what the program was asked to run where the test is alone in its process.
fn test() -> String {
    let thread = std::thread::current();
    let name = thread.name().filter(|name| *name != "main").map(str::to_owned);
    let asked = || env::args().skip(1).find(|argument| !argument.starts_with('-'));
    name.or_else(asked).unwrap_or_else(|| "a test".into())
}
