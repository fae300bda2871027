//! Band-limited interpolation between samples: the weights that meet sines best.
//!
//! For each place between two samples, the weights of the samples around are those with the least squared error over all
//! sines below half of the recording's Nyquist frequency ([`PASS_BAND`]). (Laakso, Välimäki, Karjalainen, Laine, IEEE Signal
//! Process. Mag. 13(1), 1996: least squared integral error.) Low frequencies count for more, as form and motion are
//! large at low orders and fade towards high ones: [`ERRORS`] says what is met. Above the pass band the interpolation
//! weakens, halfway between two samples to nothing at Nyquist ([`Kernel::passed`]). Between two samples each weight is a parabola in each of
//! [`STRETCHES`] stretches, interpolated at the zeros of a Chebyshev polynomial; at these, the weights are scaled to the sum 1.
//!
//! Positions about one sample apart, as those of a turn on as many angles as it has samples, share a stretch with their
//! neighbours: [`TOGETHER`] of them are worked on side by side.

#![allow(clippy::inline_always, reason = "see runout_core::numerics::lanes")]

use runout_core::{
    Complex64,
    numerics::{
        lanes::{Arithmetic, FusedWork, load},
        least_squares::PivotedQr,
    },
};

/// Samples on either side of a position that its value is made of.
pub(super) const REACH: usize = 7;
const TAPS: usize = 2 * REACH;
/// Share of the Nyquist frequency up to which sines count.
pub(super) const PASS_BAND: f64 = 0.5;
/// Largest error of a sine, as a share of its amplitude, below shares of the Nyquist frequency.
#[cfg(test)]
const ERRORS: [(f64, f64); 4] = [(0.02, 1e-8), (0.125, 1e-7), (0.25, 5e-7), (PASS_BAND, 3e-5)];
/// Largest error of a sine, as a share of its amplitude, at the orders that tests evaluate.
#[cfg(test)]
pub(super) const ERROR: f64 = 1e-7;
/// A frequency counts by (its share of Nyquist + `LEVEL`)^−`FALL`.
const LEVEL: f64 = 0.1;
const FALL: i32 = 4;
/// Sines that the weights are made to meet: the error over the pass band swings less than `REACH` times.
const SINES: usize = 32;
/// In a stretch, a parabola errs by (π·share of Nyquist/(2·STRETCHES))³/(3!·2²) of a sine: 8e-8 at the end of the pass
/// band, 1e-9 at an eighth of Nyquist.
pub(super) const STRETCHES: usize = 64;
/// How far a parabola serves, in halves of its stretch: its error grows as Chebyshev's polynomial T₃, to 26 times as much.
const SERVES: f64 = 2.0;
/// Nearer to a sample than this, a position is as good as on it.
const ON_SAMPLE: f64 = 1e-9;

/// The weights of the samples −REACH+1 to REACH in a stretch, `[tap][power]`: polynomials in −1 to 1 across it.
type Stretch = [[f64; 3]; TAPS];

/// The table of weights.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Kernel {
    stretches: Vec<Stretch>,
}

/// A position's place in the table.
struct Place<'a> {
    stretch: &'a Stretch,
    /// The middle of the stretch, in samples.
    middle: f64,
}

impl Kernel {
    pub(super) fn new() -> Self {
        let nearest = Nearest::new();
        Self { stretches: (0..STRETCHES).map(|index| parabolas(&nearest, index)).collect() }
    }

    /// What a position that is `fraction` behind a sample passes of a sine of so many rad a sample: amplitude and phase.
    pub(super) fn passed(&self, fraction: f64, omega: f64) -> Complex64 {
        let place = self.place(fraction);
        let across = place.across(fraction);
        let taps = place.stretch.iter().enumerate();
        taps.map(|(tap, [c0, c1, c2])| {
            let behind = tap as f64 - (REACH - 1) as f64 - fraction;
            Complex64::cis(omega * behind) * ((c2 * across + c1) * across + c0)
        })
        .sum()
    }

    /// The stretch of a position that is `fraction` (0 to 1) behind a sample.
    #[inline(always)]
    fn place(&self, fraction: f64) -> Place<'_> {
        let index = ((fraction * STRETCHES as f64) as i64 as usize).min(STRETCHES - 1);
        Place { stretch: &self.stretches[index], middle: (index as f64 + 0.5) / STRETCHES as f64 }
    }
}

