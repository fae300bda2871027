//! Touches and rings that are not as they are declared: said by the touches themselves, in the result of a run.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{config, lobing, scenario, setups, value};
use runout_core::{
    points::Points,
    stage::{Outcome, PointSeparator},
};
use runout_touch_probe::simulate::{TouchProbeScenario, Wave};

const LAYOUT: [(f64, f64); 3] = [(0.0, 0.0), (100.0, 0.0), (217.0, 0.0)];

fn column<'a>(points: &'a mut Points, name: &str) -> &'a mut Vec<f64> {
    &mut points.columns.iter_mut().find(|column| column.name == name).unwrap().values
}

fn said(outcome: &Outcome) -> Vec<String> {
    outcome.checks.iter().map(|check| check.finding.clone()).filter(|said| !said.is_empty()).collect()
}

/// One touch that is far off is named with its row; the noise is that of the others, and the mean keeps its coverage.
#[test]
fn one_bad_touch_is_named_and_does_not_make_the_noise() {
    for (seed, repeats, row, off_um) in [(1, 3, 17, 50.0), (2, 3, 300, -35.0), (3, 4, 500, 80.0), (4, 2, 100, -120.0)] {
        let mut scenario = scenario(seed, &setups(&LAYOUT));
        scenario.repeats = repeats;
        let mut points = scenario.touched().points();
        let clean = config(&scenario, 9, None).separate(&points).unwrap();
        column(&mut points, "radius_mm")[row] += 1e-3 * off_um;
        let found = config(&scenario, 9, None).separate(&points).unwrap();
        let [before, after] = [&clean, &found].map(|outcome| value(outcome, "touch_std").value);
        println!("{seed}: noise {before:.3} to {after:.3} µm, {:?}", said(&found));
        assert!((after / before - 1.0).abs() < 0.02, "{seed}: {before} {after}");
        assert!(
            said(&found).iter().any(|said| said.starts_with(&format!("row {} (setup r", row + 1))),
            "{:?}",
            said(&found)
        );
        let mean = value(&found, "pretravel_mean");
        let off = (mean.value - lobing(&scenario).mean_um).abs();
        assert!(off < 2.5 * mean.std().unwrap() && mean.std().unwrap() < 0.5, "{seed}: {off} {mean:?}");
    }
}

#[test]
fn a_touch_of_no_radius_is_refused_by_row() {
    let scenario = scenario(5, &setups(&LAYOUT));
    let mut points = scenario.touched().points();
    column(&mut points, "radius_mm")[41] = 0.0;
    let error = config(&scenario, 9, None).separate(&points).unwrap_err().to_string();
    assert!(error.contains("row 42") && error.contains("0 mm"), "{error}");
}

/// The tip of a stylus that bends in the middle of a setup is off by a vector from then on.
fn bent_stylus(scenario: &TouchProbeScenario, off_um: f64) -> Points {
    let mut points = scenario.touched().points();
    let count = column(&mut points, "radius_mm").len();
    let directions = column(&mut points, "direction_deg").clone();
    let from = count / 2;
    for (radius, direction) in column(&mut points, "radius_mm").iter_mut().zip(directions).skip(from) {
        *radius += 1e-3 * off_um * (direction - 40.0).to_radians().cos();
    }
    points
}

#[test]
fn a_chip_a_bent_stylus_and_a_slipped_ring_are_said() {
    let with = |seed: u64, change: &dyn Fn(&mut TouchProbeScenario)| {
        let mut scenario = scenario(seed, &setups(&LAYOUT));
        change(&mut scenario);
        let outcome = config(&scenario, 12, None).separate(&scenario.touched().points()).unwrap();
        said(&outcome)
    };
    for seed in 40..43 {
        let chipped = with(seed, &|scenario| scenario.strangers.chip = Some([133.0, 10.0, 8.0]));
        let slipped = with(seed, &|scenario| scenario.strangers.slipped = Some((1, 1, 12.0)));
        let bent = with(seed, &|scenario| {
            scenario.strangers.bent = Some((2, Wave { order: 2, amplitude_um: 2.0, phase_deg: 20.0 }));
        });
        let scenario = scenario(seed, &setups(&LAYOUT));
        let stylus = said(&config(&scenario, 12, None).separate(&bent_stylus(&scenario, 4.0)).unwrap());
        for (name, said) in [("chip", chipped), ("slip", slipped), ("bent ring", bent), ("bent stylus", stylus)] {
            println!("{seed} {name}: {said:?}");
            assert!(!said.is_empty(), "{seed}: {name}");
        }
    }
}

#[test]
fn clean_campaigns_say_nothing() {
    let mut wrong = 0;
    for seed in 0..60 {
        let mut scenario = scenario(1000 + seed, &setups(&LAYOUT));
        scenario.repeats = 1 + (seed % 3) as usize;
        let found = said(&config(&scenario, 12, None).separate(&scenario.touched().points()).unwrap());
        if !found.is_empty() {
            println!("{seed}: {found:?}");
        }
        wrong += usize::from(!found.is_empty());
    }
    assert!(wrong < 4, "{wrong} of 60");
}
