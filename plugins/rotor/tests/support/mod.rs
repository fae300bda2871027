//! Rotors from a few lines of TOML.

#![allow(dead_code, reason = "each test takes what it needs")]

use std::f64::consts::PI;

use runout_core::stage::{Loader, Outcome, PointSeparator, Request, Separator, Source};
use runout_core::{
    Error,
    fault::Fault,
    pipeline::{Context, StageConfig},
    points::Points,
};
use runout_rotor::{Equations, Modal, Mode, RotorModel, RotorModelConfig, RotorModesConfig, assemble};
use std::path::Path;

/// Steel, and a material that has nearly no mass.
pub(crate) const MATERIALS: &str = r#"
materials = [
  { id = "steel", youngs_gpa = 210.0, poisson = 0.3, density_kg_per_m3 = 7850.0 },
  { id = "light", youngs_gpa = 210.0, poisson = 0.3, density_kg_per_m3 = 1e-3 },
]
"#;

pub(crate) fn equations(parts: &str) -> Equations {
    let model: RotorModel = toml::from_str(&format!("{MATERIALS}{parts}")).unwrap();
    model.check().unwrap();
    assemble("rotor.toml", &model).unwrap()
}

pub(crate) fn modal(parts: &str) -> Modal {
    Modal::new(&equations(parts)).unwrap()
}

/// Frequencies in rad/s at a speed in rad/s.
pub(crate) fn frequencies(parts: &str, speed: f64) -> Vec<f64> {
    modal(parts).at(speed).unwrap().iter().map(Mode::frequency).collect()
}

pub(crate) fn loader(config: &str, folder: &Path) -> Result<Box<dyn Loader>, Fault> {
    let config: RotorModelConfig = toml::from_str(config).unwrap();
    config.check(&Context { folder, rig: None })
}

pub(crate) fn points(config: &str, folder: &Path) -> Result<Points, Error> {
    match loader(config, folder).unwrap().open(&Request::default())? {
        Source::Points(points) => Ok(points),
        Source::Turns(_) => unreachable!("a rotor is no recording"),
    }
}

pub(crate) fn separator(config: &str) -> Result<Box<dyn PointSeparator>, Fault> {
    let config: RotorModesConfig = toml::from_str(config).unwrap();
    match config.check(&Context { folder: Path::new(""), rig: None })? {
        Separator::Points(separator) => Ok(separator),
        Separator::Stations(_) => unreachable!("a rotor is no recording"),
    }
}

pub(crate) fn solved(parts: &str, config: &str) -> Outcome {
    let points = points(&format!("{MATERIALS}{parts}"), Path::new("")).unwrap();
    separator(config).unwrap().separate(&points).unwrap()
}

pub(crate) fn rad_per_s(rpm: f64) -> f64 {
    rpm * PI / 30.0
}

pub(crate) fn near(found: f64, expected: f64, relative: f64) {
    assert!((found / expected - 1.0).abs() <= relative, "{found}, expected {expected}");
}
