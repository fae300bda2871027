//! The format before HDF5 1.10, whose structures have no checksum: a damaged address is refused, or warned of, or changes nothing.
//!
//! Some hundred of the flips are tried; `RUNOUT_ALL_FLIPS=1` tries all of them.

use std::fs;

use runout_hdf5::inspect;

use crate::{
    damage::contents,
    double::{load, message, rig},
    foreign::python,
};

/// Of all flips, every one of so many is tried; it shares no factor with the bits of an address.
const EVERY: usize = 13;

#[test]
fn a_flipped_bit_of_an_address_never_changes_the_data_without_a_word() {
    let folder = tempfile::tempdir().unwrap();
    let [path, places, damaged] = ["old.h5", "places.txt", "damaged.h5"].map(|name| folder.path().join(name));
    if !python("write_old_format.py", &[&path, &places]) {
        return;
    }
    let bytes = fs::read(&path).unwrap();
    let whole = contents(&path).unwrap();
    let remarks = load(&path, &rig()).unwrap().remarks();
    let places = fs::read_to_string(&places).unwrap();
    let flips = places.lines().flat_map(|place| (0..64).map(move |bit| (place.parse::<usize>().unwrap(), bit)));
    let every = if std::env::var_os("RUNOUT_ALL_FLIPS").is_some() { 1 } else { EVERY };
    let (mut refused, mut warned, mut same, mut wrong) = (0, 0, 0, Vec::new());
    for (place, bit) in flips.step_by(every) {
        let mut content = bytes.clone();
        content[place + bit / 8] ^= 1 << (bit % 8);
        fs::write(&damaged, &content).unwrap();
        let _ = inspect(&damaged);
        match contents(&damaged) {
            Err(_) => refused += 1,
            Ok(found) if found == whole => same += 1,
            Ok(_) if load(&damaged, &rig()).unwrap().remarks().len() > remarks.len() => warned += 1,
            Ok(_) => wrong.push((place, bit)),
        }
    }
    println!("{refused} refused, {warned} warned of, {same} without effect");
    assert!(wrong.is_empty(), "other data without a word after flips of (byte, bit): {wrong:?}");
    assert!(refused > same && refused > 200, "{refused} refused, {warned} warned of, {same} without effect");
}

/// A part of a number's type is damaged: an exponent that counts from elsewhere makes other numbers.
#[test]
fn numbers_of_no_standard_type_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [path, places] = ["old.h5", "places.txt"].map(|name| folder.path().join(name));
    if !python("write_old_format.py", &[&path, &places]) {
        return;
    }
    let bytes = fs::read(&path).unwrap();
    // The type of 64 bits as the format has it, its last number the bias of the exponent.
    let type_of_64_bits = [0, 0, 64, 0, 52, 11, 0, 52, 0xFF, 0x03, 0, 0];
    let places: Vec<usize> =
        bytes.windows(12).enumerate().filter(|(_, found)| **found == type_of_64_bits).map(|(place, _)| place).collect();
    assert!(places.len() > 8, "{places:?}");
    for place in places {
        let mut content = bytes.clone();
        content[place + 8] ^= 4;
        fs::write(&path, &content).unwrap();
        assert!(message(load(&path, &rig())).contains("none of the standard ones"), "{place}");
    }
}
