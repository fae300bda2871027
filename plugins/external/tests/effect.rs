//! An effect that is a program: a low-pass in one channel, which the simulator has as well.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::{fs, path::Path, time::Instant};

use crate::support::{MULTI_STEP_RIG, python, registry};
use runout_core::{
    Result,
    pipeline::{Pipeline, diagnose::diagnose, run::Silent},
};

/// 1/(1 − i n p) by the frames alone.
const SCRIPT: &str = r#"
import json, sys
import numpy as np
import pyarrow as pa
source = sys.stdin.buffer
while line := source.readline():
    name, size = line.split()
    if name == b"end":
        continue
    orders = pa.ipc.open_stream(source.read(int(size))).read_all()
    about = {key.decode(): value.decode() for key, value in orders.schema.metadata.items()}
    assert name == b"orders" and about["runout.stage"] == "transfer" and about["runout.protocol"] == "1"
    p = json.loads(about["runout.values"])["inverse-cut-off"]
    n = orders["order"].to_numpy().astype(int)
    h = 1 / (1 - 1j * n * p)
    table, sink = pa.table({"order": n, "re": h.real, "im": h.imag}), pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, table.schema) as stream:
        stream.write_table(table)
    body = sink.getvalue().to_pybytes()
    sys.stdout.buffer.write(b"transfer %d\n" % len(body) + body + b"end 0\n")
    sys.stdout.buffer.flush()
"#;

/// A pipeline on a recording with a low-pass at 100 Hz, order 12 at 500 rpm, in S2.
fn pipeline(folder: &Path, python: &str, effects: &str, more: &str) -> std::result::Result<Pipeline, String> {
    let text = format!(
        "rig = {MULTI_STEP_RIG}\n[load]\nplugin = \"simulated\"\nseed = 9\nrig = {MULTI_STEP_RIG}\n\
         effect = [{{ plugin = \"filter-attenuation\", targets = [\"S2\"], cutoff_hz = 100 }}]\n\
         [[preprocess]]\nplugin = \"synchronous-average\"\nsamples_per_rev = 128\n\
         [separate]\nplugin = \"harmonic-least-squares\"\n[diagnose]\neffects = {effects}\n\
         [[effect]]\nplugin = \"external\"\nid = \"own-low-pass\"\ncommand = [{python:?}, \"own.py\"]\n\
         parameters = [{{ name = \"inverse-cut-off\", unit = \"rev\", usual = 1e-3 }}]\n{more}\n\
         [[export]]\nplugin = \"parquet\"\npath = \"out\"\n"
    );
    Pipeline::from_toml(&text, folder, &registry()).map_err(|error| error.to_string())
}

fn diagnosed(
    python: &str,
    script: &str,
    effects: &str,
    more: &str,
) -> Result<runout_core::closed_loop::diagnosis::Diagnosis> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("own.py"), script).unwrap();
    let began = Instant::now();
    let found = diagnose(&pipeline(folder.path(), python, effects, more).unwrap(), None, &Silent);
    println!("{effects}: {:.1} s", began.elapsed().as_secs_f64());
    if found.is_err() {
        let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(left, ["own.py"], "nothing is left");
    }
    found
}

#[test]
fn it_finds_what_the_built_in_effect_finds() {
    let Some(python) = python() else { return };
    let expected = diagnosed(&python, SCRIPT, "[\"filter-attenuation\", \"sensor-gain\"]", "").unwrap();
    let own = diagnosed(&python, SCRIPT, "[\"own-low-pass\", \"sensor-gain\"]", "").unwrap();
    let ([theirs], [added]) = (&expected.added[..], &own.added[..]) else {
        panic!("{:?} {:?}", expected.added, own.added)
    };
    println!("{theirs:?}\n{added:?}");
    assert_eq!((&*added.effect, &added.targets), ("own-low-pass", &vec!["S2".to_owned()]));
    assert_eq!(theirs.targets, added.targets);
    // The built-in effect states the cut-off, this one its reciprocal; partials are differences.
    let [cut_off, inverse] = [theirs, added].map(|added| added.parameters[0].value);
    assert!((cut_off * inverse - 1.0).abs() < 1e-5, "{cut_off} {inverse}");
    // The simulator filters samples, 128 a turn, which is no low-pass of continuous time.
    assert!((cut_off - 12.0).abs() < 1.0, "of 100 Hz at 500 rpm: {cut_off}");
    let after = [&expected, &own].map(|found| found.after.residual_rms_um);
    assert!((after[0] - after[1]).abs() < 1e-6 * after[0], "{after:?}");
}

