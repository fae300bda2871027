//! Effects whose shape is looked for: the period of a screw, the time of a step of the tracker.

#![allow(clippy::unwrap_used, reason = "tests")]

use crate::{
    support::{scenario, separator},
    trials::is_full,
};
use runout_core::{
    closed_loop::{
        Settings,
        diagnosis::{Added, Diagnosis, Verdict},
    },
    stage::PointSeparator,
};
use runout_spatial_error::simulate::{Layout, Scenario, SimulatedEffect};

const COARSE: &str = "query = { grid_mm = [300, 200, 175] }\n";

fn diagnose(scenario: &Scenario, text: &str) -> Diagnosis {
    let settings = Settings { max_added: 100, ..Settings::default() };
    separator(&format!("{COARSE}{text}"))
        .model()
        .unwrap()
        .diagnose(&scenario.simulate().points(), &settings)
        .unwrap()
        .diagnosis
}

fn pitch(period_mm: f64, amplitude_um: f64) -> SimulatedEffect {
    SimulatedEffect::AxisPitch { targets: ["X".into()], period_mm, amplitude_um, phase_deg: 30.0 }
}

fn scattered(seed: u64, effect: SimulatedEffect) -> Scenario {
    let layout = Layout::Scattered { from_mm: [0.0; 3], to_mm: [600.0, 400.0, 350.0], count: 130 };
    Scenario { layout, effect: vec![effect], ..scenario(seed) }
}

fn only(found: &Diagnosis) -> &Added {
    assert_eq!(found.added.len(), 1, "{:?} {:?}", found.added, found.unexplained);
    &found.added[0]
}

fn holds(added: &Added, name: &str, truth: f64) {
    let parameter = added.parameters.iter().find(|parameter| parameter.name == name).unwrap();
    let std = parameter.std.unwrap();
    assert!((parameter.value - truth).abs() < 4.0 * std, "{name} {truth}: {parameter:?}");
}

#[test]
fn the_pitch_of_a_screw_is_found_with_its_period() {
    let all = [(62, 43.0, 8.0), (63, 10.0, 2.5), (61, 16.0, 4.0)];
    for (seed, period_mm, amplitude_um) in all.into_iter().take(if is_full() { 3 } else { 2 }) {
        let simulated = scattered(seed, pitch(period_mm, amplitude_um));
        let found = diagnose(&simulated, "");
        let added = only(&found);
        assert_eq!(
            (added.effect.as_str(), added.targets[0].as_str(), found.verdict),
            ("axis-pitch", "X", Verdict::Explained)
        );
        assert!(added.confounded_with.is_empty(), "{:?}", added.confounded_with);
        holds(added, "period", period_mm);
        holds(added, "amplitude", amplitude_um);
        // Of a sine at the middle of the measured places.
        let places = simulated.simulate().commands_mm;
        let each = || places.iter().map(|place| place[0]);
        let middle = f64::midpoint(each().fold(f64::INFINITY, f64::min), each().fold(f64::NEG_INFINITY, f64::max));
        let phase = 30.0 + 360.0 * middle / period_mm;
        let stated = added.parameters.iter().find(|parameter| parameter.name == "phase").unwrap();
        let apart = (stated.value - phase + 180.0).rem_euclid(360.0) - 180.0;
        assert!(apart.abs() < 4.0 * stated.std.unwrap(), "{stated:?}, truth {phase}");
    }
}

fn line(counts: [usize; 3], seed: u64, effect: SimulatedEffect) -> Scenario {
    let layout = Layout::Grid { from_mm: [0.0; 3], to_mm: [600.0, 400.0, 350.0], counts };
    Scenario { layout, effect: vec![effect], ..scenario(seed) }
}

#[test]
fn places_that_are_too_regular_do_not_show_a_period() {
    // Nodes 46.15 mm apart: 16 mm look like 31.8, 23.7 … mm.
    let found = diagnose(&line([14, 3, 3], 64, pitch(16.0, 12.0)), "");
    assert_eq!((found.verdict, found.added.len()), (Verdict::Unexplained, 0), "{:?}", found.added);
    let said = &found.unexplained[0].place;
    assert!(said.contains("axis-pitch X") && said.contains("pitch_mm"), "{said}");
    // With the declared period its amplitude is found, and no period is.
    let found = diagnose(&line([14, 3, 3], 64, pitch(16.0, 12.0)), "pitch_mm = [16, 0, 0]");
    let added = only(&found);
    assert_eq!(added.effect, "axis-pitch");
    holds(added, "amplitude", 12.0);
    assert!(added.parameters[0].std.is_none());
}

