//! Values of an axis at standing positions: beside closed forms, with few or uneven positions, and how often their intervals cover the true value.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests; some print shares for the documentation")]

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};

use super::{Evaluate, Evaluated, decide, tests::evaluate};
use crate::{
    Decision, Limit, Value,
    evaluable::{AxisMotion, Evaluable, EvaluableKind, MotionErrors},
    trials::{fewest, trials},
};

/// Motion over the angle of the axis, in rad: x, y, z in µm, tilts in µrad.
type Motion = dyn Fn(f64) -> [f64; 5];

fn axis(angle_deg: Vec<f64>, motion: &Motion, errors: Result<MotionErrors, String>) -> AxisMotion {
    let motion = angle_deg.iter().map(|angle| motion(angle.to_radians())).collect();
    AxisMotion { of: "C".into(), letters: ['x', 'y', 'z'], angle_deg, z_mm: 60.0, motion, errors }
}

fn equal(count: usize) -> Vec<f64> {
    (0..count).map(|at| 360.0 * at as f64 / count as f64).collect()
}

/// Independent errors of these standard deviations in µm and µrad.
fn independent(count: usize, um: f64, urad: f64) -> MotionErrors {
    let std = [um, um, um, urad, urad];
    let own =
        std::array::from_fn(|row| std::array::from_fn(|column| if row == column { std[row].powi(2) } else { 0.0 }));
    MotionErrors { own: vec![own; count], ..MotionErrors::default() }
}

fn settings(text: &str) -> Evaluate {
    let mut evaluate = evaluate(text).unwrap();
    evaluate.keep_given(&[EvaluableKind::AxisMotion]);
    evaluate
}

fn evaluated(motion: AxisMotion, text: &str) -> Evaluated {
    Evaluated::of(&[Evaluable::AxisMotion(motion)], &settings(text), None).unwrap()
}

fn find<'a>(found: &'a Evaluated, symbol: &str) -> &'a Value {
    let known = || found.values.iter().map(|value| value.symbol.as_str()).collect::<Vec<_>>();
    let value = found.values.iter().find(|value| value.symbol == symbol);
    value.unwrap_or_else(|| panic!("no {symbol} in {:?}", known()))
}

/// Highest less lowest on so many angles that no crest is missed.
fn range(of: impl Fn(f64) -> f64) -> f64 {
    let values = (0..36_000).map(|at| of(TAU * f64::from(at) / 36_000.0));
    let [low, high] = values.fold([f64::MAX, f64::MIN], |[low, high], one| [low.min(one), high.max(one)]);
    high - low
}

/// 2/rev of 1 µm along x, written as a square; 6 µm of what turns with the axis and 0.3 µm against it; 3/rev of tilt about y.
fn closed_form(angle: f64) -> [f64; 5] {
    let crest = (angle - 0.3).cos();
    let (with, against) = (angle + 1.0, angle + 0.4);
    [
        2.0 * crest * crest - 1.0 + 6.0 * with.cos() + 0.3 * against.cos() + 11.0,
        6.0 * with.sin() - 0.3 * against.sin() - 7.0,
        0.5 * angle.sin() + 0.2 * (4.0 * angle).cos() + 3.0,
        40.0 * (2.0 * angle).sin(),
        3.0 * (3.0 * angle + 0.2).cos(),
    ]
}

