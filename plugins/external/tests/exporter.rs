//! An exporter that is a program: its files are there when the run is complete, and only then.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::{fs, path::Path};

use crate::support::{of_repository, pipeline, python, rig};

/// A run with the exporter of example 26, changed; what it wrote, or its error.
fn run(python: &str, folder: &Path, change: impl Fn(String) -> String) -> Result<String, String> {
    let script = fs::read_to_string(of_repository("examples/26-own-program/roundness.py")).unwrap();
    fs::write(folder.join("own.py"), change(script)).unwrap();
    let stages = format!(
        "[separate]\nplugin = \"three-point\"\n[[export]]\nplugin = \"external\"\ncommand = [{python:?}, \"own.py\"]\n\
         path = \"out\"\nfiles = [\"roundness.txt\"]\ntimeout_s = 20\n[[export]]\nplugin = \"parquet\"\npath = \"tables\"\n"
    );
    let ran = pipeline(folder, &rig("ccw"), &stages).run();
    ran.map_err(|error| format!("{error}; {}", error.advice().unwrap_or_default()))?;
    fs::read_to_string(folder.join("out/roundness.txt")).map_err(|error| error.to_string())
}

#[test]
fn its_files_are_there_when_the_run_is_complete_and_only_then() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let written = run(&python, folder.path(), |script| script).unwrap();
    println!("{written}");
    let lines: Vec<&str> = written.lines().collect();
    assert_eq!(lines.len(), 4, "a title and a line a station");
    for line in &lines[1..] {
        let range_um: f64 = line.split(' ').nth(2).unwrap().parse().unwrap();
        // 4 µm rms of harmonics of orders to 25.
        assert!((8.0..40.0).contains(&range_um), "{line}");
    }
    let mistakes = [
        ("elif name == \"summary\":", "elif name == \"never\":", "did not write it"),
        ("print(json", "raise OSError('the disk is write-protected') #", "the disk is write-protected"),
        ("sink.write(b\"end 0\\n\")", "sink.write(b\"values 0\\nend 0\\n\")", "gave `values`"),
    ];
    for (from, to, words) in mistakes {
        let folder = tempfile::tempdir().unwrap();
        let error = run(&python, folder.path(), |script| {
            assert!(script.contains(from), "{from}");
            script.replace(from, to)
        });
        let error = error.unwrap_err();
        println!("{error}");
        assert!(error.contains(words) && error.contains("plugin `external`"), "{error}");
        let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(left, ["own.py"], "nothing is left");
    }
}

#[test]
fn names_of_files_are_checked_before_the_run() {
    for files in ["[]", "[\"a.txt\", \"a.txt\"]", "[\"../a.txt\"]", "[\"b/a.txt\"]"] {
        let text = format!(
            "load = {{ plugin = \"points\", path = \"points.csv\" }}\n\
             separate = {{ plugin = \"external\", command = [\"none\"], columns = [\"x_mm\"] }}\n\
             export = [{{ plugin = \"external\", command = [\"none\"], path = \"out\", files = {files} }}]\n"
        );
        let registry = crate::support::registry();
        let refused = runout_core::pipeline::Pipeline::from_toml(&text, ".", &registry).map(|_| ()).unwrap_err();
        assert!(refused.to_string().contains("expected names of files"), "{files}: {refused}");
    }
}
