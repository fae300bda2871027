//! Traces along an axis, from a file to a table.

use std::fmt::Write;

use serde_json::Value;

use crate::folder::Folder;

const PIPELINE: &str = r#"title = "Straightedge"

[load]
plugin = "points"
path = "traces.csv"

[separate]
plugin = "axial-reversal"

[[export]]
plugin = "parquet"
path = "out"

[[export]]
plugin = "hdf5"
path = "result.h5"
"#;

/// A part bent by 2 µm and a slide bent by −1 µm over 100 mm, each trace with an offset and a slope of its own.
fn traces() -> String {
    let mut text = String::from("trace;setup;z_mm;reading_um\n");
    for (id, setup, sign, slope) in [("1", "initial", 1.0, 0.3), ("2", "reversed", -1.0, -0.1)] {
        for index in 0..=20 {
            let z = 5.0 * f64::from(index);
            let bend = (z - 50.0).powi(2) / 2500.0;
            let reading = 2.0 * bend - sign * bend + 7.0 + slope * z;
            writeln!(text, "{id};{setup};{z};{reading}").unwrap();
        }
    }
    text
}

#[test]
fn from_traces_to_tables() {
    let folder = Folder::with(&[("pipeline.toml", PIPELINE), ("traces.csv", &traces())]);
    let checked = folder.run(&["check", "pipeline.toml"]);
    assert_eq!((checked.status, checked.stderr.as_str()), (0, ""));
    assert!(checked.stdout.contains("neither taper, nor parallelism"), "{}", checked.stdout);

    let ran = folder.run(&["run", "pipeline.toml", "--json"]);
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    let summary: Value = serde_json::from_str(&ran.stdout).unwrap();
    let values = summary["values"].as_array().unwrap();
    let value = |symbol: &str, of: &str| {
        let found = values.iter().find(|one| one["symbol"] == symbol && (of.is_empty() || one["of"] == of));
        found.unwrap()["value"].clone()
    };
    // Peak to valley of a parabola of height 1 is 1, its line being level; 1e-12: rounding.
    for (quantity, expected) in [("part", 2.0), ("slide", 1.0)] {
        let strt_um = value("STRt", quantity).as_f64().unwrap();
        assert!((strt_um - expected).abs() < 1e-12, "{quantity}: {strt_um}");
        assert_eq!(value("std", quantity), Value::Null, "one trace a setup has no uncertainty");
    }
    assert_eq!(value("positions", "").as_f64(), Some(21.0));
    let written: Vec<&str> = summary["outputs"].as_array().unwrap().iter().map(|path| path.as_str().unwrap()).collect();
    assert_eq!(written, ["out/straightness.parquet", "out/values.parquet", "result.h5", "out/summary.json"]);
    assert!(written.iter().all(|path| folder.path().join(path).is_file()));

    let table = folder.run(&["inspect", "out/straightness.parquet", "--json"]);
    let table: Value = serde_json::from_str(&table.stdout).unwrap();
    let names: Vec<&Value> = table["columns"].as_array().unwrap().iter().map(|column| &column["name"]).collect();
    assert_eq!(names, ["z_mm", "part_um", "part_std_um", "slide_um", "slide_std_um"]);
    assert_eq!(table["rows"], 21);
    let result = folder.run(&["inspect", "result.h5"]).stdout;
    assert!(result.contains("straightness") && !result.contains("harmonics"), "{result}");

    let shown = folder.run(&["run", "pipeline.toml", "--verbose"]);
    for word in ["STRt", "part", "slide", "neither taper", "the uncertainty is not known"] {
        assert!(shown.stdout.contains(word), "no {word} in\n{}", shown.stdout);
    }
    assert!(!shown.stdout.contains("station") && !shown.stdout.contains("Residual"), "{}", shown.stdout);
}

/// Readings of a reversal: two setups, three traces a setup, noise of some 0.007 µm.
fn repeated_traces() -> String {
    let mut text = String::from("trace;setup;z_mm;reading_um\n");
    for (setup, sign) in [("initial", 1.0), ("reversed", -1.0)] {
        for repeat in 1..=3 {
            for index in 0..=20 {
                let z = 5.0 * f64::from(index);
                let bend = (z - 50.0).powi(2) / 2500.0;
                let noise = 0.01 * (f64::from(1000 * repeat + 37 * index) * (1.7 + sign)).sin();
                let reading = 2.0 * bend - sign * bend + 7.0 + noise;
                writeln!(text, "{setup}-{repeat};{setup};{z};{reading}").unwrap();
            }
        }
    }
    text
}