#[test]
fn values_are_those_of_a_closed_form() {
    let text = "values = ['error-motion']\ncentres = ['LSC', 'PC']\ndirections_deg = [45]\nfaces = [{ radius_mm = 20, angle_deg = 90 }]";
    // No position is on a crest, they begin anywhere, and are in no order.
    let mut angle_deg: Vec<f64> = equal(24).iter().map(|angle| angle - 97.3).collect();
    angle_deg.swap(3, 17);
    let found = evaluated(axis(angle_deg, &closed_form, Ok(independent(24, 1e-4, 1e-3))), text);
    let wave = |angle: f64| 0.2 * (4.0 * angle).cos();
    let axial = |angle: f64| 0.5 * angle.sin() + wave(angle);
    let tilt_x = |angle: f64| 40.0 * (2.0 * angle).sin();
    for (symbol, unit, expected) in [
        ("synchronous-radial-x", "um", 2.0),
        ("synchronous-radial-x-rms", "um", 0.5_f64.sqrt()),
        ("synchronous-radial-y", "um", 0.0),
        ("synchronous-radial-at-45deg", "um", 2.0_f64.sqrt()),
        ("residual-synchronous-tilt-x", "urad", 80.0),
        ("residual-synchronous-tilt-y", "urad", 6.0),
        ("fundamental-radial", "um", 0.6),
        ("fundamental-tilt", "urad", 0.0),
        ("synchronous-axial", "um", range(axial)),
        ("fundamental-axial", "um", 1.0),
        ("residual-synchronous-axial", "um", 0.4),
        // z + 20 mm of the tilt about x, which lifts what is at 90°.
        ("synchronous-face-at-20mm-90deg", "um", range(|angle| axial(angle) + 0.02 * tilt_x(angle))),
        ("residual-synchronous-face-at-20mm-90deg", "um", range(|angle| wave(angle) + 0.02 * tilt_x(angle))),
    ] {
        let value = find(&found, symbol);
        let tolerance = 1e-3 * expected.max(if unit == "um" { 0.5 } else { 5.0 });
        assert!((value.value - expected).abs() < tolerance, "{symbol}: {} instead of {expected}", value.value);
        let [low, high] = value.uncertainty.as_ref().unwrap().interval_95;
        assert!(low <= expected + tolerance && expected - tolerance <= high, "{symbol}: {low} {high}");
        assert_eq!(
            (value.unit.as_str(), value.absent_above_upr, &value.no_uncertainty),
            (unit, None, &None),
            "{symbol}"
        );
        assert!(value.source.contains("ISO 230-7:2015"), "{}", value.source);
    }
    let about = |symbol: &str| -> Vec<&str> {
        let of = found.values.iter().filter(|value| value.symbol == symbol);
        of.map(|value| value.reference.as_deref().unwrap()).collect()
    };
    assert_eq!((about("synchronous-radial-x"), about("synchronous-axial")), (vec!["LSC", "PC"], vec!["PC"]));
    assert!(find(&found, "synchronous-radial-x").source.contains("at z = 60 mm"));
    assert_eq!(find(&found, "synchronous-radial-x").band_upr, [2, 11]);
    assert_eq!(find(&found, "synchronous-axial").band_upr, [1, 11]);
    assert!(found.values.iter().all(|value| value.of.as_deref() == Some("C") && !value.symbol.contains("rotating")));
    assert!(
        found.remarks.len() == 1 && found.remarks[0].contains("no asynchronous and no total values"),
        "{:?}",
        found.remarks
    );
}

/// Of an axis along x, y and z of the machine are across it.
#[test]
fn directions_have_the_letters_of_the_machine() {
    let motion = AxisMotion {
        of: "A".into(),
        letters: ['y', 'z', 'x'],
        ..axis(equal(24), &closed_form, Ok(independent(24, 1e-4, 1e-3)))
    };
    let found = evaluated(motion, "");
    assert!((find(&found, "synchronous-radial-y").value - 2.0).abs() < 2e-3);
    assert!(find(&found, "synchronous-radial-z").source.contains("direction z, at x = 60 mm"));
    assert!((find(&found, "residual-synchronous-tilt-z").value - 6.0).abs() < 0.01);
    assert!(found.values.iter().all(|value| !value.symbol.ends_with("radial-x")));
}

/// Limits are checked against these names before there is any data.
#[test]
fn every_value_has_a_known_symbol_and_unit() {
    let text = "directions_deg = [30]\nfaces = [{ radius_mm = 20, angle_deg = 0 }]";
    let found = evaluated(axis(equal(24), &closed_form, Ok(independent(24, 1e-4, 1e-3))), text);
    let known = settings(text).known_values();
    for value in &found.values {
        let known = known.iter().find(|known| known.symbol == value.symbol);
        assert_eq!(known.map(|known| known.unit.replace('µ', "u")), Some(value.unit.clone()), "{}", value.symbol);
    }
    // z is across an axis along x or y.
    let of_z = |symbol: &str| symbol.contains("radial-z") || symbol.contains("tilt-z");
    assert_eq!(known.iter().filter(|known| !of_z(&known.symbol)).count(), found.values.len());
    assert!(known.iter().all(|known| !known.symbol.starts_with("total") && !known.symbol.starts_with("asynchronous")));
}

