//! A preprocessor of averages that is a program: it undoes a low-pass of one channel.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::{fs, path::Path};

use crate::support::{MULTI_STEP_RIG, python, registry};
use runout_core::{pipeline::Pipeline, summary::Summary};

/// Reads profiles of S1 to S3, and divides those of S2 by 1/(1 − i n/12) where `undo` is set.
const SCRIPT: &str = r#"
import json, sys
import numpy as np
import pyarrow as pa
source = sys.stdin.buffer
while line := source.readline():
    name, size = line.split()
    if name == b"end":
        continue
    profile = pa.ipc.open_stream(source.read(int(size))).read_all()
    about = {key.decode(): value.decode() for key, value in profile.schema.metadata.items()}
    assert name == b"profile" and about["runout.stage"] == "preprocess" and about["runout.protocol"] == "1"
    assert json.loads(about["runout.capture"])["setup"] in "abc" and len(json.loads(about["runout.rig"])["sensors"]) == 3
    config = json.loads(about["runout.config"])
    sensor, n = np.array(profile["sensor"].to_pylist()), profile["order"].to_numpy().astype(int)
    c = profile["re"].to_numpy() + 1j * profile["im"].to_numpy()
    gain = np.where(sensor == "S2", 1 - 1j * n / 12, 1)
    # A harmonic without a row stays.
    of = np.flatnonzero(sensor == "S2")
    table = pa.table({"sensor": sensor[of], "order": n[of], "re": (gain * c)[of].real, "im": (gain * c)[of].imag,
                      "gain_re": gain[of].real, "gain_im": gain[of].imag})
    if config.get("wrong") == "sensor":
        table = table.set_column(0, "sensor", pa.array(["S9"] * len(table)))
    if config.get("wrong") == "null":
        table = table.set_column(2, "re", pa.array([None] * len(table), pa.float64()))
    if config.get("wrong") == "level":
        table = table.set_column(3, "im", pa.array(np.ones(len(table))))
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, table.schema) as stream:
        stream.write_table(table)
    body = sink.getvalue().to_pybytes()
    sys.stdout.buffer.write(b"profile %d\n" % len(body) + body + b"warning 6\nundoneend 0\n")
    sys.stdout.buffer.flush()
"#;

const AVERAGE: &str = "[[preprocess]]\nplugin = \"synchronous-average\"\nsamples_per_rev = 128\n";

fn pipeline(folder: &Path, effect: &str, preprocess: &str) -> std::result::Result<Pipeline, String> {
    let text = format!(
        "rig = {MULTI_STEP_RIG}\n[load]\nplugin = \"simulated\"\nseed = 9\nrig = {MULTI_STEP_RIG}\n{effect}\n{preprocess}\n\
         [separate]\nplugin = \"harmonic-least-squares\"\n[[export]]\nplugin = \"parquet\"\npath = \"out\"\n"
    );
    Pipeline::from_toml(&text, folder, &registry()).map_err(|error| error.to_string())
}

const LOW_PASS: &str = "effect = [{ plugin = \"filter-attenuation\", targets = [\"S2\"], cutoff_hz = 100 }]";

fn corrector(python: &str, config: &str) -> String {
    format!("[[preprocess]]\nplugin = \"external\"\ncommand = [{python:?}, \"own.py\"]\nconfig = {{ {config} }}\n")
}

fn ran(effect: &str, preprocess: &str) -> runout_core::Result<Summary> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("own.py"), SCRIPT).unwrap();
    pipeline(folder.path(), effect, preprocess).unwrap().run()
}

#[test]
fn it_undoes_what_a_channel_lost() {
    let Some(python) = python() else { return };
    let undo = format!("{AVERAGE}{}", corrector(&python, ""));
    let [sound, lost, undone] = [("", AVERAGE), (LOW_PASS, AVERAGE), (LOW_PASS, undo.as_str())]
        .map(|(effect, preprocess)| ran(effect, preprocess).unwrap());
    let value = |summary: &Summary| {
        let values = &summary.stations[0].sections[0].values;
        let of = values.iter().find(|value| value.symbol == "RONt").unwrap();
        (of.value, of.std().unwrap())
    };
    let chi2 = |summary: &Summary| summary.stations[0].chi2_per_dof.unwrap();
    let ((sound_um, std_um), (undone_um, _)) = (value(&sound), value(&undone));
    println!("χ² {:.2}, {:.2}, {:.2}", chi2(&sound), chi2(&lost), chi2(&undone));
    // The simulator filters samples, 128 a turn, which is no low-pass of continuous time.
    assert!((sound_um - undone_um).abs() < 0.05 * sound_um.max(std_um), "{sound_um} {undone_um}");
    assert!(chi2(&undone) < 0.2 * chi2(&lost), "{} {}", chi2(&undone), chi2(&lost));
    assert!(undone.warnings.iter().any(|text| text.contains("undone")), "{:?}", undone.warnings);
}

#[test]
fn answers_that_cannot_be_and_places_where_nothing_is_averaged_are_refused() {
    let Some(python) = python() else { return };
    for (wrong, said) in [
        ("sensor", "a harmonic of the sensor `S9`, which was not asked for"),
        ("null", "a null for S2 at order 0"),
        ("level", "S2 at order 0 with an imaginary part"),
    ] {
        let own = corrector(&python, &format!("wrong = \"{wrong}\""));
        let error = ran("", &format!("{AVERAGE}{own}")).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
    let own = corrector(&python, "");
    let before = pipeline(Path::new("."), "", &format!("{own}{AVERAGE}")).err().unwrap();
    assert!(before.contains("nothing has averaged the turns yet"), "{before}");
    let behind = format!("{AVERAGE}{own}[[preprocess]]\nplugin = \"low-pass\"\ncutoff_hz = 100\n");
    let behind = pipeline(Path::new("."), "", &behind).err().unwrap();
    assert!(behind.contains("no preprocessor of samples can follow"), "{behind}");
}
