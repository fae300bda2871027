//! Measured points: `compare`, `plan`, lost orders and warnings, as their users meet them.

use serde_json::Value;

use crate::folder::{Folder, Ran};

const ROTARY: &str = include_str!("../../../examples/14-rotary-axis/pipeline.toml");
const R_TEST: &str = include_str!("../../../examples/14-rotary-axis/scenario.toml");
const PROBE: &str = include_str!("../../../examples/15-touch-probe/pipeline.toml");
const TOUCHES: &str = include_str!("../../../examples/15-touch-probe/touches.csv");

fn rotary() -> Folder {
    let folder = Folder::with(&[("pipeline.toml", ROTARY), ("scenario.toml", R_TEST)]);
    assert_eq!(folder.run(&["simulate", "scenario.toml"]).status, 0);
    folder
}

fn probe() -> Folder {
    Folder::with(&[("pipeline.toml", PROBE), ("touches.csv", TOUCHES)])
}

fn json(ran: &Ran) -> Value {
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    serde_json::from_str(&ran.stdout).unwrap()
}

fn named<'a>(all: &'a Value, key: &str, name: &str) -> &'a Value {
    all.as_array().unwrap().iter().find(|one| one[key] == name).unwrap_or_else(|| panic!("no {name} in {all}"))
}

#[test]
fn separators_of_points_are_compared() {
    let folder = rotary();
    let with = "--with=rotary-axis-circle-fit,rotary-axis-three-point";
    let found = json(&folder.run(&["compare", "pipeline.toml", with, "--json"]));
    assert_eq!(found["reference"], "rotary-axis");
    let methods: Vec<&str> =
        found["methods"].as_array().unwrap().iter().map(|one| one["method"].as_str().unwrap()).collect();
    assert_eq!(methods, ["rotary-axis", "rotary-axis-circle-fit", "rotary-axis-three-point"]);
    for (symbol, truth) in [("EX0C", 23.7), ("EY0C", 3.1), ("EA0C", 41.0), ("EB0C", 34.6)] {
        let value = named(&found["values"], "symbol", symbol);
        let numbers: Vec<[f64; 2]> = value["values"]
            .as_array()
            .unwrap()
            .iter()
            .map(|one| [one["value"].as_f64().unwrap(), one["std"].as_f64().unwrap()])
            .collect();
        assert_eq!(numbers.len(), 3);
        let [own, own_std] = numbers[0];
        assert!((own - truth).abs() < 4.0 * own_std, "{symbol} {own} {own_std}");
        for (one, [number, std]) in value["differences"].as_array().unwrap().iter().zip(&numbers[1..]) {
            let difference = one["difference"].as_f64().unwrap();
            assert!((difference - (number - own)).abs() < 1e-9);
            // The definition, written out here once more.
            let e_n = difference.abs() / (2.0 * (std * std + own_std * own_std).sqrt());
            assert!((one["e_n"].as_f64().unwrap() - e_n).abs() < 1e-9 * e_n.max(1.0));
            assert!((one["std_ratio"].as_f64().unwrap() - std / own_std).abs() < 1e-9);
        }
    }
    // Only the weighted fit gives the residual after compensation.
    assert!(named(&found["values"], "symbol", "dx_range_after")["differences"].as_array().unwrap().is_empty());
    let column = named(&found["columns"], "column", "ecc_urad");
    assert_eq!((&column["table"], &column["differences"][0]["rows"]), (&"component_errors".into(), &36.into()));
    let shown = folder.run(&["compare", "pipeline.toml", with]);
    for word in ["EX0C, µm", "E_n", "rotary-axis-three-point", "exc_um"] {
        assert!(shown.stdout.contains(word), "no {word} in\n{}", shown.stdout);
    }
}

#[test]
fn a_comparison_takes_the_keys_of_the_pipeline_and_its_own() {
    let folder = rotary();
    // Without names: every separator of these points that needs no further key.
    let found = json(&folder.run(&["compare", "pipeline.toml", "--json"]));
    let methods = found["methods"].to_string();
    assert!(methods.contains("rotary-axis-circle-fit") && methods.contains("rotary-axis-three-point"), "{methods}");
    assert!(!methods.contains("touch-probe") && !methods.contains("harmonic-least-squares"), "{methods}");
    let tables = "\n[[compare]]\nplugin = \"rotary-axis-circle-fit\"\nball = \"P2\"\n\n[[compare]]\nplugin = \"rotary-axis\"\ncomponent_errors = false\n";
    std::fs::write(folder.path().join("two.toml"), format!("{ROTARY}{tables}")).unwrap();
    let found = json(&folder.run(&["compare", "two.toml", "--json", "--out", "compared.json"]));
    let methods: Vec<&Value> = found["methods"].as_array().unwrap().iter().map(|one| &one["method"]).collect();
    assert_eq!(methods, ["rotary-axis", "rotary-axis-circle-fit", "rotary-axis (2)"]);
    assert!(found["methods"][1]["notes"].to_string().contains("only P2 is used"), "{}", found["methods"]);
    assert!(folder.path().join("compared.json").is_file());
    // A pipeline with such tables still runs.
    assert_eq!(folder.run(&["check", "two.toml"]).status, 0);
}