fn limited(found: &Evaluated, limit: &str, text: &str) -> (Decision, Option<String>) {
    let limit = toml::from_str::<Limit>(limit).unwrap().check(&settings(text), &[], None).unwrap();
    let (decided, remarks) = decide(&[limit], &found.values.iter().map(Value::placed).collect::<Vec<_>>()).unwrap();
    assert!(remarks.is_empty(), "{remarks:?}");
    (decided[0].decision, decided[0].values[0].missing.clone())
}

#[test]
fn limits_are_decided() {
    let found = evaluated(axis(equal(24), &closed_form, Ok(independent(24, 0.01, 0.1))), "");
    let limit = |symbol: &str, upper: f64| format!("symbol = '{symbol}'\nsection = 'C'\nupper = {upper}\nunit = 'um'");
    assert_eq!(limited(&found, &limit("synchronous-radial-x", 2.1), "").0, Decision::Conforms);
    assert_eq!(limited(&found, &limit("synchronous-radial-x", 1.9), "").0, Decision::DoesNotConform);
    assert_eq!(limited(&found, &limit("synchronous-radial-x", 2.001), "").0, Decision::Undecided);
    assert_eq!(
        limited(&found, &format!("{}\nreference = 'PC'", limit("fundamental-axial", 1.1)), "").0,
        Decision::Conforms
    );
    for symbol in ["asynchronous-radial-x", "total-radial-x", "synchronous-radial-rotating"] {
        let limit = toml::from_str::<Limit>(&limit(symbol, 1.0)).unwrap();
        assert!(format!("{:?}", limit.check(&settings(""), &[], None).unwrap_err()).contains("no value"), "{symbol}");
    }
}

#[test]
fn few_positions_leave_values_incomplete_and_limits_undecided() {
    let limit = "symbol = 'synchronous-radial-x'\nupper = 5.0\nunit = 'um'";
    for (count, complete) in [(8, false), (11, true), (12, true)] {
        let found = evaluated(axis(equal(count), &closed_form, Ok(independent(count, 0.01, 0.1))), "");
        let value = find(&found, "synchronous-radial-x");
        let highest = (count - 1) / 2;
        // The share of noise that is taken off, of 0.01 µm at each position, is about that.
        assert!((value.value - 2.0).abs() < 0.02, "{count}: {}", value.value);
        assert_eq!((value.band_upr, value.absent_above_upr), ([2, highest], (!complete).then_some(highest)));
        let (decision, missing) = limited(&found, limit, "");
        assert_eq!(
            (decision, missing.is_none()),
            if complete { (Decision::Conforms, true) } else { (Decision::Undecided, false) }
        );
        let said = found.remarks.iter().any(|remark| remark.contains("so few orders do not show"));
        assert_eq!(said, !complete, "{:?}", found.remarks);
    }
    // Orders 0 and 1 alone.
    let found = evaluated(axis(equal(4), &closed_form, Ok(independent(4, 0.01, 0.1))), "");
    assert!(
        found.values.is_empty() && found.remarks[0].contains("4 positions are fewer than 5"),
        "{:?}",
        found.remarks
    );
}

/// 26 waves on 36 positions look like 10: no position shows that, but that the upper half of the orders has motion.
#[test]
fn motion_that_folds_into_the_upper_orders_is_said() {
    let high = |angle: f64| [0.5 * (26.0 * angle).cos() + (2.0 * angle).cos(), 0.0, 0.0, 0.0, 0.0];
    let found = evaluated(axis(equal(36), &high, Ok(independent(36, 0.01, 0.1))), "");
    assert_eq!(find(&found, "synchronous-radial-x").absent_above_upr, Some(17));
    assert_eq!(find(&found, "synchronous-radial-y").absent_above_upr, None);
    let said = "motion may go on above order 17 (the upper half of the orders has more than noise), and limits are undecided: radial-x";
    assert!(found.remarks.iter().any(|remark| remark.contains(said)), "{:?}", found.remarks);
}

