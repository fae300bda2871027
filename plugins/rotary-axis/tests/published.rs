//! The closed loop on the eleven points of an R-test that a paper prints.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::measured_data;
use std::{
    fmt::Write,
    path::{Path, PathBuf},
};

use runout_core::{
    closed_loop::diagnosis::{Diagnosis, Verdict},
    pipeline::{Pipeline, Registry, diagnose::diagnose, document::Sources, run::Silent},
};

fn diagnosed(path: &Path, keys: &str) -> runout_core::Result<Diagnosis> {
    let mut registry = Registry::default();
    runout_points::register(&mut registry);
    runout_rotary_axis::register(&mut registry);
    let text = format!(
        "load = {{ plugin = 'points', path = '{}' }}\nseparate = {{ plugin = 'r-test', {keys} }}",
        path.display()
    );
    let sources = Sources::from_text("test.toml", &text, PathBuf::new(), &[], "rig").unwrap();
    diagnose(&Pipeline::from_sources(&sources, &registry).unwrap(), None, &Silent)
}

fn published() -> PathBuf {
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/11-measured-r-test/r-test.csv").into()
}

#[test]
fn the_second_harmonic_is_found_and_the_points_are_said_to_be_few() {
    let found = diagnosed(&published(), "std_um = 2.3, a_deg = -90").unwrap();
    println!("{found:#?}");
    // 4.7, 8.9 and 4.8 µm in x, y and z by an independent least squares; 1.8, 2.5 and 0.5 with the second harmonic.
    let pooled = |each: [f64; 3]| (each.iter().map(|rms| rms * rms).sum::<f64>() / 3.0).sqrt();
    for (found, reference) in [(&found.before, [4.7, 8.9, 4.8]), (&found.after, [1.8, 2.5, 0.5])] {
        // The references are rounded to 0.05 µm.
        assert!((found.residual_rms_um - pooled(reference)).abs() < 0.06, "{found:?}");
    }
    let effects: Vec<&str> = found.added.iter().map(|added| added.effect.as_str()).collect();
    assert_eq!(effects, ["harmonic-2"]);
    assert_eq!(found.verdict, Verdict::Explained);
    assert!(found.after.residual_rms_um < 2.3);
    assert!(found.warnings.iter().any(|warning| warning.contains("8 points a coordinate")), "{:?}", found.warnings);
    assert!(found.warnings.iter().any(|warning| warning.contains("left out")), "{:?}", found.warnings);
}

#[test]
fn the_published_table_is_the_one_measured() {
    // A copy of the table that is not this repository's; `cargo xtask data` has none.
    let Some(other) = measured_data::optional_file("rtest-c-axis/measured.csv") else { return };
    let keys = "std_um = 2.3, a_deg = -90";
    assert_eq!(diagnosed(&other, keys).unwrap(), diagnosed(&published(), keys).unwrap());
}

#[test]
fn too_few_points_are_refused() {
    let error = diagnosed(&published(), "std_um = 2.3, a_deg = 45").unwrap_err();
    assert!(error.to_string().contains("no point is at A = 45°"), "{error}");
}

/// Full turns of 36 points with noise of 1 µm: the installation alone, and with harmonics.
#[test]
fn made_harmonics_are_found_and_none_where_there_is_none() {
    let mut seed = 21_u64;
    let mut normal = || {
        let mut sum = 0.0;
        for _ in 0..12 {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sum += (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
        }
        sum
    };
    let folder = tempfile::tempdir().unwrap();
    for size in [0.0, 6.0] {
        let mut rows = String::from("a_deg,c_deg,dx_mm,dy_mm,dz_mm\n");
        for index in 0..36 {
            let c_deg = 10.0 * f64::from(index);
            let c = c_deg.to_radians();
            let x = 20.0 + 60.0 * c.cos() + size * (3.0 * c).sin() + normal();
            let y = -60.0 * c.sin() + normal();
            let z = 15.0 * (c + 1.0).cos() - size * (3.0 * c).cos() + normal();
            writeln!(rows, "0,{c_deg},{},{},{}", 1e-3 * x, 1e-3 * y, 1e-3 * z).unwrap();
        }
        let path = folder.path().join("made.csv");
        std::fs::write(&path, rows).unwrap();
        let found = diagnosed(&path, "std_um = 1.0, a_deg = 0, max_order = 6").unwrap();
        if size == 0.0 {
            assert_eq!((found.verdict, found.added.len()), (Verdict::AtNoiseFloor, 0), "{found:?}");
            continue;
        }
        let effects: Vec<&str> = found.added.iter().map(|added| added.effect.as_str()).collect();
        assert_eq!(effects, ["harmonic-3"]);
        assert_eq!(found.verdict, Verdict::Explained);
        let value = |name: &str| found.added[0].parameters.iter().find(|known| known.name == name).unwrap().clone();
        for (name, truth) in [("x_sine", size), ("z_cosine", -size), ("y_cosine", 0.0)] {
            let parameter = value(name);
            // √(2/36) µm each; four of them.
            assert!((parameter.value - truth).abs() < 4.0 * (2.0_f64 / 36.0).sqrt(), "{parameter:?}");
            assert!((parameter.std.unwrap() / (2.0_f64 / 36.0).sqrt() - 1.0).abs() < 0.3, "{parameter:?}");
        }
        assert!(found.warnings.iter().all(|warning| !warning.contains("are few")));
    }
}
