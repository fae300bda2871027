//! What single sensors, setups or the spindle add to the form or take from it, with three sensors in each of two sections and three part
//! angles.

use runout_core::closed_loop::{Effect, Fit, Model, Setting, diagnosis::Verdict};
use runout_spindle::{diagnose::SpindleModel, effects, layout::Layout, selection::Selection, simulate::SpindleConfig};

use super::{CLEAN_UM, diagnosed};
use crate::{
    campaigns::{averaged, campaign, two_sections},
    trials::is_full,
};

fn six_sensors(seed: u64, effect: &str) -> SpindleConfig {
    let mut config = campaign(seed, effect);
    config.rig.sensors = two_sections(&[0.0, 99.844, 202.5]);
    config
}

/// One effect: it alone is named, its parameters are right, and form is as of a sound campaign.
fn finds(effect: &str, named: &str, parameters: &[(&str, f64)]) {
    for seed in 1..=2 {
        let (found, [before, after]) = diagnosed(&six_sensors(seed, &format!("[{effect}]")));
        let diagnosis = &found.diagnosis;
        println!(
            "simulated, {effect}, seed {seed}: {:?}, form error {before:.4} → {after:.4} µm, {:?}",
            diagnosis.verdict, diagnosis.added
        );
        assert_eq!(diagnosis.verdict, Verdict::Explained, "{effect}: {:?}", diagnosis.unexplained);
        let [added] = &diagnosis.added[..] else { panic!("{effect}: {:?}", diagnosis.added) };
        let itself = std::iter::once(&added.effect).chain(&added.targets).cloned().collect::<Vec<_>>().join(" ");
        assert!(itself == named && added.confounded_with.is_empty(), "{effect}: {added:?}");
        for (name, truth) in parameters {
            let found = added.parameters.iter().find(|known| known.name == *name).unwrap();
            // Five standard uncertainties.
            assert!((found.value - truth).abs() <= 5.0 * found.std.unwrap(), "{effect}: {found:?} for {truth}");
        }
        assert!(after < CLEAN_UM && after <= 1.01 * before.max(CLEAN_UM), "{effect}: {before} → {after}");
    }
}