#[test]
fn a_part_of_a_turn_has_no_values_and_says_why() {
    let partial: Vec<f64> = (0..16).map(|at| -30.0 + 10.0 * f64::from(at)).collect();
    let mut one_missing = equal(36);
    one_missing.remove(20);
    for (angle_deg, widest) in [(partial, "210.0000°"), (one_missing, "20.0000°")] {
        let count = angle_deg.len();
        let found = evaluated(axis(angle_deg, &closed_form, Ok(independent(count, 0.01, 0.1))), "");
        assert!(found.values.is_empty() && found.remarks.len() == 1, "{:?}", found.values);
        assert!(found.remarks[0].contains("C: no error motion values") && found.remarks[0].contains(widest));
    }
    // Commands that were rounded are equal angles.
    let rounded = equal(91).iter().map(|angle| (100.0 * angle).round() / 100.0).collect();
    let found = evaluated(axis(rounded, &closed_form, Ok(independent(91, 0.01, 0.1))), "");
    // Of two waves a turn of 1 µm that are measured to 0.01 µm at each position.
    let found = find(&found, "synchronous-radial-x");
    let [low, high] = found.uncertainty.clone().unwrap().interval_95;
    assert!((found.value - 2.0).abs() < 0.03 && low < 2.0 && 2.0 < high, "{found:?}");
}

#[test]
fn without_known_errors_there_is_no_uncertainty_and_no_decision() {
    let found = evaluated(axis(equal(36), &closed_form, Err("no repeats".into())), "");
    for value in &found.values {
        assert!(value.uncertainty.is_none() && value.no_uncertainty.as_deref() == Some("no repeats"), "{value:?}");
    }
    assert_eq!(find(&found, "synchronous-radial-x").absent_above_upr, Some(17));
    assert!(
        found.remarks.iter().any(|remark| remark.contains("no uncertainty of 15 values: no repeats")),
        "{:?}",
        found.remarks
    );
    assert_eq!(limited(&found, "symbol = 'fundamental-radial'\nupper = 5.0\nunit = 'um'", "").0, Decision::Undecided);
    // Errors of other positions are no errors of these; errors of 0 are none.
    for (errors, reason) in
        [(independent(35, 0.01, 0.1), "not known at every position"), (independent(36, 0.0, 0.0), "stated as 0")]
    {
        let found = evaluated(axis(equal(36), &closed_form, Ok(errors)), "");
        assert!(found.values.iter().all(|value| value.no_uncertainty.as_ref().unwrap().contains(reason)));
    }
}

#[test]
fn what_is_not_observable_has_no_value() {
    let mut motion = axis(equal(36), &closed_form, Ok(independent(36, 0.01, 0.1)));
    motion.motion[4][0] = f64::NAN;
    motion.motion.iter_mut().for_each(|at| at[2] = f64::NAN);
    let errors = motion.errors.as_mut().unwrap();
    errors.own.iter_mut().for_each(|own| own[2] = [f64::NAN; 5]);
    let found = evaluated(motion, "directions_deg = [45]\nfaces = [{ radius_mm = 20, angle_deg = 0 }]");
    let symbols: Vec<&str> = found.values.iter().map(|value| value.symbol.as_str()).collect();
    let across = ["synchronous-radial-y", "synchronous-radial-y-rms"];
    let tilt = ["tilt-x", "tilt-x-rms", "tilt-y", "tilt-y-rms", "tilt-at-45deg", "tilt-at-45deg-rms"];
    let tilt = tilt.map(|id| format!("residual-synchronous-{id}"));
    let expected: Vec<&str> =
        across.into_iter().chain(tilt.iter().map(String::as_str)).chain(["fundamental-tilt"]).collect();
    assert_eq!(symbols, expected);
    assert!(found.values.iter().all(|value| value.uncertainty.is_some()));
    for said in [
        "no value of axial, face-at-20mm-0deg: not observable",
        "no value of radial-x: not observable at 1 of 36 positions",
    ] {
        assert!(found.remarks.iter().any(|remark| remark.contains(said)), "{:?}", found.remarks);
    }
}

/// Waves of x and y, and of the tilts, with amplitudes that fall with the order; z of one wave.
fn random_motion(seed: u64, highest: i32) -> impl Fn(f64) -> [f64; 5] {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let waves: Vec<[f64; 5]> = (2..=highest).map(|_| std::array::from_fn(|_| TAU * random.random::<f64>())).collect();
    move |angle| {
        let mut sum = [0.0, 0.0, 0.7 * angle.cos(), 0.0, 0.0];
        for (order, phases) in (2..).map(f64::from).zip(&waves) {
            for (row, phase) in phases.iter().enumerate() {
                sum[row] += if row < 3 { 1.0 } else { 10.0 } * order.powf(-1.5) * (order * angle + phase).sin();
            }
        }
        sum
    }
}