#[test]
fn what_cannot_be_compared_is_said() {
    let folder = rotary();
    let ran = folder.run(&["compare", "pipeline.toml", "--with", "touch-probe"]);
    assert!(
        ran.status == 2 && ran.stderr.contains("touch-probe") && ran.stderr.contains("ring_radius_mm"),
        "{}",
        ran.stderr
    );
    let ran = folder.run(&["compare", "pipeline.toml", "--with", "four-sensor-reversal"]);
    assert!(ran.status == 2 && ran.stderr.contains("nothing to compare"), "{}", ran.stderr);
    let ran = folder.run(&["compare", "pipeline.toml", "--out", "compared.parquet"]);
    assert!(ran.status == 2 && ran.stderr.contains("no orders") && ran.stderr.contains(".json"), "{}", ran.stderr);
    assert!(!folder.path().join("compared.parquet").exists());
    let ran = folder.run(&["compare", "pipeline.toml", "--out", "r-test.csv"]);
    assert_eq!(ran.status, 2, "{}", ran.stderr);
    let wrong = "\n[[compare]]\nplugin = \"rotary-axis-circle-fit\"\nball = \"P9\"\n";
    std::fs::write(folder.path().join("wrong.toml"), format!("{ROTARY}{wrong}")).unwrap();
    let ran = folder.run(&["compare", "wrong.toml"]);
    assert!(ran.status == 2 && ran.stderr.contains("P9") && ran.stderr.contains("wrong.toml:"), "{}", ran.stderr);
}

#[test]
fn balls_are_planned_without_data() {
    let folder = Folder::with(&[("pipeline.toml", ROTARY)]);
    let found = json(&folder.run(&["plan", "pipeline.toml", "--json"]));
    let gain = |found: &Value, group: &str, quantity: &str| {
        named(&found["noise_gain"][group], "quantity", quantity)["gain"].as_f64()
    };
    for quantity in ["EX0C", "EY0C", "EA0C", "EB0C"] {
        assert!(gain(&found, "location", quantity).is_some_and(|gain| gain > 0.0 && gain < 10.0), "{quantity}");
    }
    for quantity in ["EXC", "EYC", "EZC", "EAC", "EBC", "ECC"] {
        let [before, after] = [&found, &found["suggestions"][0]].map(|at| gain(at, "component", quantity).unwrap());
        assert!(after < before, "a fourth ball takes noise out of {quantity}: {before} {after}");
    }
    assert_eq!(found["suggestions"][0]["add"], "ball");
    assert!(found["blind_to"].to_string().contains("linear-axis-scale"), "{}", found["blind_to"]);
    // Two balls lose the rotation about their line; a third one gives it.
    let two = "separate.balls=[{ id = \"P1\", x_mm = 120.0, y_mm = 0.0, z_mm = 60.0 }, { id = \"P2\", x_mm = -50.0, y_mm = 95.0, z_mm = 60.0 }]";
    let found = json(&folder.run(&["plan", "pipeline.toml", "--json", "--set", two]));
    assert_eq!(gain(&found, "component", "EXC"), None);
    assert!(gain(&found, "component", "ECC").is_some());
    assert_eq!(found["score"]["lost"], 9);
    assert_eq!(found["suggestions"][0]["after"]["lost"], 0);
    // What is suggested can be put into the pipeline.
    let entry = found["suggestions"][0]["entry"].as_str().unwrap();
    let more = format!("{}, {entry}]", two.trim_end_matches(']'));
    let after = json(&folder.run(&["plan", "pipeline.toml", "--json", "--set", &more]));
    assert_eq!(after["score"]["lost"], 0);
    let ratio = after["score"]["rms"].as_f64().unwrap() / found["suggestions"][0]["after"]["rms"].as_f64().unwrap();
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    let shown = folder.run(&["plan", "pipeline.toml"]);
    assert!(shown.stdout.contains("a ball at x") && shown.stdout.contains("EX0C"), "{}", shown.stdout);
}

