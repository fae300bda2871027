//! Damaged files: an error, or the data as they were; never a panic, never other data.

use std::fs;

use runout_core::Result;
use runout_hdf5::{WriteOptions, inspect};

use crate::double::{Memory, load, noise, read, rig, write};

/// Everything that can be read of the file, for comparison.
pub(crate) fn contents(path: &std::path::Path) -> Result<Vec<(Vec<f64>, Vec<f64>)>> {
    let rig = rig();
    let recording = load(path, &rig)?;
    let mut all = Vec::new();
    for station in 0..recording.stations().len() {
        for setup in 0..rig.setups.len() {
            let read = read(&*recording, station, setup)?;
            all.push((read.samples, read.capture.marks));
        }
        recording.truth(station)?;
    }
    Ok(all)
}

fn intact() -> (tempfile::TempDir, std::path::PathBuf, Vec<u8>) {
    let (folder, rig) = (tempfile::tempdir().unwrap(), rig());
    let path = folder.path().join("intact.h5");
    let memory = Memory::new(&rig, &[("a", 1.0)], 600, false);
    write(&memory, &rig, &path, &WriteOptions::default()).unwrap();
    let bytes = fs::read(&path).unwrap();
    (folder, path, bytes)
}

#[test]
fn a_truncated_file_is_an_error() {
    let (folder, _, bytes) = intact();
    let path = folder.path().join("cut.h5");
    for part in 0..60 {
        fs::write(&path, &bytes[..bytes.len() * part / 60]).unwrap();
        assert!(contents(&path).is_err(), "cut to {part}/60");
        assert!(inspect(&path).is_err(), "cut to {part}/60");
    }
}

#[test]
fn a_flipped_byte_never_changes_the_data() {
    let (folder, path, bytes) = intact();
    let whole = contents(&path).unwrap();
    let path = folder.path().join("flipped.h5");
    let mut wrong = Vec::new();
    let places = noise(3).map(|value| (value.abs() * bytes.len() as f64) as usize);
    for place in places.take(400).chain(0..64) {
        let place = place.min(bytes.len() - 1);
        let mut damaged = bytes.clone();
        damaged[place] ^= 1 << (place % 8);
        fs::write(&path, &damaged).unwrap();
        let _ = inspect(&path);
        if contents(&path).is_ok_and(|found| found != whole) {
            wrong.push(place);
        }
    }
    assert!(wrong.is_empty(), "other data after a flip at {wrong:?}");
}
