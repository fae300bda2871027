//! Uncertainty of values that depend on a profile non-linearly, by Monte Carlo (GUM supplement 1, JCGM 101:2008).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::errors::{Errors, TURNS_OF_A_DRAW};
pub use runout_numerics::statistics::{NORMAL_95, student_95};
use runout_numerics::{Complex64, fourier::Fourier};

/// Draws for each value: the 95 % interval's ends are then known to about a tenth of a standard uncertainty.
pub const DRAWS: usize = 400;
/// The largest error of a few hundred drawn profiles is about so many standard deviations.
pub const LARGEST: f64 = 5.0;
/// Share of the draws below the interval, and above it.
const TAIL: f64 = 0.025;
/// Amplitude of noise that 5 % of all are above, in standard deviations of its real part as they are known from so many real
/// degrees of freedom: √(ν (20^{2/ν} − 1)), of Rayleigh's distribution √(2 ln 20) for 0, where they are taken as exact.
#[must_use]
pub fn noise_95(freedom: f64) -> f64 {
    let tail = 20.0_f64.ln();
    if freedom > 0.0 { (freedom * (2.0 * tail / freedom).exp_m1()).sqrt() } else { (2.0 * tail).sqrt() }
}

/// What is known of a value's error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Uncertainty {
    /// Standard uncertainty, in the value's unit.
    pub std: f64,
    /// Where the truth lies with 95 % probability. A peak-to-valley grows with noise; the interval takes that back, and so
    /// need not lie evenly about the value.
    pub interval_95: [f64; 2],
    /// Draws of the Monte Carlo; 0 where none was needed.
    pub draws: usize,
}

impl Uncertainty {
    /// Of an amplitude, from the standard uncertainty of its part along the phasor, known from so many real degrees of
    /// freedom (0 where it is taken as exact). An amplitude that noise alone exceeds in more than [5 % of all
    /// cases](noise_95) may be noise: its interval begins at 0.
    #[must_use]
    pub fn of_amplitude(value: f64, std: f64, freedom: usize) -> Self {
        let reach = student_95(freedom as f64) * std;
        let low = if value < noise_95(freedom as f64) * std { 0.0 } else { (value - reach).max(0.0) };
        Self { std, interval_95: [low, value + reach], draws: 0 }
    }

    /// The same where its draws come from so many transforms of several draws each: the interval is [wider](widening) about its middle.
    #[must_use]
    fn of_transforms(self, transforms: f64) -> Self {
        self.widened(widening(transforms))
    }

    /// The same with an interval so many times as wide about its middle.
    #[must_use]
    pub fn widened(mut self, factor: f64) -> Self {
        let [low, high] = self.interval_95;
        let (middle, half) = (0.5 * (low + high), 0.5 * factor * (high - low));
        let floor = if low >= 0.0 { 0.0 } else { f64::NEG_INFINITY };
        // An end at 0 stays there.
        self.interval_95 = [if low == 0.0 { low } else { (middle - half).max(floor) }, middle + half];
        self
    }

    /// The same of a value that is larger by so much; an interval from 0 on stays one.
    #[must_use]
    pub fn moved(mut self, by: f64) -> Self {
        let floor = if self.interval_95[0] >= 0.0 { 0.0 } else { f64::NEG_INFINITY };
        self.interval_95 = self.interval_95.map(|end| (end + by).max(floor));
        self
    }

    /// The same where the data do not decide between `value` and these: the largest distance from it is added to the standard
    /// uncertainty, and the interval reaches as far beyond each of them as beyond it.
    #[must_use]
    pub fn with_equivalents(mut self, value: f64, equivalents: &[f64]) -> Self {
        let distances = || equivalents.iter().map(|other| other - value).filter(|distance| distance.is_finite());
        let [low, high] = &mut self.interval_95;
        let floor = if *low >= 0.0 { 0.0 } else { f64::NEG_INFINITY };
        *low = (*low + distances().fold(0.0, f64::min)).max(floor);
        *high += distances().fold(0.0, f64::max);
        self.std = self.std.hypot(distances().map(f64::abs).fold(0.0, f64::max));
        self
    }
}

/// A harmonic stands out where noise has its power in one of 8000 cases, e⁻⁹.
const LINE: f64 = 9.0;

/// Whether a harmonic stands out from its noise of this variance; not where that is not known.
#[must_use]
pub fn stands_out(harmonic: Complex64, variance: f64) -> bool {
    variance > 0.0 && harmonic.norm_sqr() > LINE * variance
}

/// Values with their uncertainty: `draw` computes them once from what was found (given false) and then `draws` times from
/// what was drawn (given true), always the same ones in the same order. The interval is 2v − (the draws' 97.5 % point) to
/// 2v − (their 2.5 % point) for a value v: the error of v about the truth is that of a draw about v. It ends at 0 for a
/// value that no draw has below 0. A value that is not a number, or not in every draw, has no uncertainty. All draws together
/// are of so many independent `transforms`.
pub fn monte_carlo_of(
    draws: usize,
    transforms: usize,
    mut draw: impl FnMut(bool, &mut Vec<f64>),
) -> Vec<(f64, Option<Uncertainty>)> {
    let transforms = transforms.max(1) as f64;
    let mut found = Vec::new();
    draw(false, &mut found);
    let mut results: Vec<Vec<f64>> = found.iter().map(|_| Vec::with_capacity(draws)).collect();
    let mut row = Vec::with_capacity(found.len());
    for _ in 0..draws {
        row.clear();
        draw(true, &mut row);
        results.iter_mut().zip(&row).for_each(|(all, value)| all.push(*value));
    }
    let known =
        |value: f64, drawn: &[f64]| value.is_finite() && drawn.len() > 1 && drawn.iter().all(|draw| draw.is_finite());
    let pairs = found.into_iter().zip(results);
    let uncertainty =
        |value: f64, drawn: &mut [f64]| known(value, drawn).then(|| summed_up(drawn, value).of_transforms(transforms));
    pairs.map(|(value, mut drawn)| (value, uncertainty(value, &mut drawn))).collect()
}