impl Place<'_> {
    /// What the polynomials take.
    #[inline(always)]
    fn across(&self, fraction: f64) -> f64 {
        (fraction - self.middle) * (2 * STRETCHES) as f64
    }
}

/// The weights' coefficients in one stretch.
fn parabolas(nearest: &Nearest, index: usize) -> Stretch {
    // Chebyshev's coefficients from the values at the zeros of the polynomial of degree 3.
    let mut chebyshev = [[0.0; 3]; TAPS];
    for node in 0..3 {
        let angle = (f64::from(node) + 0.5) * std::f64::consts::FRAC_PI_3;
        let weights = nearest.weights((index as f64 + 0.5 * (1.0 + angle.cos())) / STRETCHES as f64);
        let sum: f64 = weights.iter().sum();
        for (coefficients, weight) in chebyshev.iter_mut().zip(weights) {
            for (degree, coefficient) in coefficients.iter_mut().enumerate() {
                let share = if degree == 0 { 1.0 } else { 2.0 } / 3.0 * (degree as f64 * angle).cos();
                *coefficient += share * weight / sum;
            }
        }
    }
    chebyshev.map(|[a0, a1, a2]| [a0 - a2, a1, 2.0 * a2])
}

/// The weights that meet the cosines and sines of the pass band best, about sample 0.
struct Nearest {
    /// From how the cosines and sines go at a position to the weights, `[tap][cosines, sines]`.
    operator: Vec<Complex64>,
}

impl Nearest {
    fn new() -> Self {
        let mut matrix = Vec::with_capacity(2 * SINES * TAPS);
        for of in [f64::cos, f64::sin] {
            for (omega, counts) in pass_band() {
                matrix.extend(
                    (0..TAPS).map(|tap| Complex64::from(counts * of(omega * (tap as f64 - (REACH - 1) as f64)))),
                );
            }
        }
        // Neighbouring weights nearly make up for each other; none is left out.
        Self { operator: PivotedQr::new(2 * SINES, TAPS, &matrix, 0.0).operator() }
    }

    /// For a position that is `fraction` behind sample 0.
    fn weights(&self, fraction: f64) -> [f64; TAPS] {
        let wanted = |of: fn(f64) -> f64| pass_band().map(move |(omega, counts)| counts * of(omega * fraction));
        let wanted: Vec<f64> = wanted(f64::cos).chain(wanted(f64::sin)).collect();
        let mut weights = [0.0; TAPS];
        for (weight, row) in weights.iter_mut().zip(self.operator.chunks_exact(wanted.len())) {
            *weight = row.iter().zip(&wanted).map(|(entry, wanted)| entry.re * wanted).sum();
        }
        weights
    }
}

/// Frequencies of the pass band, in rad a sample, with what each counts.
fn pass_band() -> impl Iterator<Item = (f64, f64)> {
    (0..SINES).map(|index| {
        let share = PASS_BAND * (index as f64 + 0.5) / SINES as f64;
        (std::f64::consts::PI * share, (share + LEVEL).powi(-FALL))
    })
}

/// The sample that a position of at least 0 is as good as on.
#[inline(always)]
pub(super) fn on_sample(position: f64) -> Option<usize> {
    // Not `round`: without a processor's own instruction for it, that is a call.
    let below = position as usize;
    let fraction = position - below as f64;
    if fraction < ON_SAMPLE { Some(below) } else { (fraction > 1.0 - ON_SAMPLE).then_some(below + 1) }
}

/// Positions that are worked on side by side.
const TOGETHER: usize = 8;
/// Samples that these see.
const SEEN: usize = TAPS + TOGETHER - 1;
/// Channels that are worked on side by side, at most: their sums fill the registers.
const CHANNELS: usize = 4;

/// Interpolates all channels at many positions.
pub(super) struct Interpolation<'a> {
    pub kernel: &'a Kernel,
    /// Samples, `[channel][sample]`.
    pub samples: &'a [&'a [f64]],
    /// At least REACH samples lie on either side of each.
    pub positions: &'a [f64],
    /// That all positions are on samples.
    pub exact: bool,
    /// `[channel][position]`.
    pub values: &'a mut [f64],
}

