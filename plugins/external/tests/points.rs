//! A separator of points that is a program: the sphere of examples/26-own-program.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::{fmt::Write, fs, path::Path, process::Command};

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
    run_program(&format!("[{python:?}, {:?}]", script.display().to_string()), folder, points)
}

fn run_program(command: &str, folder: &Path, points: &str) -> Result<Summary> {
    fs::write(folder.join("points.csv"), points).unwrap();
    let text = format!(
        "load = {{ plugin = \"points\", path = \"points.csv\" }}\n\
         separate = {{ plugin = \"external\", command = {command}, columns = [\"x_mm\", \"y_mm\", \"z_mm\"], labels = [\"ball\"] }}\n\
         export = [{{ plugin = \"parquet\", path = \"out\" }}]\n"
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
    assert_eq!(found.values[0].no_uncertainty.as_deref(), Some("the plugin gives no `std`"));
}

/// The program in C++ with the Arrow of pyarrow, where a compiler is there.
#[test]
fn the_sphere_in_cpp_is_that_in_python() {
    let Some(python) = python() else { return };
    let code = "import glob, pyarrow as pa; folder = pa.get_library_dirs()[0]; \
                print(pa.get_include(), folder, glob.glob(folder + '/libarrow.so.*')[0], sep='\\n')";
    let found = Command::new(&python).args(["-c", code]).output().unwrap();
    let found = String::from_utf8(found.stdout).unwrap();
    let [include, libraries, arrow] = found.lines().collect::<Vec<_>>()[..] else {
        return println!("skipped: pyarrow comes without its library for C++");
    };
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("sphere");
    let built = Command::new("c++")
        .args(["-std=c++20", "-O1", "-o"])
        .arg(&program)
        .arg(of_repository("examples/26-own-program/sphere.cpp"))
        .args([&format!("-I{include}"), arrow, &format!("-Wl,-rpath,{libraries}")])
        .output();
    let Ok(built) = built else { return println!("skipped: there is no c++") };
    let said = String::from_utf8_lossy(&built.stderr);
    if !built.status.success() {
        assert!(!said.contains("sphere.cpp:"), "{said}");
        return println!("skipped: {said}");
    }
    let points = sphere(40, |index| if index * index % 7 < 3 { 1.0 } else { -1.0 });
    let cpp = run_program(&format!("[{:?}]", program.display().to_string()), folder.path(), &points).unwrap();
    let script = of_repository("examples/26-own-program/sphere.py");
    let expected = run(&python, &script, folder.path(), &points).unwrap();
    assert_eq!(cpp.values.len(), 4);
    for (one, other) in cpp.values.iter().zip(&expected.values) {
        let [a, b] = [one, other].map(|value| (value.value, value.std().unwrap()));
        assert!((a.0 - b.0).abs() < 1e-9 && (a.1 / b.1 - 1.0).abs() < 1e-6, "{a:?} {b:?}");
    }
    let few = run_program(&format!("[{:?}]", program.display().to_string()), folder.path(), &sphere(3, |_| 0.0));
    assert!(few.unwrap_err().to_string().contains("expected 5 points or more, found 3"));
}