#[test]
fn a_wide_spot_is_found() {
    finds(r#"{"plugin":"probe-spot","targets":["S2"],"width_mm":2.5}"#, "probe-spot S2", &[("width", 2.5)]);
    // Wider than a period of the highest orders, which it sees with the other sign.
    finds(r#"{"plugin":"probe-spot","targets":["S6"],"width_mm":5.0}"#, "probe-spot S6", &[("width", 5.0)]);
}

#[test]
fn a_bracket_that_moves_is_found() {
    for share in [0.03, -0.1] {
        let effect = format!(r#"{{"plugin":"bracket-motion","targets":["S5"],"share":{share}}}"#);
        finds(&effect, "bracket-motion S5", &[("share", share)]);
    }
}

/// Patterns of one order, large and small (in a usual run by turns), each with its amplitude, order and phase.
#[test]
fn patterns_beside_the_form_are_found() {
    for (size, (order, amplitude_um, phase_deg)) in [(3, 0.5, 40.0), (8, 0.03, -100.0)].into_iter().enumerate() {
        let pattern = format!(r#""order":{order},"amplitude_um":{amplitude_um},"phase_deg":{phase_deg}"#);
        let parameters = [("amplitude", amplitude_um), ("order", f64::from(order)), ("phase", phase_deg)];
        let kinds = [
            (r#""plugin":"chuck-form""#, "chuck-form"),
            (r#""plugin":"clamping-form","targets":["b"]"#, "clamping-form b"),
            (r#""plugin":"electrical-run-out","targets":["S5"]"#, "electrical-run-out S5"),
        ];
        for (_, (plugin, named)) in kinds.into_iter().enumerate().filter(|(kind, _)| is_full() || kind % 2 == size) {
            finds(&format!("{{{plugin},{pattern}}}"), named, &parameters);
        }
    }
}

/// Two sensors a section do not say which of them sees the pattern, and two setups not whether the chuck or a clamping has it.
#[test]
fn what_does_not_decide_between_patterns_is_said() {
    let confounded = |config: &SpindleConfig| {
        let found = diagnosed(config).0.diagnosis;
        println!("simulated: {:?}, {:?}", found.verdict, found.added);
        let [added] = &found.added[..] else { panic!("{:?}", found.added) };
        let itself = std::iter::once(&added.effect).chain(&added.targets).cloned().collect::<Vec<_>>().join(" ");
        let mut all: Vec<String> = added.confounded_with.iter().cloned().chain([itself]).collect();
        all.sort();
        all
    };
    let run_out = r#"[{"plugin":"electrical-run-out","targets":["S2"],"order":5,"amplitude_um":0.2}]"#;
    assert_eq!(confounded(&campaign(1, run_out)), ["electrical-run-out S1", "electrical-run-out S2"]);
    let mut config = six_sensors(1, r#"[{"plugin":"chuck-form","order":3,"amplitude_um":0.2}]"#);
    config.rig.setups.truncate(2);
    assert_eq!(confounded(&config), ["chuck-form", "clamping-form b"]);
}

/// Partials are what the residual does around 0, and around the values that the data have.
#[test]
fn partials_hold_at_any_value() {
    for (named, values, effect) in PLANTED {
        partials_hold(named, &vec![0.0; values.len()], "[]");
        partials_hold(named, values, &format!("[{effect}]"));
    }
}

fn partials_hold(named: &str, values: &[f64], effect: &str) {
    let mut config = six_sensors(1, effect);
    config.noise.rms_um = 0.005;
    config.asynchronous.rms_um = Some(0.015);
    let rig = config.rig.clone().check().unwrap();
    let (station, _) = averaged(&config, &rig);
    let layout = Layout::new(&rig, false);
    let model = SpindleModel::new(Selection::whole(&rig), layout, true, effects::all(), &[station]).unwrap();
    let name =
        |effect: &Effect| std::iter::once(&effect.id).chain(&effect.targets).cloned().collect::<Vec<_>>().join(" ");
    let index = model.effects().iter().position(|effect| name(effect) == named).unwrap();
    let fit = |values: Vec<f64>| model.fit(&[Setting { effect: index, values }]).unwrap();
    let norm = |vector: &[f64]| vector.iter().map(|value| value * value).sum::<f64>().sqrt();
    let signature = fit(values.to_vec()).signature(index);
    for (place, (parameter, analytic)) in model.effects()[index].parameters.iter().zip(&signature).enumerate() {
        let step = 0.02 * parameter.tolerance;
        let moved = |by: f64| {
            let mut values = values.to_vec();
            values[place] += by;
            fit(values).remainder().residual.clone()
        };
        let (above, below) = (moved(step), moved(-step));
        let found = above.iter().zip(&below).map(|(above, below)| (above - below) / (2.0 * step));
        let off: Vec<f64> = found.zip(analytic).map(|(found, analytic)| found - analytic).collect();
        let (size, off) = (norm(analytic) * parameter.tolerance, norm(&off) * parameter.tolerance);
        println!("{named} {} at {values:?}: {size:.3e}, off by {off:.1e}", parameter.name);
        // As of all effects: what exact geometry adds, and the change of the projection, are left out.
        assert!(size > 1.0 && off < 0.05 * size + 1.0, "{named} {}", parameter.name);
    }
}

/// Effects, values of their parameters, and the same in a scenario.
const PLANTED: [(&str, &[f64], &str); 5] = [
    ("probe-spot S2", &[6.25], r#"{"plugin":"probe-spot","targets":["S2"],"width_mm":2.5}"#),
    ("bracket-motion S5", &[0.1], r#"{"plugin":"bracket-motion","targets":["S5"],"share":0.1}"#),
    ("chuck-form", &[0.3, 0.0], r#"{"plugin":"chuck-form","order":2,"amplitude_um":0.3}"#),
    (
        "clamping-form c",
        &[0.0, 0.3],
        r#"{"plugin":"clamping-form","targets":["c"],"order":2,"amplitude_um":0.3,"phase_deg":90}"#,
    ),
    (
        "electrical-run-out S4",
        &[0.3, 0.0],
        r#"{"plugin":"electrical-run-out","targets":["S4"],"order":2,"amplitude_um":0.3}"#,
    ),
];
