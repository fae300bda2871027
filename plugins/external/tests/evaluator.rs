//! An evaluator that is a program: values of a result's tables, beside those of the standards, with limits.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::{fs, path::Path};

use crate::support::{pipeline, python, registry, rig};
use runout_core::{
    Error,
    pipeline::Pipeline,
    summary::{Decision, Summary},
};

/// The largest difference of form a quarter of a turn apart, over all stations, and the mean of RONt of the table `values`.
const SCRIPT: &str = r#"
import json, sys
import numpy as np
import pyarrow as pa
source, sink = sys.stdin.buffer, sys.stdout.buffer
largest, ront = {}, []
while line := source.readline():
    name, size = line.decode().split()
    body = source.read(int(size))
    if name == "symbols":
        about = pa.ipc.open_stream(body).read_all().schema.metadata
        assert about[b"runout.stage"] == b"evaluate" and about[b"runout.protocol"] == b"1"
        config = json.loads(about[b"runout.config"])
    elif name == "form":
        form = pa.ipc.open_stream(body).read_all().to_pydict()
        um = np.array(form["form_um"])
        largest[form["station"][0]] = np.abs(um - np.roll(um, len(um) // 4)).max()
    elif name == "values":
        table = pa.ipc.open_stream(body).read_all().to_pylist()
        ront = [row["value"] for row in table if row["symbol"] == "RONt" and row["reference"] == "LSCI"]
    elif name == "summary":
        title = json.loads(body)["title"]
        values = {"symbol": ["quarter"] * len(largest) + ["mean-RONt"], "of": [*largest, None], "value": [*largest.values(), np.mean(ront)],
                  "std": [0.01] * len(largest) + [None], "unit": ["um"] * (len(largest) + 1)}
        if config.get("about"):
            values["about"] = ["of " + title] * len(values["of"])
        table, out = pa.table(values), pa.BufferOutputStream()
        with pa.ipc.new_stream(out, table.schema) as stream:
            stream.write_table(table)
        body = out.getvalue().to_pybytes()
        sink.write(b"values %d\n" % len(body) + body + b"warning 8\na remark")
    elif name == "end":
        sink.write(b"end 0\n")
        sink.flush()
"#;

const SYMBOLS: &str = r#"[{ symbol = "quarter", unit = "um" }, { symbol = "mean-RONt", unit = "um" }]"#;

fn stages(python: &str, more: &str) -> String {
    format!(
        "[separate]\nplugin = \"three-point\"\n[[evaluator]]\nplugin = \"external\"\ncommand = [{python:?}, \"own.py\"]\n\
         symbols = {SYMBOLS}\nconfig = {{ about = true }}\n{more}\n[[export]]\nplugin = \"parquet\"\npath = \"out\"\n"
    )
}

fn run(python: &str, folder: &Path, script: &str, more: &str) -> Result<Summary, Error> {
    fs::write(folder.join("own.py"), script).unwrap();
    pipeline(folder, &rig("ccw"), &stages(python, more)).run()
}

#[test]
fn its_values_are_among_those_of_the_run_and_limits_decide_them() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let limits = "[[limit]]\nsymbol = \"quarter\"\nupper = 100\nunit = \"um\"\n[[limit]]\nsymbol = \"quarter\"\nupper = 0.1\nunit = \"um\"\n\
                  [[limit]]\nsymbol = \"mean-RONt\"\nupper = 100\nunit = \"um\"\n";
    let summary = run(&python, folder.path(), SCRIPT, limits).unwrap();
    assert_eq!(summary.values.len(), 4, "three stations and one of all: {:?}", summary.values);
    let quarter = &summary.values[0];
    println!("{quarter:?}");
    assert_eq!((&*quarter.symbol, &*quarter.unit, &*quarter.source), ("quarter", "um", "of Untitled"));
    assert_eq!(quarter.of.as_deref(), Some(&*summary.stations[0].station));
    // 4 µm rms of form.
    assert!((4.0..60.0).contains(&quarter.value) && quarter.std() == Some(0.01));
    let all = summary.all_values();
    let ront = all.iter().filter(|one| one.value.symbol == "RONt" && one.value.reference.as_deref() == Some("LSCI"));
    let ront: Vec<f64> = ront.map(|one| one.value.value).collect();
    assert!(!ront.is_empty() && (summary.values[3].value - ront.iter().sum::<f64>() / ront.len() as f64).abs() < 1e-9);
    let decisions: Vec<Decision> = summary.limits.iter().map(|limit| limit.decision).collect();
    assert_eq!(decisions, [Decision::Conforms, Decision::DoesNotConform, Decision::Undecided], "the last has no ±");
    assert!(summary.warnings.iter().any(|warning| warning == "a remark"), "{:?}", summary.warnings);
    assert!(folder.path().join("out/named_values.parquet").is_file());
    let written = fs::read_to_string(folder.path().join("out/summary.json")).unwrap();
    assert!(written.contains("\"quarter\""));
}

#[test]
fn one_that_fails_is_an_error_of_the_run() {
    let Some(python) = python() else { return };
    for (from, to, more, expected) in [
        ("title = json", "raise OSError('no licence')\n        title = json", "", "no licence"),
        ("import json, sys", "import sys; sys.exit('not today')\nimport json, sys", "", "not today"),
        (
            "title = json",
            "import time; time.sleep(600)\n        title = json",
            "timeout_s = 3",
            "gave no answer within 3 s",
        ),
        (
            "largest, ront = {}, []",
            "largest, ront = {}, []; print('hello', flush=True)",
            "",
            "wrote \"hello\\n\" to stdout",
        ),
        ("np.mean(ront)]", "np.nan]", "", "gave NaN in row 4 of the column `value`"),
        ("[\"quarter\"] *", "[\"other\"] *", "", "gave other, which `symbols` does not declare"),
        ("\"unit\": [\"um\"]", "\"unit\": [\"mm\"]", "", "gave quarter in `mm`: `symbols` declares `um`"),
        ("[*largest, None]", "[\"x\"] * 4", "", "gave quarter x twice"),
        ("[0.01]", "[-0.01]", "", "with a `std` below 0"),
        ("b\"values %d\\n\" % len(body) + body + ", "", "", "gave no table `values`"),
        ("b\"values %d\\n\" % len(body)", "b\"values 10000000000\\n\"", "output_mb = 1", "larger than 1 MB"),
        ("elif name == \"end\":", "elif name == \"end\":\n        sink.write(b\"values 0\\n\")", "", "gave `values`"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        assert!(SCRIPT.contains(from), "{from}");
        let error = run(&python, folder.path(), &SCRIPT.replace(from, to), more).unwrap_err();
        println!("{error}");
        assert!(error.to_string().contains(expected), "{expected}: {error}");
        assert!(error.advice().is_some_and(|advice| !advice.is_empty()));
        let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(left, ["own.py"], "nothing is left");
    }
}

#[test]
fn symbols_are_checked_before_the_run() {
    let refused = |symbols: &str, limit: &str| {
        let text = format!(
            "load = {{ plugin = \"points\", path = \"points.csv\" }}\n\
             separate = {{ plugin = \"external\", command = [\"none\"], columns = [\"x_mm\"], symbols = [{{ symbol = \"radius\", unit = \"mm\" }}] }}\n\
             evaluator = [{{ plugin = \"external\", command = [\"none\"], symbols = {symbols} }}]\n{limit}"
        );
        Pipeline::from_toml(&text, ".", &registry()).map(|_| ()).map_err(|error| error.to_string())
    };
    let limit =
        |symbol: &str, unit: &str| format!("limit = [{{ symbol = \"{symbol}\", upper = 1, unit = \"{unit}\" }}]\n");
    assert_eq!(refused("[{ symbol = \"lobing\" }]", &limit("radius", "mm")), Ok(()));
    assert_eq!(refused("[{ symbol = \"lobing\" }]", &limit("lobing", "")), Ok(()));
    for (symbols, limit, expected) in [
        ("[]", String::new(), "expected at least one value"),
        ("[{ symbol = \"\" }]", String::new(), "must differ and not be empty"),
        ("[{ symbol = \"a\" }, { symbol = \"a\" }]", String::new(), "must differ and not be empty"),
        ("[{ symbol = \"radius\" }]", String::new(), "the value `radius` is computed already"),
        ("[{ symbol = \"lobing\" }]", limit("lobng", "um"), "no value `lobng` is computed"),
        ("[{ symbol = \"lobing\" }]", limit("lobing", "um"), "is given in ``, found `um`"),
    ] {
        let found = refused(symbols, &limit).unwrap_err();
        assert!(found.contains(expected), "{expected}: {found}");
    }
}
