//! Equality with scikit-learn and pykrige, which are asked again where Python has them.

#![allow(
    clippy::unwrap_used,
    clippy::print_stderr,
    clippy::format_collect,
    clippy::unnecessary_debug_formatting,
    reason = "tests"
)]

use std::{path::PathBuf, process::Command};

use crate::support::{column, readings, separator, table};
use runout_core::{
    consistency::{Check, Test},
    stage::PointSeparator,
};
use serde_json::Value;

fn assets(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/assets")).join(name)
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

fn places(value: &Value) -> Vec<[f64; 3]> {
    value.as_array().unwrap().iter().map(|place| numbers(place).try_into().unwrap()).collect()
}

/// Compares every case; gives the largest differences, relative to the largest mean and the standard deviation.
fn compare(golden: &Value) -> [f64; 2] {
    let known = places(&golden["places_mm"]);
    let queries = places(&golden["queries_mm"]);
    let fields: Vec<Vec<f64>> = golden["fields_um"].as_array().unwrap().iter().map(numbers).collect();
    let values: Vec<[f64; 3]> = (0..known.len()).map(|row| [0, 1, 2].map(|axis| fields[axis][row])).collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("queries.csv");
    let lines: String = queries.iter().map(|[x, y, z]| format!("{x},{y},{z}\n")).collect();
    std::fs::write(&path, format!("x_mm,y_mm,z_mm\n{lines}")).unwrap();
    let mut worst = [0.0_f64; 2];
    for case in golden["cases"].as_array().unwrap() {
        let text = format!(
            "declared = {}\nkriging = {{ variogram = {}, sill_um = {}, range_mm = {}, nugget_um = {} }}\nquery = {{ path = {path:?} }}",
            case["declared"], case["variogram"], case["sill_um"], case["range_mm"], case["nugget_um"]
        );
        let outcome = separator(&text).separate(&readings(&known, &values)).unwrap();
        let rows = table(&outcome, "prediction");
        let mut of_case = [0.0_f64; 2];
        for (axis, name) in ["dx_um", "dy_um", "dz_um"].into_iter().enumerate() {
            let (mean, std) = (numbers(&case["mean"][axis]), numbers(&case["std"][axis]));
            let size = mean.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
            let found = [column(&rows, name), column(&rows, &format!("std_{name}"))];
            // Where the readings refute the given covariance, ± is wider than that of the peers by a factor that is named.
            let is_own = |check: &&Check| check.test == Test::LeftOut && name.starts_with(&check.of);
            let factor = outcome.checks.iter().find(is_own).map_or(1.0, |check| check.factor);
            for row in 0..queries.len() {
                of_case[0] = of_case[0].max((found[0][row] - mean[row]).abs() / size);
                of_case[1] = of_case[1].max((found[1][row] / factor / std[row] - 1.0).abs());
            }
        }
        eprintln!(
            "{} {} nugget {}: mean {:.1e}, std {:.1e}",
            case["peer"], case["variogram"], case["nugget_um"], of_case[0], of_case[1]
        );
        worst = [0, 1].map(|part| worst[part].max(of_case[part]));
    }
    worst
}

#[test]
fn predictions_are_those_of_the_golden_file() {
    let golden: Value = serde_json::from_str(&std::fs::read_to_string(assets("golden.json")).unwrap()).unwrap();
    assert_eq!(golden["cases"].as_array().unwrap().len(), 9);
    let worst = compare(&golden);
    assert!(worst.iter().all(|difference| *difference < 1e-8), "{worst:?}");
}

#[test]
fn predictions_are_those_of_scikit_learn_and_pykrige_asked_now() {
    let python = std::env::var("RUNOUT_PYTHON").unwrap_or_else(|_| "python3".into());
    let required = std::env::var("RUNOUT_REQUIRE_FOREIGN").is_ok_and(|value| value == "1");
    let has = Command::new(&python).args(["-c", "import sklearn, pykrige"]).output();
    if !has.is_ok_and(|output| output.status.success()) {
        assert!(!required, "{python} cannot import sklearn and pykrige, and RUNOUT_REQUIRE_FOREIGN is 1");
        eprintln!("skipped: {python} cannot import sklearn and pykrige; RUNOUT_PYTHON can name one that does");
        return;
    }
    let output = Command::new(&python).arg("-B").arg(assets("write_golden.py")).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let worst = compare(&serde_json::from_slice(&output.stdout).unwrap());
    assert!(worst.iter().all(|difference| *difference < 1e-8), "{worst:?}");
}
