//! h5py reads what this crate writes, and writes what it reads.
//!
//! `RUNOUT_PYTHON` names the interpreter (default `python3`); without h5py the tests say so and pass, unless
//! `RUNOUT_REQUIRE_FOREIGN=1`.

use std::{path::Path, process::Command};

use runout_core::measurement::StationTruth;
use runout_hdf5::{SampleFormat, Scale, WriteOptions};

use crate::{
    double::{Memory, load, read, rig, write},
    other_programs, result,
};

/// Runs a script of `tests/foreign`; false where there is no h5py.
pub(crate) fn python(script: &str, arguments: &[&Path]) -> bool {
    let interpreter = std::env::var("RUNOUT_PYTHON").unwrap_or_else(|_| "python3".into());
    let required = std::env::var("RUNOUT_REQUIRE_FOREIGN").is_ok_and(|value| value == "1");
    let ready = Command::new(&interpreter).args(["-c", "import h5py, numpy"]).output();
    if !ready.is_ok_and(|output| output.status.success()) {
        assert!(!required, "{interpreter} with h5py is required and missing");
        #[allow(clippy::print_stderr, reason = "a skipped test has to say so")]
        {
            eprintln!("skipped: {interpreter} has no h5py");
        }
        return false;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/foreign").join(script);
    let output = Command::new(interpreter).arg(script).args(arguments).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    true
}

#[test]
fn h5py_reads_measurements() {
    let (folder, rig) = (tempfile::tempdir().unwrap(), rig());
    let path = folder.path().join("measurement.h5");
    let mut memory = Memory::new(&rig, &[("a", 1.5)], 20_000, false);
    // A ramp that the script knows: channel 1 reads (sample − 100) / 64 µm, channel 2 the same with its sign.
    for stream in &mut memory.captures[0] {
        for (index, value) in stream.samples.iter_mut().enumerate() {
            *value = ((index / 2) as f64 - 100.0) / 64.0;
        }
    }
    memory.truth = Some(StationTruth { form_um: vec![vec![0.5; 36], vec![1.5; 36]], motion: None, z_um: None });
    let formats = [
        SampleFormat::F64,
        SampleFormat::F32,
        SampleFormat::I16(Scale::Given { scale_um: 1.0 / 64.0, offset_um: -100.0 / 64.0 }),
        SampleFormat::I32(Scale::Given { scale_um: 1.0 / 64.0, offset_um: 0.0 }),
    ];
    for samples in formats {
        let options =
            WriteOptions { samples, title: "Welle µ", scenario: Some("seed = 1"), ..WriteOptions::default() };
        write(&memory, &rig, &path, &options).unwrap();
        if !python("check_measurement.py", &[&path]) {
            return;
        }
    }
}

#[test]
fn h5py_reads_results() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("result.h5");
    result::write(&path);
    python("check_result.py", &[&path]);
}

/// The script that made the files in `data`, as this machine's h5py runs it.
#[test]
fn files_as_matlab_and_labview_write_them_are_read() {
    let folder = tempfile::tempdir().unwrap();
    if !python("write_other_programs.py", &[folder.path()]) {
        return;
    }
    for name in ["matlab", "matlab-one-text", "matlab-cells", "matlab-char-matrix", "labview"] {
        other_programs::holds_the_readings(&folder.path().join(format!("{name}.h5")), None, 0.25);
    }
}

#[test]
fn measurements_of_h5py_are_read() {
    let (folder, rig) = (tempfile::tempdir().unwrap(), rig());
    if !python("write_measurements.py", &[folder.path()]) {
        return;
    }
    // Each file of the script holds the same readings in its own way: S1 reads sample / 8 µm, S2 its negative.
    for name in ["plain", "big-endian", "codes", "codes-per-channel", "fixed-text", "float32", "encoder"] {
        let recording = load(&folder.path().join(format!("{name}.h5")), &rig).unwrap();
        assert_eq!(recording.stations().len(), 1);
        for setup in 0..2 {
            let found = read(&*recording, 0, setup).unwrap();
            assert_eq!(found.capture.samples, 5000, "{name}");
            assert_eq!(found.capture.stated_speed_rpm, Some(60.0), "{name}");
            assert_eq!(found.capture.sample_rate_hz, Some(100.0), "{name}");
            assert_eq!(found.capture.encoder, name == "encoder");
            for (row, pair) in found.samples.chunks_exact(2).enumerate() {
                // The second sensor's sign is −1.
                assert_eq!(pair, [row as f64 / 8.0; 2], "{name}, sample {row}");
            }
            assert_eq!(found.capture.marks.len(), 50, "{name}");
            for (turn, mark) in found.capture.marks.iter().enumerate() {
                assert!((mark - (100.0 * turn as f64 + 0.25)).abs() < 1e-9, "{name}: {mark}");
            }
        }
        let extra = recording.remarks().join("; ");
        assert_eq!(extra.contains("temperature"), name == "plain", "{extra}");
    }
}

/// Few stations have their links in the group's header, many in a heap.
#[test]
fn files_with_names_beyond_ascii_are_read() {
    let folder = tempfile::tempdir().unwrap();
    if !python("write_umlaut.py", &[folder.path()]) {
        return;
    }
    for (name, stations) in [("umlaut-few.h5", 3), ("umlaut-many.h5", 12)] {
        other_programs::umlauts_are_read(&folder.path().join(name), stations);
    }
}
