//! `examples/08-text-recording` as it stands: a data logger's file.

use serde_json::Value;

use crate::folder::Folder;

const PIPELINE: &str = include_str!("../../../examples/08-text-recording/pipeline.toml");
const RECORDING: &str = include_str!("../../../examples/08-text-recording/shaft.csv");

#[test]
fn form_and_motion_come_out_of_the_file() {
    let folder = Folder::with(&[("pipeline.toml", PIPELINE), ("shaft.csv", RECORDING)]);
    let ran = folder.run(&["run", "pipeline.toml", "--json"]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let summary: Value = serde_json::from_str(&ran.stdout).unwrap();
    let station = &summary["stations"][0];
    let rms_um = station["sections"][0]["form_rms_um"].as_f64().unwrap();
    // 1.5 µm were simulated; 0.02 µm is five times the stated uncertainty.
    assert!((rms_um - 1.5).abs() < 0.02, "{station}");
    let warnings = summary["warnings"].to_string();
    assert!(warnings.contains("Zeit, Temperatur"), "{warnings}");
}

/// Ten turns are enough to know what is usual. A disturbance that is left out need not be reported.
#[test]
fn a_reading_far_from_all_others_is_reported_unless_its_turn_is_left_out() {
    let mut lines: Vec<String> = RECORDING.lines().map(str::to_owned).collect();
    let mut cells: Vec<&str> = lines[1300].split(';').collect();
    cells[2] = "106,221";
    lines[1300] = cells.join(";");
    let spiked = lines.join("\n");
    let folder = Folder::with(&[("pipeline.toml", PIPELINE), ("shaft.csv", &spiked)]);
    let warnings_with = |more: &[&str]| {
        let ran = folder.run(&[&["run", "pipeline.toml", "--json"], more].concat());
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        let summary: Value = serde_json::from_str(&ran.stdout).unwrap();
        summary["stations"][0]["warnings"].to_string()
    };
    let warnings = warnings_with(&[]);
    for part in ["shaft.csv", "A reads 106.2210 µm at sample", "in other turns at most", "outlier_sigma"] {
        assert!(warnings.contains(part), "{part}: {warnings}");
    }
    let warnings = warnings_with(&["--set", "preprocess.0.outlier_sigma=6", "--set", "preprocess.0.min_turns=4"]);
    assert!(!warnings.contains("µm at sample"), "{warnings}");
}

/// A recorder that is faster than its sensors repeats each reading, while the angle goes on.
#[test]
fn readings_that_stand_for_several_samples_refute_the_values() {
    let head = RECORDING.lines().find(|line| line.starts_with("Zeit")).unwrap();
    let rows = RECORDING.lines().filter(|line| line.starts_with('1')).map(|line| line.split(';').collect());
    let cells: Vec<Vec<&str>> = rows.collect();
    let sensors: Vec<bool> = head.split(';').map(|name| ["A", "B", "C"].contains(&name)).collect();
    for samples in [1, 4] {
        let row = |row: usize| -> String {
            let held = row / samples * samples;
            let cell = |(column, is_sensor): (usize, &bool)| cells[if *is_sensor { held } else { row }][column];
            sensors.iter().enumerate().map(cell).collect::<Vec<_>>().join(";")
        };
        let held: Vec<String> = std::iter::once(head.to_owned()).chain((0..cells.len()).map(row)).collect();
        let folder = Folder::with(&[("pipeline.toml", PIPELINE), ("shaft.csv", &held.join("\n"))]);
        let ran = folder.run(&["run", "pipeline.toml", "--json"]);
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        let summary: Value = serde_json::from_str(&ran.stdout).unwrap();
        let values = summary["stations"][0]["sections"][0]["values"].as_array().unwrap();
        let refuted =
            values.iter().filter(|value| value["refuted_by"].to_string().contains("stands for about 4 samples"));
        assert_eq!(refuted.count(), if samples == 4 { values.len() } else { 0 }, "{summary}");
    }
}

#[test]
fn a_cell_that_is_no_number_is_named_with_what_to_do() {
    let damaged = RECORDING.replacen("6,221", "NA", 1);
    let folder = Folder::with(&[("pipeline.toml", PIPELINE), ("shaft.csv", &damaged)]);
    let ran = folder.run(&["run", "pipeline.toml"]);
    assert_eq!(ran.status, 1, "{}", ran.stdout);
    for part in ["line 6, column 3 (`A`)", "found `NA`", "write NaN"] {
        assert!(ran.stderr.split_whitespace().collect::<Vec<_>>().join(" ").contains(part), "{part}: {}", ran.stderr);
    }
    assert!(!folder.path().join("out").exists(), "a run that fails leaves nothing");
}
