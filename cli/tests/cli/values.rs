//! The standards' values of a run, and limits on the shop floor.

use serde_json::Value;

use crate::folder::{Folder, RIG, pipeline};

const SCENARIO: &str = r#"
plugin = "spindle"
seed = 5
output = "shaft.h5"
rig = "rig.toml"

[recording]
revolutions = 12
samples_per_rev = 256

[recording.stations]
count = 2

[form]
rms_um = 4
max_order = 20

[motion]
x_rms_um = 1.5
y_rms_um = 1.5

[noise]
rms_um = 0.05
"#;

/// Peaks of a form of 4 µm rms are some 10 to 25 µm apart.
const LIMITS: &str = r#"
[surface]
step_mm = 1

[evaluate]
values = ["roundness", "texture", "cylindricity", "areal"]
references = ["MZCI", "LSCI"]
filter_upr = [15]

[[limit]]
symbol = "RONt"
reference = "MZCI"
filter = "none"
upper = 100
unit = "um"

[[limit]]
symbol = "CYLt"
upper = 1
unit = "um"
"#;

fn campaign(text: &str) -> Folder {
    let text = pipeline() + text;
    let folder = Folder::with(&[("pipeline.toml", &*text), ("scenario.toml", SCENARIO), ("rig.toml", RIG)]);
    assert_eq!(folder.run(&["simulate", "scenario.toml"]).status, 0);
    folder
}

#[test]
fn limits_are_decided_and_end_the_program_only_when_asked() {
    let folder = campaign(LIMITS);
    let ran = folder.run(&["run", "pipeline.toml", "--json"]);
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    let summary: Value = serde_json::from_str(&ran.stdout).unwrap();
    let decisions: Vec<&Value> = summary["limits"].as_array().unwrap().iter().map(|one| &one["decision"]).collect();
    assert_eq!(decisions, ["conforms", "does-not-conform"]);
    assert_eq!(summary["limits"][0]["values"].as_array().unwrap().len(), 4, "two stations, two sections each");
    assert_eq!(summary["limits"][1]["values"].as_array().unwrap().len(), 4, "two references, two filters");
    let symbols: Vec<&Value> = summary["part"]["values"].as_array().unwrap().iter().map(|one| &one["symbol"]).collect();
    assert!(["CYLt", "Sa", "Sdr"].iter().all(|symbol| symbols.iter().any(|found| found == symbol)), "{symbols:?}");

    let failed = folder.run(&["run", "pipeline.toml", "--fail-on-limit", "--json"]);
    assert_eq!(failed.status, 1);
    assert!(failed.stderr.contains("not proven to be kept: CYLt ≤ 1 um"), "{}", failed.stderr);
    let document: Value = serde_json::from_str(&failed.stdout).unwrap();
    assert_eq!(document["limits"], summary["limits"]);
    let shown = folder.run(&["run", "pipeline.toml", "--fail-on-limit"]);
    assert_eq!(shown.status, 1);
    for word in ["Limits", "conforms", "does not conform", "The whole part", "Not proven to be kept"] {
        assert!(shown.stdout.contains(word), "no {word} in\n{}", shown.stdout);
    }

    let kept = folder.run(&["run", "pipeline.toml", "--fail-on-limit", "--set", "limit.1.upper=500"]);
    assert_eq!((kept.status, kept.stderr.as_str()), (0, ""));
    let table = folder.run(&["inspect", "out/values.parquet", "--json"]);
    assert!(table.stdout.contains("low_95"), "{}", table.stdout);
}

#[test]
fn warnings_end_the_program_only_when_asked() {
    let folder = campaign("");
    let sound = folder.run(&["run", "pipeline.toml", "--fail-on-warning"]);
    assert_eq!(sound.status, 0, "{}{}", sound.stdout, sound.stderr);
    let wrong = ["run", "pipeline.toml", "--set", "rig.sensors.0.sign=-1"];
    let warned = folder.run(&wrong);
    assert_eq!(warned.status, 0, "{}", warned.stderr);
    let failed = folder.run(&[&wrong[..], &["--fail-on-warning"]].concat());
    assert_eq!(failed.status, 1);
    assert!(failed.stderr.contains("--fail-on-warning"), "{}", failed.stderr);
    assert!(failed.stdout.contains("sensor-sign"), "the likely mistake is named\n{}", failed.stdout);
}

#[test]
fn what_cannot_be_evaluated_or_limited_has_a_place() {
    let folder = campaign("");
    let refused = |arguments: &[&str], words: &[&str]| {
        let ran = folder.run(&[&["run", "pipeline.toml"], arguments].concat());
        assert_eq!(ran.status, 2, "{}", ran.stderr);
        assert!(words.iter().all(|word| ran.stderr.contains(word)), "{}", ran.stderr);
    };
    refused(&["--fail-on-limit"], &["the pipeline has no limit", "[[limit]]"]);
    refused(&["--set", "evaluate.values=[\"roundnes\"]"], &["did you mean `roundness`"]);
    refused(&["--set", "evaluate.references=[\"LSC\"]"], &["did you mean `LSCI`"]);
    refused(&["--set", "evaluate.filter_upr=[0]"], &["above 0"]);
    refused(
        &["--set", "limit=[{ symbol = \"RONt\", unit = \"um\", upper = 1, section = \"c\" }]"],
        &["no value has the section `c`", "`a`"],
    );
    refused(&["--set", "limit=[{ symbol = \"Rz\", unit = \"um\", upper = 1 }]"], &["no value `Rz`", "`RONt`"]);
}