/// How errors are made, and what is stated of them.
#[derive(Debug, Clone, Copy)]
enum Told {
    /// Their standard deviations, exactly.
    Exactly,
    /// From so many degrees of freedom.
    From(f64),
    /// With two changes of the whole motion beside.
    WithCommon,
}

/// Of each value the trials of which an interval covers the true value.
fn held(count: usize, std_um: f64, told: Told, trials: u64) -> Vec<(String, usize)> {
    let text = "values = ['error-motion']\ncentres = ['LSC', 'MZC']";
    let mut held: Vec<(String, usize)> = Vec::new();
    for trial in 0..trials {
        let truth = random_motion(trial, 4);
        let exact = evaluated(axis(equal(count), &truth, Err("the truth".into())), text);
        let mut random = ChaCha8Rng::seed_from_u64(1_000_000 + trial);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let mut errors = independent(count, std_um, 10.0 * std_um);
        let mut measured = axis(equal(count), &truth, Err(String::new()));
        for at in &mut measured.motion {
            for (row, value) in at.iter_mut().enumerate() {
                *value += if row < 3 { std_um } else { 10.0 * std_um } * normal();
            }
        }
        match told {
            Told::Exactly => {}
            Told::From(freedom) => {
                let squares: f64 = ChiSquared::new(freedom).unwrap().sample(&mut random);
                errors = independent(count, 1.0, 10.0);
                errors
                    .own
                    .iter_mut()
                    .flatten()
                    .flatten()
                    .for_each(|entry| *entry *= std_um.powi(2) * squares / freedom);
                errors.freedom = freedom;
            }
            Told::WithCommon => {
                for order in [2.0, 3.0] {
                    let change: Vec<[f64; 5]> = equal(count)
                        .iter()
                        .map(|angle| {
                            [1.0, -1.0, 0.5, 10.0, 5.0]
                                .map(|size| 0.7 * std_um * size * (order * angle.to_radians()).cos())
                        })
                        .collect();
                    let factor = normal();
                    for (at, change) in measured.motion.iter_mut().zip(&change) {
                        at.iter_mut().zip(change).for_each(|(value, change)| *value += factor * change);
                    }
                    errors.common.push(change);
                }
            }
        }
        measured.of = format!("trial {trial}");
        measured.errors = Ok(errors);
        let found = evaluated(measured, text);
        for (value, truth) in found.values.iter().zip(&exact.values) {
            let key = format!("{} {}", value.symbol, value.reference.as_deref().unwrap());
            assert_eq!(key, format!("{} {}", truth.symbol, truth.reference.as_deref().unwrap()));
            let place = held.iter().position(|known| known.0 == key).unwrap_or_else(|| {
                held.push((key, 0));
                held.len() - 1
            });
            let [low, high] = value.uncertainty.as_ref().unwrap().interval_95;
            held[place].1 += usize::from(low <= truth.value && truth.value <= high);
        }
    }
    held
}

#[test]
fn intervals_cover_the_true_value() {
    for (count, std_um, told) in [
        (36, 0.02, Told::Exactly),
        (36, 0.3, Told::Exactly),
        (36, 1.0, Told::Exactly),
        (12, 0.1, Told::Exactly),
        (12, 0.5, Told::Exactly),
        (36, 0.1, Told::From(6.0)),
        (36, 0.1, Told::WithCommon),
    ] {
        let trials = trials(200);
        let all = held(count, std_um, told, trials as u64);
        println!("{count} positions, {std_um} µm, {told:?}: {all:?}");
        for (name, held) in all {
            // 90 % of 200; 95 % are 190 ± 3. About MZC, with errors from six degrees of freedom, 178 to 181 are held, 89 to 90 %.
            let (least, chance) =
                if matches!(told, Told::From(_)) && name.ends_with("MZC") { (174, 0.89) } else { (180, 0.95) };
            let least = fewest(trials, [least, 200], chance);
            assert!(held >= least, "{count} positions, {std_um} µm, {told:?}, {name}: {held} of {trials}");
        }
    }
}