#[test]
fn one_that_fails_is_an_error_of_the_diagnosis() {
    let Some(python) = python() else { return };
    let all = "[\"own-low-pass\", \"sensor-gain\"]";
    for (from, to, more, expected) in [
        ("h = 1 /", "if p: raise OSError('no licence')\n    h = 1 /", "", "no licence"),
        (
            "h = 1 /",
            "if p: import time; time.sleep(600)\n    h = 1 /",
            "timeout_s = 2",
            "gave no answer within 2 s and was stopped",
        ),
        ("h = 1 /", "if p: print('hello', flush=True)\n    h = 1 /", "", "wrote \"hello\\n\" to stdout"),
        (
            "1j * n * p)",
            "1j * n * p) + np.where((n == 7) & (p != 0), np.nan, 0)",
            "",
            "gave NaN in row 8 of the column `re`",
        ),
        ("1j * n * p)", "1j * n * p) * (n != 7)", "", "gave the transfer 0 at order 7"),
        ("1 / (1", "2 / (1", "", "gave the transfer 2+0i at order 0 where all values are 0: expected 1"),
        ("\"re\": h.real", "\"re\": [str(one) for one in h.real]", "", "whose column `re` is of type Utf8"),
        ("\"order\": n", "\"order\": n + 1", "", "at an order that is not one of 0 to 511"),
        ("\"order\": n", "\"order\": n // 2", "", "gave the transfer at order 0 twice"),
        (
            "table, sink = pa.table({\"order\": n, \"re\": h.real, \"im\": h.imag})",
            "table, sink = pa.table({\"order\": n[:9], \"re\": h.real[:9], \"im\": h.imag[:9]})",
            "",
            "gave no transfer at order 9",
        ),
        ("b\"transfer %d\\n\"", "b\"harmonics %d\\n\"", "", "gave `harmonics`, where one `transfer` was expected"),
        (
            "sys.stdout.buffer.write(b\"transfer",
            "sys.stdout.buffer.write(b\"transfer 10000000000\\n\" + b\"",
            "",
            "which makes its answer larger than 64 MB",
        ),
        (
            "import json, sys",
            "import json, sys\nsys.stderr.write('x' * 50_000_000); sys.exit('the last word')",
            "",
            "the last word",
        ),
    ] {
        assert!(SCRIPT.contains(from), "{from}");
        let error = diagnosed(&python, &SCRIPT.replace(from, to), all, more).unwrap_err();
        let text = error.to_string();
        println!("{text}\n  help: {}", error.advice().unwrap_or_default());
        assert!(text.contains(expected) && text.contains("the effect own-low-pass"), "{expected}: {text}");
        assert!(error.advice().is_some_and(|advice| !advice.is_empty()) && text.len() < 4000);
    }
    let folder = tempfile::tempdir().unwrap();
    let error = diagnose(&pipeline(folder.path(), "./no-such-program", all, "").unwrap(), None, &Silent).unwrap_err();
    assert!(error.to_string().contains("did not start: "), "{error}");
}

/// `run` does not ask effects.
#[test]
fn a_run_leaves_it_alone_and_keys_are_checked() {
    let folder = tempfile::tempdir().unwrap();
    let pipeline = pipeline(folder.path(), "./no-such-program", "\"all\"", "").unwrap();
    pipeline.run().unwrap();
    let refused = |from: &str, to: &str| {
        let text = format!(
            "rig = {MULTI_STEP_RIG}\nload = {{ plugin = \"simulated\", seed = 9, rig = {MULTI_STEP_RIG} }}\nseparate = {{ plugin = \"harmonic-least-squares\" }}\n\
             preprocess = [{{ plugin = \"synchronous-average\", samples_per_rev = 128 }}]\n\
             effect = [{{ plugin = \"external\", id = \"own\", command = [\"a\"], parameters = [{{ name = \"p\", unit = \"1\", usual = 1 }}] }}]\n"
        );
        assert!(text.contains(from));
        let found = Pipeline::from_toml(&text.replace(from, to), "", &registry()).map(|_| ()).unwrap_err();
        found.to_string()
    };
    for (from, to, expected) in [
        ("\"own\"", "\"sensor-gain\"", "there is an effect `sensor-gain` already"),
        ("\"own\"", "\"Own effect\"", "small letters and digits"),
        ("[{ name = \"p\", unit = \"1\", usual = 1 }]", "[]", "at least one parameter"),
        ("usual = 1 ", "usual = 0 ", "expected a number above 0"),
        ("usual = 1 ", "usual = nan ", "expected a number above 0"),
        ("name = \"p\"", "name = \"\"", "must differ and not be empty"),
        ("id = \"own\", ", "", "id"),
        ("plugin = \"external\"", "plugin = \"externl\"", "unknown plugin `externl`"),
    ] {
        let found = refused(from, to);
        assert!(found.contains(expected), "{expected}: {found}");
    }
}
