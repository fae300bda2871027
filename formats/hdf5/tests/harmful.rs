//! Files that lead out of themselves, or declare more than they hold: `foreign/write_harmful.py` made them.

use std::{fs, path::Path};

use runout_core::{Result, measurement::Recording, rig::Rig};
use runout_hdf5::{Hdf5Config, inspect};

use crate::{
    double::{load_as, message, read, rig},
    foreign::python,
};

/// The rig with its first setup.
fn one_setup() -> Rig {
    let mut rig = rig();
    rig.setups.truncate(1);
    rig
}

fn load(path: &Path, follow_links: bool) -> Result<Box<dyn Recording>> {
    load_as(&one_setup(), Hdf5Config { path: path.to_owned(), marker: None, follow_links })
}

#[test]
fn ways_out_of_a_file_are_refused_or_their_files_are_inputs() {
    let folder = tempfile::tempdir().unwrap();
    if !python("write_harmful.py", &[folder.path()]) {
        return;
    }
    let path = |name: &str| folder.path().join(format!("{name}.h5"));
    for (name, words, source) in [
        ("external-link", "link to another file (`other.h5`)", "other.h5"),
        ("soft-through-external", "link to another file (`other.h5`)", "other.h5"),
        ("virtual", "virtual data set", "other.h5"),
        ("external-storage", "external storage", "raw.bin"),
    ] {
        let text = message(load(&path(name), false));
        assert!(text.contains(words), "{name}: {text}");
        let error = load(&path(name), false).err().unwrap();
        assert!(error.advice().is_some_and(|advice| advice.contains("follow_links = true")), "{name}");
        assert!(inspect(&path(name)).is_err(), "{name}");
        let recording = load(&path(name), true).unwrap();
        let inputs = recording.inputs();
        assert!(inputs.len() == 2 && inputs[1].ends_with(source), "{name}: {inputs:?}");
        let found = read(&*recording, 0, 0).unwrap();
        assert_eq!((found.samples[0], found.samples[2], found.samples.len()), (0.0, 2.0 / 64.0, 1200), "{name}");
        // What was followed is examined like the file itself.
        let other = folder.path().join(source);
        let bytes = fs::read(&other).unwrap();
        fs::write(&other, [&bytes[..], b"more"].concat()).unwrap();
        assert!(recording.opened().unwrap().iter().any(|file| file.check().is_err()), "{name}");
        fs::write(&other, bytes).unwrap();
    }
}

#[test]
fn what_has_no_end_is_an_error_at_once() {
    let folder = tempfile::tempdir().unwrap();
    if !python("write_harmful.py", &[folder.path()]) {
        return;
    }
    #[cfg(unix)]
    assert!(std::process::Command::new("mkfifo").arg(folder.path().join("pipe.h5")).status().unwrap().success());
    let path = |name: &str| folder.path().join(format!("{name}.h5"));
    for (name, follow_links, words) in [
        ("soft-circle", false, "links without end"),
        ("virtual-itself", true, "a virtual data set itself"),
        ("external-storage-endless", true, "its files have 9600 bytes"),
        ("one-chunk", false, "a chunk of it is too large"),
        ("pipe-link", true, "a pipe"),
        ("pipe", false, "a pipe"),
    ] {
        let text = message(load(&path(name), follow_links));
        assert!(text.contains(words), "{name}: {text}");
        assert!(inspect(&path(name)).is_err(), "{name}");
    }
    // Hard links in a circle, in a file that is large enough to be walked through.
    assert_eq!(read(&*load(&path("circle"), false).unwrap(), 0, 0).unwrap().samples.len(), 1200);
    let remarks = load(&path("longer"), false).unwrap().remarks().join("; ");
    assert!(remarks.contains("8 bytes longer than it says"), "{remarks}");
}