const LIMITS: &str = r#"
[[limit]]
symbol = "STRt"
section = "part"
reference = "MZLI"
upper = 2.2
unit = "um"

[[limit]]
symbol = "STRt"
section = "slide"
upper = 0.9
unit = "um"
"#;

#[test]
fn standards_values_of_both_profiles_have_intervals_and_limits() {
    let text = format!("{PIPELINE}{LIMITS}");
    let folder = Folder::with(&[("pipeline.toml", text.as_str()), ("traces.csv", &repeated_traces())]);
    let checked: Value = serde_json::from_str(&folder.run(&["check", "pipeline.toml", "--json"]).stdout).unwrap();
    assert_eq!(checked["evaluables"], serde_json::json!(["open-profile"]));

    let ran = folder.run(&["run", "pipeline.toml", "--json"]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let summary: Value = serde_json::from_str(&ran.stdout).unwrap();
    for (of, truth) in [("part", 2.0), ("slide", 1.0)] {
        for reference in ["LSLI", "MZLI"] {
            let found = summary["values"].as_array().unwrap().iter().find(|one| {
                (&one["symbol"], &one["of"], &one["reference"]) == (&"STRt".into(), &of.into(), &reference.into())
            });
            let interval: Vec<f64> = serde_json::from_value(found.unwrap()["interval_95"].clone()).unwrap();
            assert!(interval[0] <= truth && truth <= interval[1] && interval[1] - interval[0] < 0.1, "{found:?}");
        }
    }
    let decisions =
        |summary: &Value| [0, 1].map(|limit| summary["limits"][limit]["decision"].as_str().unwrap().to_owned());
    assert_eq!(decisions(&summary), ["conforms", "does-not-conform"]);
    assert_eq!(summary["limits"][1]["values"].as_array().unwrap().len(), 2, "about LSLI and about MZLI");
    assert_eq!(folder.run(&["run", "pipeline.toml", "--fail-on-limit"]).status, 1);
    let shown = folder.run(&["run", "pipeline.toml"]).stdout;
    assert!(shown.contains("STRt MZLI of section part ≤ 2.2 µm") && shown.contains("does not conform"), "{shown}");

    // After the closed loop by the same way.
    assert_eq!(folder.run(&["diagnose", "pipeline.toml"]).status, 0);
    let diagnosed = std::fs::read(folder.path().join("out/diagnosed/summary.json")).unwrap();
    let diagnosed: Value = serde_json::from_slice(&diagnosed).unwrap();
    assert_eq!(decisions(&diagnosed), ["conforms", "does-not-conform"]);

    let refused = folder.run(&["check", "pipeline.toml", "--set", "evaluate.values=[\"straightness\", \"roundness\"]"]);
    assert_eq!(refused.status, 2);
    let said: String = refused.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        said.contains("nothing here gives values of `roundness`") && said.contains("offers open-profile"),
        "{said}"
    );
    let textured = ["run", "pipeline.toml", "--json", "--set", "evaluate.lambda_c_mm=20"];
    let summary: Value = serde_json::from_str(&folder.run(&textured).stdout).unwrap();
    assert!(summary["values"].as_array().unwrap().iter().any(|one| one["symbol"] == "Rq" && one["of"] == "slide"));
}

#[test]
fn what_does_not_go_with_straightness_is_refused_before_the_run() {
    let folder = Folder::with(&[("pipeline.toml", PIPELINE), ("traces.csv", &traces())]);
    let refused = |added: &[&str], status: i32, words: &[&str]| {
        let ran = folder.run(&[&["run", "pipeline.toml"], added].concat());
        assert_eq!(ran.status, status, "{}", ran.stderr);
        let said: String = ran.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words.iter().all(|word| said.contains(word)), "no {words:?} in\n{}", ran.stderr);
    };
    let mesh = ["--set", "export.1.plugin=obj", "--set", "export.1.path=part.obj"];
    refused(&mesh, 2, &["this exporter takes form", "take one that writes tables"]);
    refused(&["--set", "surface.angles=90"], 2, &["makes no surface"]);
    refused(&["--set", "separate.initial=reversed"], 2, &["both setups are named"]);
    refused(&["--set", "separate.step_mm=-1"], 2, &["must be above 0 mm"]);
    refused(&["--set", "separate.reversed=turned"], 1, &["no trace of setup `turned`", "`reversed`, `initial`"]);
    assert!(!folder.path().join("out").join("straightness.parquet").exists());
}
