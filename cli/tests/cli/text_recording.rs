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
    let told = summary["warnings"].to_string();
    assert!(told.contains("Zeit, Temperatur"), "{told}");
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
