//! Files as MATLAB and LabVIEW write them. `foreign/write_other_programs.py` made those in `data`, and
//! `foreign/write_umlaut.py` the one with names beyond ASCII.

use std::{
    fs,
    path::{Path, PathBuf},
};

use hdf5_metno::File;
use ndarray::Array2;
use runout_core::marker::{Edge, Marker};
use runout_hdf5::inspect;

use crate::double::{load, load_marked, message, read, rig};

const SAMPLES: usize = 300;
const TURN: f64 = 50.0;
const WITHOUT_TRACE: [&str; 5] = ["matlab", "matlab-one-text", "matlab-cells", "matlab-char-matrix", "labview"];
const WITH_TRACE: [&str; 2] = ["labview-trace", "matlab-trace"];

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(format!("{name}.h5"))
}

fn marker(channel: &str, edge: Edge) -> Marker {
    Marker { channel: channel.into(), threshold: 2.5, hysteresis: 0.5, edge }
}

/// Reads both setups of a file and compares them with what every file holds; marks begin at this place of the first turn.
pub(crate) fn holds_the_readings(path: &Path, marker: Option<Marker>, first: f64) {
    let shown = path.display();
    let recording = load_marked(path, &rig(), marker).unwrap();
    for setup in 0..2 {
        let found = read(&*recording, 0, setup).unwrap();
        assert_eq!(found.capture.samples, SAMPLES as u64, "{shown}");
        assert_eq!(found.capture.stated_speed_rpm, Some(60.0), "{shown}");
        assert_eq!(found.capture.sample_rate_hz, Some(50.0), "{shown}");
        for (row, pair) in found.samples.chunks_exact(2).enumerate() {
            // The second sensor's sign is -1.
            assert_eq!(pair, [row as f64 / 8.0; 2], "{shown}, sample {row}");
        }
        assert_eq!(found.capture.marks.len(), 6, "{shown}: {:?}", found.capture.marks);
        for (turn, mark) in found.capture.marks.iter().enumerate() {
            assert!((mark - (TURN * turn as f64 + first)).abs() < 1e-9, "{shown}: {mark}");
        }
    }
}

#[test]
fn files_of_matlab_and_labview_are_read() {
    for name in WITHOUT_TRACE {
        holds_the_readings(&data(name), None, 0.25);
        let report = inspect(&data(name)).unwrap();
        let capture = &report.stations[0].captures[0];
        assert_eq!(
            (&capture.channels[..], capture.samples),
            (&["S1".to_owned(), "S2".to_owned()][..], SAMPLES),
            "{name}"
        );
    }
}

#[test]
fn marks_are_found_in_an_analogue_trace() {
    for name in WITH_TRACE {
        holds_the_readings(&data(name), Some(marker("MARK", Edge::Rising)), 0.25);
        // From 5 V at sample 6 to 0 V at sample 7.
        holds_the_readings(&data(name), Some(marker("MARK", Edge::Falling)), 6.5);
        let text = message(load(&data(name), &rig()));
        assert!(text.contains("`index` or `angle_deg`, found neither"), "{name}: {text}");
        assert_eq!(inspect(&data(name)).unwrap().stations[0].captures[0].phase, "none");
    }
    // Where both are there, the configuration decides.
    let text = message(load_marked(&data("matlab"), &rig(), Some(marker("MARK", Edge::Rising))));
    assert!(text.contains("`MARK` with the mark, found the channels S1, S2"), "{text}");
    let high = Marker { threshold: 50.0, ..marker("MARK", Edge::Rising) };
    for name in WITH_TRACE {
        let recording = load_marked(&data(name), &rig(), Some(high.clone())).unwrap();
        let text = message(read(&*recording, 0, 0));
        assert!(text.contains("it lies from 0 to 5, the threshold is 50"), "{name}: {text}");
    }
}

