//! Rotors: their modes, and the check of a campaign against them.

use crate::folder::{Folder, RIG, STAGES};
use serde_json::Value;

const SPINDLE: &str = include_str!("../../../examples/20-rotor-modes/spindle.toml");
const PIPELINE: &str = include_str!("../../../examples/20-rotor-modes/pipeline.toml");

#[test]
fn the_example_has_its_tables_and_values() {
    let folder = Folder::with(&[("spindle.toml", SPINDLE), ("pipeline.toml", PIPELINE)]);
    let ran = folder.run(&["run", "pipeline.toml", "--json"]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    for table in ["modes", "campbell", "critical_speeds", "mode_shapes", "speeds_to_avoid", "values"] {
        assert!(folder.path().join(format!("out/{table}.parquet")).exists(), "{table}");
    }
    let document: Value = serde_json::from_str(&ran.stdout).unwrap();
    let values = document["values"].as_array().unwrap();
    let of = |symbol: &str| values.iter().filter(|value| value["symbol"] == symbol).count();
    assert_eq!(of("f"), 6);
    assert!(of("n_crit") > 0 && of("avoid_from") > 0 && of("avoid_from") == of("avoid_to"), "{values:?}");
}

#[test]
fn mistakes_have_their_status() {
    let folder =
        Folder::with(&[("spindle.toml", &SPINDLE.replace("length_mm = 300.0", "length_mm = 0")), ("p.toml", PIPELINE)]);
    let ran = folder.run(&["run", "p.toml"]);
    assert_eq!(ran.status, 1, "{}", ran.stderr);
    assert!(ran.stderr.contains("spindle.toml") && ran.stderr.contains("above 0 mm"), "{}", ran.stderr);
    assert!(!folder.path().join("out").exists());
    let ran = folder.run(&["run", "p.toml", "--set", "separate.modes=0"]);
    assert_eq!(ran.status, 2, "{}", ran.stderr);
}

/// A campaign at 3000 rpm, and a shaft whose first mode is at 99 Hz: order 2, 100 Hz, is within 15 % of it.
#[test]
fn check_warns_of_a_mode_near_an_order() {
    let rotor = |length_mm: f64| {
        format!(
            "materials = [{{ id = \"s\", youngs_gpa = 210, poisson = 0.3, density_kg_per_m3 = 7850 }}]\n\
             segments = [{{ length_mm = {length_mm}, outer_mm = 30, material = \"s\", elements = 8 }}]\n\
             supports = [{{ z_mm = 0, kind = \"pinned\" }}, {{ z_mm = {length_mm}, kind = \"pinned\" }}]\n"
        )
    };
    let check = |path: &str, more: &str| format!("\n[[check]]\nplugin = \"rotor-speeds\"\npath = \"{path}\"\n{more}\n");
    let pipeline = |check: &str| format!("title = \"Shaft\"\n\n[rig]\n{RIG}{STAGES}{check}");
    let scenario = format!(
        "title = \"Shaft\"\nplugin = \"spindle\"\noutput = \"shaft.h5\"\nseed = 1\n\n[rig]\n{RIG}\n[recording]\nspeed_rpm = 3000\n\
         revolutions = 6\nsamples_per_rev = 256\nphase = \"index\"\n"
    );
    let folder = Folder::with(&[
        ("near.toml", &rotor(785.0)),
        ("far.toml", &rotor(300.0)),
        ("bad.toml", "segments = []\n"),
        ("scenario.toml", &scenario),
        ("near-p.toml", &pipeline(&check("near.toml", ""))),
        ("far-p.toml", &pipeline(&check("far.toml", ""))),
        ("stated-p.toml", &pipeline(&check("far.toml", "speed_rpm = [3000]\norders = [12]"))),
        ("bad-p.toml", &pipeline(&check("bad.toml", ""))),
        ("unknown-p.toml", &pipeline(&check("near.toml", "speeds = [3000]"))),
    ]);
    let notes = |pipeline: &str| {
        let ran = folder.run(&["check", pipeline, "--json"]);
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        let document: Value = serde_json::from_str(&ran.stdout).unwrap();
        document["notes"].as_array().unwrap().iter().filter_map(Value::as_str).collect::<Vec<_>>().join("\n")
    };
    // Without the recording no speed is known.
    assert!(notes("near-p.toml").contains("give `speed_rpm`"));
    assert!(notes("stated-p.toml").contains("order 12"), "{}", notes("stated-p.toml"));
    let ran = folder.run(&["simulate", "scenario.toml"]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let near = notes("near-p.toml");
    assert!(near.contains("at 3000 rpm, order 2 is at 100.0 Hz and mode 1"), "{near}");
    assert!(!near.contains("order 1 is") && !near.contains("order 3 is"), "{near}");
    assert!(!notes("far-p.toml").contains("mode 1"), "{}", notes("far-p.toml"));
    // A rotor that is none is a mistake of the configuration; it points at the key.
    let ran = folder.run(&["check", "bad-p.toml"]);
    assert_eq!(ran.status, 2, "{}", ran.stderr);
    assert!(ran.stderr.contains("bad.toml") && ran.stderr.contains("at least one segment"), "{}", ran.stderr);
    assert_eq!(folder.run(&["check", "unknown-p.toml"]).status, 2);
}