impl FusedWork for Interpolation<'_> {
    #[inline(always)]
    fn call<A: Arithmetic>(mut self) {
        if self.exact {
            return self.take();
        }
        for first in (0..self.samples.len()).step_by(CHANNELS) {
            match self.samples.len() - first {
                1 => self.channels::<A, 1>(first),
                2 => self.channels::<A, 2>(first),
                3 => self.channels::<A, 3>(first),
                _ => self.channels::<A, CHANNELS>(first),
            }
        }
    }
}

impl Interpolation<'_> {
    /// Takes the samples as they are.
    fn take(&mut self) {
        for (samples, values) in self.samples.iter().zip(self.values.chunks_exact_mut(self.positions.len())) {
            for (value, position) in values.iter_mut().zip(self.positions) {
                *value = samples[(position + 0.5) as usize];
            }
        }
    }

    /// Some channels from `first`.
    #[inline(always)]
    fn channels<A: Arithmetic, const C: usize>(&mut self, first: usize) {
        let samples: [&[f64]; C] = std::array::from_fn(|channel| self.samples[first + channel]);
        let count = self.positions.len();
        let values = &mut self.values[first * count..(first + C) * count];
        let mut done = 0;
        for positions in self.positions.chunks(TOGETHER) {
            let together = positions.try_into().ok();
            if let Some(found) = together.and_then(|positions| several::<A, C>(self.kernel, samples, positions)) {
                for (values, found) in values.chunks_exact_mut(count).zip(found) {
                    values[done..done + TOGETHER].copy_from_slice(&found);
                }
            } else {
                for (index, position) in positions.iter().enumerate() {
                    let found = single::<A, C>(self.kernel, samples, *position);
                    for (values, found) in values.chunks_exact_mut(count).zip(found) {
                        values[done + index] = found;
                    }
                }
            }
            done += positions.len();
        }
    }
}

/// The values at positions that are about one sample apart, `[channel][position]`; `None` where they are not.
#[inline(always)]
fn several<A: Arithmetic, const C: usize>(
    kernel: &Kernel,
    samples: [&[f64]; C],
    positions: &[f64; TOGETHER],
) -> Option<[[f64; TOGETHER]; C]> {
    let below = positions[0].floor();
    // Behind one sample after the other: a little less than 0 or more than 1 of a sample serves as well.
    let fraction = |index: usize| positions[index] - below - index as f64;
    let place = kernel.place(fraction(TOGETHER / 2).clamp(0.0, 1.0));
    let across: [f64; TOGETHER] = std::array::from_fn(|index| place.across(fraction(index)));
    // No `all`: it would examine one after the other.
    if !across.iter().fold(true, |near, across| near & (across.abs() <= SERVES)) {
        return None;
    }
    let first = (below as i64 as usize + 1).checked_sub(REACH)?;
    let mut seen = [&[0.0; SEEN]; C];
    for (seen, samples) in seen.iter_mut().zip(samples) {
        *seen = samples.get(first..first + SEEN)?.try_into().ok()?;
    }
    let mut sums = [[0.0; TOGETHER]; C];
    for (tap, [c0, c1, c2]) in place.stretch.iter().enumerate() {
        let mut weights = [*c2; TOGETHER];
        for coefficient in [c1, c0] {
            for (weight, across) in weights.iter_mut().zip(across) {
                *weight = A::mul_add(*weight, across, *coefficient);
            }
        }
        for (sums, seen) in sums.iter_mut().zip(seen) {
            let seen: [f64; TOGETHER] = load(seen, tap);
            for lane in 0..TOGETHER {
                sums[lane] = A::mul_add(weights[lane], seen[lane], sums[lane]);
            }
        }
    }
    Some(sums)
}

