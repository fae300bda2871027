//! Band-limited interpolation between samples: a sinc under a Kaiser window.
//!
//! The window's width puts the first zero of its spectrum half of Nyquist away: a signal below half of the recording's
//! Nyquist frequency ([`PASS_BAND`]) is interpolated to 1e-7 of its amplitude, wherever the position; above,
//! the interpolation weakens, to one half at Nyquist. (Kaiser, Schafer, IEEE Trans. ASSP 28(1), 1980: β from the
//! transition's width.) Between two samples each weight is a cubic in each of [`PHASES`] stretches, interpolated at the
//! zeros of a Chebyshev polynomial; at these, the weights are scaled to the sum 1.

#![allow(clippy::inline_always, reason = "see LaneWork")]

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
/// In a stretch, a cubic errs by (π·PASS_BAND/PHASES)⁴/(4!·2⁷) < 2e-9 of a sine in the pass band.
const PHASES: usize = 32;
/// Nearer to a sample than this, a position is the sample's, which then passes unchanged.
const ON_SAMPLE: f64 = 1e-9;

/// The table of weights.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Kernel {
    /// `[stretch][power]`: weights of the samples −REACH+1 to REACH are polynomials in −1 to 1 across the stretch.
    stretches: Vec<[[f64; TAPS]; 4]>,
}

impl Kernel {
    pub(super) fn new() -> Self {
        Self { stretches: (0..PHASES).map(cubics).collect() }
    }

    /// Weights for a position `fraction` (0 to 1) behind the sample REACH−1.
    #[inline(always)]
    fn weights(&self, fraction: f64) -> [f64; TAPS] {
        if !(ON_SAMPLE..=1.0 - ON_SAMPLE).contains(&fraction) {
            let mut weights = [0.0; TAPS];
            weights[if fraction < 0.5 { REACH - 1 } else { REACH }] = 1.0;
            return weights;
        }
        let phase = fraction * PHASES as f64;
        let stretch = (phase as usize).min(PHASES - 1);
        let across = 2.0 * (phase - stretch as f64) - 1.0;
        let [c0, c1, c2, c3] = &self.stretches[stretch];
        let mut weights = [0.0; TAPS];
        for tap in 0..TAPS {
            weights[tap] = c0[tap] + across * (c1[tap] + across * (c2[tap] + across * c3[tap]));
        }
        weights
    }
}

/// The weights' coefficients in one stretch.
fn cubics(stretch: usize) -> [[f64; TAPS]; 4] {
    // Chebyshev's coefficients from the values at the zeros of the polynomial of degree 4.
    let mut chebyshev = [[0.0; TAPS]; 4];
    for node in 0..4 {
        let angle = (f64::from(node) + 0.5) * std::f64::consts::FRAC_PI_4;
        let phase = (stretch as f64 + 0.5 * (1.0 + angle.cos())) / PHASES as f64;
        let raw: [f64; TAPS] = std::array::from_fn(|tap| weight(phase - (tap as f64 - (REACH - 1) as f64)));
        let sum: f64 = raw.iter().sum();
        for (degree, coefficients) in chebyshev.iter_mut().enumerate() {
            let share = if degree == 0 { 0.25 } else { 0.5 } * (degree as f64 * angle).cos();
            for (coefficient, weight) in coefficients.iter_mut().zip(raw) {
                *coefficient += share * weight / sum;
            }
        }
    }
    let mut powers = [[0.0; TAPS]; 4];
    for tap in 0..TAPS {
        let [a0, a1, a2, a3] = chebyshev.map(|coefficients| coefficients[tap]);
        for (power, value) in powers.iter_mut().zip([a0 - a2, a1 - 3.0 * a3, 2.0 * a2, 4.0 * a3]) {
            power[tap] = value;
        }
    }
    powers
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
#[inline(always)]
pub(super) fn on_sample(position: f64) -> Option<usize> {
    // Not `round`: without a processor's own instruction for it, that is a call.
    let below = position as usize;
    let fraction = position - below as f64;
    if fraction < ON_SAMPLE { Some(below) } else { (fraction > 1.0 - ON_SAMPLE).then_some(below + 1) }
}

/// Positions whose weights are laid down before they are used, which then come from memory one by one.
const TOGETHER: usize = 16;

/// Interpolates all channels at many positions.
pub(super) struct Interpolation<'a> {
    pub kernel: &'a Kernel,
    /// `[frame][channel]`.
    pub frames: &'a [f64],
    pub channels: usize,
    /// In frames; at least REACH frames lie on either side of each.
    pub positions: &'a [f64],
    /// That all positions are on samples.
    pub exact: bool,
    /// `[channel][position]`.
    pub values: &'a mut [f64],
}

impl LaneWork for Interpolation<'_> {
    #[inline(always)]
    fn lanes<const C: usize>(&mut self, offset: usize) {
        // A distance between frames that the compiler knows makes straight code of the sum.
        match (self.exact, self.channels == C) {
            (true, _) => self.take::<C>(offset),
            (false, true) => self.interpolate::<C>(C, 0),
            (false, false) => self.interpolate::<C>(self.channels, offset),
        }
    }
}

impl Interpolation<'_> {
    /// Takes the samples as they are.
    #[inline(always)]
    fn take<const C: usize>(&mut self, offset: usize) {
        let count = self.positions.len();
        for (at, position) in self.positions.iter().enumerate() {
            let frame: [f64; C] = load(&self.frames[(position + 0.5) as usize * self.channels..], offset);
            for lane in 0..C {
                self.values[(offset + lane) * count + at] = frame[lane];
            }
        }
    }

    #[inline(always)]
    fn interpolate<const C: usize>(&mut self, channels: usize, offset: usize) {
        let count = self.positions.len();
        let mut taps = [(0, [0.0; TAPS]); TOGETHER];
        for (group, positions) in self.positions.chunks(TOGETHER).enumerate() {
            for (taps, position) in taps.iter_mut().zip(positions) {
                let below = *position as usize;
                *taps = (below + 1 - REACH, self.kernel.weights(position - below as f64));
            }
            for (index, (first, weights)) in taps[..positions.len()].iter().enumerate() {
                let window = &self.frames[first * channels..(first + TAPS) * channels];
                // Two sums, which need not wait for each other.
                let mut sums = [[0.0; C]; 2];
                for (pair, weights) in window.chunks_exact(2 * channels).zip(weights.chunks_exact(2)) {
                    for half in 0..2 {
                        let frame: [f64; C] = load(&pair[half * channels..(half + 1) * channels], offset);
                        for lane in 0..C {
                            sums[half][lane] += weights[half] * frame[lane];
                        }
                    }
                }
                for lane in 0..C {
                    self.values[(offset + lane) * count + group * TOGETHER + index] = sums[0][lane] + sums[1][lane];
                }
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
                exact: false,
                values: &mut values,
            };
            in_lanes(channels, &mut interpolation);
            let interpolated = interpolation.values.to_vec();
            interpolation.exact = true;
            in_lanes(channels, &mut interpolation);
            assert_eq!(values, interpolated);
            for channel in 0..channels {
                let expected = [10, 17, 29].map(|frame| frames[frame * channels + channel]);
                assert_eq!(values[channel * 3..(channel + 1) * 3], expected);
            }
        }
    }
}
