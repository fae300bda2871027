//! Whether an encoder's angle is in another unit than degrees.

use std::f64::consts::TAU;

use runout_core::{
    Complex64, Error, ErrorKind, Result,
    measurement::{Block, Capture},
};

use crate::low_pass::significant;

/// A revolution in other units that angles come in.
const RADIANS: f64 = TAU;
const TURNS: f64 = 1.0;
/// Orders of a revolution that are evaluated: eccentricity and the form's lowest.
const ORDERS: usize = 6;
/// Share of a reading's variance that has to repeat with each revolution in another unit.
const SHARE: f64 = 0.5;
/// Turns in degrees from which on order 57.3 and its neighbours differ.
const FEWEST_TURNS: f64 = 3.0;
/// Samples of a long recording that are evaluated, which takes some milliseconds.
const MOST_SAMPLES: u64 = 1 << 16;

/// What of each reading repeats with each revolution, if the angle is in another unit.
pub(super) struct AngleUnit {
    channels: usize,
    /// Of so many samples, one is evaluated.
    step: usize,
    range_rev: [f64; 2],
    samples: f64,
    /// First reading of each channel, which the others are counted from.
    first: Vec<f64>,
    /// Σ x and Σ x² of each channel.
    sums: Vec<[f64; 2]>,
    /// Waves in radians and in turns.
    waves: [Waves; 2],
}

/// Σ e, and Σ x e of each channel, e = e^{inφ} and n from 1 to [`ORDERS`], for an angle φ in one unit.
struct Waves {
    revolution: f64,
    of_one: [Complex64; ORDERS],
    of_readings: Vec<[Complex64; ORDERS]>,
}

impl Waves {
    fn new(revolution: f64, channels: usize) -> Self {
        let none = [Complex64::ZERO; ORDERS];
        Self { revolution, of_one: none, of_readings: vec![none; channels] }
    }

    fn add(&mut self, angle_rev: f64, readings: impl Iterator<Item = f64>) {
        let first = Complex64::cis(TAU * (360.0 * angle_rev / self.revolution).fract());
        let mut all = [first; ORDERS];
        for order in 1..ORDERS {
            all[order] = all[order - 1] * first;
        }
        self.of_one.iter_mut().zip(all).for_each(|(sum, wave)| *sum += wave);
        for (sums, reading) in self.of_readings.iter_mut().zip(readings) {
            sums.iter_mut().zip(all).for_each(|(sum, wave)| *sum += wave * reading);
        }
    }

    /// The largest share of a reading's variance that repeats, of so many samples with these sums.
    fn share(&self, samples: f64, sums: &[[f64; 2]]) -> f64 {
        let of_channel = |(waves, [sum, squares]): (&[Complex64; ORDERS], &[f64; 2])| {
            let (mean, variance) = (sum / samples, squares / samples - (sum / samples).powi(2));
            let power = |(wave, one): (&Complex64, &Complex64)| 2.0 * ((wave - one * mean) / samples).norm_sqr();
            let powers: f64 = waves.iter().zip(&self.of_one).map(power).sum();
            if variance > 0.0 { powers / variance } else { 0.0 }
        };
        self.of_readings.iter().zip(sums).map(of_channel).fold(0.0, f64::max)
    }
}

impl AngleUnit {
    pub(super) fn new(capture: &Capture) -> Self {
        let channels = capture.channels();
        Self {
            channels,
            step: (capture.samples / MOST_SAMPLES) as usize + 1,
            range_rev: [f64::INFINITY, f64::NEG_INFINITY],
            samples: 0.0,
            first: Vec::new(),
            sums: vec![[0.0; 2]; channels],
            waves: [RADIANS, TURNS].map(|revolution| Waves::new(revolution, channels)),
        }
    }

    pub(super) fn take(&mut self, block: &Block) {
        let samples = block.samples.chunks_exact(self.channels.max(1)).zip(&block.angle_rev);
        for (readings, angle_rev) in samples.step_by(self.step) {
            if !angle_rev.is_finite() || readings.iter().any(|reading| !reading.is_finite()) {
                continue;
            }
            if self.first.is_empty() {
                self.first.extend_from_slice(readings);
            }
            let moved = readings.iter().zip(&self.first).map(|(reading, first)| reading - first);
            self.samples += 1.0;
            self.range_rev = [self.range_rev[0].min(*angle_rev), self.range_rev[1].max(*angle_rev)];
            self.waves.iter_mut().for_each(|waves| waves.add(*angle_rev, moved.clone()));
            for ([sum, squares], reading) in self.sums.iter_mut().zip(moved) {
                *sum += reading;
                *squares += reading * reading;
            }
        }
    }

    /// Warns of readings that repeat with each revolution in turns, or 360 times a turn.
    ///
    /// # Errors
    /// When most of a reading repeats with each revolution in radians: no part has 57.3 lobes.
    pub(super) fn check(&self, object: &str) -> Result<Option<String>> {
        if self.range_rev[1] - self.range_rev[0] < FEWEST_TURNS {
            return Ok(None);
        }
        let found = |share: f64, of_angle: &str| {
            let percent = significant(100.0 * share.min(1.0), 3);
            format!("readings that repeat {percent} % of their variance every {of_angle} of the encoder's angle")
        };
        let [radians, turns] = self.waves.each_ref().map(|waves| waves.share(self.samples, &self.sums));
        if radians >= SHARE {
            let problem =
                format!("expected the encoder's angle in degrees, found {}: it is in radians", found(radians, "2π"));
            let error = Error::new("average", object, problem).of(ErrorKind::UnsuitableData);
            return Err(error.help("multiply the angle by 180/π"));
        }
        let found = (turns >= SHARE).then(|| found(turns, "degree"));
        Ok(found
            .map(|found| format!("{object}: {found}: it is in turns (multiply it by 360), or the part has 360 lobes")))
    }
}
