//! `runout compare`: what is shown, what is refused, what is written.

use std::fs;

use insta::assert_snapshot;
use serde_json::Value;

use crate::{
    commands::SCENARIO,
    folder::{Folder, RIG, pipeline},
};

/// A folder with a small campaign, and tables of what to compare.
fn campaign(tables: &str) -> Folder {
    let text = pipeline() + tables;
    let folder = Folder::with(&[("pipeline.toml", &text), ("scenario.toml", SCENARIO), ("rig.toml", RIG)]);
    assert_eq!(folder.run(&["simulate", "scenario.toml"]).status, 0);
    folder
}

const TABLES: &str = "\n[[compare]]\nplugin = \"donaldson-reversal\"\n\n[[compare]]\nplugin = \"multi-step\"\n";

#[test]
fn two_methods_and_one_refused() {
    let folder = campaign(TABLES);
    assert_snapshot!(folder.run(&["compare", "pipeline.toml"]).shown());
}

#[test]
fn a_run_checks_what_is_compared_and_leaves_it_alone() {
    let folder = campaign(TABLES);
    assert_eq!(folder.run(&["run", "pipeline.toml"]).status, 0);
    let wrong = folder.run(&["check", "pipeline.toml", "--set", "compare.0.sensor=S1"]);
    assert_eq!(wrong.status, 2);
    assert!(wrong.stderr.contains("unknown key `sensor`"), "{}", wrong.stderr);
}

/// Three-point by its formula and by least squares are one method: no reading is redundant. Simulated.
#[test]
fn methods_that_agree_to_rounding_have_no_normalised_difference() {
    let rig = "part_radius_mm = 30\nsensors = [{ id = \"S1\", angle_deg = 0 }, { id = \"S2\", angle_deg = 99.844 }, \
               { id = \"S3\", angle_deg = 202.5 }]\nsetups = [{ id = \"initial\" }]\n";
    let pipeline = pipeline().replace(RIG, rig).replace("four-sensor-reversal", "harmonic-least-squares");
    let folder = Folder::with(&[("pipeline.toml", &pipeline), ("scenario.toml", SCENARIO), ("rig.toml", rig)]);
    for set in ["eccentricity.offset_um=8", "eccentricity.offset_um=200", "asynchronous.rms_um=0.2"] {
        assert_eq!(folder.run(&["simulate", "scenario.toml", "--set", set]).status, 0);
        let ran = folder.run(&["compare", "pipeline.toml", "--with", "three-point", "--json"]);
        let document: Value = serde_json::from_str(&ran.stdout).unwrap();
        for quantity in document["stations"][0]["quantities"].as_array().unwrap() {
            let difference = &quantity["differences"][0];
            assert!(difference["orders_compared"].as_u64().unwrap() > 60, "{set}");
            assert_eq!(
                difference["worst"]["e_n"], 0.0,
                "{set}: {} differs by {}",
                quantity["quantity"], difference["rms"]
            );
        }
    }
}

#[test]
fn what_cannot_be_compared() {
    let folder = campaign("");
    let unknown = folder.run(&["compare", "pipeline.toml", "--with", "donaldson-reversal,thre-point"]);
    assert_snapshot!(unknown.shown());
    let alone = folder.run(&["compare", "pipeline.toml", "--with", "multi-step"]);
    assert_snapshot!("nothing_left_to_compare", alone.shown());
    let name = folder.run(&["compare", "pipeline.toml", "--out", "out.csv"]);
    assert_eq!(name.status, 2, "{}", name.stderr);
    let input = folder.run(&["compare", "pipeline.toml", "--out", "pipeline.toml"]);
    assert_eq!(input.status, 2, "{}", input.stderr);
    // Its ending says JSON, and it is what the comparison reads.
    fs::rename(folder.path().join("shaft.h5"), folder.path().join("shaft.json")).unwrap();
    let over = ["compare", "pipeline.toml", "--set", "load.path=shaft.json", "--out", "./shaft.json"];
    let ran = folder.run(&over);
    assert_eq!(ran.status, 1, "{}", ran.stdout);
    assert!(ran.stderr.contains("what the run reads"), "{}", ran.stderr);
}

#[test]
fn lost_orders_are_null_in_every_file() {
    let folder = campaign("");
    let set = "rig.setups.1.sensors_deg=0";
    let fixed = ["compare", "pipeline.toml", "--with", "harmonic-least-squares", "--set", set, "--out"];
    let written = folder.run(&[&fixed[..], &["compare.json"]].concat());
    assert_eq!((written.status, written.stderr.as_str()), (0, ""));
    let document: Value = serde_json::from_slice(&fs::read(folder.path().join("compare.json")).unwrap()).unwrap();
    let even: Vec<usize> = (2..=63).step_by(2).collect();
    for method in document["methods"].as_array().unwrap() {
        assert_eq!(method["lost_orders"]["form"], serde_json::json!(even), "{method}");
    }
    let form = &document["stations"][0]["quantities"][0];
    let general = form["values"].as_array().unwrap().last().unwrap();
    assert_eq!(general["harmonics"]["re"][1], Value::Null);
    assert_eq!(form["differences"][0]["by_order"]["difference"][1], Value::Null);
    assert!(form["differences"][0]["by_order"]["e_n"][2].is_number());

    let table = folder.run(&[&fixed[..], &["compare.parquet", "--json"]].concat());
    assert_eq!((table.status, table.stderr.as_str()), (0, ""));
    let printed: Value = serde_json::from_str(&table.stdout).unwrap();
    assert_eq!(printed["stations"], document["stations"], "the same, printed");
    let held: Value = serde_json::from_str(&folder.run(&["inspect", "compare.parquet", "--json"]).stdout).unwrap();
    // 2 stations, 63 orders, forms a and b, x, y, two tilts, two methods.
    assert_eq!(held["rows"], 2 * 63 * 6 * 2);
}
