//! Crests and valleys cut flat: as low as the highest of a profile may be, as high as the lowest.
//!
//! What noise does to an extreme depends on how flat the profile is there: it raises the end of a range by four of its standard deviations where the profile
//! is level over a wide arc, a sharp crest by nothing. Harmonics show a level arc as a few waves and noise, which have crests of their own. So the
//! profile is cut at a height above which the part of each arc may be noise: a matched filter for that part finds it by no more than [`HIDDEN`]
//! standard deviations.

use runout_numerics::{
    Complex64,
    fourier::{Fourier, quick_length},
};

use crate::spectrum::Noise;

/// Standard deviations up to which the part of one arc may be noise: some arc of a hundred has as much.
const HIDDEN: f64 = 3.0;
/// No crest is cut by more than so many standard deviations of the noise at an angle.
const DEEPEST: f64 = 6.0;
/// Halvings of that until the height of a cut is known, to a twentieth of the standard deviation.
const HALVINGS: usize = 7;
/// Angles to a wave of the highest order.
const ANGLES_A_WAVE: usize = 4;

/// The harmonics of a profile cut at both ends; orders without noise stay as they are.
pub(crate) fn cut(harmonics: &[Complex64], noise: Noise<'_>) -> Vec<Complex64> {
    let power: f64 = (0..harmonics.len()).filter_map(|order| noise.of(order)).sum();
    let mut fourier = Fourier::new(quick_length(ANGLES_A_WAVE * harmonics.len()));
    let mut profile = fourier.synthesise(harmonics.iter().copied()).to_vec();
    let arcs = Arcs::new(harmonics.len(), noise, profile.len());
    for _ in 0..2 {
        let top = profile.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (mut level, mut deepest) = (top, DEEPEST * (0.5 * power).sqrt());
        for _ in 0..HALVINGS {
            deepest *= 0.5;
            if arcs.may_be_noise(&profile, level - deepest) {
                level -= deepest;
            }
        }
        // The valleys are the crests of the profile upside down.
        profile.iter_mut().for_each(|height| *height = -height.min(level));
    }
    let mut cut = vec![Complex64::ZERO; harmonics.len()];
    fourier.analyse_in_place(&mut profile, &mut cut);
    let each = cut.into_iter().zip(harmonics).enumerate();
    each.map(|(order, (cut, whole))| if noise.of(order).is_some() { cut } else { *whole }).collect()
}

/// How much of an arc above a level stands out of noise.
struct Arcs {
    /// Mean of 1/variance of the orders up to each, from the first one with noise.
    weights: Vec<f64>,
    first: usize,
    angles: usize,
}

impl Arcs {
    fn new(orders: usize, noise: Noise<'_>, angles: usize) -> Self {
        let (mut sum, mut count) = (0.0, 0.0);
        let up_to = |order: usize| {
            if let Some(variance) = noise.of(order) {
                (sum, count) = (sum + variance.recip(), count + 1.0);
            }
            if count > 0.0 { sum / count } else { 0.0 }
        };
        let first = (0..orders).find(|order| noise.of(*order).is_some()).unwrap_or(0);
        Self { weights: (0..orders).map(up_to).collect(), first, angles }
    }

    /// Whether no part of the profile above a level, between two places below it, is more than noise may be. For a part f the matched filter finds
    /// 2 Σ|fₙ|²/sₙ, where Σ|fₙ|² = ∫f²/π is twice its mean square; a part of an angle a has next to nothing above the order 2π/a.
    fn may_be_noise(&self, profile: &[f64], level: f64) -> bool {
        let Some(below) = profile.iter().position(|height| *height <= level) else { return false };
        let highest = self.weights.len() - 1;
        let from_below = profile[below..].iter().chain(&profile[..=below]);
        let (mut squares, mut wide) = (0.0, 0_usize);
        for height in from_below {
            if *height > level {
                (squares, wide) = (squares + (height - level).powi(2), wide + 1);
                continue;
            }
            if let Some(reach) = self.angles.checked_div(wide) {
                let found = 4.0 * squares / self.angles as f64 * self.weights[reach.clamp(self.first, highest)];
                if found > HIDDEN * HIDDEN {
                    return false;
                }
                (squares, wide) = (0.0, 0);
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::spectrum::VarianceFrom;

    const ORDERS: usize = 120;

    /// Range of a profile on angles after it is cut, in standard deviations of the noise less than before.
    fn lowered(profile: impl Fn(f64) -> f64, std: f64) -> f64 {
        let variance: Vec<f64> =
            (0..ORDERS).map(|order| if order < 2 { 0.0 } else { 2.0 * std * std / 118.0 }).collect();
        let squares = vec![0; ORDERS];
        let noise = Noise { variance: &variance, squares: &squares, variance_from: VarianceFrom::default(), lowest: 2 };
        let mut fourier = Fourier::new(1024);
        let mut harmonics = vec![Complex64::ZERO; ORDERS];
        fourier.analyse((0..1024).map(|angle| profile(TAU * f64::from(angle) / 1024.0)), &mut harmonics);
        let mut range = |harmonics: &[Complex64]| {
            let heights = fourier.synthesise(harmonics.iter().copied());
            let ends = heights.iter().fold([0.0_f64; 2], |[low, high], height| [low.min(*height), high.max(*height)]);
            ends[1] - ends[0]
        };
        (range(&harmonics) - range(&cut(&harmonics, noise))) / std
    }

    #[test]
    fn waves_of_noise_on_level_arcs_are_cut_and_sharp_crests_are_not() {
        let std = 0.1;
        // Two levels, with ripples of two standard deviations on them.
        let level = |angle: f64| (3.0 * angle).sin().signum() + 2.0 * std * (40.0 * angle).cos();
        let found = [
            lowered(level, std),
            lowered(|angle| (3.0 * angle).cos(), std),
            lowered(|angle| (-0.5 * ((angle - 1.0) / 0.05).powi(2)).exp(), std),
        ];
        assert!(found[0] > 4.0 && found[1] < 3.0 && found[2] < 3.0, "{found:?}");
    }

    #[test]
    fn without_noise_nothing_is_cut() {
        let noise = Noise { variance: &[], squares: &[], variance_from: VarianceFrom::default(), lowest: 2 };
        let harmonics = [Complex64::ZERO, Complex64::ONE, Complex64::I];
        assert_eq!(cut(&harmonics, noise), harmonics);
    }
}
