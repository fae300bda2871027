//! 60 touches in each of 10 setups. `separate` also fits with touches left out.
#![allow(clippy::unwrap_used, missing_docs, reason = "a benchmark")]

use divan::{Bencher, black_box};
use runout_core::{points::Points, stage::PointSeparator};
use runout_touch_probe::{
    SetupConfig, TouchProbe, TouchProbeConfig,
    simulate::{Placed, TouchProbeScenario},
};

fn campaign() -> (TouchProbe, Points) {
    let setups = (0..10).map(|index| Placed {
        id: format!("r{index}"),
        ring_deg: f64::from(37 * index),
        probe_deg: f64::from(61 * (index / 3)),
        ..Placed::default()
    });
    let scenario = TouchProbeScenario { repeats: 1, setups: setups.collect(), ..TouchProbeScenario::default() };
    let config = TouchProbeConfig {
        ring_radius_mm: scenario.ring_radius_mm,
        setups: (scenario.setups.iter())
            .map(|setup| SetupConfig { id: setup.id.clone(), ring_deg: setup.ring_deg, probe_deg: setup.probe_deg })
            .collect(),
        max_order: 15,
        ring_form_um: None,
        std_um: Some(0.9),
    };
    (config.separator().unwrap(), scenario.touched().points())
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
