//! Motion with the spindle still: values computed by hand, simulated vibration, and what cannot be evaluated.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::f64::consts::TAU;

use runout_core::consistency::Check;
use runout_machine_tests::StructuralMotionConfig;

use crate::support::{Chance, Held, Rows, separated, value};

fn config(window_s: f64) -> StructuralMotionConfig {
    StructuralMotionConfig { window_s }
}

/// A hum of 50 Hz whose amplitude beats, and noise with a memory of some milliseconds.
fn vibration(chance: &mut Chance, seconds: usize, rate: usize) -> Rows {
    let mut rows = Rows::new("", &["time_s", "x_um"]);
    let mut slow = 0.0;
    let beat = TAU * chance.normal();
    for sample in 0..seconds * rate {
        let time = sample as f64 / rate as f64;
        slow = 0.9 * slow + 0.03 * chance.normal();
        let hum = 0.1 * (1.0 + 0.3 * (TAU * 7.3 * time + beat).sin()) * (TAU * 50.0 * time).sin();
        rows.push("", &[time, hum + slow]);
    }
    rows
}

#[test]
fn a_window_has_its_peak_to_valley() {
    let mut rows = Rows::new("", &["time_s", "x_um", "z_um"]);
    // 1, 2, … 6 µm in six windows of 40 readings.
    for sample in 0..240 {
        let amplitude = 0.5 * f64::from(sample / 40 + 1);
        let wave = if sample % 2 == 0 { amplitude } else { -amplitude };
        rows.push("", &[f64::from(sample) / 40.0, wave + 12.0, 0.0]);
    }
    let found = separated(config(1.0), &rows).unwrap();
    let motion = value(&found, "structural-motion", "X");
    assert!((motion.value - 3.5).abs() < 1e-12, "{motion:?}");
    // 1 to 6: a standard deviation of √3.5, and 2.571 of Student's distribution.
    let expected = (3.5_f64 / 6.0).sqrt();
    assert!((motion.std().unwrap() - expected).abs() < 1e-12);
    assert!((motion.interval_95().unwrap()[1] - 3.5 - 2.571 * expected).abs() < 1e-3);
    assert!((value(&found, "structural-motion-max", "X").value - 6.0).abs() < 1e-12);
    let changes = |check: &Check| check.refutes() && check.finding.starts_with("X: the last of the windows differs");
    assert!(found.checks.iter().any(changes), "{:?}", found.checks);
    assert!(
        found.remarks.iter().any(|remark| remark.starts_with("Z: all windows have the same")),
        "{:?}",
        found.remarks
    );
    assert!(value(&found, "structural-motion", "Z").uncertainty.is_none());
}

#[test]
fn intervals_cover_the_mean_of_many_windows() {
    let truth = {
        let found = separated(config(0.5), &vibration(&mut Chance::new(77), 400, 1000)).unwrap();
        value(&found, "structural-motion", "X").value
    };
    for seconds in [3, 10] {
        let mut held = Held::default();
        let mut chance = Chance::new(seconds as u64);
        for _ in 0..150 {
            let found = separated(config(0.5), &vibration(&mut chance, seconds, 1000)).unwrap();
            held.take("X", value(&found, "structural-motion", "X"), truth);
        }
        let [all, _] = held.shares(&format!("{seconds} s of vibration, {truth:.3} µm"));
        assert!(all >= 0.93, "{all}");
    }
}

#[test]
fn what_cannot_be_evaluated_is_refused() {
    let refused = |rows: &Rows, window_s: f64| separated(config(window_s), rows).unwrap_err().to_string();
    let usual = vibration(&mut Chance::new(1), 2, 1000);
    assert!(refused(&usual, 0.01).contains("expected at least 20 readings in 0.01 s, found 10"));
    let mut bare = usual.clone();
    bare.names[1] = "u_um";
    assert!(refused(&bare, 0.5).contains("there is none of x_um"));
    assert!(refused(&Rows::new("", &["time_s", "x_um"]), 1.0).contains("found 0"));
    let found = separated(config(0.5), &usual).unwrap();
    assert!(found.remarks.iter().any(|remark| remark.starts_with("X: 4 windows show no uncertainty")));
    assert!(value(&found, "structural-motion", "X").uncertainty.is_none());
}
