//! A loader of recorded turns that is a program: the same samples by it and without it give the same result.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::{fs, io::Write, path::Path};

use crate::support::{pipeline, python, registry, rig};
use runout_core::{
    Error,
    measurement::{Block, Recording},
    pipeline::Pipeline,
    rig::Rig,
    stage::{Request, Source},
    summary::Summary,
};
use serde_json::json;

/// A line of JSON about the captures, and their samples as numbers of 64 bits, sample by sample.
const SCRIPT: &str = r#"
import json, sys
import numpy as np
import pyarrow as pa
source, sink = sys.stdin.buffer, sys.stdout.buffer

def frame(name, table):
    out = pa.BufferOutputStream()
    with pa.ipc.new_stream(out, table.schema) as stream:
        stream.write_table(table)
    body = out.getvalue().to_pybytes()
    sink.write(b"%s %d\n" % (name, len(body)) + body)

while line := source.readline():
    name, size = line.split()
    if name == b"end":
        sink.write(b"end 0\n")
        sink.flush()
        continue
    table = pa.ipc.open_stream(source.read(int(size))).read_all()
    about = {key.decode(): value.decode() for key, value in table.schema.metadata.items()}
    assert about["runout.stage"] == "load-samples" and about["runout.protocol"] == "1"
    sensors = [sensor["id"] for sensor in json.loads(about["runout.rig"])["sensors"]]
    if name == b"sensors":
        assert table["sensor"].to_pylist() == sensors
        file = open(about["runout.path"], "rb")
        captures = json.loads(file.readline())
        data = np.frombuffer(file.read(), float).reshape(-1, len(sensors))
        rows = [{key: capture[key] for key in ("station", "z_mm", "setup", "samples", "sample_rate_hz", "speed_rpm")} for capture in captures]
        frame(b"captures", pa.Table.from_pylist(rows))
        marks = [{"station": one["station"], "setup": one["setup"], "at": at} for one in captures for at in one["marks"]]
        frame(b"marks", pa.Table.from_pylist(marks))
        sink.write(b"warning 7\nguessed")
    else:
        (block,) = table.to_pylist()
        (capture,) = [one for one in captures if (one["station"], one["setup"]) == (block["station"], block["setup"])]
        first = capture["offset"] + block["first"]
        samples = data[first:first + block["count"]]
        frame(b"samples", pa.table(dict(zip(sensors, samples.T.copy()))))
"#;

/// The simulated recording as a file of that format.
fn write(path: &Path, pipeline: &Pipeline) {
    let rig = pipeline.rig.as_ref().unwrap();
    let Source::Turns(recording) = pipeline.loader.open(&Request { rig: Some(rig), columns: &[] }).unwrap() else {
        panic!("turns are simulated")
    };
    let (captures, samples) = content(&*recording, rig);
    let mut file = fs::File::create(path).unwrap();
    writeln!(file, "{captures}").unwrap();
    let bytes: Vec<u8> = samples.iter().flat_map(|sample| sample.to_le_bytes()).collect();
    file.write_all(&bytes).unwrap();
}

fn content(recording: &dyn Recording, rig: &Rig) -> (serde_json::Value, Vec<f64>) {
    let (mut captures, mut samples) = (Vec::new(), Vec::new());
    for (index, station) in recording.stations().iter().enumerate() {
        for (setup, described) in rig.setups.iter().enumerate() {
            let mut stream = recording.open(index, setup).unwrap();
            let (mut block, offset) = (Block::default(), samples.len() / rig.sensors.len());
            while stream.next_block(&mut block).unwrap() {
                samples.extend_from_slice(&block.samples);
            }
            let capture = stream.capture();
            captures.push(json!({
                "station": station.name, "z_mm": station.z_mm, "setup": described.id, "offset": offset, "marks": capture.marks,
                "samples": capture.samples, "sample_rate_hz": capture.sample_rate_hz, "speed_rpm": capture.stated_speed_rpm,
            }));
        }
    }
    (json!(captures), samples)
}

fn run(python: &str, folder: &Path, script: &str, timeout_s: f64) -> Result<Summary, Error> {
    fs::write(folder.join("own.py"), script).unwrap();
    let rig = rig("cw");
    let text = format!(
        "rig = {rig}\n[load]\nplugin = \"external\"\ncommand = [{python:?}, \"own.py\"]\npath = \"turns.bin\"\ngives = \"samples\"\ntimeout_s = {timeout_s}\n\
         [[preprocess]]\nplugin = \"synchronous-average\"\nsamples_per_rev = 128\n[separate]\nplugin = \"three-point\"\n\
         [[export]]\nplugin = \"parquet\"\npath = \"out\"\n"
    );
    Pipeline::from_toml(&text, folder, &registry()).map_err(|error| error.to_string()).unwrap().run()
}

