//! Band-limited interpolation between samples: a sinc under a Kaiser window.
//!
//! The window's width puts the first zero of its spectrum half of Nyquist away: a signal below half of the recording's
//! Nyquist frequency ([`PASS_BAND`]) is interpolated to 1e-7 of its amplitude, wherever the position; above,
//! the interpolation weakens, to one half at Nyquist. (Kaiser, Schafer, IEEE Trans. ASSP 28(1), 1980: β from the
//! transition's width.) Weights are tabulated at [`PHASES`] positions between two samples, each set scaled to the sum 1,
//! and interpolated by cubics between them.

use runout_core::numerics::lanes::{LaneWork, load};

/// Samples on either side of a position that its value is made of.
pub(super) const REACH: usize = 11;
const TAPS: usize = 2 * REACH;
/// Share of the Nyquist frequency up to which the stated error holds.
pub(super) const PASS_BAND: f64 = 0.5;
/// Largest error of a sine in the pass band, as a share of its amplitude.
#[cfg(test)]
pub(super) const ERROR: f64 = 1e-7;
/// Shape of the window: √((π·REACH/2)² − π²) would put the zero exactly there.
const BETA: f64 = 16.99;
/// Between them, a cubic errs by 3/128·π⁴/5·PHASES⁻⁴ < 2e-9.
const PHASES: usize = 128;
/// Nearer to a sample than this, a position is the sample's, which then passes unchanged.
const ON_SAMPLE: f64 = 1e-9;

/// The table of weights.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Kernel {
    /// Weights of the samples −REACH+1 to REACH for the phases −1 to PHASES+1.
    rows: Vec<[f64; TAPS]>,
}

impl Kernel {
    pub(super) fn new() -> Self {
        let row = |index: usize| {
            let phase = (index as f64 - 1.0) / PHASES as f64;
            let raw: [f64; TAPS] = std::array::from_fn(|tap| weight(phase - (tap as f64 - (REACH - 1) as f64)));
            let sum: f64 = raw.iter().sum();
            raw.map(|weight| weight / sum)
        };
        Self { rows: (0..PHASES + 3).map(row).collect() }
    }

    /// Weights for a position `fraction` (0 to 1) behind the sample REACH−1.
    fn weights(&self, fraction: f64) -> [f64; TAPS] {
        let phase = fraction * PHASES as f64;
        let row = (phase as usize).min(PHASES - 1);
        let t = phase - row as f64;
        // Lagrange's cubic through −1, 0, 1, 2.
        let (before, after, behind) = (t + 1.0, t - 1.0, t - 2.0);
        let share = [
            -t * after * behind / 6.0,
            0.5 * before * after * behind,
            -0.5 * before * t * behind,
            before * t * after / 6.0,
        ];
        let mut weights = [0.0; TAPS];
        if let Some([a, b, c, d]) = self.rows.get(row..row + 4).and_then(|rows| rows.first_chunk::<4>()) {
            for tap in 0..TAPS {
                weights[tap] = (share[0] * a[tap] + share[1] * b[tap]) + (share[2] * c[tap] + share[3] * d[tap]);
            }
        }
        weights
    }
}

fn weight(distance: f64) -> f64 {
    let inside = 1.0 - (distance / REACH as f64).powi(2);
    if inside < 0.0 {
        return 0.0;
    }
    let angle = std::f64::consts::PI * distance;
    let sinc = if angle == 0.0 { 1.0 } else { angle.sin() / angle };
    sinc * bessel_i0(BETA * inside.sqrt()) / bessel_i0(BETA)
}

/// Modified Bessel function of the first kind and order 0: Σ ((x/2)ᵏ/k!)² (Abramowitz, Stegun 9.6.12).
fn bessel_i0(x: f64) -> f64 {
    let (mut sum, mut term, mut k) = (1.0, 1.0, 1.0);
    while term > f64::EPSILON * sum {
        term *= (0.5 * x / k).powi(2);
        sum += term;
        k += 1.0;
    }
    sum
}

/// The sample that a position of at least 0 is as good as on.
pub(super) fn on_sample(position: f64) -> Option<usize> {
    // Not `round`: without a processor's own instruction for it, that is a call.
    let below = position as usize;
    let fraction = position - below as f64;
    if fraction < ON_SAMPLE { Some(below) } else { (fraction > 1.0 - ON_SAMPLE).then_some(below + 1) }
}

/// Interpolates all channels at many positions.
pub(super) struct Interpolation<'a> {
    pub kernel: &'a Kernel,
    /// `[frame][channel]`.
    pub frames: &'a [f64],
    pub channels: usize,
    /// In frames; at least REACH frames lie on either side of each.
    pub positions: &'a [f64],
    /// `[channel][position]`.
    pub values: &'a mut [f64],
}

impl LaneWork for Interpolation<'_> {
    fn lanes<const C: usize>(&mut self, offset: usize) {
        let (channels, count) = (self.channels, self.positions.len());
        for (at, position) in self.positions.iter().enumerate() {
            let mut sum = [0.0; C];
            if let Some(sample) = on_sample(*position) {
                sum = load(&self.frames[sample * channels..], offset);
            } else {
                let below = *position as usize;
                let weights = self.kernel.weights(position - below as f64);
                let first = below + 1 - REACH;
                let window = &self.frames[first * channels..(first + TAPS) * channels];
                for (frame, weight) in window.chunks_exact(channels).zip(weights) {
                    let value: [f64; C] = load(frame, offset);
                    for lane in 0..C {
                        sum[lane] += weight * value[lane];
                    }
                }
            }
            for (lane, sum) in sum.into_iter().enumerate() {
                self.values[(offset + lane) * count + at] = sum;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use runout_core::{Complex64, numerics::lanes::in_lanes};

    use super::*;

    /// Every frequency of the pass band, every position between two samples.
    #[test]
    fn sines_in_the_pass_band_are_met_to_the_stated_error() {
        let kernel = Kernel::new();
        let mut worst = 0.0_f64;
        for step in 0..=100 {
            let omega = std::f64::consts::PI * PASS_BAND * f64::from(step) / 100.0;
            for part in 0..997 {
                let fraction = f64::from(part) / 997.0;
                let found: Complex64 = kernel
                    .weights(fraction)
                    .iter()
                    .enumerate()
                    .map(|(tap, weight)| weight * Complex64::cis(omega * (tap as f64 - (REACH - 1) as f64)))
                    .sum();
                worst = worst.max((found - Complex64::cis(omega * fraction)).norm());
            }
        }
        assert!(worst < ERROR, "{worst:e}");
    }

    #[test]
    fn positions_on_samples_take_them_unchanged_in_any_number_of_channels() {
        let kernel = Kernel::new();
        for channels in [1, 3, 8, 11] {
            let frames: Vec<f64> = (0..40 * channels).map(|index| (index as f64).sqrt()).collect();
            let positions = [10.0, 17.0 + 1e-10, 29.0 - 1e-10];
            let mut values = vec![0.0; 3 * channels];
            let mut interpolation = Interpolation {
                kernel: &kernel,
                frames: &frames,
                channels,
                positions: &positions,
                values: &mut values,
            };
            in_lanes(channels, &mut interpolation);
            for channel in 0..channels {
                let expected = [10, 17, 29].map(|frame| frames[frame * channels + channel]);
                assert_eq!(values[channel * 3..(channel + 1) * 3], expected);
            }
        }
    }
}
