//! The loop: each effect alone, clean campaigns, unmodelled disturbances.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::f64::consts::PI;

use crate::support::{scenario, separator};
use runout_core::{
    closed_loop::{
        Setting, Settings,
        diagnosis::{Diagnosis, Verdict},
    },
    consistency::Check,
    points::Points,
    stage::PointSeparator,
};
use runout_spatial_error::simulate::{Scenario, SimulatedEffect};

fn diagnose(scenario: &Scenario, text: &str) -> Diagnosis {
    let settings = Settings { max_added: 40, ..Settings::default() };
    separator(text).model().unwrap().diagnose(&scenario.simulate().points(), &settings).unwrap().diagnosis
}

fn with(seed: u64, effect: SimulatedEffect) -> Scenario {
    Scenario { effect: vec![effect], ..scenario(seed) }
}

const COARSE: &str = "query = { grid_mm = [300, 200, 175] }";

#[test]
fn rigid_and_field_alone_are_at_the_noise_floor() {
    let found = diagnose(&scenario(11), COARSE);
    assert_eq!(found.verdict, Verdict::AtNoiseFloor, "{:?}", found.added);
    assert!(found.warnings.iter().any(|warning| warning.contains("smooth field")), "{:?}", found.warnings);
    let chi2 = found.after.chi2_per_dof.unwrap();
    assert!((0.7..1.4).contains(&chi2), "{chi2}");
    // Without a tool offset, four rotations displace no measured point.
    let blind: Vec<&str> = found
        .blind_to
        .iter()
        .filter(|blind| blind.effect == "angular")
        .map(|blind| blind.targets[0].as_str())
        .collect();
    for target in ["ECY", "EAZ", "EBZ", "ECZ"] {
        assert!(blind.contains(&target), "{blind:?}");
    }
}

#[test]
fn effects_are_found_with_their_values() {
    let target = |name: &str| [name.to_owned()];
    let cases = [
        (SimulatedEffect::Scale { targets: target("Y"), scale_um_per_m: 150.0 }, "scale", "Y", 150.0),
        // Four heights do not distinguish a scale from a positioning error of a higher order: the scale is the simpler one.
        (SimulatedEffect::Scale { targets: target("Z"), scale_um_per_m: 90.0 }, "scale", "Z", 90.0),
        (SimulatedEffect::Squareness { targets: target("XZ"), angle_urad: -120.0 }, "squareness", "XZ", -120.0),
        (
            SimulatedEffect::Positioning { targets: target("EXX"), order: 3, amplitude_um: 15.0 },
            "positioning",
            "EXX",
            15.0,
        ),
        (
            SimulatedEffect::Straightness { targets: target("EZX"), order: 2, amplitude_um: -20.0 },
            "straightness",
            "EZX",
            -20.0,
        ),
        (SimulatedEffect::Angular { targets: target("EBY"), order: 1, amplitude_urad: 110.0 }, "angular", "EBY", 110.0),
        (
            SimulatedEffect::ThermalDrift { targets: target("z"), drift_um: 12.0, time_constant: None },
            "thermal-drift",
            "z",
            12.0,
        ),
    ];
    for (index, (effect, id, target, value)) in cases.into_iter().enumerate() {
        let found = diagnose(&with(20 + index as u64, effect), COARSE);
        assert_eq!(found.verdict, Verdict::Explained, "{id} {target}: {:?}", found.added);
        let added = &found.added[0];
        assert_eq!(
            (found.added.len(), added.effect.as_str(), added.targets[0].as_str()),
            (1, id, target),
            "{:?}",
            found.added
        );
        let parameter = added.parameters.iter().find(|parameter| parameter.name != "order").unwrap();
        if let Some(std) = parameter.std {
            assert!((parameter.value - value).abs() < 4.0 * std, "{id}: {parameter:?}");
        }
    }
}