/// The uncertainty of values of a profile on equal angles, from the variance of its harmonics by order from 0; those
/// below 2 are taken as exact. `None` where no variance is known.
#[must_use]
pub fn monte_carlo<const N: usize>(
    form_um: &[f64],
    variance: &[f64],
    seed: u64,
    values: impl Fn(&[f64]) -> [f64; N],
) -> Option<[Uncertainty; N]> {
    if form_um.len() < 2 {
        return None;
    }
    let (mut errors, mut fourier) = (Errors::new(variance, 2, seed)?, Fourier::new(form_um.len()));
    let mut drawn = form_um.to_vec();
    let found = monte_carlo_of(DRAWS, DRAWS.div_ceil(TURNS_OF_A_DRAW), |disturbed, found| {
        if disturbed {
            errors.draw(&mut fourier, form_um, &mut drawn);
        }
        found.extend(values(&drawn));
    });
    let all: Option<Vec<Uncertainty>> = found.into_iter().map(|(_, uncertainty)| uncertainty).collect();
    all?.try_into().ok()
}

/// How much wider intervals are whose draws come from so many transforms of several draws each, which give a standard deviation no better than
/// two real degrees of freedom a transform do.
fn widening(transforms: f64) -> f64 {
    student_95(2.0 * transforms) / NORMAL_95
}

/// Value at a share of sorted draws.
fn point(sorted: &[f64], share: f64) -> f64 {
    let position = share * (sorted.len().saturating_sub(1)) as f64;
    let below = position.floor() as usize;
    let at = |index: usize| sorted.get(index).or(sorted.last()).copied().unwrap_or(f64::NAN);
    at(below) + (at(below + 1) - at(below)) * position.fract()
}

fn summed_up(draws: &mut [f64], value: f64) -> Uncertainty {
    draws.sort_by(f64::total_cmp);
    let count = draws.len().max(1) as f64;
    let mean = draws.iter().sum::<f64>() / count;
    let squares: f64 = draws.iter().map(|draw| (draw - mean).powi(2)).sum();
    let floor = if draws.first().is_some_and(|lowest| *lowest >= 0.0) { 0.0 } else { f64::NEG_INFINITY };
    Uncertainty {
        std: (squares / (count - 1.0).max(1.0)).sqrt(),
        interval_95: [(2.0 * value - point(draws, 1.0 - TAIL)).max(floor), 2.0 * value - point(draws, TAIL)],
        draws: draws.len(),
    }
}

/// A seed that depends on names only, so that it is the same however the work is shared.
#[must_use]
pub fn seed(names: &[&str]) -> u64 {
    let mut hash = blake3::Hasher::new();
    for name in names {
        hash.update(name.as_bytes());
        hash.update(&[0]);
    }
    let bytes = hash.finalize();
    bytes.as_bytes()[..8].iter().fold(0, |seed, byte| (seed << 8) | u64::from(*byte))
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// A linear value, the profile at one angle, has the standard uncertainty √(½ Σ E|δₙ|²) and a symmetric interval.
    #[test]
    fn a_linear_value_has_its_closed_form() {
        let variance: Vec<f64> = (0..60).map(|order| 1e-4 / (1.0 + f64::from(order))).collect();
        let expected = (0.5 * variance.iter().skip(2).sum::<f64>()).sqrt();
        let form = vec![1.0; 512];
        let [found] = monte_carlo(&form, &variance, 7, |profile| [profile[100]]).unwrap();
        // 400 draws of 16 transforms, which give a standard deviation to an eighth: three of that.
        assert!((found.std / expected - 1.0).abs() < 0.37, "{} for {expected}", found.std);
        for (end, sign) in found.interval_95.iter().zip([-1.0, 1.0]) {
            assert!((end - (1.0 + sign * 1.96 * expected)).abs() < 0.8 * expected, "{:?}", found.interval_95);
        }
    }

    /// Amplitudes of noise over a standard deviation from 2, 16 and 24 squares.
    #[test]
    fn noise_is_above_its_limit_in_one_of_twenty_cases() {
        assert!((noise_95(0.0) - noise_95(1e9)).abs() < 1e-6);
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let mut square = || -> f64 { Distribution::<f64>::sample(&StandardNormal, &mut random).powi(2) };
        for freedom in [2_u32, 16, 24] {
            let limit = noise_95(f64::from(freedom));
            let mut above = 0;
            for _ in 0..20_000 {
                let variance = (0..freedom).map(|_| square()).sum::<f64>() / f64::from(freedom);
                above += u32::from(square() + square() > limit * limit * variance);
            }
            // 1000 ± 31.
            assert!((880..=1120).contains(&above), "{freedom}: {above} of 20000");
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_numbers_and_no_variance_none() {
        let form: Vec<f64> = (0..64).map(|step| (f64::from(step) * 0.3).sin()).collect();
        let peak = |profile: &[f64]| [profile.iter().copied().fold(f64::MIN, f64::max)];
        let first = monte_carlo(&form, &[0.01; 20], 3, peak);
        assert_eq!(first, monte_carlo(&form, &[0.01; 20], 3, peak));
        assert_ne!(first, monte_carlo(&form, &[0.01; 20], 4, peak));
        assert_eq!(monte_carlo(&form, &[f64::NAN; 20], 3, peak), None);
        assert_ne!(seed(&["a", "b"]), seed(&["ab"]));
    }
}
