//! `examples/11-measured-r-test` as it stands: a model of points that has no form to separate.

use serde_json::Value;

use crate::folder::{Folder, RIG};

const PIPELINE: &str = include_str!("../../../examples/11-measured-r-test/pipeline.toml");
const POINTS: &str = include_str!("../../../examples/11-measured-r-test/r-test.csv");
const DIAGNOSIS: &str = include_str!("../../../examples/11-measured-r-test/diagnosis.json");

fn example() -> Folder {
    Folder::with(&[("pipeline.toml", PIPELINE), ("r-test.csv", POINTS)])
}

#[test]
fn the_diagnosis_is_the_one_shown() {
    let ran = example().run(&["diagnose", "pipeline.toml", "--json"]);
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    let [found, shown]: [Value; 2] = [&ran.stdout, DIAGNOSIS].map(|text| serde_json::from_str(text).unwrap());
    assert_eq!((&found["verdict"], &found["warnings"]), (&shown["verdict"], &shown["warnings"]));
    assert_eq!(found["added"][0]["effect"], "harmonic-2");
    for level in ["before", "after"] {
        let [found, shown] = [&found, &shown].map(|text| text[level]["residual_rms_um"].as_f64().unwrap());
        // 1e-9 µm: another processor rounds otherwise.
        assert!((found - shown).abs() < 1e-9, "{level}: {found} instead of {shown}");
    }
}

#[test]
fn what_it_cannot_do_is_said() {
    let folder = example();
    let ran = folder.run(&["check", "pipeline.toml"]);
    assert!(ran.stdout.contains("Columns of the points") && ran.stdout.contains("dx_mm"), "{}", ran.stdout);
    // 3 levels and 3 pairs of one harmonic, of which those of this example are never fitted exactly.
    let ran = folder.run(&["run", "pipeline.toml", "--json"]);
    let found: Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!((ran.status, found["values"].as_array().unwrap().len()), (0, 9), "{}", ran.stderr);
    assert!(found["values"].as_array().unwrap().iter().all(|value| value["unit"] == "um" && value["std"].is_f64()));
    let ran = folder.run(&["run", "pipeline.toml", "--set", "evaluate.values=\"all\""]);
    assert!(ran.status == 2 && ran.stderr.contains("there is no form here"), "{}", ran.stderr);
    let ran = folder.run(&["diagnose", "pipeline.toml", "--set", "diagnose.path=r-test.csv"]);
    assert!(ran.status == 1 && ran.stderr.contains("it is what the run reads"), "{}", ran.stderr);
    let ran = folder.run(&["diagnose", "pipeline.toml", "--set", "diagnose.effects=[\"harmonics-2\"]"]);
    assert!(ran.status == 2 && ran.stderr.contains("did you mean `harmonic-2`"), "{}", ran.stderr);
}

#[test]
fn a_rig_beside_points_is_refused_and_not_ignored() {
    let inline = PIPELINE.replace("[load]", &format!("[rig]\n{RIG}\n[load]"));
    let included = PIPELINE.replace("[load]", "rig = \"rig.toml\"\n\n[load]");
    for pipeline in [&inline, &included] {
        let folder = Folder::with(&[("pipeline.toml", pipeline), ("r-test.csv", POINTS), ("rig.toml", RIG)]);
        for command in ["check", "run", "diagnose"] {
            let ran = folder.run(&[command, "pipeline.toml"]);
            let said = ran.stderr.contains("measured points take no [rig]") && ran.stderr.contains("pipeline.toml:");
            assert!(ran.status == 2 && said, "{command}: {}", ran.stderr);
        }
    }
}
