//! Values of data that are computed by hand.

#![allow(clippy::unwrap_used, reason = "tests")]

use runout_core::{
    Result,
    consistency::Check,
    pipeline::{Context, StageConfig},
    points::{Column, Points},
    stage::{Outcome, Separator},
};
use runout_machine_tests::{CircularConfig, PositioningConfig};

fn outcome<C: StageConfig<Stage = Separator>>(config: C, columns: &[(&str, Vec<f64>)]) -> Result<Outcome> {
    let context = Context { folder: std::path::Path::new("."), rig: None };
    let Separator::Points(separator) = config.check(&context).unwrap() else { panic!("it takes points") };
    let columns = columns.iter().map(|(name, values)| Column { name: (*name).into(), values: values.clone() });
    separator.separate(&Points { columns: columns.collect(), ..Points::default() })
}

fn value(outcome: &Outcome, symbol: &str) -> f64 {
    outcome.values.iter().find(|value| value.symbol == symbol).unwrap().value
}

fn positioning() -> PositioningConfig {
    PositioningConfig { axis: "X".into(), rotary: false, scale_std_ppm: 0.0 }
}

/// Two targets, two runs from each side. Means + 1, 4 and − 0, 6; standard deviations √2 of {0, 2}, {3, 5}, {−1, 1} and {5, 7}.
#[test]
fn positioning_is_that_of_the_formulas() {
    let columns = [
        ("target_mm", vec![0.0, 100.0, 100.0, 0.0, 0.0, 100.0, 100.0, 0.0]),
        ("deviation_um", vec![0.0, 3.0, 5.0, -1.0, 2.0, 5.0, 7.0, 1.0]),
    ];
    let found = outcome(positioning(), &columns).unwrap();
    let s = 2.0_f64.sqrt();
    let expected = [
        ("B", 2.0),
        ("B_mean", 0.5),
        ("E", 6.0),
        ("E+", 3.0),
        ("E-", 6.0),
        ("M", 4.5),
        ("R+", 4.0 * s),
        ("R", 4.0 * s + 2.0),
        ("A+", 3.0 + 4.0 * s),
        ("A", 6.0 + 4.0 * s),
    ];
    for (symbol, expected) in expected {
        assert!((value(&found, symbol) - expected).abs() < 1e-12, "{symbol}: {} {expected}", value(&found, symbol));
    }
    assert!(found.remarks.iter().any(|remark| remark.starts_with("2 runs")), "{:?}", found.remarks);
    // The other direction of the file's own deviations is another machine: reversed signs leave ranges, and turn nothing else.
    let mirrored: Vec<f64> = columns[1].1.iter().map(|value| -value).collect();
    let mirrored = outcome(positioning(), &[columns[0].clone(), ("deviation_um", mirrored)]).unwrap();
    assert!((value(&mirrored, "A") - value(&found, "A")).abs() < 1e-12);
}

#[test]
fn a_drift_of_the_runs_is_said() {
    let mut columns = [("target_mm", Vec::new()), ("deviation_um", Vec::new())];
    for run in 0..5 {
        for step in 0..11 {
            columns[0].1.push(f64::from(step));
            columns[1].1.push(f64::from(run) + 0.1 * f64::from((run * 7 + step * 5) % 4));
        }
    }
    let found = outcome(positioning(), &columns).unwrap();
    assert!(
        found.remarks.iter().any(|remark| remark.starts_with("the runs drift: the last one lies +")),
        "{:?}",
        found.remarks
    );
    assert!(found.remarks.iter().any(|remark| remark.contains("one side")), "{:?}", found.remarks);
}

#[test]
fn what_cannot_be_evaluated_is_refused() {
    let refused = |columns: &[(&str, Vec<f64>)]| outcome(positioning(), columns).unwrap_err().to_string();
    let one = refused(&[("target_mm", vec![5.0; 4]), ("deviation_um", vec![0.0; 4])]);
    assert!(one.contains("at least 2 target positions"), "{one}");
    let once = refused(&[("target_mm", vec![0.0, 1.0, 2.0]), ("deviation_um", vec![0.0; 3])]);
    assert!(once.contains("at least 2 approaches of target 0 in direction +1"), "{once}");
    let side = [("target_mm", vec![0.0, 1.0]), ("deviation_um", vec![0.0; 2]), ("direction", vec![1.0, 2.0])];
    assert!(refused(&side).contains("row 2: expected a direction of 1 or -1"), "{}", refused(&side));
}

/// Rows in the order of the path say the sides; rows that were sorted do not.
#[test]
fn sides_follow_from_the_order_of_the_targets_where_they_can() {
    let sides = |targets: &[f64], runs: usize| {
        let targets = targets.repeat(runs);
        let deviations = (0..targets.len()).map(|row| (row * 7 % 5) as f64).collect();
        let found = outcome(positioning(), &[("target_mm", targets), ("deviation_um", deviations)])?;
        let has = |symbol: &str| found.values.iter().any(|value| value.symbol == symbol);
        Ok::<[bool; 2], runout_core::Error>([has("A+"), has("A-")])
    };
    // Up, passed at the end, down, passed at the beginning; up only; up and down without the last target twice.
    assert_eq!(sides(&[0.0, 1.0, 2.0, 2.0, 1.0, 0.0], 3).unwrap(), [true, true]);
    assert_eq!(sides(&[0.0, 1.0, 2.0], 3).unwrap(), [true, false]);
    let turning = sides(&[0.0, 1.0, 2.0, 1.0], 3).unwrap_err().to_string();
    assert!(turning.contains("at least 2 approaches of target 0 in direction +1, found 1"), "{turning}");
    // Sorted by side, target and run; by target and side; by run and target.
    for (sorted, runs) in [
        (&[0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0][..], 2),
        (&[0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], 1),
        (&[0.0, 0.0, 1.0, 1.0, 2.0, 2.0], 3),
        (&[0.0, 1.0, 1.0, 2.0, 2.0, 3.0], 2),
    ] {
        let said = sides(sorted, runs).unwrap_err().to_string();
        assert!(said.contains("follows itself where the path does not turn"), "{sorted:?}: {said}");
    }
}

