//! Minimum-zone circles and cylinders beside those that ZEISS Calypso stored in its plots: public files of
//! ZEISS-PiWeb/PiWeb-Formplots (BSD-3-Clause, `src/Tests/TestData/pltx`, commit 23dc4d3). The files are not in this repository:
//! `cargo xtask data` fetches them.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::measured_data;
use std::{
    f64::consts::TAU,
    fs::File,
    io::Read,
    path::{Path, PathBuf},
};

use runout_core::standards::{cylindricity, reference::Reference, roundness};

/// Name, what Calypso stores as `actual` in µm and its last digit, and the nominal radius in mm (any large one for circles:
/// their plots have none).
const CIRCLES: [(&str, f64, f64, f64); 4] = [
    ("DIN Rundheit Auswertebereich", 19.6, 0.1, 30.0),
    ("DIN Rundheit Punktemaskierung", 19.8, 0.1, 30.0),
    ("Rundheit 1", 103.1, 0.1, 30.0),
    ("Rundheit 2", 99.0, 0.1, 30.0),
];
/// Cylinders of which the points that count are distinguished from the others by their state.
const CYLINDERS: [(&str, f64, f64, f64); 5] = [
    ("DIN Zylinderform2", 24.1, 0.1, 15.055_957_294_5),
    ("DIN Zylinderform3", 9.1, 0.1, 15.057_263_497_1),
    ("DIN Zylinderform Mantel", 65.2, 0.1, 29.987_295_629_4),
    ("DIN Zylinderform nur Helix", 76.1, 0.1, 29.985_820_134_8),
    ("Zylinderform_Zylinder4", 10.859, 0.001, 22.862_808_310_9),
];
/// What the elements are moved by, so that the solver does not begin where Calypso ended, in µm and rad.
const SHIFT_UM: [f64; 2] = [20.0, -13.0];
const TILT: f64 = 2e-4;

/// A plot's points that count: angle in rad, height in mm, deviation in µm.
fn points(path: &Path, columns: usize) -> Vec<[f64; 3]> {
    let mut archive = zip::ZipArchive::new(File::open(path).unwrap()).unwrap();
    let mut header = String::new();
    archive.by_name("header.xml").unwrap().read_to_string(&mut header).unwrap();
    let mut bytes = Vec::new();
    archive.by_name("plotpoints.dat").unwrap().read_to_end(&mut bytes).unwrap();
    let numbers: Vec<f64> = bytes.chunks_exact(8).map(|eight| f64::from_le_bytes(eight.try_into().unwrap())).collect();
    let mut counts = vec![true; numbers.len() / columns];
    // <State Points="0-3;140-143">: duplicates, overlaps, outliers, points beyond the range of evaluation.
    for state in header.split("<State Points=\"").skip(1) {
        for range in state.split('"').next().unwrap().split(';').filter(|range| !range.is_empty()) {
            let (from, to) = range.split_once('-').unwrap_or((range, range));
            counts[from.parse().unwrap()..=to.parse().unwrap()].fill(false);
        }
    }
    let each =
        numbers.chunks_exact(columns).map(|row| [row[0], if columns == 3 { row[1] } else { 0.0 }, row[columns - 1]]);
    let counted = each.zip(counts).filter(|(point, counts)| *counts && point.iter().all(|value| value.is_finite()));
    counted.map(|([angle, z_mm, deviation_mm], _)| [angle, z_mm, 1e3 * deviation_mm]).collect()
}

/// Plots that every folder of measured data holds.
const ALWAYS: [&str; 2] = ["DIN Zylinderform2", "DIN Zylinderform3"];

/// The file of a plot, where it is.
fn file(name: &str) -> Option<PathBuf> {
    let place = format!("zeiss-cylinder/original/{name}.pltx");
    if ALWAYS.contains(&name) { measured_data::file(&place) } else { measured_data::optional_file(&place) }
}

fn compare(name: &str, found_um: f64, stored_um: f64, digit_um: f64) {
    println!("{name}: {found_um:.4} µm, Calypso {stored_um} µm");
    // Half of the last digit, and rounding of what is stored: positions to 1e-7 mm.
    assert!((found_um - stored_um).abs() <= 0.5 * digit_um + 1e-4, "{name}: {found_um} µm, stored {stored_um} µm");
}

#[test]
fn minimum_zone_circles_are_those_that_calypso_stored() {
    for (name, stored_um, digit_um, radius_mm) in CIRCLES {
        let Some(path) = file(name) else { continue };
        let places = points(&path, 2).into_iter().map(|[angle, _, form_um]| {
            let radius = 1e3 * radius_mm + form_um;
            (radius * angle.cos() + SHIFT_UM[0], radius * angle.sin() + SHIFT_UM[1])
        });
        let (x_um, y_um): (Vec<f64>, Vec<f64>) = places.unzip();
        let mut circle = roundness::Points::default();
        circle.set_plane(&x_um, &y_um);
        let zone = circle.reference(Reference::MinimumZone).unwrap();
        compare(name, circle.values(&zone).ront_um, stored_um, digit_um);
    }
}

#[test]
fn minimum_zone_cylinders_are_those_that_calypso_stored() {
    for (name, stored_um, digit_um, radius_mm) in CYLINDERS {
        let Some(path) = file(name) else { continue };
        let places = points(&path, 3).into_iter().map(|[angle, z_mm, form_um]| {
            let radius = 1e3 * radius_mm + form_um;
            let x = radius * angle.cos() + SHIFT_UM[0] + TILT * 1e3 * z_mm;
            let y = radius * angle.sin() + SHIFT_UM[1];
            (y.atan2(x).rem_euclid(TAU), z_mm, x.hypot(y) - 1e3 * radius_mm)
        });
        let wall = cylindricity::Points::new(radius_mm, places);
        let zone = wall.reference(Reference::MinimumZone).unwrap();
        compare(name, wall.values(&zone).cylt_um, stored_um, digit_um);
    }
}
