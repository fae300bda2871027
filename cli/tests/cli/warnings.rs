//! Warnings of the whole and of single stations reach whoever looks at one place only.

use std::fs;

use serde_json::Value;

use crate::folder::{self, Folder};

const SCENARIO: &str = r#"
plugin = "spindle"
output = "shaft.h5"
rig = "rig.toml"
seed = 77

[recording]
revolutions = 24
samples_per_rev = 128
stations = { first_z_mm = 0, step_mm = 5, count = 3 }

[form]
rms_um = 2
max_order = 12

[motion]
x_rms_um = 0.5
y_rms_um = 0.5

[noise]
rms_um = 0.05
"#;

/// A campaign, with its pipeline on a rig whose first sensor has the wrong sign, or as it is.
fn recorded(sets: &[&str], wrong_sign: bool) -> Folder {
    let sign = if wrong_sign { "z_mm = 200, section = \"a\", sign = -1 }" } else { "z_mm = 200, section = \"a\" }" };
    let pipeline = folder::pipeline().replacen("z_mm = 200, section = \"a\" }", sign, 1);
    let folder = Folder::with(&[("pipeline.toml", &pipeline), ("rig.toml", folder::RIG), ("scenario.toml", SCENARIO)]);
    let sets = sets.iter().flat_map(|set| ["--set", set]);
    let ran = folder.run(&["simulate", "scenario.toml"].into_iter().chain(sets).collect::<Vec<_>>());
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    folder
}

fn json(folder: &Folder, words: &[&str]) -> Value {
    let ran = folder.run(&[words, &["--json"]].concat());
    serde_json::from_str(&ran.stdout).unwrap_or_else(|_| panic!("{}", ran.stderr))
}

fn texts(document: &Value, key: &str) -> Vec<String> {
    let all = document[key].as_array().into_iter().flatten();
    all.map(|text| text.as_str().unwrap_or_default().to_owned()).collect()
}

#[test]
fn a_station_s_warning_is_at_the_top_with_its_name() {
    let folder = recorded(&[], true);
    for command in ["run", "compare"] {
        let document = json(&folder, &[command, "pipeline.toml"]);
        let top = texts(&document, "warnings");
        let stations = document["stations"].as_array().unwrap();
        let mut of_stations = 0;
        for station in stations {
            let name = station["station"].as_str().unwrap();
            for warning in texts(station, "warnings") {
                of_stations += 1;
                let named = top.iter().any(|text| text.contains(&warning) && text.contains(name));
                assert!(named, "{command}, {name}: {warning}\n{top:#?}");
            }
        }
        assert!(of_stations >= stations.len(), "{document}");
    }
}

#[test]
fn a_diagnosis_repeats_what_the_run_warns_of() {
    for folder in [recorded(&[], true), recorded(&["noise.rms_um=0.3"], false)] {
        let ran = json(&folder, &["run", "pipeline.toml"]);
        let diagnosis = json(&folder, &["diagnose", "pipeline.toml"]);
        let all = texts(&diagnosis, "warnings");
        for warning in texts(&ran, "warnings") {
            assert!(all.iter().any(|text| text.contains(&warning)), "{warning}\n{all:#?}");
        }
        let notes = texts(&diagnosis, "notes");
        assert!(texts(&ran, "notes").iter().all(|note| notes.contains(note)), "{notes:#?}");
        let written = fs::read_to_string(folder.path().join("out/diagnosed/diagnosis.json")).unwrap();
        let written: Value = serde_json::from_str(&written).unwrap();
        assert_eq!(written["warnings"], diagnosis["warnings"]);
    }
}

#[test]
fn each_command_can_fail_on_a_warning() {
    let (wrong, sound) = (recorded(&[], true), recorded(&[], false));
    let commands: [&[&str]; 4] = [
        &["run", "pipeline.toml"],
        &["diagnose", "pipeline.toml"],
        &["compare", "pipeline.toml"],
        &["batch", "pipeline.toml", "shaft.h5", "--out", "data"],
    ];
    for words in commands {
        assert_eq!(wrong.run(words).status, 0, "{words:?}");
        let words = [words, &["--fail-on-warning"]].concat();
        let failed = wrong.run(&words);
        assert_eq!(failed.status, 1, "{words:?}: {}", failed.stdout);
        assert!(failed.stderr.contains("warning") && failed.stderr.contains("--fail-on-warning"), "{}", failed.stderr);
        let kept = sound.run(&words);
        assert_eq!(kept.status, 0, "{words:?}: {}{}", kept.stdout, kept.stderr);
    }
}