/// An ellipse of ±3 µm, 2 µm too large, whose clockwise path is 1 µm larger still; recorded 40 µm off centre.
#[test]
fn a_circle_has_the_values_of_its_geometry() {
    let mut columns = [("angle_deg", Vec::new()), ("deviation_um", Vec::new())];
    for (side, larger) in [(1.0, 2.0), (1.0, 2.0), (-1.0, 3.0), (-1.0, 3.0)] {
        for step in 0..=900 {
            let angle = side * f64::from(step) * 0.4_f64;
            let (sin, cos) = angle.to_radians().sin_cos();
            columns[0].1.push(angle);
            // Of a circle off centre, by its own geometry.
            let (radius, x, y) = (150e3 + larger + 3.0 * (2.0 * angle.to_radians()).cos(), 40.0, -10.0);
            let along = x * cos + y * sin;
            let across = y * cos - x * sin;
            columns[1].1.push(along + (radius * radius - across * across).sqrt() - 150e3);
        }
    }
    let config = CircularConfig { plane: "XY".into(), radius_mm: 150.0, radius_std_um: 0.0 };
    let found = outcome(config, &columns).unwrap();
    let expected = [("G+", 6.0), ("G-", 6.0), ("G_b", 7.0), ("H", 1.0), ("D", 2.5), ("F_max", 6.0), ("F_min", -1.0)];
    for (symbol, expected) in expected {
        // Radii are along the recorded angle, not that about the other centre: 40 µm of 150 mm turn them by 55″, half a per mille of the ellipse.
        assert!((value(&found, symbol) - expected).abs() < 0.01, "{symbol}: {} {expected}", value(&found, symbol));
    }
}

/// Identical turns, however many and however they end, are one turn: a peak at 0° stays whole.
#[test]
fn turns_are_parted_where_they_end() {
    let deviation = |angle: f64| {
        let from_zero = (angle + 180.0).rem_euclid(360.0) - 180.0;
        3.0 * (2.0 * angle.to_radians()).sin() + 4.0 * (-from_zero * from_zero / 2.0).exp()
    };
    let recorded = |turns: i32, wrapped: bool, end: i32, first: f64| {
        let mut columns = [("angle_deg", Vec::new()), ("deviation_um", Vec::new())];
        for side in [first, -first] {
            for step in 0..turns * 360 + end {
                let angle = side * f64::from(step);
                columns[0].1.push(if wrapped { angle.rem_euclid(360.0) } else { angle });
                columns[1].1.push(deviation(angle) + 0.001 * f64::from(step / 360));
            }
        }
        let config = CircularConfig { plane: "XY".into(), radius_mm: 100.0, radius_std_um: 0.0 };
        outcome(config, &columns).unwrap()
    };
    let one = recorded(1, false, 0, 1.0);
    for turns in 2..6 {
        for (wrapped, end, first) in [(false, 0, 1.0), (true, 0, -1.0), (true, 1, 1.0), (false, 1, -1.0)] {
            let found = recorded(turns, wrapped, end, first);
            for symbol in ["G+", "G-", "G_b", "H"] {
                let off = (value(&found, symbol) - value(&one, symbol)).abs();
                assert!(off < 1e-3, "{turns} turns, {wrapped} {end} {first}: {symbol} {off}");
            }
        }
    }
}

/// The scale of the instrument is one unknown number: an axis without errors may have all of it.
#[test]
fn an_unknown_scale_is_in_the_interval() {
    let mut columns = [("target_mm", Vec::new()), ("deviation_um", Vec::new())];
    for run in 0..5 {
        for target in [(0..11).collect::<Vec<i32>>(), (0..11).rev().collect()].concat() {
            columns[0].1.push(100.0 * f64::from(target));
            columns[1].1.push(0.01 * f64::from((run * 13 + target * 7) % 5));
        }
    }
    let found = outcome(PositioningConfig { scale_std_ppm: 1.0, ..positioning() }, &columns).unwrap();
    for symbol in ["A", "E", "M"] {
        let [low, high] = found.values.iter().find(|value| value.symbol == symbol).unwrap().interval_95().unwrap();
        // Of a normal number of 1 µm at the far end, 5 % are above 1.96 µm by their absolute value.
        assert!(low < value(&found, symbol) + 0.1 && (1.5..3.0).contains(&high), "{symbol}: {low} to {high}");
    }
    let copies: Vec<f64> = columns[1].1[..22].iter().copied().cycle().take(110).collect();
    let copied = outcome(positioning(), &[columns[0].clone(), ("deviation_um", copies)]).unwrap();
    assert!(copied.values.iter().all(|value| value.uncertainty.is_none()));
    assert!(copied.remarks.iter().any(|remark| remark.contains("the runs are identical")), "{:?}", copied.remarks);
    let mut odd = columns.clone();
    odd[1].1[37] += 1000.0;
    let odd = outcome(positioning(), &odd).unwrap();
    let named =
        |check: &Check| check.refutes() && check.finding.contains("of target") && check.finding.contains("is off by");
    assert!(odd.checks.iter().any(named), "{:?}", odd.checks);
}
