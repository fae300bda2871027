//! The closed loop on a measured interferometer axis, and on signals with known errors.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::measured_data;
use std::{f64::consts::TAU, fmt::Write, path::PathBuf};

use runout_core::{
    closed_loop::diagnosis::Diagnosis,
    pipeline::{
        Pipeline, Registry,
        diagnose::diagnose,
        document::Sources,
        run::{Silent, run},
    },
};

fn pipeline(text: &str) -> Pipeline {
    let mut registry = Registry::default();
    runout_points::register(&mut registry);
    runout_quadrature::register(&mut registry);
    let sources = Sources::from_text("test.toml", text, PathBuf::new(), &[], "rig").unwrap();
    Pipeline::from_sources(&sources, &registry).unwrap()
}

fn text(path: &std::path::Path) -> String {
    format!("load = {{ plugin = 'points', path = '{}' }}\nseparate.plugin = 'quadrature'\n", path.display())
}

fn diagnosed(path: &std::path::Path) -> Diagnosis {
    diagnose(&pipeline(&text(path)), None, &Silent).unwrap()
}

#[test]
fn a_measured_axis_is_an_ellipse_with_a_fourth_harmonic() {
    let Some(path) = measured_data::file("bev-quadrature/x-axis.csv") else { return };
    let found = diagnosed(&path);
    for added in &found.added {
        println!("{} {:?} {:?} {:.0}", added.effect, added.parameters, added.held_out_rms_um, added.delta_bic);
    }
    println!("{:?} {:?}", found.refused, found.warnings);
    let effects: Vec<&str> = found.added.iter().map(|added| added.effect.as_str()).collect();
    assert_eq!(effects[..3], ["quadrature-gain-and-angle", "quadrature-offset", "harmonic-3-backward"]);
    // The radius does not decide any of them.
    let partners: Vec<&str> =
        found.added[..3].iter().flat_map(|added| &added.confounded_with).map(String::as_str).collect();
    assert_eq!(partners, ["harmonic-3-forward", "harmonic-2-forward", "harmonic-5-forward"]);
    // Independent least squares, in counts: 3.40 by blocks left out without any of them, 0.739 with these three.
    let [before, three, after] =
        [found.before.held_out_rms_um, found.added[2].held_out_rms_um.after, found.after.held_out_rms_um]
            .map(Option::unwrap);
    println!("blocks left out: {before:.3} → {three:.3} with three effects → {after:.3} counts");
    assert!((before - 3.40).abs() < 0.05 && three <= 0.75 && after <= three, "{before} {three} {after}");
    assert_eq!(found.before.unit.as_deref(), Some("counts"));
    // What is added further lowers the blocks left out by little.
    assert!(three - after < 0.01, "{three} {after}");
}

/// Signals of known errors, by the pair itself: angle and length of (cosine, sine), with noise of 0.5 counts.
fn made(offset: [f64; 2], ratio: f64, angle: f64) -> tempfile::NamedTempFile {
    let mut seed = 9_u64;
    let mut uniform = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut rows = String::from("phase_deg,radius_counts\n");
    for _ in 0..4000 {
        let theta = TAU * uniform();
        let x = 500.0 * theta.cos() + offset[0] + 1.7 * uniform();
        let y = 500.0 * ratio * (theta + angle).sin() + offset[1] + 1.7 * uniform();
        writeln!(rows, "{:.4},{:.4}", y.atan2(x).to_degrees(), x.hypot(y)).unwrap();
    }
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), rows).unwrap();
    file
}

