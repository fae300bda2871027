//! Scenarios, and the truth of their probes by sums over a dense circle.

#![allow(clippy::unwrap_used, dead_code, reason = "tests")]

use std::f64::consts::TAU;

use runout_core::{
    stage::Outcome,
    summary::Value,
    table::{ArrayRef, RecordBatch},
};
use runout_touch_probe::{
    SetupConfig, TouchProbe, TouchProbeConfig,
    simulate::{Placed, Ring, TouchProbeScenario},
};

pub(crate) fn setups(angles: &[(f64, f64)]) -> Vec<Placed> {
    let one = |(index, (ring_deg, probe_deg)): (usize, &(f64, f64))| Placed {
        id: format!("r{index}"),
        ring_deg: *ring_deg,
        probe_deg: *probe_deg,
        centre_um: [9.0 * index as f64 - 7.0, 4.0 - 13.0 * index as f64],
    };
    angles.iter().enumerate().map(one).collect()
}

/// The probe of the paper's size: 0.9 µm, ring form of 1.2 µm rms.
pub(crate) fn scenario(seed: u64, setups: &[Placed]) -> TouchProbeScenario {
    TouchProbeScenario {
        seed,
        setups: setups.to_vec(),
        ring: Ring { random_rms_um: 1.2, ..Ring::default() },
        ..TouchProbeScenario::default()
    }
}

pub(crate) fn configuration(
    scenario: &TouchProbeScenario,
    max_order: usize,
    ring_form_um: Option<f64>,
) -> TouchProbeConfig {
    TouchProbeConfig {
        ring_radius_mm: scenario.ring_radius_mm,
        setups: (scenario.setups.iter())
            .map(|setup| SetupConfig { id: setup.id.clone(), ring_deg: setup.ring_deg, probe_deg: setup.probe_deg })
            .collect(),
        max_order,
        ring_form_um,
        std_um: None,
    }
}

pub(crate) fn config(scenario: &TouchProbeScenario, max_order: usize, ring_form_um: Option<f64>) -> TouchProbe {
    configuration(scenario, max_order, ring_form_um).separator().unwrap()
}

/// Pre-travel over the circle, in µm.
pub(crate) struct Truth {
    pub mean_um: f64,
    each: Vec<f64>,
}

const DENSE: usize = 720;

pub(crate) fn lobing(scenario: &TouchProbeScenario) -> Truth {
    let each: Vec<f64> = (0..DENSE).map(|index| scenario.pretravel_um(TAU * index as f64 / DENSE as f64)).collect();
    Truth { mean_um: each.iter().sum::<f64>() / DENSE as f64, each }
}

impl Truth {
    pub(crate) fn parts(&self, order: usize) -> [f64; 2] {
        let sum = |wave: fn(f64) -> f64| {
            let at = |index: usize| wave(TAU * (order * index) as f64 / DENSE as f64);
            2.0 / DENSE as f64 * self.each.iter().enumerate().map(|(index, value)| value * at(index)).sum::<f64>()
        };
        [sum(f64::cos), sum(f64::sin)]
    }

    pub(crate) fn amplitude(&self, order: usize) -> f64 {
        let [a, b] = self.parts(order);
        a.hypot(b)
    }

    /// Without mean and order 1.
    pub(crate) fn at(&self, angle: f64) -> f64 {
        let [a, b] = self.parts(1);
        let index = (angle / TAU * DENSE as f64).round() as usize % DENSE;
        self.each[index] - self.mean_um - a * angle.cos() - b * angle.sin()
    }

    pub(crate) fn range(&self) -> f64 {
        let all: Vec<f64> = (0..DENSE).map(|index| self.at(TAU * index as f64 / DENSE as f64)).collect();
        range(&all)
    }
}

pub(crate) fn range(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max) - values.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Radii in µm about the mean circle of evenly spread places, by Fourier sums.
pub(crate) fn about_circle(places: &[[f64; 2]]) -> Vec<f64> {
    let count = places.len() as f64;
    let radius: Vec<f64> = places.iter().map(|[x, y]| 1e3 * x.hypot(*y)).collect();
    let angle: Vec<f64> = places.iter().map(|[x, y]| y.atan2(*x)).collect();
    let sum =
        |wave: fn(f64) -> f64| radius.iter().zip(&angle).map(|(radius, angle)| radius * wave(*angle)).sum::<f64>();
    let [mean, a, b] = [sum(|_| 1.0) / count, 2.0 * sum(f64::cos) / count, 2.0 * sum(f64::sin) / count];
    radius.iter().zip(&angle).map(|(radius, angle)| radius - mean - a * angle.cos() - b * angle.sin()).collect()
}

pub(crate) fn table(outcome: &Outcome, name: &str) -> RecordBatch {
    outcome.tables.iter().find(|table| table.table == name).unwrap().rows.clone()
}

pub(crate) fn column(rows: &RecordBatch, name: &str) -> Vec<f64> {
    let column = rows.column_by_name(name).unwrap();
    let data = column.to_data();
    data.buffer::<f64>(0)[..column.len()].to_vec()
}

pub(crate) fn flags(column: &ArrayRef) -> Vec<bool> {
    let data = column.to_data();
    let bits = data.buffers()[0].as_slice();
    (0..column.len()).map(|index| bits[index / 8] >> (index % 8) & 1 == 1).collect()
}

pub(crate) fn value<'a>(outcome: &'a Outcome, symbol: &str) -> &'a Value {
    outcome.values.iter().find(|value| value.symbol == symbol).unwrap()
}
