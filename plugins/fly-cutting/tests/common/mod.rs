//! Scenarios and separators from TOML.

#![allow(dead_code, clippy::unwrap_used, reason = "tests, which use a part each")]

use runout_core::{
    closed_loop::{
        Settings,
        diagnosis::{Added, Diagnosis},
    },
    height_grid::HeightGrid,
    points::Points,
    stage::{Outcome, PointDiagnosis, PointSeparator},
};
use runout_fly_cutting::{FlyCutting, FlyCuttingConfig, simulate::FlyCuttingScenario};

/// The paper's cut.
pub(crate) const CUT: &str =
    "nose_radius_mm = 6.0\nfeed_um_per_rev = 8.3\ncutter_radius_mm = 250.0\nspeed_rpm = 390.0\n";

/// A scenario of the paper's cut on a square of 4 mm.
pub(crate) fn scenario(side: usize, more: &str) -> FlyCuttingScenario {
    let step_mm = 4.0 / side as f64;
    let grid = format!("[grid]\nrows = {side}\ncolumns = {side}\nstep_x_mm = {step_mm}\nstep_y_mm = {step_mm}\n");
    of(&format!("{more}\n[cut]\n{CUT}{grid}"))
}

pub(crate) fn of(text: &str) -> FlyCuttingScenario {
    toml::from_str(text).unwrap()
}

pub(crate) fn separator(text: &str) -> FlyCutting {
    toml::from_str::<FlyCuttingConfig>(text).unwrap().separator().unwrap()
}

pub(crate) fn run(grid: HeightGrid, separator: &FlyCutting) -> Outcome {
    separator.separate(&Points::of_grid(grid, "map.h5".into())).unwrap()
}

pub(crate) fn diagnose(grid: HeightGrid, separator: &FlyCutting) -> PointDiagnosis {
    let settings = Settings { max_added: 40, ..Settings::default() };
    separator.model().unwrap().diagnose(&Points::of_grid(grid, "map.h5".into()), &settings).unwrap()
}

pub(crate) fn value(outcome: &Outcome, symbol: &str, of: Option<&str>) -> f64 {
    let found = outcome.values.iter().find(|value| value.symbol == symbol && value.of.as_deref() == of);
    found.unwrap().value
}

pub(crate) fn parameter(added: &Added, name: &str) -> [f64; 2] {
    let found = added.parameters.iter().find(|parameter| parameter.name == name).unwrap();
    [found.value, found.std.unwrap_or(f64::NAN)]
}

pub(crate) fn listing(diagnosis: &Diagnosis) -> String {
    let added: Vec<String> = diagnosis
        .added
        .iter()
        .map(|added| {
            let parameters: Vec<String> = added
                .parameters
                .iter()
                .map(|one| format!("{} {:.5} ± {:.2e}", one.name, one.value, one.std.unwrap_or(f64::NAN)))
                .collect();
            format!("{} {:?} {:?}: {}", added.effect, added.targets, added.confounded_with, parameters.join(", "))
        })
        .collect();
    let left: Vec<&str> = diagnosis.unexplained.iter().map(|left| left.place.as_str()).collect();
    format!(
        "{:?}, chi2 {:?} -> {:?}, added {added:#?}, unexplained {left:?}, refused {:?}",
        diagnosis.verdict, diagnosis.before.chi2_per_dof, diagnosis.after.chi2_per_dof, diagnosis.refused
    )
}
