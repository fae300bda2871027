//! What is said of a rig, a speed and a recording that are possible and unusual.

use std::fs;

use serde_json::Value;

use crate::folder::{self, Folder};

const SCENARIO: &str = r#"
plugin = "spindle"
output = "shaft.h5"
rig = "rig.toml"

[recording]
revolutions = 20
samples_per_rev = 128
stations = { count = 1 }

[form]
rms_um = 2
max_order = 12

[motion]
x_rms_um = 0.5
y_rms_um = 0.5

[asynchronous]
rms_um = 0.1

[noise]
rms_um = 0.02
"#;

/// Recorded with the rig as it is; then the pipeline has `from` replaced.
fn recorded(sets: &[&str], from: &str, to: &str) -> Folder {
    let pipeline = folder::pipeline().replacen(from, to, 1);
    let files = [("pipeline.toml", &*pipeline), ("rig.toml", folder::RIG), ("scenario.toml", SCENARIO)];
    let folder = Folder::with(&files);
    let sets = sets.iter().flat_map(|set| ["--set", set]);
    let ran = folder.run(&["simulate", "scenario.toml"].into_iter().chain(sets).collect::<Vec<_>>());
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    folder
}

fn json(folder: &Folder, words: &[&str]) -> Value {
    let ran = folder.run(&[words, &["--json"]].concat());
    serde_json::from_str(&ran.stdout).unwrap_or_else(|_| Value::from(ran.stderr))
}

fn said(document: &Value, key: &str, text: &str) -> usize {
    let all = document[key].as_array().into_iter().flatten();
    all.filter(|one| one.as_str().is_some_and(|one| one.contains(text))).count()
}

#[test]
fn mains_at_a_whole_order_is_a_note() {
    let at_500 = recorded(&[], "x", "x");
    let text = "50 Hz is order 6.00 at 500 rpm";
    assert_eq!(said(&json(&at_500, &["check", "pipeline.toml"]), "notes", text), 1);
    let summary = json(&at_500, &["run", "pipeline.toml"]);
    assert_eq!(said(&summary, "warnings", text), 1, "{summary}");
    assert_eq!(said(&json(&at_500, &["diagnose", "pipeline.toml"]), "warnings", text), 1);
    // No warning that fails a run.
    assert_eq!(at_500.run(&["run", "pipeline.toml", "--fail-on-warning"]).status, 0);
    // 50 Hz and 60 Hz are orders 6.42 and 7.70.
    let at_467 = recorded(&["recording.speed_rpm=467.3"], "x", "x");
    for (command, key) in [("check", "notes"), ("run", "warnings"), ("diagnose", "warnings")] {
        let document = json(&at_467, &[command, "pipeline.toml"]);
        assert_eq!(said(&document, key, " Hz is order "), 0, "{document}");
    }
}

#[test]
fn an_angle_beyond_a_turn_is_a_warning_of_each_command_and_of_a_batch() {
    let folder = recorded(&[], "angle_deg = 90", "angle_deg = 450");
    let text = "`angle_deg` of the sensor `S2` = 450.000000 is beyond a turn and counts as 90.000000";
    for (command, key) in [("check", "notes"), ("run", "warnings"), ("diagnose", "warnings")] {
        let document = json(&folder, &[command, "pipeline.toml"]);
        assert_eq!(said(&document, key, text), 1, "{command}: {document}");
    }
    fs::copy(folder.path().join("shaft.h5"), folder.path().join("other.h5")).unwrap();
    let batch = ["batch", "pipeline.toml", "shaft.h5", "other.h5", "--out", "data"];
    let report = json(&folder, &batch);
    assert_eq!(report["warned"], 2, "{report}");
    assert_eq!(report["warnings"][0]["recording"], "other");
    assert_eq!(said(&report["warnings"][1], "first", text), 1, "{report}");
    // Skipped as up to date, they warn of the same.
    let shown = folder.run(&batch).stdout;
    assert!(shown.contains("Recordings with warnings") && shown.contains(text), "{shown}");
    assert_eq!(json(&folder, &batch)["warned"], 2);
}

#[test]
fn a_text_recording_can_be_inspected() {
    let folder = Folder::with(&[("a.csv", "time_s;index;S1\n0,0;0;1,5\n0,1;1;1,25\n")]);
    let report = json(&folder, &["inspect", "a.csv"]);
    assert_eq!((&report["format"], &report["rows"]), (&"csv".into(), &2.into()), "{report}");
    let shown = folder.run(&["inspect", "a.csv"]).stdout;
    assert!(shown.contains("2 rows of 3 columns") && shown.contains("time_s, index, S1"), "{shown}");
}
