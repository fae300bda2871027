//! Weights from the scatter over the turns: matrices, since asynchronous motion is common to channels.

#![allow(clippy::inline_always, reason = "see runout_core::numerics::lanes")]

use runout_core::{
    Complex64,
    numerics::{
        lanes::{Arithmetic, FusedWork, fused},
        side_by_side::{Complexes, TOGETHER, inverse_of_cholesky},
    },
    profile::{self, SMOOTHING},
};

use super::{
    algebra::Blocks,
    readings::Readings,
    side_by_side::{Orders, gather, lane},
};

/// With fewer independent samples a channel than this, correlations are shrunk towards none.
const SAMPLES_A_CHANNEL: f64 = 10.0;

/// Replaces each order's scatter by the mean over its neighbours, and its covariance by the mean over
/// [those beside it](profile::smooth_by_order).
pub(crate) fn smooth_by_order(readings: &mut Readings) {
    let sensors = readings.count / readings.turns.len().max(1);
    let both = [
        (&mut readings.scatter, profile::smooth as fn(&mut [Complex64], usize)),
        (&mut readings.covariance, profile::smooth_by_order),
    ];
    for (setups, smooth) in both {
        setups.iter_mut().flatten().for_each(|matrices| smooth(matrices, sensors * sensors));
    }
    // A tone is at one order only.
    readings.add_near_tones();
}

/// W with Wᴴ·W = Σ⁻¹ for the scatter Σ of each order from 1: with independent turns it makes errors uncorrelated and of
/// size 1.
///
/// `None` where there is no scatter to weigh by (one turn, or turns that are all alike).
#[must_use]
pub(crate) fn whitening(readings: &Readings) -> Option<Vec<Blocks>> {
    let setups = readings.scatter.as_ref()?;
    let sensors = readings.count / setups.len().max(1);
    let block = sensors * sensors;
    let mut matrix = vec![Complexes::ZERO; block];
    let mut inverses = vec![Complexes::ZERO; block * setups.len()];
    let mut weights = Vec::with_capacity(readings.max_order);
    for orders in Orders::up_to(readings.max_order) {
        let window = if orders.of(0) == 1 { 1 } else { 2 * SMOOTHING + 1 };
        for ((scatter, turns), inverse) in setups.iter().zip(&readings.turns).zip(inverses.chunks_exact_mut(block)) {
            let samples = (turns.saturating_sub(1) * window) as f64;
            let mut positive = false;
            fused(Whitening {
                sensors,
                scatter: orders.map(|order| &scatter[order * block..(order + 1) * block]),
                correlation: (samples / (SAMPLES_A_CHANNEL * sensors as f64)).clamp(0.0, 1.0),
                matrix: &mut matrix,
                inverse,
                positive: &mut positive,
            });
            if !positive {
                return None;
            }
        }
        weights.extend((0..orders.each().len()).map(|place| Blocks::new(sensors, lane(&inverses, place))));
    }
    Some(weights)
}

/// Eight orders of one setup on their way to weights.
struct Whitening<'a> {
    sensors: usize,
    scatter: [&'a [Complex64]; TOGETHER],
    /// Share of the correlations that is kept.
    correlation: f64,
    matrix: &'a mut [Complexes],
    /// Its upper triangle is 0.
    inverse: &'a mut [Complexes],
    positive: &'a mut bool,
}

impl FusedWork for Whitening<'_> {
    #[inline(always)]
    fn call<A: Arithmetic>(self) {
        let Self { sensors, scatter, correlation, matrix, inverse, positive } = self;
        gather(scatter, matrix);
        let mut variance = [0.0; TOGETHER];
        for entry in matrix.iter().step_by(sensors + 1) {
            for lane in 0..TOGETHER {
                variance[lane] += entry.re[lane] / sensors as f64;
            }
        }
        for (index, entry) in matrix.iter_mut().enumerate() {
            if index % (sensors + 1) == 0 {
                // 1e-6 of the variance: far below any estimate's own error, enough to keep the factor real.
                for lane in 0..TOGETHER {
                    entry.re[lane] += 1e-6 * variance[lane];
                }
            } else {
                *entry = entry.scaled([correlation; TOGETHER]);
            }
        }
        *positive = inverse_of_cholesky::<A>(sensors, matrix, inverse);
    }
}