#[test]
fn known_errors_are_found_again() {
    let signal = made([3.0, -2.0], 1.012, 0.008);
    let sines = "diagnose.effects = ['quadrature-offset', 'quadrature-gain-and-angle']";
    let found = diagnose(&pipeline(&format!("{}{sines}", text(signal.path()))), None, &Silent).unwrap();
    let value = |name: &str| {
        let parameters = found.added.iter().flat_map(|added| &added.parameters);
        parameters
            .clone()
            .find(|parameter| parameter.name == name)
            .map(|parameter| (parameter.value, parameter.std.unwrap()))
            .unwrap()
    };
    assert_eq!(found.added.len(), 2, "{:?}", found.added);
    for (name, truth) in [("cosine", 3.0), ("sine", -2.0), ("gain_ratio_less_1", 0.012), ("angle_error", 0.008)] {
        let (value, std) = value(name);
        println!("{name}: {value} ± {std}, truth {truth}");
        assert!((value - truth).abs() < 5.0 * std, "{name}: {value} ± {std} instead of {truth}");
    }
}

/// Fewer samples than the usual blocks would take have fewer blocks.
#[test]
fn sixty_samples_are_enough() {
    let file = made([3.0, -2.0], 1.012, 0.008);
    let rows: Vec<String> = std::fs::read_to_string(file.path()).unwrap().lines().map(str::to_owned).collect();
    let step = (rows.len() - 1) / 60;
    let few = tempfile::NamedTempFile::new().unwrap();
    let kept = rows.iter().skip(1).step_by(step).take(60);
    let kept: Vec<&str> = std::iter::once(&rows[0]).chain(kept).map(String::as_str).collect();
    std::fs::write(few.path(), kept.join("\n")).unwrap();
    assert!(!diagnosed(few.path()).added.is_empty());
    std::fs::write(few.path(), rows[..4].join("\n")).unwrap();
    let refused = diagnose(&pipeline(&text(few.path())), None, &Silent).unwrap_err().to_string();
    assert!(refused.contains("at least 4 samples, found 3"), "{refused}");
}

#[test]
fn a_clean_circle_needs_nothing() {
    let found = diagnosed(made([0.0, 0.0], 1.0, 0.0).path());
    assert!(found.added.is_empty(), "{:?}", found.added);
}

#[test]
fn the_diagnosis_is_written_and_a_run_gives_the_declared_circle() {
    let (signal, folder) = (made([3.0, 0.0], 1.0, 0.0), tempfile::tempdir().unwrap());
    let path = folder.path().join("diagnosis.json");
    let text = format!("{}diagnose.path = '{}'", text(signal.path()), path.display());
    let found = diagnose(&pipeline(&text), None, &Silent).unwrap();
    let written: Diagnosis = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    assert_eq!(written.added.len(), found.added.len());
    let summary = run(&pipeline(&text), None, &Silent).unwrap();
    let [radius] = &summary.values[..] else { panic!("{:?}", summary.values) };
    // The declared circle: its radius to 1e-4, from 4000 samples with an offset of 3 counts.
    assert!(radius.symbol == "radius" && (radius.value - 500.0).abs() < 0.05, "{radius:?}");
    assert!(summary.warnings.iter().any(|warning| warning.contains("the angle is not corrected")));
    let known = format!("{text}\ndiagnose.known = [{{ effect = 'quadrature-offset', values = {{ cosine = 3.0 }} }}]");
    assert!(diagnose(&pipeline(&known), None, &Silent).unwrap().added.is_empty());
}

#[test]
fn what_a_model_cannot_take_is_refused_before_it_runs() {
    let mut registry = Registry::default();
    runout_points::register(&mut registry);
    runout_quadrature::register(&mut registry);
    let refused = |more: &str| {
        let text = format!("{}{more}", text(std::path::Path::new("signal.csv")));
        let sources = Sources::from_text("test.toml", &text, PathBuf::new(), &[], "rig").unwrap();
        Pipeline::from_sources(&sources, &registry).err().unwrap().to_string()
    };
    assert!(refused("diagnose.hold_out = 0.2").contains("group by group"));
    assert!(refused("diagnose.hold_out = 2").contains("between 0 and 1"));
    assert!(refused("separate.blocks = 1").contains("blocks"));
    assert!(refused("diagnose.known = [{ effect = 'quadrature-offset', values = { sine = nan } }]").contains("finite"));
}
