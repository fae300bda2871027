//! An effect of measured points that is a program: an autocollimator whose reading follows the temperature of the air, on a plate.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::{fmt::Write, fs, path::Path};

use crate::support::{MULTI_STEP_RIG, python, registry};
use runout_core::{
    Result,
    closed_loop::diagnosis::{Diagnosis, Verdict},
    pipeline::{Pipeline, diagnose::diagnose, document::ConfigError, run::Silent},
};

/// What one unit of `slope` adds, by the frames alone.
const SCRIPT: &str = r#"
import json, sys
import numpy as np
import pyarrow as pa
source = sys.stdin.buffer
while line := source.readline():
    name, size = line.split()
    if name == b"end":
        continue
    points = pa.ipc.open_stream(source.read(int(size))).read_all()
    about = {key.decode(): value.decode() for key, value in points.schema.metadata.items()}
    assert name == b"points" and about["runout.stage"] == "change" and json.loads(about["runout.config"]) == {"reference_k": 20}
    kelvin = points["temperature_k"].to_numpy() - 20
    rows = np.arange(len(kelvin))
    table = pa.table({"parameter": ["slope"] * len(rows), "row": rows, "slope_urad": kelvin})
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, table.schema) as stream:
        stream.write_table(table)
    body = sink.getvalue().to_pybytes()
    sys.stdout.buffer.write(b"change %d\n" % len(body) + body + b"end 0\n")
    sys.stdout.buffer.flush()
"#;

/// A plate of 8 x 8 places, by the lines along x, along y and along both diagonals; air that warms and cools, and what a kelvin adds to a reading in µrad.
fn plate(per_kelvin: f64) -> String {
    let mut text = "line,from_x_mm,from_y_mm,to_x_mm,to_y_mm,slope_urad,temperature_k\n".to_owned();
    let height = |x: f64, y: f64| 2.0 * (x / 300.0).sin() + 1.5 * (y / 200.0).cos() * (x / 700.0) + (y / 350.0).powi(2);
    let mut reading = 0_u32;
    let lines = (0..8).flat_map(|line| [("row", line), ("column", line)]).chain([("rising", 0), ("falling", 0)]);
    for (kind, line) in lines {
        for step in 0..7 {
            reading += 1;
            let time = f64::from(reading);
            let place = |step: i32| {
                match kind {
                    "row" => [step, line],
                    "column" => [line, step],
                    "rising" => [step, step],
                    _ => [step, 7 - step],
                }
                .map(|one| 100.0 * f64::from(one))
            };
            let [[x0, y0], [x1, y1]] = [place(step), place(step + 1)];
            let kelvin = 20.0 + (0.37 * time).sin() + 0.6 * (0.11 * time).cos();
            // Noise of 0.1 µrad in an order that nothing follows.
            let noise =
                0.2 * (f64::from(reading.wrapping_mul(2_654_435_769) >> 8) / f64::from(1 << 24) - 0.5) * 3_f64.sqrt();
            let tilt = 1e3 * (height(x1, y1) - height(x0, y0)) / (x1 - x0).hypot(y1 - y0);
            let slope = tilt + 7.0 * f64::from(line % 3) + per_kelvin * (kelvin - 20.0) + noise;
            writeln!(text, "{kind} {line},{x0},{y0},{x1},{y1},{slope},{kelvin}").unwrap();
        }
    }
    text
}

fn pipeline(
    folder: &Path,
    python: &str,
    script: &str,
    per_kelvin: f64,
    more: &str,
) -> std::result::Result<Pipeline, String> {
    fs::write(folder.join("own.py"), script).unwrap();
    fs::write(folder.join("plate.csv"), plate(per_kelvin)).unwrap();
    Pipeline::from_toml(&text(python, more), folder, &registry()).map_err(|error| error.to_string())
}

fn text(python: &str, more: &str) -> String {
    format!(
        "load = {{ plugin = \"points\", path = \"plate.csv\" }}\nseparate = {{ plugin = \"flatness\" }}\n\
         [[effect]]\nplugin = \"external\"\nid = \"warm-air\"\ncommand = [{python:?}, \"own.py\"]\ncolumns = [\"temperature_k\"]\n\
         config = {{ reference_k = 20 }}\nparameters = [{{ name = \"slope\", unit = \"urad/K\", usual = 0.5 }}]\n{more}\n\
         [[export]]\nplugin = \"parquet\"\npath = \"out\"\n"
    )
}