/// A copy whose first capture's samples are replaced.
fn replaced(folder: &Path, shape: (usize, usize), names: &[&str]) -> PathBuf {
    let path = folder.join("changed.h5");
    fs::copy(data("matlab"), &path).unwrap();
    let file = File::open_rw(&path).unwrap();
    let group = file.group("initial/only").unwrap();
    group.unlink("samples").unwrap();
    let samples = group.new_dataset_builder().with_data(&Array2::<f64>::zeros(shape)).create("samples").unwrap();
    let names: Vec<hdf5_metno::types::VarLenUnicode> = names.iter().map(|name| name.parse().unwrap()).collect();
    samples.new_attr_builder().with_data(&names).create("sensors").unwrap();
    file.close().unwrap();
    path
}

/// A wrong guess would be a wrong result: what is open is refused.
#[test]
fn an_orientation_that_is_open_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (shape, names, words) in [
        ((2, 2), &["S1", "S2"][..], "either way"),
        ((300, 4), &["S1", "S2"], "[300, 4]"),
        ((4, 300), &["S1", "S2"], "[4, 300]"),
        ((300, 2), &["S1", "S2", "S3"], "found 3"),
        ((1, 300), &["S1 S2"], "found S1 S2"),
    ] {
        let text = message(load(&replaced(folder.path(), shape, names), &rig()));
        assert!(text.contains("/initial/only/samples") && text.contains(words), "{shape:?}: {text}");
    }
    assert_eq!(message(load(&replaced(folder.path(), (2, 300), &["S2", "S1"]), &rig())), "");
    assert_eq!(message(load(&replaced(folder.path(), (300, 2), &["S2 ", "S1\u{a0} "]), &rig())), "");
}

/// Each file cut anywhere, or with a byte changed, is read or answered by an error: nothing panics, nothing hangs.
#[test]
fn damaged_files_are_answered() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged.h5");
    let mut state = 1_u64;
    let mut next = move |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    for name in WITHOUT_TRACE.into_iter().chain(WITH_TRACE) {
        let whole = fs::read(data(name)).unwrap();
        for round in 0..12 {
            let mut bytes = whole.clone();
            if round % 3 == 0 {
                bytes.truncate(next(whole.len()));
            } else {
                for _ in 0..round {
                    let place = next(bytes.len());
                    bytes[place] = next(256) as u8;
                }
            }
            fs::write(&path, &bytes).unwrap();
            let marker = WITH_TRACE.contains(&name).then(|| marker("MARK", Edge::Rising));
            let found = load_marked(&path, &rig(), marker).and_then(|recording| read(&*recording, 0, 0));
            if let Ok(found) = found {
                assert_eq!(found.samples.len(), 2 * found.capture.samples as usize, "{name}");
            }
        }
    }
}

/// What the library says of a filter that it has not holds a folder of the machine that compiled it.
#[test]
fn errors_have_no_path_of_the_machine_that_compiled() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("packed.h5");
    fs::copy(data("lzf"), &path).unwrap();
    let text = message(load(&path, &rig()).and_then(|recording| read(&*recording, 0, 0)));
    assert!(text.contains("/initial/only/samples") && text.contains("filter"), "{text}");
    let without = text.replace(&folder.path().display().to_string(), "");
    for part in ["/home", "/root", "/usr", "/build", "/lib/", "plugin"] {
        assert!(!without.contains(part), "{part}: {text}");
    }
}

/// Names in UTF-8 make the library convert groups of the old format, which leaves bytes behind that belong to nothing.
pub(crate) fn umlauts_are_read(path: &Path, stations: usize) {
    let recording = load(path, &rig()).unwrap();
    assert_eq!(recording.remarks(), [] as [String; 0], "{}", path.display());
    assert_eq!(recording.stations().len(), stations);
    for (station, key) in recording.stations().iter().enumerate() {
        assert!(!key.name.is_ascii(), "{}", key.name);
        assert_eq!(read(&*recording, station, 1).unwrap().capture.samples, 150, "{}", key.name);
    }
    assert_eq!(inspect(path).unwrap().stations.len(), stations);
}

#[test]
fn names_beyond_ascii_are_no_damage() {
    umlauts_are_read(&data("umlaut-few"), 3);
}
