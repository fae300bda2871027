//! Programs that do not keep the protocol: each is a clear error, and nothing is left behind.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support;
use std::{
    fs,
    path::Path,
    time::{Duration, Instant},
};

use crate::support::{pipeline, python, rig};
use runout_core::ErrorKind;

/// Runs a pipeline with a program; gives its error, having looked for what it leaves behind.
fn failure(command: &[&str], keys: &str, pids: &Path) -> runout_core::Error {
    let folder = tempfile::tempdir().unwrap();
    let export = "[[export]]\nplugin = \"parquet\"\npath = \"out\"\n";
    let stages = format!("[separate]\nplugin = \"external\"\ncommand = {command:?}\n{keys}\n{export}");
    let began = Instant::now();
    let error = pipeline(folder.path(), &rig("ccw"), &stages).run().unwrap_err();
    println!("{:.1} s: {error}\n  help: {}", began.elapsed().as_secs_f64(), error.advice().unwrap_or_default());
    assert!(began.elapsed() < Duration::from_secs(20));
    let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(left.is_empty(), "{left:?}");
    if let Ok(pids) = fs::read_to_string(pids) {
        for pid in pids.split_whitespace() {
            // A process whose parent has not asked for its end yet is no more than a name.
            let state = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
            assert!(state.is_empty() || state.contains(") Z "), "process {pid} is left: {state}");
        }
    }
    let text = error.to_string();
    assert!(text.contains("plugin `external`") && text.contains(command[0]) && text.contains("station "), "{text}");
    assert!(error.advice().is_some_and(|advice| !advice.is_empty()), "{text}");
    error
}

#[test]
fn each_is_an_error_in_words() {
    let Some(python) = python() else { return };
    let script = support::of_repository("plugins/external/tests/hostile.py").display().to_string();
    let cases = [
        ("hangs", "timeout_s = 1", "gave no answer within 1 s and was stopped"),
        ("hangs-with-a-child", "timeout_s = 1", "gave no answer within 1 s"),
        ("never-reads", "timeout_s = 1", "gave no answer within 1 s"),
        ("exits", "", "ended with exit status: 1 and gave no answer; its stderr ends with: the probe of section a is"),
        ("exits-well", "", "closed its output and gave no answer"),
        ("garbage", "", "wrote \"separating station 1 ...\\n\" to stdout"),
        ("not-arrow", "", "a table `harmonics` that is no Arrow IPC stream"),
        ("flood", "", "the last word"),
        (
            "ten-gigabytes",
            "output_mb = 100",
            "announced `harmonics` with 10000000000 bytes, which makes its answer larger than 100 MB",
        ),
        ("empty-frames", "output_mb = 1", "which makes its answer larger than 1 MB"),
        ("cut-off", "", "announced `harmonics` with 500 bytes and gave 3"),
        ("schema", "", "whose column `re` is of type Utf8: expected float64"),
        ("column", "", "an unknown column `sdt`: known: `"),
        ("missing-column", "", "without the column `quantity`: it has station"),
        ("text-order", "", "whose column `order` is of type Float64: expected integer"),
        ("nan", "", "gave NaN in row 1 of the column `re` of `harmonics`: what is not known is null"),
        ("version", "", "speaks version 2 of the protocol, and this is runout with version 1"),
        ("unasked", "", "gave harmonics of station `another`, and was asked for `"),
        ("order", "", "gave order 4000 of form: the profiles have 63"),
        ("null-order", "", "at an order that is null or negative"),
        ("twice", "", "gave form a of order 2 twice"),
        ("half", "", "with one of `re` and `im`"),
        ("std", "", "gave form a of order 2 with a `std` below 0: -0.1"),
        ("compressed", "", "its buffers are compressed"),
        ("other-table", "", "gave `values`, where one `harmonics` was expected"),
        ("nothing", "", "gave no table `harmonics`"),
    ];
    for (what, keys, expected) in cases {
        let folder = tempfile::tempdir().unwrap();
        let pids = folder.path().join("pid");
        let error = failure(&[&python, &script, what, &pids.display().to_string()], keys, &pids);
        let text = error.to_string();
        assert!(text.contains(expected), "{what}: {text}");
        assert!(pids.exists() && text.len() < 4000, "{what}: {}", text.len());
        assert!(!text.contains('\x1b'), "no command for a terminal");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn memory_is_limited() {
    let Some(python) = python() else { return };
    let script = support::of_repository("plugins/external/tests/hostile.py").display().to_string();
    let folder = tempfile::tempdir().unwrap();
    let pids = folder.path().join("pid");
    let command = [python.as_str(), &script, "eats-memory", &pids.display().to_string()];
    let error = failure(&command, "memory_mb = 500", &pids);
    assert!(error.to_string().contains("MemoryError"), "{error}");
    assert!(error.advice().unwrap().contains("`memory_mb` (500)"));
    assert!(failure(&command, "", &pids).to_string().contains("there was room"), "the limit did it");
}

#[test]
fn a_program_that_is_not_there_is_named() {
    let nowhere = Path::new("nowhere");
    for command in ["no-such-program-anywhere", "./no-such-program"] {
        let error = failure(&[command], "", nowhere);
        assert_eq!(error.kind(), ErrorKind::MissingFile);
        assert!(error.to_string().contains("did not start: "), "{error}");
        assert!(error.advice().unwrap().contains("from the pipeline's folder"));
    }
}

#[test]
fn keys_that_cannot_be_are_refused_with_their_place() {
    let refused = |keys: &str| {
        let text = format!(
            "rig = {rig}\n[load]\nplugin = \"simulated\"\nseed = 7\nrig = {rig}\n[[preprocess]]\nplugin = \"synchronous-average\"\n\
             samples_per_rev = 128\n[separate]\nplugin = \"external\"\n{keys}",
            rig = rig("ccw")
        );
        let found = runout_core::pipeline::Pipeline::from_toml(&text, "", &support::registry());
        found.err().map(|error| error.to_string()).unwrap_or_default()
    };
    assert!(refused("command = []").contains("expected a program and its arguments"));
    assert!(refused("command = [\"a\"]\ntimeout_s = 0").contains("found 0"));
    assert!(refused("command = [\"a\"]\nmemory_mb = 0").contains("expected 1 to 1000000 MB"));
    assert!(refused("command = [\"a\"]\nmax_order = 3").contains("unknown key `max_order`"));
    assert!(refused("").contains("command"));
}
