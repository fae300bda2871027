//! Whether an encoder's angle is in another unit than degrees.

use std::f64::consts::TAU;

use runout_core::{
    Complex64, Error, ErrorKind, Result,
    measurement::{Block, Capture},
};

use crate::low_pass::significant;

/// Units that angles are in, and how many of each make a revolution.
const OTHERS: [(&str, f64); 2] = [("radians", TAU), (TURNS, 1.0)];
const TURNS: &str = "turns";
/// Share of a reading's variance that has to repeat with each revolution in another unit. In degrees it is at order 57.3 or 360, where
/// no part has most of what a sensor reads.
const SHARE: f64 = 0.5;
/// Turns in degrees from which on order 57.3 and its neighbours differ.
const FEWEST_TURNS: f64 = 3.0;
/// Samples of a long recording that are looked at, which takes some milliseconds.
const MOST_SAMPLES: u64 = 1 << 18;

/// What of each reading repeats with each revolution, if the angle is in another unit.
pub(super) struct AngleUnit {
    channels: usize,
    /// Of so many samples, one is looked at.
    step: usize,
    samples: u64,
    range_rev: [f64; 2],
    /// Σ x and Σ x² of each channel, x from its first sample on.
    sums: Vec<[f64; 3]>,
    /// Σ e and, of each channel, Σ x e, of each unit.
    waves: [Vec<Complex64>; 2],
}

impl AngleUnit {
    pub(super) fn new(capture: &Capture) -> Self {
        let channels = capture.channels();
        let waves = std::array::from_fn(|_| vec![Complex64::ZERO; channels + 1]);
        let step = (capture.samples / MOST_SAMPLES) as usize + 1;
        Self { channels, step, samples: 0, range_rev: [f64::INFINITY, f64::NEG_INFINITY], sums: Vec::new(), waves }
    }

    pub(super) fn take(&mut self, block: &Block) {
        let samples = block.samples.chunks_exact(self.channels.max(1)).zip(&block.angle_rev);
        for (readings, angle_rev) in samples.step_by(self.step) {
            if !angle_rev.is_finite() || readings.iter().any(|reading| !reading.is_finite()) {
                continue;
            }
            if self.sums.is_empty() {
                self.sums = readings.iter().map(|first| [*first, 0.0, 0.0]).collect();
            }
            self.samples += 1;
            self.range_rev = [self.range_rev[0].min(*angle_rev), self.range_rev[1].max(*angle_rev)];
            for (waves, (_, revolution)) in self.waves.iter_mut().zip(OTHERS) {
                let wave = Complex64::cis(TAU * (360.0 * angle_rev / revolution).fract());
                waves[0] += wave;
                for ((sum, reading), [first, ..]) in waves[1..].iter_mut().zip(readings).zip(&self.sums) {
                    *sum += (reading - first) * wave;
                }
            }
            for ([first, sum, squares], reading) in self.sums.iter_mut().zip(readings) {
                *sum += reading - *first;
                *squares += (reading - *first).powi(2);
            }
        }
    }

    /// Warns of readings that repeat with each revolution in turns, or 360 times a turn.
    ///
    /// # Errors
    /// When most of a reading repeats with each revolution in radians: no part has that many lobes.
    pub(super) fn check(&self, object: &str) -> Result<Option<String>> {
        if self.range_rev[1] - self.range_rev[0] < FEWEST_TURNS {
            return Ok(None);
        }
        let Some((unit, per_revolution, share)) = self.repeats() else { return Ok(None) };
        let found = format!(
            "readings that repeat {} % of their variance every {} of the encoder's angle",
            significant(100.0 * share, 3),
            significant(per_revolution, 5)
        );
        if unit == TURNS {
            return Ok(Some(format!(
                "{object}: {found}: it is in turns, not in degrees (multiply it by 360), or the part has 360 lobes"
            )));
        }
        let problem = format!("expected the encoder's angle in degrees, found {found}: it is in {unit}");
        Err(Error::new("average", object, problem).of(ErrorKind::UnsuitableData).help("multiply the angle by 180/π"))
    }

    /// The unit, what makes a revolution, and the share of a reading that repeats with it.
    fn repeats(&self) -> Option<(&'static str, f64, f64)> {
        let samples = self.samples as f64;
        let of_unit = |(waves, (unit, per_revolution)): (&Vec<Complex64>, (&'static str, f64))| {
            let share = |([_, sum, squares], wave): (&[f64; 3], &Complex64)| {
                let variance = squares / samples - (sum / samples).powi(2);
                let amplitude = 2.0 * (wave - waves[0] * (sum / samples)).norm() / samples;
                if variance > 0.0 { 0.5 * amplitude.powi(2) / variance } else { 0.0 }
            };
            let share = self.sums.iter().zip(&waves[1..]).map(share).fold(0.0, f64::max);
            (share >= SHARE).then_some((unit, per_revolution, share.min(1.0)))
        };
        self.waves.iter().zip(OTHERS).find_map(of_unit)
    }
}
