//! Separation of one station: 4 sensors in two setups, orders to 1279.
#![allow(clippy::unwrap_used, missing_docs, reason = "a benchmark")]

use divan::{Bencher, black_box};
use runout_core::{
    Complex64,
    profile::{Profile, TurnCount},
    rig::{Rig, RigConfig, Rotation, SensorConfig, SetupConfig},
    stage::{Station, StationSeparator},
};
use runout_spindle::separators::{HarmonicLeastSquares, Weighting};

const SENSORS_DEG: [f64; 4] = [0.0, 90.0, 180.0, 228.75];
const PART_DEG: [f64; 2] = [0.0, 180.0];
const ORDERS: usize = 1280;
const TURNS: usize = 120;

fn rig() -> Rig {
    let sensor = |(index, angle_deg): (usize, &f64)| SensorConfig {
        id: format!("S{index}"),
        angle_deg: *angle_deg,
        z_mm: 0.0,
        section: "s".into(),
        sign: 1,
        ..SensorConfig::default()
    };
    let setup = |(index, part_deg): (usize, &f64)| SetupConfig {
        id: format!("{index}"),
        part_deg: *part_deg,
        ..SetupConfig::default()
    };
    let config = RigConfig {
        interruptions: Vec::new(),
        bearings: Vec::new(),
        part_radius_mm: 30.0,
        rotation: Rotation::Cw,
        sensors: SENSORS_DEG.iter().enumerate().map(sensor).collect(),
        setups: PART_DEG.iter().enumerate().map(setup).collect(),
    };
    config.check().unwrap()
}

/// Numbers about 0 from Knuth's multiplicative hash.
fn noise(index: usize) -> f64 {
    f64::from((index as u32).wrapping_mul(2_654_435_761)) / f64::from(u32::MAX) - 0.5
}

/// Readings that fall with the order, and covariances that are near to those of independent channels.
fn profile(setup: usize) -> Profile {
    let channels = SENSORS_DEG.len();
    let mean = |index: usize| {
        let order = index / channels;
        Complex64::new(noise(2 * index + setup), noise(2 * index + 1 + setup)) / (1 + order) as f64
    };
    let entry = |index: usize| {
        let (row, column) = (index / channels % channels, index % channels);
        Complex64::from(1e-6 * if row == column { 1.0 } else { 0.1 })
    };
    let matrices: Vec<Complex64> = (0..ORDERS * channels * channels).map(entry).collect();
    Profile {
        object: "bench".into(),
        setup,
        sensors: (0..channels).collect(),
        samples_per_rev: 2 * ORDERS,
        turn_angles: 2 * ORDERS,
        mean: (0..ORDERS * channels).map(mean).collect(),
        covariance: Some(matrices.clone()),
        scatter: Some(matrices),
        spread: None,
        turns: TurnCount { recorded: TURNS, used: TURNS, ..TurnCount::default() },
        speed_rpm: Some(600.0),
        responses: Vec::new(),
        warnings: Vec::new(),
        ..Profile::default()
    }
}

fn bench(bencher: Bencher, second_order: bool) {
    let separator = HarmonicLeastSquares::new(&rig(), second_order, Weighting::TurnCovariance);
    let station = Station { name: "s".into(), z_mm: 0.0, profiles: vec![profile(0), profile(1)] };
    bencher.bench_local(|| separator.separate(black_box(&station)).unwrap());
}

#[divan::bench]
fn linear(bencher: Bencher) {
    bench(bencher, false);
}

#[divan::bench]
fn second_order(bencher: Bencher) {
    bench(bencher, true);
}

fn main() {
    divan::main();
}
