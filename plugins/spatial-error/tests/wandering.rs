//! A tracker whose errors depend on each other from reading to reading: one that wanders, and one that warms up.

#![allow(clippy::unwrap_used, reason = "tests")]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use runout_core::{
    closed_loop::Settings,
    consistency::Test,
    stage::{Outcome, PointModel, PointSeparator},
};
use runout_spatial_error::simulate::{Scenario, Simulated, SimulatedEffect};

use crate::{
    support::{column, scenario, separator, table},
    trials::{fewest, trials},
};

/// Adds to each component a mean of all earlier steps, which forgets over so many readings.
fn wander(made: &mut Simulated, std_um: f64, readings: f64, seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let keep = (-1.0 / readings).exp();
    for axis in 0..3 {
        let mut state: f64 = random.sample(StandardNormal);
        for reading in &mut made.readings_um {
            reading[axis] += std_um * state;
            let step: f64 = random.sample(StandardNormal);
            state = keep * state + (1.0 - keep * keep).sqrt() * step;
        }
    }
}

const QUERY: &str = "query = { grid_mm = [150.0, 130.0, 110.0] }";

/// Share of predictions within 1.96 of their standard uncertainties.
fn held(made: &Simulated, outcome: &Outcome) -> f64 {
    let rows = table(outcome, "prediction");
    let [x, y, z] = ["x_mm", "y_mm", "z_mm"].map(|name| column(&rows, name));
    let mut inside = 0;
    for (axis, name) in ["dx_um", "dy_um", "dz_um"].into_iter().enumerate() {
        let (mean, std) = (column(&rows, name), column(&rows, &format!("std_{name}")));
        let holds =
            |row: &usize| (mean[*row] - made.truth_um([x[*row], y[*row], z[*row]])[axis]).abs() < 1.96 * std[*row];
        inside += (0..rows.num_rows()).filter(holds).count();
    }
    inside as f64 / (3 * rows.num_rows()) as f64
}

/// Row by row of the grid, so that neighbours share what the tracker is off by.
fn in_rows(seed: u64) -> Scenario {
    Scenario { random_order: false, ..scenario(seed) }
}

#[test]
fn predictions_cover_the_true_error_beside_a_tracker_that_wanders() {
    let (mut shares, mut said, mut moved) = (Vec::new(), 0, 0);
    let campaigns = trials(12);
    for seed in 0..campaigns as u64 {
        let mut made = in_rows(100 + seed).simulate();
        wander(&mut made, 2.0, 15.0, seed);
        shares.push(held(&made, &separator(QUERY).separate(&made.points()).unwrap()));
        let found = separator("").diagnose(&made.points(), &Settings::default()).unwrap().diagnosis;
        let is_order =
            |check: &&runout_core::consistency::Check| check.test == Test::Order && !check.finding.is_empty();
        said += usize::from(found.consistency.iter().find(is_order).is_some());
        moved +=
            usize::from(found.added.iter().any(|one| one.effect == "tracker-step" || one.effect == "thermal-drift"));
    }
    let mean = shares.iter().sum::<f64>() / shares.len() as f64;
    eprintln!("held {mean:.3} {shares:.2?}, said {said}, steps or drifts {moved} of {campaigns}");
    assert!(
        mean > 0.9 && said >= fewest(campaigns, [10, 12], 0.95) && 6 * moved <= campaigns,
        "{mean:.3} {shares:.2?} {said} {moved}"
    );
}

/// A warm-up bends early: a third of the campaign is its time constant. As it is explained, predictions are those of the first reading.
#[test]
fn predictions_cover_the_true_error_behind_a_warm_up() {
    let drift = |target: &str, drift_um: f64| SimulatedEffect::ThermalDrift {
        targets: [target.into()],
        drift_um,
        time_constant: Some(0.33),
    };
    let campaigns = trials(8);
    let (mut shares, mut found) = (Vec::new(), 0);
    for seed in 0..campaigns as u64 {
        let made = Scenario { effect: vec![drift("x", 6.0), drift("z", 12.0)], ..scenario(300 + seed) }.simulate();
        let closed = separator(QUERY).diagnose(&made.points(), &Settings::default()).unwrap();
        let drifts = |axis: &str| {
            let added = closed.diagnosis.added.iter();
            added.filter(|one| one.effect == "thermal-drift" && one.targets == [axis]).count() == 1
        };
        found += usize::from(drifts("x") && drifts("z"));
        shares.push(held(&made, &closed.after));
    }
    let mean = shares.iter().sum::<f64>() / shares.len() as f64;
    eprintln!("held {mean:.3} {shares:.2?}, both drifts found {found} of {campaigns}");
    assert!(mean > 0.9 && found >= fewest(campaigns, [6, 8], 0.9), "{mean:.3} {shares:.2?} {found}");
}

#[test]
fn sound_campaigns_have_independent_errors() {
    let campaigns = trials(24) as u64;
    let said = (0..campaigns).filter(|seed| {
        let outcome = separator("").separate(&in_rows(200 + seed).simulate().points()).unwrap();
        outcome.checks.iter().any(|check| check.test == Test::Order && !check.finding.is_empty())
    });
    let said = said.count();
    assert!(said <= 1, "{said} of {campaigns}");
}
