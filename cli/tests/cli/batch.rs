//! One pipeline on many recordings.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use serde_json::Value;

use crate::folder::{self, Folder};

const SCENARIO: &str = r#"
plugin = "spindle"
output = "one.h5"
seed = 3
rig = "rig.toml"

[recording]
revolutions = 8
samples_per_rev = 128
stations = { count = 1 }

[form]
rms_um = 2
max_order = 12

[noise]
rms_um = 0.02
"#;

/// A folder with these recordings, of which each has its own form.
fn recorded(names: &[&str]) -> Folder {
    let files = [("pipeline.toml", &*folder::pipeline()), ("rig.toml", folder::RIG), ("scenario.toml", SCENARIO)];
    let folder = Folder::with(&files);
    for (index, name) in names.iter().enumerate() {
        let sets = [format!("seed={index}"), format!("form.rms_um={}", 2.0 + 0.1 * index as f64)];
        let ran = folder.run(&["simulate", "scenario.toml", "--out", name, "--set", &sets[0], "--set", &sets[1]]);
        assert_eq!(ran.status, 0, "{}", ran.stderr);
    }
    folder
}

fn batch(folder: &Folder, out: &str, recordings: &[&str], more: &[&str]) -> (i32, Value, String) {
    let words = [&["batch", "pipeline.toml"], recordings, &["--out", out, "--json"], more].concat();
    let ran = folder.run(&words);
    (ran.status, serde_json::from_str(&ran.stdout).unwrap_or_default(), ran.stderr)
}

/// Every Parquet file below a folder.
fn tables(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "parquet") {
                found.insert(path.strip_prefix(folder).unwrap().to_owned(), fs::read(&path).unwrap());
            }
        }
    }
    found
}

fn counts(report: &Value) -> [u64; 4] {
    let failed = report["failed"].as_array().unwrap().len() as u64;
    let number = |key: &str| report[key].as_u64().unwrap();
    [number("done"), number("skipped"), number("earlier"), failed]
}

#[test]
fn one_job_and_two_give_the_same_and_what_is_done_is_skipped() {
    let names = ["part-10.h5", "part-2.h5", "a b=c%\"ü#.h5"];
    let folder = recorded(&names);
    let (status, report, said) = batch(&folder, "one", &names, &["--jobs", "1"]);
    assert_eq!((status, said.as_str()), (0, ""), "no progress in a pipe");
    assert_eq!(counts(&report), [3, 0, 0, 0]);
    // In another order, and one of them twice.
    let (status, _, said) = batch(&folder, "two", &["./part-2.h5", names[2], names[1], names[0]], &["--jobs", "2"]);
    assert_eq!(status, 0, "{said}");
    let [one, two] = ["one", "two"].map(|out| tables(&folder.path().join(out)));
    assert!(one.keys().eq(two.keys()), "{:?} {:?}", one.keys(), two.keys());
    for (path, bytes) in &one {
        assert!(two[path] == *bytes, "{} differs", path.display());
    }
    // Form, circles, motion, harmonics, values, consistency, and turns and spectra of motion and tilt of three, values and trend of all.
    assert_eq!(one.len(), 10 * 3 + 2, "{:?}", one.keys());
    assert!(one.contains_key(Path::new("form/recording=a%20b%3Dc%25%22ü%23/0.parquet")), "{:?}", one.keys());
    let mean = |report: &Value, value: &str| {
        let series = report["trend"].as_array().unwrap();
        let found = series.iter().find(|series| series["series"].as_str().unwrap().starts_with(value)).unwrap();
        (found["count"].as_u64().unwrap(), found["mean"].as_f64().unwrap())
    };
    let (count, before) = mean(&report, "RONq");
    assert!(count == 3 && (before - 2.1).abs() < 0.1, "{before}");

    let first = report;
    let (status, report, _) = batch(&folder, "one", &names, &[]);
    assert_eq!((status, counts(&report)), (0, [0, 3, 0, 0]));
    assert_eq!([&report["warned"], &report["warnings"]], [&first["warned"], &first["warnings"]], "notes are none");
    assert_eq!(tables(&folder.path().join("one")), one);
    // A recording that changes, and one that is not given again.
    fs::copy(folder.path().join("part-10.h5"), folder.path().join("part-2.h5")).unwrap();
    let (_, report, _) = batch(&folder, "one", &names[..2], &[]);
    assert_eq!(counts(&report), [1, 1, 1, 0]);
    assert!(mean(&report, "RONq").1 < before);
    // Another configuration.
    let (_, report, _) = batch(&folder, "one", &names[..1], &["--set", "preprocess.0.samples_per_rev=64"]);
    assert_eq!(counts(&report), [1, 0, 0, 0]);
    assert_eq!(report["other_configuration"].as_array().unwrap().len(), 2);
}