#[test]
fn the_same_samples_give_the_same_result() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let simulated = pipeline(folder.path(), &rig("cw"), "[separate]\nplugin = \"three-point\"\n");
    write(&folder.path().join("turns.bin"), &simulated);
    let expected = simulated.run().unwrap();
    let found = run(&python, folder.path(), SCRIPT, 10.0).unwrap();
    assert_eq!(found.stations.len(), 3);
    let values = |summary: &Summary| -> Vec<(String, f64)> {
        summary.all_values().iter().map(|placed| (placed.id().to_string(), placed.value.value)).collect()
    };
    let (expected, values) = (values(&expected), values(&found));
    assert!(expected.len() > 20 && expected.len() == values.len());
    for ((name, one), (other_name, other)) in expected.iter().zip(&values) {
        assert_eq!(name, other_name);
        assert!((one - other).abs() <= 1e-12 * one.abs() || (one.is_nan() && other.is_nan()), "{name}: {one} {other}");
    }
    assert_eq!(found.provenance.inputs.len(), 1, "the file belongs to the result");
    assert!(found.warnings.iter().any(|warning| warning == "guessed"), "{:?}", found.warnings);
}

#[test]
fn what_cannot_be_is_an_error_in_words() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let simulated = pipeline(folder.path(), &rig("cw"), "[separate]\nplugin = \"three-point\"\n");
    write(&folder.path().join("turns.bin"), &simulated);
    let rows = "frame(b\"captures\", pa.Table.from_pylist(rows))";
    let samples = "frame(b\"samples\", pa.table(dict(zip(sensors, samples.T.copy()))))";
    for (from, to, expected) in [
        (rows, "sys.exit('the amplifier is off')", "the amplifier is off"),
        (rows, "", "gave no table `captures`"),
        (
            rows,
            "frame(b\"captures\", pa.Table.from_pylist(rows[:0] or [{**rows[0], 'setup': 'other'}]))",
            "in setup initial, which the rig has",
        ),
        (rows, "frame(b\"captures\", pa.Table.from_pylist(rows + rows[:1]))", "twice"),
        (
            rows,
            "frame(b\"captures\", pa.Table.from_pylist([{**row, 'sample_rate_hz': -1.0} for row in rows]))",
            "sampling rate that is not above 0",
        ),
        (
            rows,
            "frame(b\"captures\", pa.Table.from_pylist([{**row, 'z_mm': None} for row in rows], schema=pa.Table.from_pylist(rows).schema))",
            "a null in the column `z_mm`",
        ),
        ("for at in one[\"marks\"]]", "for at in one[\"marks\"][::-1]]", "with marks that do not ascend"),
        ("for at in one[\"marks\"]]", "for at in [*one[\"marks\"], float('nan')]]", "gave NaN"),
        ("block[\"count\"]]\n", "block[\"count\"] - 1]\n", "samples, where"),
        (samples, "frame(b\"samples\", pa.table({'S1': samples[:, 0].copy()}))", "without the column `S2`"),
        (
            samples,
            "frame(b\"samples\", pa.table(dict(zip(sensors, np.inf * samples.T))))",
            "gave inf in row 1 of the column `S1`",
        ),
        (samples, "import time; time.sleep(600)", "gave no answer within 3 s"),
        (samples, "sink.write(b\"samples 10000000000\\n\"); sink.flush()", "larger than 64 MB"),
        (samples, "sys.exit(3)", "ended with exit status: 3"),
    ] {
        assert!(SCRIPT.contains(from), "{from}");
        // The one that sleeps is waited for.
        let timeout_s = if to.contains("sleep") { 3.0 } else { 10.0 };
        let error = run(&python, folder.path(), &SCRIPT.replace(from, to), timeout_s).unwrap_err();
        println!("{error}");
        assert!(error.to_string().contains(expected) && error.to_string().contains("turns.bin"), "{expected}: {error}");
        assert!(error.advice().is_some_and(|advice| !advice.is_empty()));
        assert!(!folder.path().join("out").exists(), "nothing is left");
    }
}
