//! Traces that judge themselves: errors that depend on each other along z are no effect, and the uncertainty holds them.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::{
    common::{Campaign, ground, rms},
    trials::trials,
};
use runout_core::{
    closed_loop::{Settings, diagnosis::Diagnosis},
    consistency::{Check, Test},
};
use runout_straightness::{AxialReversal, AxialReversalConfig, Straightness};

fn separator() -> AxialReversal {
    AxialReversalConfig::default().separator().unwrap()
}

fn diagnosed(campaign: &Campaign) -> (Diagnosis, Straightness) {
    separator().diagnosed(&campaign.points(), &Settings { max_added: 10, ..Settings::default() }).unwrap()
}

fn findings(checks: &[Check]) -> Vec<String> {
    checks.iter().filter(|check| !check.finding.is_empty()).map(|check| check.finding.clone()).collect()
}

/// Heights integrated from slopes: each trace walks by 5 nm a step, with white noise of 4 nm beside it.
fn walking(seed: u64, repeats: [usize; 2]) -> Campaign {
    let mut campaign = ground(seed, repeats);
    (campaign.noise_um, campaign.walk_um) = (0.004, 0.005);
    // Every trace at the same places, as an autocollimator is read.
    (campaign.length_mm, campaign.step_mm) = (120.0, 0.5);
    campaign
}

#[test]
fn a_walk_along_the_traces_is_no_effect_and_is_in_the_uncertainty() {
    let (mut squares, mut named, mut added, mut alone, campaigns) = ([0.0; 2], 0, 0, 0, 10);
    for seed in 0..campaigns {
        let campaign = walking(300 + seed, [[1, 3], [2, 2], [3, 3]][seed as usize % 3]);
        let (diagnosis, found) = diagnosed(&campaign);
        added += diagnosis.added.len();
        let is_named = |check: &Check| check.test == Test::Order && check.of == "z" && !check.finding.is_empty();
        named += usize::from(diagnosis.consistency.iter().any(is_named));
        alone += usize::from(diagnosis.consistency.iter().any(|check| check.test == Test::Alike && check.refutes()));
        let errors = campaign.errors(&found.z_mm, [&found.part_um, &found.slide_um]);
        for ((sum, error), std) in squares.iter_mut().zip(errors).zip([&found.part_std_um, &found.slide_std_um]) {
            *sum += (error / rms(std)).powi(2) / campaigns as f64;
        }
        println!("{seed}: {errors:?} {:?} {:?}", rms(&found.part_std_um), findings(&diagnosis.consistency));
    }
    println!("{squares:?} named {named}, added {added}, one trace unlike the others {alone}");
    assert!(added == 0 && alone <= 1, "{added} {alone}");
    assert!(named + 1 >= campaigns as usize);
    // Few independent numbers a campaign: 10 of them scatter by a half.
    assert!(squares.iter().all(|square| (0.3..1.8).contains(square)), "{squares:?}");
}

#[test]
fn a_gain_beside_a_walk_is_found() {
    let mut found = 0;
    for seed in 0..5 {
        let mut campaign = walking(400 + seed, [2, 3]);
        campaign.traces[3].gain = 0.2;
        let (diagnosis, _) = diagnosed(&campaign);
        let is_gain = |one: &runout_core::closed_loop::diagnosis::Added| {
            one.effect == "sensor-gain" && one.targets == ["reversed-2"]
        };
        found += usize::from(diagnosis.added.len() == 1 && diagnosis.added.iter().any(is_gain));
    }
    assert!(found >= 4, "{found} of 5");
}

#[test]
fn independent_errors_raise_no_finding_and_a_loud_trace_is_named() {
    let (mut said, campaigns) = (0, trials(12).max(6) as u64);
    for seed in 0..campaigns {
        let campaign = ground(500 + seed, [[3, 3], [2, 2], [4, 1]][seed as usize % 3]);
        let checks = separator().separated(&campaign.points()).unwrap().checks;
        println!("{seed}: {:?}", findings(&checks));
        said += usize::from(!findings(&checks).is_empty());
    }
    assert!(said <= 1, "{said} of {campaigns}");
    let campaign = ground(600, [3, 3]);
    let mut points = campaign.points();
    let own = points.traces[4].points.clone();
    for (row, reading) in points.columns[1].values[own].iter_mut().enumerate() {
        *reading += 0.03 * (row as f64 * row as f64).sin();
    }
    let said = findings(&separator().separated(&points).unwrap().checks);
    assert!(said.iter().any(|finding| finding.contains("trace reversed-2 has")), "{said:?}");
    // With the wrong sign its errors are a profile, which depends on itself along z.
    let mut points = campaign.points();
    let own = points.traces[4].points.clone();
    points.columns[1].values[own].iter_mut().for_each(|reading| *reading = -*reading);
    let found = separator().separated(&points).unwrap();
    let said = findings(&found.checks);
    assert!(said.iter().any(|finding| finding.contains("trace reversed-2 is off the others")), "{said:?}");
    assert!(found.checks.iter().any(Check::refutes), "{:?}", found.checks);
}
