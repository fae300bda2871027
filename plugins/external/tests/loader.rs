//! A loader of points that is a program.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::fs;

use crate::support::{python, registry};
use runout_core::{
    Result,
    points::{PointColumn, PointKind, Points},
    stage::{Request, Source},
};

/// Lines of `NAME: X Y` as points, with the columns that are asked for.
const SCRIPT: &str = r#"
import json, sys
import pyarrow as pa
source = sys.stdin.buffer
name, size = source.readline().split()
columns = pa.ipc.open_stream(source.read(int(size))).read_all()
assert source.readline() == b"end 0\n" and name == b"columns"
about = {key.decode(): value.decode() for key, value in columns.schema.metadata.items()}
assert about["runout.stage"] == "load-points" and about["runout.protocol"] == "1"
scale = json.loads(about["runout.config"]).get("scale", 1)
rows = [line.replace(":", "").split() for line in open(about["runout.path"])]
if not rows:
    sys.exit("the file has no lines")
points = {"trace": [row[0] for row in rows], "x_mm": [scale * float(row[1]) for row in rows], "flag": [int(row[2]) for row in rows]}
wanted = columns["name"].to_pylist()
table, sink = pa.table({name: points[name] for name in wanted if name in points}), pa.BufferOutputStream()
with pa.ipc.new_stream(sink, table.schema) as stream:
    stream.write_table(table)
body = sink.getvalue().to_pybytes()
sys.stdout.buffer.write(b"points %d\n" % len(body) + body + b"warning 7\nguessedend 0\n")
sys.stdout.buffer.flush()
"#;

fn load(python: &str, content: &str, columns: &[PointColumn]) -> Result<Points> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("own.py"), SCRIPT).unwrap();
    fs::write(folder.path().join("points.txt"), content).unwrap();
    let text = format!(
        "load = {{ plugin = \"external\", command = [{python:?}, \"own.py\"], path = \"points.txt\", config = {{ scale = 10 }} }}\n\
         separate = {{ plugin = \"external\", command = [\"none\"], columns = [\"x_mm\"] }}\n"
    );
    let pipeline = runout_core::pipeline::Pipeline::from_toml(&text, folder.path(), &registry())
        .map_err(|error| error.to_string());
    match pipeline.unwrap().loader.open(&Request { rig: None, columns })? {
        Source::Points(points) => {
            assert_eq!(points.provenance().unwrap().len(), 1, "the file belongs to the result");
            Ok(points)
        }
        Source::Turns(_) => panic!("points are loaded"),
    }
}

#[test]
fn points_come_as_they_are_asked_for_and_mistakes_are_named() {
    let Some(python) = python() else { return };
    let x = PointColumn::needed("x_mm", PointKind::Number, "mm", "place");
    let trace = PointColumn::needed("trace", PointKind::Trace, "", "trace");
    let flag = PointColumn::optional("flag", PointKind::Flag, "", "left out");
    let missing = PointColumn::optional("z_mm", PointKind::Number, "mm", "place");
    let points = load(&python, "A: 1.5 0\nA: 2.5 1\nB: 3 0\n", &[x, trace, flag, missing]).unwrap();
    assert_eq!(points.column("x_mm").unwrap(), [15.0, 25.0, 30.0]);
    assert_eq!(points.column("flag").unwrap(), [0.0, 1.0, 0.0]);
    let traces: Vec<_> = points.traces.iter().map(|trace| (trace.id.as_str(), trace.points.clone())).collect();
    assert_eq!(traces, [("A", 0..2), ("B", 2..3)]);
    assert_eq!(points.remarks, ["guessed"]);

    let failure = |content: &str, columns: &[PointColumn]| {
        let error = load(&python, content, columns).unwrap_err();
        println!("{error}");
        assert!(error.to_string().contains("points.txt") && error.advice().is_some());
        error.to_string()
    };
    assert!(failure("A: 1 0\nB: 2 0\nA: 3 0\n", &[x, trace]).contains("trace A in two stretches"));
    assert!(failure("A: nan 0\n", &[x]).contains("gave NaN in row 1 of the column `x_mm`"));
    assert!(failure("A: 1 2\n", &[x, flag]).contains("other numbers than 0 and 1"));
    let needed = PointColumn::needed("y_mm", PointKind::Number, "mm", "place");
    assert!(failure("A: 1 0\n", &[x, needed]).contains("without the column `y_mm`: it has x_mm"));
    assert!(failure("", &[x]).contains("the file has no lines"));
}
