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

    let shown = folder.run(&["run", "pipeline.toml"]);
    for word in ["STRt", "part", "slide", "neither taper", "nothing tells the uncertainty"] {
        assert!(shown.stdout.contains(word), "no {word} in\n{}", shown.stdout);
    }
    assert!(!shown.stdout.contains("station") && !shown.stdout.contains("Residual"), "{}", shown.stdout);
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