#[test]
fn unmodelled_disturbances_are_unexplained_with_their_place() {
    let step = SimulatedEffect::Step { axis: "X".into(), at_mm: 310.0, by_um: [14.0, -9.0, 0.0] };
    let found = diagnose(&with(31, step), COARSE);
    assert_eq!((found.verdict, found.added.len()), (Verdict::Unexplained, 0), "{:?}", found.added);
    assert!(found.unexplained[0].place.contains("x = 300"), "{:?}", found.unexplained);
    let corner =
        SimulatedEffect::DisplacedBox { from_mm: [-1.0; 3], to_mm: [250.0, 180.0, 180.0], by_um: [-15.0, 12.0, 18.0] };
    let found = diagnose(&with(32, corner), COARSE);
    assert_eq!((found.verdict, found.added.len()), (Verdict::Unexplained, 0), "{:?}", found.added);
    assert!(found.unexplained[0].place.contains("corner"), "{:?}", found.unexplained);
}

#[test]
fn what_is_known_is_not_found_again() {
    let effect = SimulatedEffect::Positioning { targets: ["EXX".into()], order: 3, amplitude_um: 15.0 };
    let points = with(41, effect).simulate().points();
    let separator = separator(COARSE);
    let model = separator.model().unwrap();
    let place = model.effects().iter().position(|effect| effect.id == "positioning").unwrap();
    let known = |order: f64| Settings {
        known: vec![Setting { effect: place, values: vec![order, 15.0] }],
        max_added: 40,
        ..Settings::default()
    };
    let found = model.diagnose(&points, &known(3.0)).unwrap().diagnosis;
    assert_eq!((found.verdict, found.added.len()), (Verdict::AtNoiseFloor, 0), "{:?}", found.added);
    let problem = model.diagnose(&points, &known(7.0)).unwrap_err().to_string();
    assert!(problem.contains("order"), "{problem}");
}

#[test]
fn without_noise_from_elsewhere_nothing_is_at_its_floor() {
    let found = diagnose(&Scenario { passes: 1, ..scenario(51) }, COARSE);
    assert_eq!(found.verdict, Verdict::NothingFound, "{:?}", found.added);
    assert!(found.before.noise_floor_um.is_none());
}

/// Readings of a machine that is sound, changed: for each reading its time as a share of all, and its place in the file.
fn changed(seed: u64, change: impl Fn(f64, usize) -> f64) -> Points {
    let mut points = scenario(seed).simulate().points();
    let column = points.columns.iter_mut().find(|column| column.name == "dx_um").unwrap();
    let count = column.values.len() as f64;
    column.values.iter_mut().enumerate().for_each(|(row, value)| *value += change(row as f64 / count, row));
    points
}

/// A sine is none of the effects: what is added beside it, and the residual, is not called explained.
#[test]
fn what_the_data_contradict_is_not_explained() {
    let settings = Settings { max_added: 40, ..Settings::default() };
    let points = changed(61, |share, _| 9.0 * (3.0 * PI * share).sin());
    let found = separator(COARSE).model().unwrap().diagnose(&points, &settings).unwrap().diagnosis;
    assert_eq!(found.verdict, Verdict::Unexplained, "{:?} {:?}", found.added, found.after.chi2_per_dof);
}

/// Two readings of a place that differ do not say which of them is wrong.
#[test]
fn one_bad_reading_of_a_place_that_was_read_twice_is_named_with_both_rows() {
    for (seed, off_um) in [(71, 200.0), (72, -40.0)] {
        let points = changed(seed, |_, row| if row == 17 { off_um } else { 0.0 });
        let found = separator(COARSE).separate(&points).unwrap();
        let named = |check: &&Check| check.refutes() && check.finding.contains("row 18");
        let said: Vec<&Check> = found.checks.iter().filter(named).collect();
        assert!(said.iter().any(|check| check.finding.contains(" or row ")), "{:?}", found.checks);
    }
}
