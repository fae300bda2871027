//! One R-test of a paper's size: 91 commands, 4 balls, 3 repeats. `separate` also fits 40 times with commands left out.
#![allow(clippy::unwrap_used, missing_docs, reason = "a benchmark")]

use divan::{Bencher, black_box};
use runout_core::{points::Points, stage::PointSeparator};
use runout_rotary_axis::{RotaryAxis, RotaryAxisConfig, simulate::Scenario};

const BALLS: &str = "balls = [
    { id = 'P1', x_mm = 120, y_mm = 0, z_mm = 60 },
    { id = 'P2', x_mm = -50, y_mm = 95, z_mm = 110 },
    { id = 'P3', x_mm = -70, y_mm = -80, z_mm = 40 },
    { id = 'P4', x_mm = 20, y_mm = -110, z_mm = 150 },
]\n";

fn campaign() -> (RotaryAxis, Points) {
    let scenario: Scenario = toml::from_str(&format!(
        "{BALLS}noise_um = 2.3\nseed = 1\ncommands = {{ step_deg = 4, count = 91 }}\npasses = 3\nrandom_component = 3.0
        location = {{ EX0C = 23.7, EY0C = 3.1, EA0C = 41.0, EB0C = 34.6 }}"
    ))
    .unwrap();
    let config: RotaryAxisConfig = toml::from_str(&format!("{BALLS}std_um = 2.3")).unwrap();
    (config.separator().unwrap(), scenario.simulate().points())
}

#[divan::bench]
fn fit(bencher: Bencher) {
    let (separator, points) = campaign();
    bencher.bench_local(|| separator.fit_only(black_box(&points)).unwrap());
}

#[divan::bench]
fn separate(bencher: Bencher) {
    let (separator, points) = campaign();
    bencher.bench_local(|| separator.separate(black_box(&points)).unwrap());
}

fn main() {
    divan::main();
}