fn diagnosed(python: &str, script: &str, per_kelvin: f64, more: &str) -> Result<Diagnosis> {
    let folder = tempfile::tempdir().unwrap();
    let found = diagnose(&pipeline(folder.path(), python, script, per_kelvin, more).unwrap(), None, &Silent);
    if found.is_err() {
        assert!(!folder.path().join("out").exists(), "nothing is left");
    }
    found
}

#[test]
fn it_is_found_by_what_it_adds_to_readings() {
    let Some(python) = python() else { return };
    let found = diagnosed(&python, SCRIPT, 0.8, "").unwrap();
    let [added] = &found.added[..] else { panic!("{:?}", found.added) };
    let slope = &added.parameters[0];
    println!("{} {:.4} ± {:.4} {}", added.effect, slope.value, slope.std.unwrap(), slope.unit);
    assert_eq!((&*added.effect, &*slope.unit), ("warm-air", "urad/K"));
    assert!((slope.value - 0.8).abs() < 4.0 * slope.std.unwrap() && slope.std.unwrap() < 0.05);
    assert_eq!(found.verdict, Verdict::Improved, "the noise of a reading is not stated");
    assert!(found.after.residual_rms_um < 0.3 * found.before.residual_rms_um, "{found:?}");
    // Where it is not there, it is not found; as known it is neither looked for nor left in.
    assert!(diagnosed(&python, SCRIPT, 0.0, "").unwrap().added.is_empty());
    let known = "[diagnose]\nknown = [{ effect = \"warm-air\", values = { slope = 0.8 } }]";
    let known = diagnosed(&python, SCRIPT, 0.8, known).unwrap();
    assert!(known.added.is_empty() && known.after.residual_rms_um < 0.3 * found.before.residual_rms_um, "{known:?}");
}

#[test]
fn what_cannot_be_is_an_error_in_words() {
    let Some(python) = python() else { return };
    for (from, to, expected) in [
        ("\"row\": rows", "\"row\": rows + 1", "gave a change of a row that is not one of 0 to 125"),
        ("\"row\": rows", "\"row\": rows // 2", "gave the change of row 0 by `slope` twice"),
        ("[\"slope\"]", "[\"slop\"]", "gave the change by `slop`, which is no parameter: did you mean `slope`?"),
        ("\"slope_urad\": kelvin", "\"slope\": kelvin", "with an unknown column `slope`"),
        (", \"slope_urad\": kelvin", "", "without a column of the points"),
        ("\"slope_urad\": kelvin", "\"slope_urad\": kelvin / 0", "of the column `slope_urad`"),
        ("kelvin = ", "raise OSError('no licence')\n    kelvin = ", "no licence"),
    ] {
        assert!(SCRIPT.contains(from), "{from}");
        let error = diagnosed(&python, &SCRIPT.replace(from, to), 0.8, "").unwrap_err().to_string();
        assert!(error.contains(expected), "{expected}: {error}");
    }
    // A channel of turns is no column.
    let folder = tempfile::tempdir().unwrap();
    let none = pipeline(folder.path(), &python, SCRIPT, 0.8, "labels = [\"line\", \"line\"]").err().unwrap();
    assert!(none.contains("names of columns must differ"), "{none}");
}

#[test]
fn an_effect_of_other_data_is_refused_by_name() {
    let text = text("python3", "");
    let turns = format!(
        "rig = {MULTI_STEP_RIG}\n[load]\nplugin = \"simulated\"\nseed = 9\nrig = {MULTI_STEP_RIG}\n\
         [[preprocess]]\nplugin = \"synchronous-average\"\nsamples_per_rev = 128\n\
         [separate]\nplugin = \"harmonic-least-squares\"\n"
    );
    let [points, effect] = ["load = ", "[[effect]]"].map(|from| text.find(from).unwrap());
    let of_turns = text.replace(&text[points..effect], &turns);
    for (text, expected, help) in [
        (text.replace("columns = [\"temperature_k\"]\n", ""), "changes a channel of turns", "names the columns"),
        (of_turns, "turns have no columns", "leave `columns` and `labels` out"),
        (
            text.replace(
                "\"flatness\"",
                "\"touch-probe\", ring_radius_mm = 20, setups = [{ id = \"r0\" }, { id = \"r100\", ring_deg = 100 }]",
            ),
            "takes no effect of a pipeline's own, as `warm-air`",
            "leave [[effect]] out",
        ),
    ] {
        let Err(ConfigError::Text(mistake)) = Pipeline::from_toml(&text, Path::new("."), &registry()) else {
            panic!("it is taken: {expected}")
        };
        assert!(mistake.message.contains(expected), "{expected}: {}", mistake.message);
        assert!(mistake.help.as_deref().unwrap_or_default().contains(help), "{help}: {:?}", mistake.help);
    }
}
