//! Weights from the scatter over the turns: matrices, since asynchronous motion is common to channels.

use runout_core::{
    Complex64,
    numerics::least_squares::{cholesky, invert_lower},
    profile::{self, SMOOTHING},
};

use super::{algebra::Blocks, readings::Readings};

/// With fewer independent samples a channel than this, correlations are shrunk towards none.
const SAMPLES_A_CHANNEL: f64 = 10.0;

/// Replaces each order's covariance by the mean over its neighbours.
pub fn smooth(readings: &mut Readings) {
    let sensors = readings.count / readings.turns.len().max(1);
    for matrices in [&mut readings.covariance, &mut readings.scatter].into_iter().flatten().flatten() {
        profile::smooth(matrices, sensors * sensors);
    }
}

/// W with Wᴴ·W = Σ⁻¹ for one order's scatter Σ: with independent turns it makes errors uncorrelated and of size 1.
///
/// `None` where there is no scatter to weigh by (one turn, or turns that are all alike).
#[must_use]
pub fn whitening(readings: &Readings, order: usize) -> Option<Blocks> {
    let setups = readings.scatter.as_ref()?;
    let sensors = readings.count / setups.len();
    let size = sensors * sensors;
    let mut weights = Vec::with_capacity(size * setups.len());
    for (setup, matrices) in setups.iter().enumerate() {
        let mut matrix = matrices[order * size..(order + 1) * size].to_vec();
        regularise(&mut matrix, sensors, readings.turns[setup], if order == 1 { 1 } else { 2 * SMOOTHING + 1 });
        weights.extend(invert_lower(sensors, &cholesky(sensors, &matrix)?));
    }
    Some(Blocks::new(sensors, weights))
}

fn regularise(matrix: &mut [Complex64], sensors: usize, turns: usize, window: usize) {
    let samples = (turns.saturating_sub(1) * window) as f64;
    let shrink = (1.0 - samples / (SAMPLES_A_CHANNEL * sensors as f64)).clamp(0.0, 1.0);
    let mean_variance =
        (0..sensors).map(|channel| matrix[channel * sensors + channel].re).sum::<f64>() / sensors as f64;
    for row in 0..sensors {
        for col in 0..sensors {
            let entry = &mut matrix[row * sensors + col];
            if row == col {
                // 1e-6 of the variance: far below any estimate's own error, enough to keep the factor real.
                *entry += 1e-6 * mean_variance;
            } else {
                *entry *= 1.0 - shrink;
            }
        }
    }
}