/// The value at any position, of each channel.
#[inline(always)]
fn single<A: Arithmetic, const C: usize>(kernel: &Kernel, samples: [&[f64]; C], position: f64) -> [f64; C] {
    let below = position as usize;
    let fraction = position - below as f64;
    let place = kernel.place(fraction);
    let across = place.across(fraction);
    let seen = samples.map(|samples| &samples[below + 1 - REACH..][..TAPS]);
    let mut sums = [0.0; C];
    for (tap, [c0, c1, c2]) in place.stretch.iter().enumerate() {
        let weight = A::mul_add(A::mul_add(*c2, across, *c1), across, *c0);
        for (sum, seen) in sums.iter_mut().zip(seen) {
            *sum = A::mul_add(weight, seen[tap], *sum);
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use runout_core::numerics::lanes::{Fused, Separate, fused};

    use super::*;

    fn slices(samples: &[Vec<f64>]) -> Vec<&[f64]> {
        samples.iter().map(Vec::as_slice).collect()
    }

    fn interpolate<A: Arithmetic>(samples: &[Vec<f64>], positions: &[f64], exact: bool) -> Vec<f64> {
        let mut values = vec![0.0; samples.len() * positions.len()];
        let (kernel, samples) = (Kernel::new(), slices(samples));
        Interpolation { kernel: &kernel, samples: &samples, positions, exact, values: &mut values }.call::<A>();
        values
    }

    /// Every frequency of the pass band, every position between two samples; steps for which positions go together, and
    /// for which they do not.
    #[test]
    fn sines_in_the_pass_band_are_met_to_the_stated_error() {
        for step in [1.0 - 1.5e-3, 0.999_99, 1.001, 0.9, 5.0 / 3.0] {
            let positions: Vec<f64> = (0..3000).map(|index| 20.3 + step * f64::from(index)).collect();
            let mut worst = [0.0_f64; ERRORS.len()];
            for part in 0..=200 {
                let share = PASS_BAND * f64::from(part) / 200.0;
                let omega = std::f64::consts::PI * share;
                let wave = |position: f64| [(omega * position).cos(), (omega * position).sin()];
                let samples: [Vec<f64>; 2] =
                    std::array::from_fn(|half| (0..5100).map(|sample| wave(f64::from(sample))[half]).collect());
                let values = interpolate::<Separate>(&samples, &positions, false);
                for (index, position) in positions.iter().enumerate() {
                    let [cosine, sine] = wave(*position);
                    let error = (values[index] - cosine).hypot(values[positions.len() + index] - sine);
                    let below = worst.iter_mut().zip(ERRORS).filter(|(_, (end, _))| share <= *end);
                    below.for_each(|(worst, _)| *worst = worst.max(error));
                }
            }
            assert!(worst.iter().zip(ERRORS).all(|(worst, (_, stated))| *worst < stated), "{step}: {worst:?}");
        }
    }

    #[test]
    fn positions_on_samples_take_them_unchanged() {
        let samples: Vec<Vec<f64>> =
            (0..3).map(|channel| (0..40).map(|index| f64::from(index * 3 + channel).sqrt()).collect()).collect();
        let values = interpolate::<Separate>(&samples, &[10.0, 17.0 + 1e-10, 29.0 - 1e-10], true);
        for (values, samples) in values.chunks_exact(3).zip(&samples) {
            assert_eq!(values, [10, 17, 29].map(|sample| samples[sample]));
        }
    }

    #[test]
    fn any_number_of_channels_is_met_alike_however_it_rounds() {
        let channel = |channel: usize| (0..120).map(|index| ((index * 7 + channel * 31) % 23) as f64).collect();
        let samples: Vec<Vec<f64>> = (0..11).map(channel).collect();
        for step in [1.0001, 0.93] {
            let positions: Vec<f64> = (0..83).map(|index| 12.4 + step * f64::from(index)).collect();
            let alone: Vec<f64> = samples
                .iter()
                .flat_map(|channel| interpolate::<Separate>(std::slice::from_ref(channel), &positions, false))
                .collect();
            assert_eq!(interpolate::<Separate>(&samples, &positions, false), alone);
            let mut values = vec![0.0; alone.len()];
            let kernel = Kernel::new();
            let work = Interpolation {
                kernel: &kernel,
                samples: &slices(&samples),
                positions: &positions,
                exact: false,
                values: &mut values,
            };
            fused(work);
            let rounded_once = interpolate::<Fused>(&samples, &positions, false);
            for ((value, once), alone) in values.iter().zip(&rounded_once).zip(&alone) {
                // 1e-13: rounding of 14 products of values near 20.
                assert!((value - alone).abs() < 1e-13 && (once - alone).abs() < 1e-13, "{value} {once} {alone}");
            }
        }
    }
}