#[test]
fn setups_are_planned() {
    let folder = probe();
    let found = json(&folder.run(&["plan", "pipeline.toml", "--json"]));
    assert_eq!(found["lost_orders"]["lobing"], serde_json::json!([1]));
    let gains = found["noise_gain"]["lobing"].as_array().unwrap();
    assert_eq!((gains.len(), &gains[0]["order"]), (14, &2.into()));
    // 120° loses every third order, which one more setup gives.
    let thirds = "separate.setups=[{ id = \"a\" }, { id = \"b\", ring_deg = 120.0 }, { id = \"c\", ring_deg = 240.0 }]";
    let found = json(&folder.run(&["plan", "pipeline.toml", "--json", "--set", thirds]));
    assert_eq!(found["lost_orders"]["lobing"], serde_json::json!([1, 3, 6, 9, 12, 15]));
    let of_order = |order: usize| found["noise_gain"]["form"][order - 2]["gain"].clone();
    assert!(of_order(3).is_null() && of_order(4).is_f64());
    assert_eq!(found["suggestions"][0]["after"]["lost"], 0);
    let reveals = found["suggestions"].to_string();
    assert!(reveals.contains("axis-reversal X"), "{reveals}");
}

#[test]
fn what_has_nothing_to_plan_is_said() {
    let text = include_str!("../../../examples/10-measured-quadrature/pipeline.toml");
    let folder = Folder::with(&[("pipeline.toml", text), ("rotary.toml", ROTARY)]);
    let ran = folder.run(&["plan", "pipeline.toml"]);
    assert!(ran.status == 2 && ran.stderr.contains("nothing to plan"), "{}", ran.stderr);
    let ran = folder.run(&["plan", "rotary.toml", "--optimise", "angles"]);
    assert!(ran.status == 2 && ran.stderr.contains("--optimise"), "{}", ran.stderr);
}

#[test]
fn lost_orders_are_by_what_they_are_of() {
    let folder = probe();
    let lost = serde_json::json!({ "form": [1], "lobing": [1] });
    assert_eq!(json(&folder.run(&["diagnose", "pipeline.toml", "--json"]))["lost_orders"], lost);
    assert_eq!(json(&folder.run(&["check", "pipeline.toml", "--json"]))["lost_orders"], lost);
    let ran = json(&folder.run(&["run", "pipeline.toml", "--json"]));
    assert_eq!((&ran["lost_orders"]["form"], &ran["lost_orders"]["lobing"]), (&lost["form"], &lost["lobing"]));
    // Without r217, and with the other setup at 120° in name.
    let thirds =
        "separate.setups=[{ id = \"r0\" }, { id = \"r100\", ring_deg = 120.0 }, { id = \"r217\", ring_deg = 240.0 }]";
    let ran = json(&folder.run(&["diagnose", "pipeline.toml", "--json", "--set", thirds]));
    assert_eq!(ran["lost_orders"]["lobing"], serde_json::json!([1, 3, 6, 9, 12, 15]));
    assert_eq!(ran["lost_orders"]["form"], serde_json::json!([1, 3, 6, 9, 12, 15]));
}

#[test]
fn notes_are_no_warnings() {
    let folder = probe();
    let ran = folder.run(&["run", "pipeline.toml", "--fail-on-warning", "--verbose"]);
    assert_eq!(ran.status, 0, "{}{}", ran.stdout, ran.stderr);
    assert!(ran.stdout.contains("orders of lobing with evidence"), "{}", ran.stdout);
    let ran = folder.run(&["run", "pipeline.toml", "--fail-on-warning", "--set", "separate.ring_radius_mm=23"]);
    assert_eq!(ran.status, 1, "2 mm off is a warning: {}", ran.stdout);
    let sound = format!("{}\n", R_TEST.split("\n[[effect]]\n").next().unwrap());
    let folder = Folder::with(&[("pipeline.toml", ROTARY), ("scenario.toml", &sound)]);
    assert_eq!(folder.run(&["simulate", "scenario.toml"]).status, 0);
    let ran = folder.run(&["run", "pipeline.toml", "--fail-on-warning"]);
    assert_eq!(ran.status, 0, "{}{}", ran.stdout, ran.stderr);
    let text = ROTARY.replace("std_um = 1.5\n", "");
    std::fs::write(folder.path().join("repeats.toml"), text).unwrap();
    let ran = folder.run(&["run", "repeats.toml", "--fail-on-warning", "--verbose"]);
    assert_eq!(ran.status, 0, "{}{}", ran.stdout, ran.stderr);
    assert!(ran.stdout.contains("is the scatter of repeats"), "{}", ran.stdout);
}
