//! What the interpolation between samples passes of each order, and its undoing.
//!
//! Above [`PASS_BAND`](super::kernel::PASS_BAND) the kernel passes an order by a share that depends on where between two samples a position lies: of
//! a position that is the fraction f behind a sample, P(f) = Σ w_k(f) e^{iω(k − f)}. An average over turns has the mean of P over all of its
//! positions, which are known: its orders are divided by that.

use std::f64::consts::TAU;

use runout_core::{Complex64, profile::Split};

use super::kernel::{Kernel, STRETCHES};

/// Of orders of which less than this passes, an average holds nothing: dividing would make noise of them. Where positions lie anywhere between
/// samples, 48 % pass at Nyquist.
const LEAST_PASSED: f64 = 0.4;

/// Where between two samples the positions of all turns lie: their number in each stretch of the kernel, and the sum of their fractions.
pub(super) struct Fractions([(f64, f64); STRETCHES]);

impl Fractions {
    pub(super) const NONE: Self = Self([(0.0, 0.0); STRETCHES]);

    /// Takes the positions of a turn.
    pub(super) fn note(&mut self, positions: &[f64]) {
        for position in positions {
            let fraction = position - position.floor();
            let (count, sum) = &mut self.0[((fraction * STRETCHES as f64) as usize).min(STRETCHES - 1)];
            *count += 1.0;
            *sum += fraction;
        }
    }

    /// What passes of e^{−inΦ}, by order from 0, of turns of so many samples.
    pub(super) fn passed(&self, kernel: &Kernel, turn_samples: f64, orders: usize) -> Vec<Complex64> {
        let all: f64 = self.0.iter().map(|(count, _)| count).sum();
        let stretches = self.0.iter().filter(|(count, _)| *count > 0.0);
        let stretches: Vec<_> = stretches.map(|(count, sum)| (count / all, sum / count)).collect();
        let of_order = |order: usize| -> Complex64 {
            let omega = TAU * order as f64 / turn_samples;
            stretches.iter().map(|(share, fraction)| kernel.passed(*fraction, omega).conj() * *share).sum()
        };
        (0..orders).map(of_order).collect()
    }
}

/// Orders from 0 that an average holds, of which so much passes.
pub(super) fn held(passed: &[Complex64]) -> usize {
    passed.iter().position(|passed| passed.norm() < LEAST_PASSED).unwrap_or(passed.len())
}

/// Divides the parts of a split by what passes of each order.
pub(super) fn undo_split(split: &mut Split, passed: &[Complex64], channels: usize) {
    let parts = [&mut split.fit.neighbours, &mut split.held_out.neighbours, &mut split.neighbours];
    for coefficients in parts.into_iter().flatten().flat_map(|neighbours| &mut neighbours.coefficients) {
        harmonics(coefficients, passed, channels);
    }
    for part in [&mut split.fit, &mut split.held_out] {
        harmonics(&mut part.mean, passed, channels);
        for matrices in [&mut part.covariance, &mut part.scatter].into_iter().flatten() {
            squares(matrices, passed, channels);
        }
    }
    for turn in split.turns.harmonics.chunks_mut((split.turns.orders * channels).max(1)) {
        harmonics(turn, passed, channels);
    }
}

/// `[order][channel]`.
pub(super) fn harmonics(values: &mut [Complex64], passed: &[Complex64], channels: usize) {
    for (values, passed) in values.chunks_mut(channels.max(1)).zip(passed) {
        values.iter_mut().for_each(|value| *value /= passed);
    }
}

/// `[order][channel][channel]`.
pub(super) fn squares(values: &mut [Complex64], passed: &[Complex64], channels: usize) {
    for (values, passed) in values.chunks_mut((channels * channels).max(1)).zip(passed) {
        values.iter_mut().for_each(|value| *value /= passed.norm_sqr());
    }
}
