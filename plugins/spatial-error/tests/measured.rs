//! Components that were not measured, and errors that are not smooth.

#![allow(clippy::unwrap_used, reason = "tests")]

use crate::{
    support::{column, scenario, separator, table, value},
    trials::trials,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use runout_core::{
    closed_loop::{Settings, diagnosis::Verdict},
    consistency::Test,
    points::Points,
    stage::{Outcome, PointSeparator},
};
use runout_spatial_error::simulate::{Field, Layout, Scenario, Simulated};

fn change(points: &mut Points, name: &str, to: impl FnMut((usize, &mut f64))) {
    let column = points.columns.iter_mut().find(|column| column.name == name).unwrap();
    column.values.iter_mut().enumerate().for_each(to);
}

fn without(made: &Simulated, name: &str) -> Points {
    let mut points = made.points();
    points.columns.retain(|column| column.name != name);
    points
}

fn predictions(outcome: &Outcome, names: &[&str]) -> Vec<Vec<f64>> {
    let rows = table(outcome, "prediction");
    names.iter().flat_map(|name| [column(&rows, name), column(&rows, &format!("std_{name}"))]).collect()
}

/// A component that is absent, constant, a plane or nearly so: the others are what they are without it, to the last bit.
#[test]
fn a_component_that_was_not_measured_changes_no_other() {
    let made = scenario(61).simulate();
    let separator = separator("query = { grid_mm = [200, 150, 175] }");
    let absent = separator.separate(&without(&made, "dy_um")).unwrap();
    assert!(absent.notes.iter().any(|note| note.contains("dy is not measured")), "{:?}", absent.notes);
    let others = ["dx_um", "dz_um"];
    let expected = predictions(&absent, &others);
    assert!(expected.iter().flatten().all(|value| value.is_finite()));
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for (kind, size) in [("zero", 0.0), ("constant", 0.0), ("plane", 0.0), ("noise", 2e-3)] {
        let mut points = made.points();
        change(&mut points, "dy_um", |(row, value)| {
            let [x, y, z] = made.commands_mm[row];
            let level = match kind {
                "constant" => 31.7,
                "plane" => 4.0 + 0.03 * x - 0.01 * y + 0.02 * z,
                _ => 0.0,
            };
            *value = level + size * random.sample::<f64, _>(StandardNormal);
        });
        let outcome = separator.separate(&points).unwrap();
        assert_eq!(predictions(&outcome, &others), expected, "{kind}");
        let lost = predictions(&outcome, &["dy_um"]);
        assert!(lost.iter().flatten().all(|value| value.is_nan()), "{kind}");
        for symbol in ["sill", "nugget", "noise", "left_out_chi2"] {
            assert!(value(&outcome, symbol, Some("dy")).value.is_nan(), "{kind} {symbol}");
        }
        assert!(value(&outcome, "remains_rms", None).value.is_finite());
        let said = &outcome.checks[0];
        assert!(
            said.finding.contains("`dy_um`") && said.finding.contains("not measured") && !said.refutes(),
            "{said:?}"
        );
        let rows = table(&outcome, "compensation");
        assert!(column(&rows, "correct_y_um").iter().all(|add| add.is_nan()), "{kind}");
        assert!(column(&rows, "correct_x_um").iter().all(|add| add.is_finite()), "{kind}");
    }
}

#[test]
fn a_loop_without_a_component_finds_what_the_others_show() {
    let effect = runout_spatial_error::simulate::SimulatedEffect::Positioning {
        targets: ["EXX".into()],
        order: 3,
        amplitude_um: 15.0,
    };
    let made = Scenario { effect: vec![effect], ..scenario(62) }.simulate();
    let settings = Settings { max_added: 40, ..Settings::default() };
    let separator = separator("query = { grid_mm = [300, 200, 175] }");
    let found = separator.model().unwrap().diagnose(&without(&made, "dz_um"), &settings).unwrap().diagnosis;
    assert_eq!(found.verdict, Verdict::Explained, "{:?} {:?}", found.added, found.unexplained);
    assert_eq!((found.added.len(), found.added[0].effect.as_str()), (1, "positioning"));
    let blind =
        |effect: &str, target: &str| found.blind_to.iter().any(|one| one.effect == effect && one.targets == [target]);
    assert!(blind("scale", "Z") && blind("thermal-drift", "z") && !blind("scale", "X"), "{:?}", found.blind_to);
}

#[test]
fn at_least_one_component_is_needed() {
    let mut points = scenario(63).simulate().points();
    points.columns.retain(|column| !column.name.starts_with('d'));
    let text = separator("").separate(&points).unwrap_err().to_string();
    assert!(text.contains("`dx_um`, `dy_um`, `dz_um`"), "{text}");
}

/// One pass over a plane, smooth errors with a nugget, and a third component that is constant, or nearly: 95 % intervals of the other
/// two cover the smooth error of unseen places.
#[test]
fn intervals_cover_the_true_error_beside_a_constant_component() {
    let mut held = [0.0; 3];
    let mut asked = 0.0;
    let campaigns = trials(8);
    for seed in 0..campaigns as u64 {
        let layout = Layout::Scattered { from_mm: [0.0, 0.0, 40.0], to_mm: [520.0, 430.0, 40.0], count: 90 };
        let mut scenario = Scenario { layout, passes: 1, ..scenario(600 + seed) };
        scenario.tracker.noise_um = 2.5;
        let made = scenario.simulate();
        for (index, size) in [0.0, 0.005, 0.4].into_iter().enumerate() {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let mut points = made.points();
            change(&mut points, "dz_um", |(_, value)| *value = size * random.sample::<f64, _>(StandardNormal));
            let outcome = separator("query = { grid_mm = [60, 60, 60] }").separate(&points).unwrap();
            let rows = table(&outcome, "prediction");
            let [x, y, z] = ["x_mm", "y_mm", "z_mm"].map(|name| column(&rows, name));
            for (axis, name) in ["dx_um", "dy_um"].into_iter().enumerate() {
                let (mean, std) = (column(&rows, name), column(&rows, &format!("std_{name}")));
                for row in 0..x.len() {
                    let truth = made.truth_um([x[row], y[row], z[row]])[axis];
                    held[index] += f64::from(u8::from((mean[row] - truth).abs() < 1.96 * std[row]));
                    asked += 1.0 / 3.0;
                }
            }
        }
    }
    // Places of a campaign share its errors: of fewer campaigns the share scatters with the root of their number.
    let wider = f64::sqrt(8.0 / campaigns as f64);
    let bounds = 0.95 - 0.05 * wider..0.95 + 0.045 * wider;
    assert!(held.iter().all(|held| bounds.contains(&(held / asked))), "{held:?} of {asked}");
}

/// Noise of 1 µm is stated, and each place is off by 18 µm of its own: no axis takes this away.
#[test]
fn what_is_not_smooth_remains_and_is_no_noise() {
    let mut scenario = Scenario { passes: 1, ..scenario(71) };
    scenario.tracker.noise_um = 1.0;
    let made = scenario.simulate();
    let mut random = ChaCha8Rng::seed_from_u64(72);
    let mut points = made.points();
    for name in ["dx_um", "dy_um", "dz_um"] {
        change(&mut points, name, |(_, value)| *value += 18.0 * random.sample::<f64, _>(StandardNormal));
    }
    let settings = Settings { max_added: 40, ..Settings::default() };
    let expected = 18.0 * 3.0_f64.sqrt();
    for query in ["", "query = { grid_mm = [170, 130, 110] }\n"] {
        let found = separator(&format!("{query}std_um = 1.0")).model().unwrap().diagnose(&points, &settings).unwrap();
        assert_eq!((found.diagnosis.verdict, found.diagnosis.added.len()), (Verdict::Unexplained, 0));
        let said = &found.diagnosis.unexplained[0].place;
        assert!(said.contains("from place to place"), "{said}");
        let remains = value(&found.after, "remains_rms", None).value;
        assert!((0.85..1.25).contains(&(remains / expected)), "{query}: {remains}");
        let error = value(&found.after, "error_rms", None).value;
        assert!(error > remains, "{error} {remains}");
    }
}

/// A given nugget of a third of the true one: regions that are left out refute it, and predictions are wider by about what is missing.
#[test]
fn a_covariance_that_the_readings_refute_widens_predictions() {
    let field = Field { std_um: [4.0; 3], range_mm: [260.0, 220.0, 200.0], smoothness: Some(2.5) };
    let mut scenario = Scenario { passes: 1, field: Some(field), ..scenario(81) };
    scenario.tracker.noise_um = 3.0;
    let points = scenario.simulate().points();
    let given = |nugget: f64| {
        let kriging =
            format!("variogram = \"matern-5/2\", sill_um = 4.0, range_mm = [260, 220, 200], nugget_um = {nugget}");
        separator(&format!("kriging = {{ {kriging} }}")).separate(&points).unwrap()
    };
    let (right, wrong) = (given(3.0), given(0.9));
    let left_out = |outcome: &Outcome, of: &str| {
        outcome.checks.iter().find(|check| check.test == Test::LeftOut && check.of == of).unwrap().clone()
    };
    for name in ["dx", "dy", "dz"] {
        assert!(!left_out(&right, name).refutes(), "{:?}", left_out(&right, name));
        let check = left_out(&wrong, name);
        assert!(check.refutes() && (1.5..4.5).contains(&check.factor), "{check:?}");
        let sill = value(&wrong, "sill", Some(name));
        assert!(sill.refuted_by.as_ref().is_some_and(|said| said.contains("regions left out")), "{sill:?}");
    }
    assert!(value(&right, "sill", Some("dx")).refuted_by.is_none());
}

/// The second pass is offset along y: the pass is named, and bars the verdict until a drift explains it.
#[test]
fn a_pass_that_is_offset_is_named() {
    let made = scenario(82).simulate();
    let separator = separator("query = { grid_mm = [300, 200, 175] }");
    let shifts = |points: &Points| -> Vec<String> {
        let outcome = separator.separate(points).unwrap();
        let shifts = outcome.checks.into_iter().filter(|check| check.test == Test::Shift && check.refutes());
        shifts.map(|check| check.finding).collect()
    };
    assert_eq!(shifts(&made.points()), Vec::<String>::new());
    let mut points = made.points();
    change(&mut points, "dy_um", |(row, value)| *value += if made.repeat[row] > 1.5 { 1.6 } else { 0.0 });
    let found = shifts(&points);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].starts_with("dy: pass 2 differs from pass 1 by"), "{found:?}");
}

/// Repeats that scatter unlike the stated uncertainty, to either side.
#[test]
fn a_stated_noise_that_repeats_refute_is_said() {
    let points = scenario(83).simulate().points();
    for (std_um, refuted) in [(0.85, false), (2.5, true), (0.3, true)] {
        let outcome = separator(&format!("query = {{ grid_mm = [300, 200, 175] }}\nstd_um = {std_um}"))
            .separate(&points)
            .unwrap();
        let found = outcome.checks.iter().any(|check| check.test == Test::Alike && check.refutes());
        assert_eq!(found, refuted, "{std_um}: {:?}", outcome.checks);
    }
}