#[test]
fn a_recording_that_fails_does_not_stop_the_others() {
    let folder = recorded(&["a.h5", "b.h5"]);
    fs::write(folder.path().join("bad.h5"), "no HDF5").unwrap();
    let all = ["a.h5", "bad.h5", "missing.h5", "b.h5"];
    let (status, report, said) = batch(&folder, "out", &all, &[]);
    assert_eq!((status, counts(&report)), (1, [2, 0, 0, 2]), "{said}");
    assert!(said.contains("2 recordings failed"), "{said}");
    let failed = report["failed"].as_array().unwrap();
    assert_eq!([&failed[0]["recording"], &failed[1]["recording"]], ["bad", "missing"]);
    assert_eq!(failed[1]["kind"], "missing-file");
    let kept = tables(&folder.path().join("out"));
    assert!(kept.keys().all(|path| !path.to_string_lossy().contains("bad")), "{:?}", kept.keys());
    // One that was good and is damaged: its outdated result goes.
    fs::write(folder.path().join("b.h5"), "damaged").unwrap();
    let (status, report, _) = batch(&folder, "out", &["a.h5", "b.h5"], &[]);
    assert_eq!((status, counts(&report)), (1, [0, 1, 0, 1]));
    assert!(tables(&folder.path().join("out")).keys().all(|path| !path.starts_with("form/recording=b")));
    let text = folder.run(&["batch", "pipeline.toml", "a.h5", "bad.h5", "--out", "out"]);
    assert_eq!(text.status, 1);
    assert!(text.stdout.contains("0 recordings run, 1 skipped as up to date, 1 failed"), "{}", text.stdout);
    assert!(text.stdout.contains("- bad: cannot"), "{}", text.stdout);
}