#[test]
fn a_period_that_all_nodes_share_is_not_seen() {
    // Each node is whole turns from the others.
    let found = diagnose(&line([6, 5, 4], 65, pitch(10.0, 12.0)), "pitch_mm = [10, 0, 0]");
    assert_eq!((found.verdict, found.added.len()), (Verdict::AtNoiseFloor, 0), "{:?}", found.added);
    let blind = found.blind_to.iter().find(|blind| blind.effect == "axis-pitch" && blind.targets == ["X"]).unwrap();
    assert_eq!(blind.bias_per_unit.on, "readings");
}

#[test]
fn a_step_of_the_tracker_is_found_with_its_time() {
    let all = [(72, 0.81, [-2.0, 5.0, 0.0]), (75, 0.5, [30.0, 0.0, -25.0]), (71, 0.37, [6.0, -4.0, 3.0])];
    for (seed, at, by_um) in all.into_iter().take(if is_full() { 3 } else { 2 }) {
        let found =
            diagnose(&Scenario { effect: vec![SimulatedEffect::TrackerStep { at, by_um }], ..scenario(seed) }, "");
        let added = only(&found);
        assert_eq!((added.effect.as_str(), found.verdict), ("tracker-step", Verdict::Explained));
        for (name, truth) in ["step_x", "step_y", "step_z"].into_iter().zip(by_um) {
            holds(added, name, truth);
        }
        // The step is none of the noise of repeats.
        let chi2 = found.after.chi2_per_dof.unwrap();
        assert!((0.75..1.3).contains(&chi2), "{chi2}");
        let when = &added.parameters[0];
        assert!((when.value - at).abs() < 0.02, "{when:?}");
    }
}

#[test]
fn a_step_of_the_tracker_is_no_error_of_the_machine() {
    // One pass, layer by layer: between two layers the tracker moved, or the machine has a step there.
    let found = diagnose(
        &Scenario {
            passes: 1,
            random_order: false,
            effect: vec![SimulatedEffect::TrackerStep { at: 0.5, by_um: [16.0, -14.0, 20.0] }],
            ..scenario(73)
        },
        "std_um = 0.9",
    );
    assert_eq!((found.verdict, found.added.len()), (Verdict::Unexplained, 0), "{:?}", found.added);
    assert!(found.unexplained[0].place.contains("tracker"), "{:?}", found.unexplained);
    // A step in space that is read twice is none in time.
    let step = SimulatedEffect::Step { axis: "X".into(), at_mm: 310.0, by_um: [14.0, -9.0, 0.0] };
    let found = diagnose(&Scenario { effect: vec![step], ..scenario(74) }, "");
    assert!(!found.added.iter().any(|added| added.effect == "tracker-step"), "{:?}", found.added);
}

/// Two passes of one order show what lies between them, and not what the readings do within one.
#[test]
fn a_steady_drift_is_no_step_of_the_tracker() {
    let drift = |(target, drift_um): (&str, f64)| SimulatedEffect::ThermalDrift {
        targets: [target.into()],
        drift_um,
        time_constant: None,
    };
    let effect = [("x", 7.0), ("y", -10.0), ("z", 5.0)].map(drift).into();
    let found = diagnose(&Scenario { random_order: false, effect, ..scenario(75) }, "");
    assert_eq!(found.verdict, Verdict::Unexplained, "{:?}", found.added);
    assert!(!found.added.iter().any(|added| added.effect == "tracker-step"), "{:?}", found.added);
    let left = found.unexplained.iter().find(|left| left.place.contains("or the readings drift")).unwrap();
    assert!(left.rms_um > 1.0, "{left:?}");
}

#[test]
fn passes_that_are_exchanged_in_the_file_are_named() {
    for (passes, said) in [([1, 2], "pass 1 and pass 2 are exchanged"), ([2, 2], "pass 2 are in reverse order")] {
        let found = diagnose(
            &Scenario { effect: vec![SimulatedEffect::PassSwapped { passes }], ..scenario(81) },
            "std_um = 0.9",
        );
        assert_eq!(found.verdict, Verdict::Unexplained, "{:?}", found.added);
        assert!(found.unexplained.iter().any(|one| one.place.contains(said)), "{:?}", found.unexplained);
    }
}
