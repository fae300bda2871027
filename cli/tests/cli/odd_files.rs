//! Names, files and numbers that nobody means: an error in words, at once, or work as usual.

use std::fs;

use crate::folder::{Folder, pipeline};

const PIPELINE: &str = include_str!("../../../examples/08-text-recording/pipeline.toml");
const RECORDING: &str = include_str!("../../../examples/08-text-recording/shaft.csv");

fn text_recording() -> Folder {
    Folder::with(&[("pipeline.toml", PIPELINE), ("shaft.csv", RECORDING)])
}

/// Results name their files in UTF-8: a folder that has no such name can be worked in, and not be named.
#[test]
#[cfg(target_os = "linux")]
fn a_folder_whose_name_is_not_utf_8_can_be_worked_in() {
    use std::{ffi::OsStr, os::unix::ffi::OsStrExt};

    let folder = text_recording();
    let odd = folder.path().join(OsStr::from_bytes(b"f\xff\xfeolder"));
    fs::create_dir(&odd).unwrap();
    for name in ["pipeline.toml", "shaft.csv"] {
        fs::copy(folder.path().join(name), odd.join(name)).unwrap();
    }
    let run = |pipeline: &std::path::Path| {
        let mut command = assert_cmd::cargo::cargo_bin_cmd!("runout");
        let output = command.arg("run").arg(pipeline).current_dir(&odd).output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (status, said) = run(&odd.join("pipeline.toml"));
    assert!(status == Some(1) && said.contains("invalid UTF-8"), "{said}");
    assert_eq!(fs::read_dir(&odd).unwrap().count(), 2, "nothing is left");
    let (status, said) = run("pipeline.toml".as_ref());
    assert_eq!(status, Some(0), "{said}");
    assert!(odd.join("out/summary.json").is_file());
    let recording = odd.join("shaft.h5");
    fs::write(&recording, b"\x89HDF\r\n\x1a\n and more").unwrap();
    let output = assert_cmd::cargo::cargo_bin_cmd!("runout").arg("inspect").arg(&recording).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(1) && said.contains("needs a path in UTF-8"), "{said}");
}

#[test]
fn a_recording_in_the_place_of_a_pipeline_is_named() {
    let folder = text_recording();
    fs::write(folder.path().join("recording.h5"), b"\x89HDF\r\n\x1a\n and more").unwrap();
    for command in ["run", "check", "diagnose"] {
        let ran = folder.run(&[command, "recording.h5"]);
        let said = ran.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!([1, 2].contains(&ran.status) && said.contains("found an HDF5 file") && said.contains("hdf5"), "{said}");
    }
}

#[test]
#[cfg(unix)]
fn what_never_ends_is_refused_at_once_wherever_a_file_is_named() {
    let folder = text_recording();
    assert!(std::process::Command::new("mkfifo").arg(folder.path().join("pipe")).status().unwrap().success());
    for name in ["pipe", "/dev/zero"] {
        let (pattern, rig) = (format!("load.pattern=\"{name}\""), format!("rig=\"{name}\""));
        for arguments in [
            &["check", name][..],
            &["run", name],
            &["simulate", name],
            &["plan", name],
            &["report", name],
            &["inspect", name],
            &["run", "pipeline.toml", "--set", &pattern],
            &["check", "pipeline.toml", "--set", &rig],
        ] {
            let ran = folder.run(arguments);
            assert!([1, 2].contains(&ran.status), "{arguments:?}: {}", ran.stderr);
            let flat = ran.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(flat.contains("found a pipe, a device or a socket"), "{arguments:?}: {flat}");
        }
    }
    let ran = folder.run(&["run", "pipeline.toml", "--set", "export.0.path=\"pipe\""]);
    assert!(ran.status == 1 && ran.stderr.contains("pipe is no folder"), "{}", ran.stderr);
    let ran = folder.run(&["run", "pipeline.toml", "--set", "export=[{plugin=\"hdf5\",path=\"pipe\"}]"]);
    assert!(ran.status == 1 && ran.stderr.contains("is no file"), "{}", ran.stderr);
}

#[test]
fn a_title_with_nul_is_refused() {
    let folder = Folder::with(&[("pipeline.toml", &pipeline())]);
    let ran = folder.run(&["check", "pipeline.toml", "--set", "title=\"a\\u0000b\""]);
    assert!(ran.status == 2 && ran.stderr.contains("must not contain NUL"), "{}", ran.stderr);
}

/// A million angles for turns of 256 samples took 2 GB and half a minute.
#[test]
fn far_more_angles_than_samples_are_a_warning_and_fewer() {
    let folder = text_recording();
    let ran = folder.run(&["run", "pipeline.toml", "--set", "preprocess.0.samples_per_rev=131072", "--json"]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let said = "`samples_per_rev` = 131072 is far above the 256 samples of a turn: results are given on 4096 angles";
    assert!(ran.stdout.contains(said), "{}", ran.stdout);
    let rows = folder.run(&["inspect", "out/form.parquet", "--json"]).stdout;
    assert!(rows.contains("\"rows\": 4096"), "{rows}");
}

#[test]
fn diagnose_asks_for_the_memory_that_it_needs() {
    let folder = text_recording();
    let ran = folder.run(&["diagnose", "pipeline.toml", "--memory", "0.0001"]);
    let flat = ran.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(ran.status != 0 && flat.contains("0.0001 GB are allowed") && flat.contains("--memory 1"), "{flat}");
    assert_eq!(folder.run(&["diagnose", "pipeline.toml", "--memory", "0"]).status, 2);
    assert_eq!(folder.run(&["diagnose", "pipeline.toml", "--memory", "1"]).status, 0);
}

/// HDF5 locks a file that it writes to: another program's lock is no damage.
#[test]
#[cfg(target_os = "linux")]
fn a_recording_that_another_program_holds_open_is_not_called_damaged() {
    let folder = Folder::with(&[("pipeline.toml", &pipeline())]);
    let path = folder.path().join("shaft.h5");
    drop(hdf5_metno::File::create(&path).unwrap());
    let held = fs::File::options().read(true).write(true).open(&path).unwrap();
    held.lock().unwrap();
    let mut command = assert_cmd::cargo::cargo_bin_cmd!("runout");
    command.args(["run", "pipeline.toml"]).env("HDF5_USE_FILE_LOCKING", "TRUE").current_dir(folder.path());
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("another program holds the file open") && said.contains("HDF5_USE_FILE_LOCKING"), "{said}");
    assert!(!said.contains("damaged"), "{said}");
}