#[test]
fn what_is_killed_is_completed_by_the_next_call() {
    let names: Vec<String> = (0..12).map(|number| format!("part-{number}.h5")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let folder = recorded(&names);
    assert_eq!(batch(&folder, "whole", &names, &[]).0, 0);
    let summaries = folder.path().join("out/summaries");
    let mut killed = Command::new(env!("CARGO_BIN_EXE_runout"))
        .current_dir(folder.path())
        .args(["batch", "pipeline.toml", "--out", "out", "--jobs", "1"])
        .args(&names)
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let start = Instant::now();
    // Folders are made before their recordings are complete.
    let complete = || {
        let folders = fs::read_dir(&summaries).into_iter().flatten().flatten();
        folders.filter(|folder| folder.path().join("summary.json").is_file()).count()
    };
    while complete() < 2 && start.elapsed() < Duration::from_mins(1) {
        std::thread::sleep(Duration::from_millis(1));
    }
    killed.kill().unwrap();
    killed.wait().unwrap();
    let (status, report, said) = batch(&folder, "out", &names, &[]);
    assert_eq!(status, 0, "{said}");
    let [done, skipped, ..] = counts(&report);
    assert!(done + skipped == 12 && skipped >= 1, "{done} done, {skipped} skipped");
    let [out, whole] = ["out", "whole"].map(|out| tables(&folder.path().join(out)));
    assert!(out.keys().eq(whole.keys()) && out.values().eq(whole.values()));
    // Nothing is left of what was begun.
    for table in ["form", "values", "summaries"] {
        for entry in fs::read_dir(folder.path().join("out").join(table)).unwrap() {
            let path = entry.unwrap().path();
            let inner = if path.is_dir() { fs::read_dir(path).unwrap().count() } else { 1 };
            assert_eq!(inner, 1);
        }
    }
}

/// At steps over all of a recording's publication: the summary says that its files are complete, and the next call leaves what a call does
/// that nobody killed.
#[test]
fn a_kill_at_any_step_leaves_no_summary_without_its_tables() {
    let folder = recorded(&["a.h5"]);
    assert_eq!(batch(&folder, "whole", &["a.h5"], &[]).0, 0);
    let whole = tables(&folder.path().join("whole"));
    let parts = |tables: &BTreeMap<PathBuf, Vec<u8>>| {
        tables.keys().filter(|path| path.starts_with("form") || path.starts_with("values")).count()
    };
    let (mut with, mut without) = (0, 0);
    for step in (1..).step_by(4) {
        let out = folder.path().join("out");
        let killed = Command::new(env!("CARGO_BIN_EXE_runout"))
            .current_dir(folder.path())
            .args(["batch", "pipeline.toml", "a.h5", "--out", "out", "--jobs", "1"])
            .env("RUNOUT_TEST_FAULT", format!("kill:{step}"))
            .output()
            .unwrap();
        if killed.status.success() {
            break;
        }
        if out.join("summaries/recording=a/summary.json").is_file() {
            with += 1;
            let found = tables(&out);
            assert!(parts(&found) >= 2 && found.iter().all(|(path, bytes)| whole[path] == *bytes), "step {step}");
        } else {
            without += 1;
        }
        let (status, _, said) = batch(&folder, "out", &["a.h5"], &[]);
        assert!(status == 0 && tables(&out) == whole, "step {step}: {said}");
        let summary = fs::read_dir(out.join("summaries/recording=a")).unwrap().count();
        assert_eq!((summary, out.join(".runout.lock").exists()), (1, false), "step {step}");
        fs::remove_dir_all(&out).unwrap();
    }
    assert!(with >= 2 && without >= 5, "{with} with a summary, {without} without");
}

#[test]
fn a_batch_can_fail_on_a_limit() {
    let folder = recorded(&["a.h5"]);
    let limit =
        |upper: &str| format!("limit=[{{ symbol = \"RONt\", upper = {upper}, unit = \"um\", filter = \"none\" }}]");
    let ran = |out: &str, more: &[&str]| batch(&folder, out, &["a.h5"], &[&["--fail-on-limit"], more].concat());
    assert_eq!(ran("kept", &["--set", &limit("500")]).0, 0);
    let (status, report, stderr) = ran("broken", &["--set", &limit("1e-3")]);
    assert_eq!((status, &report["limits"][0]["does_not_conform"]), (1, &Value::from(1)), "{stderr}");
    assert_eq!(ran("none", &[]).0, 2);
}

#[test]
fn what_cannot_be_distinguished_is_refused_before_the_work() {
    let folder = recorded(&["a.h5"]);
    fs::create_dir(folder.path().join("other")).unwrap();
    fs::copy(folder.path().join("a.h5"), folder.path().join("other/a.h5")).unwrap();
    let both = ["a.h5", "other/a.h5"];
    let (status, error, said) = batch(&folder, "out", &both, &[]);
    assert!(status == 2 && said.contains("has the same name, `a`") && said.contains("--name-folders"), "{said}");
    assert_eq!(error["error"]["kind"], "command-line");
    assert!(!folder.path().join("out").exists());
    assert_eq!(batch(&folder, "out", &both, &["--name-folders", "1"]).0, 0);
    let (status, _, said) = batch(&folder, ".", &["a.h5"], &[]);
    assert!(status == 2 && said.contains("lies in the data set"), "{said}");
    let (status, _, said) = batch(&folder, "a.h5", &["other/a.h5"], &[]);
    assert!(status == 1 && said.contains("there is a file of that name"), "{said}");
    let mistake = batch(&folder, "out", &["a.h5"], &["--set", "preprocess.0.samples_per_rev=0"]);
    assert_eq!(mistake.0, 2, "{}", mistake.2);
    assert_eq!(folder.run(&["batch", "pipeline.toml", "--out", "out"]).status, 2);
}

/// Text files: a recording is a folder with the names that [load] gives.
#[test]
fn a_folder_is_a_recording() {
    let pipeline = include_str!("../../../examples/08-text-recording/pipeline.toml");
    let text = include_str!("../../../examples/08-text-recording/shaft.csv");
    let folder = Folder::with(&[("pipeline.toml", pipeline)]);
    for name in ["monday", "tuesday.1"] {
        fs::create_dir(folder.path().join(name)).unwrap();
        fs::write(folder.path().join(name).join("shaft.csv"), text).unwrap();
    }
    let (status, report, said) = batch(&folder, "out", &["monday", "tuesday.1/"], &[]);
    assert_eq!((status, counts(&report)), (0, [2, 0, 0, 0]), "{said} {report}");
    assert!(folder.path().join("out/form/recording=tuesday.1/0.parquet").is_file());
    fs::write(folder.path().join("good.csv"), text).unwrap();
    let (status, report, said) = batch(&folder, "other", &["good.csv"], &[]);
    assert!(status != 0 && format!("{said}{report}").contains("which a file cannot replace"), "{said} {report}");
}

/// The control charts go where the exporter of the pipeline goes with its files: into the folder of the data set.
#[test]
fn the_trend_is_drawn_and_printed() {
    let names: Vec<String> = (0..7).map(|number| format!("part-{number}.h5")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let folder = recorded(&names);
    let figures = "\n[[export]]\nplugin = \"figures\"\npath = \"pictures\"\nformats = [\"svg\"]\n";
    fs::write(folder.path().join("pipeline.toml"), folder::pipeline() + figures).unwrap();
    let ran = folder.run(&[&["batch", "pipeline.toml", "--out", "out"], &names[..]].concat());
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    // A form that grows by 0.1 µm from part to part.
    assert!(ran.stdout.contains("part-5 (six-rising-or-falling)"), "{}", ran.stdout);
    assert!(ran.stdout.contains("fewer than 20 recordings"), "{}", ran.stdout);
    for figure in ["trend", "trend-range", "trend-signals"] {
        let svg = fs::read_to_string(folder.path().join(format!("out/{figure}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && !svg.contains("NaN"), "{figure}");
    }
    assert!(!folder.path().join("pictures").exists());
}

/// Readers that share no code with the writer take each folder as one table.
#[test]
fn foreign_readers_take_the_data_set_as_one() {
    let python = std::env::var("RUNOUT_PYTHON").unwrap_or_else(|_| "python3".into());
    let required = std::env::var("RUNOUT_REQUIRE_FOREIGN").is_ok_and(|value| value == "1");
    let there = Command::new(&python).args(["-c", "import pyarrow.dataset, polars, duckdb"]).output();
    if !there.is_ok_and(|output| output.status.success()) {
        assert!(!required, "{python} cannot import pyarrow, polars and duckdb, and RUNOUT_REQUIRE_FOREIGN is 1");
        println!("skipped: {python} cannot import pyarrow, polars and duckdb; RUNOUT_PYTHON may name one that can");
        return;
    }
    let names = ["part-1.h5", "a b=c%.h5"];
    let folder = recorded(&names);
    assert_eq!(batch(&folder, "out", &names, &[]).0, 0);
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/foreign/read_data_set.py");
    let output = Command::new(&python).arg(script).arg(folder.path().join("out")).args(["part-1", "a b=c%"]).output();
    let output = output.unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    println!("{said}");
}

#[test]
fn a_second_batch_into_the_same_folder_hears_who_holds_it() {
    let folder = recorded(&["a.h5"]);
    let held = folder.path().join("out/batch.json");
    let lock = runout_core::atomic_file::FolderLock::of([held.as_path()]).unwrap();
    let (status, _, said) = batch(&folder, "out", &["a.h5"], &[]);
    assert_eq!(status, 1, "{said}");
    assert!(said.contains(&format!("process {} (", std::process::id())), "{said}");
    drop(lock);
    assert_eq!(batch(&folder, "out", &["a.h5"], &[]).0, 0);
    assert!(!folder.path().join("out/.runout.lock").exists());
}
