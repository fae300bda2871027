//! A separator of points that is a program: the sphere of examples/26-own-program.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::{fmt::Write, fs, path::Path};

use crate::support::{of_repository, python, registry};
use runout_core::{Result, pipeline::Pipeline, summary::Summary};

/// Points on a sphere about (10, −20, 30) mm with radius 15 mm, on a spiral, and what is added to their distance, in µm.
fn sphere(points: usize, added_um: impl Fn(usize) -> f64) -> String {
    let mut text = "x_um,y_mm,z_mm,ball\n".to_owned();
    for index in 0..points {
        let height = 1.0 - 2.0 * (index as f64 + 0.5) / points as f64;
        let (across, turn) = ((1.0 - height * height).sqrt(), 2.4 * index as f64);
        let radius = 15.0 + 1e-3 * added_um(index);
        let place = [across * turn.cos(), across * turn.sin(), height].map(|part| radius * part);
        writeln!(text, "{},{},{},B1", 1e3 * (10.0 + place[0]), place[1] - 20.0, place[2] + 30.0).unwrap();
    }
    text
}

fn run(python: &str, script: &Path, folder: &Path, points: &str) -> Result<Summary> {
    fs::write(folder.join("points.csv"), points).unwrap();
    let text = format!(
        "load = {{ plugin = \"points\", path = \"points.csv\" }}\n\
         separate = {{ plugin = \"external\", command = [{python:?}, {:?}], columns = [\"x_mm\", \"y_mm\", \"z_mm\"], labels = [\"ball\"] }}\n\
         export = [{{ plugin = \"parquet\", path = \"out\" }}]\n",
        script.display().to_string()
    );
    Pipeline::from_toml(&text, folder, &registry()).map_err(|error| error.to_string()).unwrap().run()
}

#[test]
fn a_sphere_is_found_within_its_uncertainty() {
    let Some(python) = python() else { return };
    let script = of_repository("examples/26-own-program/sphere.py");
    let folder = tempfile::tempdir().unwrap();
    let truth = [10.0, -20.0, 30.0, 15.0];
    let exact = run(&python, &script, folder.path(), &sphere(40, |_| 0.0)).unwrap();
    for (value, truth) in exact.values.iter().zip(truth) {
        assert!((value.value - truth).abs() < 1e-9, "{value:?}");
    }
    // ±1 µm in an order that no sphere follows.
    let noisy =
        run(&python, &script, folder.path(), &sphere(40, |index| if index * index % 7 < 3 { 1.0 } else { -1.0 }))
            .unwrap();
    for (value, truth) in noisy.values.iter().zip(truth) {
        let (found, std) = (value.value, value.std().unwrap());
        println!("{} {:?}: {found:.6} ± {std:.6} mm", value.symbol, value.of);
        assert!((found - truth).abs() < 4.0 * std && (5e-5..1e-3).contains(&std));
    }
    assert!(folder.path().join("out/residual.parquet").is_file());
}

#[test]
fn what_cannot_be_is_an_error_in_words() {
    let Some(python) = python() else { return };
    let script = of_repository("examples/26-own-program/sphere.py");
    let text = fs::read_to_string(&script).unwrap();
    let changed = |from: &str, to: &str| {
        let folder = tempfile::tempdir().unwrap();
        let script = folder.path().join("own.py");
        assert!(text.contains(from), "{from}");
        fs::write(&script, text.replace(from, to)).unwrap();
        let error = run(&python, &script, folder.path(), &sphere(40, |_| 0.0)).unwrap_err();
        assert!(!folder.path().join("out").exists(), "no output");
        error.to_string()
    };
    for (from, to, expected) in [
        ("\"value\": found", "\"value\": np.nan * found", "gave NaN in row 1 of the column `value`"),
        ("\"row\": np.arange(len(left))", "\"row\": 1 + np.arange(len(left))", "a row that is not one of 0 to 39"),
        ("\"symbol\": [\"centre\"] * 3", "\"symbol\": [\"\"] * 3", "gave row 1 of `values` without a symbol"),
        ("\"of\": [\"x\", \"y\"", "\"of\": [\"x\", \"x\"", "gave centre x twice"),
        ("\"std\": std", "\"std\": -std", "gave centre with a `std` below 0"),
        ("frame(\"values\", values) + ", "", "gave no table `values`"),
        ("frame(\"residual\"", "frame(\"errors\"", "gave `errors`, where one `values`, one `residual` was expected"),
    ] {
        let found = changed(from, to);
        assert!(found.contains(expected), "{expected}: {found}");
    }
    let folder = tempfile::tempdir().unwrap();
    let few = run(&python, &script, folder.path(), &sphere(3, |_| 0.0)).unwrap_err().to_string();
    assert!(few.contains("expected 5 points or more, found 3"), "{few}");
    // Without ±, the value says why.
    let own = folder.path().join("own.py");
    fs::write(&own, text.replace("\"std\": std, ", "")).unwrap();
    let found = run(&python, &own, folder.path(), &sphere(40, |_| 0.0)).unwrap();
    assert!(found.values.iter().all(|value| value.uncertainty.is_none()));
    assert_eq!(found.values[0].no_uncertainty.as_deref(), Some("the program gives no `std`"));
}
