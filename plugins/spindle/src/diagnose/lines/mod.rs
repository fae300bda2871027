//! Lines in the turns' spectrum: at orders that are not whole, alike in all setups.
//!
//! A harmonic of one turn sees a line at order ν as a phasor that turns by ν from turn to turn: its spectrum over the turns
//! has a peak there. A line is one that stands far out of all others, since asynchronous motion may be many tones. Its
//! amplitude in each channel is then fitted to all low harmonics of the turns to be fitted (`search.rs`), and it is taken out of the
//! turns, their averages and the noise of these: the residual of the turns is searched for further lines. It is a motion where all
//! channels fit one displacement and tilt (`source.rs`), and else electrical pick-up. A line of the machine keeps its order; one of the
//! mains keeps its frequency, also where captures differ in speed.

mod orbit;
mod search;
mod source;
mod spectrum;
mod turns;

use runout_core::{Complex64, neighbours::Neighbours, profile::Turns};

use super::drift::Part;
use crate::layout::Layout;
use orbit::Orbit;
pub(crate) use search::lines;
pub(super) use source::Source;
use turns::{Fixed, InCapture};

/// The lines of a station, the largest first.
#[derive(Debug, Default)]
pub(crate) struct Lines {
    pub(super) found: Vec<Line>,
    /// The turns of each setup without them; nothing where there are none.
    pub(super) without: Vec<Turns>,
}

/// A line, and what it does to the averages.
#[derive(Debug, Clone)]
pub(crate) struct Line {
    pub(super) order: f64,
    pub(super) order_std: f64,
    pub(super) orbit: Orbit,
    /// Turns a second, where known, and turns fitted in each capture.
    pub(super) turns_hz: Option<f64>,
    pub(super) turns: f64,
    pub(super) source: Source,
    /// Of each sensor.
    pub(super) sensors: Vec<OfSensor>,
    /// χ² of the turns fitted that its parameters explain of noise.
    expected: f64,
    fixed: Fixed,
    /// In each setup.
    captures: Vec<InCapture>,
}

/// A line in one sensor, all setups together.
#[derive(Debug, Clone, Default)]
pub(super) struct OfSensor {
    pub(super) amplitude_um: f64,
    pub(super) amplitude_std: f64,
    /// χ² of the turns fitted that it explains.
    pub(super) explained: f64,
    /// χ² of the turns that are held out, without it and with it.
    pub(super) held_out: [f64; 2],
}

impl Line {
    /// The first of the sensors that it is of, or the axis, and χ² of the turns fitted that it explains there, beyond what its
    /// parameters would of noise.
    pub(crate) fn row(&self) -> (Option<usize>, f64) {
        let expected = self.expected / self.sensors.len().max(1) as f64;
        let beyond = self.of().map(|sensor| self.sensors[sensor].explained - expected).sum::<f64>();
        (self.target(), beyond.max(0.0))
    }

    /// χ² of the turns that are held out, without it and with it.
    pub(crate) fn held_out(&self) -> [f64; 2] {
        [0, 1].map(|with| self.of().map(|sensor| self.sensors[sensor].held_out[with]).sum())
    }

    /// The first of the sensors that it is of; nothing where it is of the axis.
    fn target(&self) -> Option<usize> {
        match &self.source {
            Source::Motion { .. } => None,
            Source::Sensors { channels, .. } => channels.first().copied(),
        }
    }

    /// Squares of its amplitudes, summed over the sensors.
    fn power(&self) -> f64 {
        self.sensors.iter().map(|sensor| sensor.amplitude_um.powi(2)).sum()
    }

    /// The sensors that have it.
    fn of(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.sensors.len()).filter(|sensor| match &self.source {
            Source::Motion { .. } => true,
            Source::Sensors { channels, .. } => channels.contains(sensor),
        })
    }

    /// Its mean over some turns, `[order][reading]` to an order.
    pub(crate) fn leak(&self, part: Part, max_order: usize) -> Vec<Complex64> {
        let of_order = |order: usize| {
            let setups = self.captures.iter();
            setups.flat_map(move |one| (0..self.sensors.len()).map(move |sensor| one.leak(part, order, sensor)))
        };
        (0..=max_order).flat_map(of_order).collect()
    }

    /// Takes a leak out of the readings of the sensors that have the line.
    pub(crate) fn take_out(&self, leak: &[Complex64], layout: &Layout, mean: &mut [Complex64]) {
        let count = layout.readings.len();
        for (index, reading) in layout.readings.iter().enumerate() {
            if self.of().any(|sensor| sensor == reading.sensor) {
                let values = mean.iter_mut().skip(index).step_by(count);
                values.zip(leak.iter().skip(index).step_by(count)).for_each(|(mean, leak)| *mean -= leak);
            }
        }
    }

    /// Takes it out of what stands beside whole orders in some turns of a setup; `channel` is the place of a sensor among its channels.
    pub(crate) fn take_out_of(
        &self,
        neighbours: &mut Neighbours,
        part: Part,
        setup: usize,
        channel: impl Fn(usize) -> Option<usize>,
    ) {
        for (sensor, channel) in self.of().filter_map(|sensor| Some((sensor, channel(sensor)?))) {
            self.captures[setup].take_out_of(neighbours, part, sensor, channel);
        }
    }

    /// What it adds to the scatter of the mean over some turns of a setup in a sensor, by order from 0.
    pub(crate) fn scatter(&self, part: Part, setup: usize, sensor: usize, orders: usize) -> Vec<f64> {
        if self.of().any(|one| one == sensor) { self.captures[setup].scatter(part, orders, sensor) } else { Vec::new() }
    }

    /// Root mean square amplitude in some sensors, in µm, and its standard uncertainty.
    pub(super) fn of_sensors(&self, sensors: &[usize]) -> [f64; 2] {
        let count = sensors.len().max(1) as f64;
        let each = || sensors.iter().filter_map(|sensor| self.sensors.get(*sensor));
        let amplitude_um = (each().map(|one| one.amplitude_um.powi(2)).sum::<f64>() / count).sqrt();
        let std = each().map(|one| one.amplitude_um * one.amplitude_std).map(|product| product * product).sum::<f64>();
        [amplitude_um, std.sqrt() / (count * amplitude_um)]
    }
}
