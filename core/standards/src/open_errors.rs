//! Errors of an open profile, and draws of them.

use std::f64::consts::{PI, TAU};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::drawn::{Drawn, in_pairs};
use runout_numerics::{
    Complex64,
    fourier::Fourier,
    moderated::{Moderated, moderated},
    statistics::{NORMAL_95, student_95},
};

/// Power of a cosine's amplitude above which it is not noise alone, in variances: noise exceeds it in 0.25 % of all cases.
const SIGNIFICANT: f64 = 9.14;
/// Mean power of noise of variance 1 below that: P(χ²₃ < s)/P(χ²₁ < s).
const OF_NOISE: f64 = 0.975;
/// Cosines on each side over which the power of those that may be noise is averaged.
const WINDOW: usize = 20;
/// Share of the mean power of correlated noise that each wave of it has at least.
const LEAST_POWER: f64 = 1e-3;

/// What the errors of a profile on positions along a line are. A covariance: diagonal · correlation · diagonal, and whole-profile changes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OpenErrors {
    /// Standard deviation at each position, in µm, but for `common_um`.
    pub std_um: Vec<f64>,
    /// Degrees of freedom behind the standard deviation at one position; 0 where it is taken as exact.
    pub freedom: f64,
    /// Correlation of these errors over 0, 1, … positions, none beyond its end; empty where they are independent.
    pub correlation: Vec<f64>,
    /// Changes of the whole profile, in µm at each position, each with a factor of its own of standard deviation 1.
    pub common_um: Vec<Vec<f64>>,
}

impl OpenErrors {
    /// Whether there is a number at each of so many positions.
    #[must_use]
    pub fn are_known(&self, positions: usize) -> bool {
        let known = |values: &Vec<f64>| values.len() == positions && values.iter().all(|value| value.is_finite());
        positions > 1 && known(&self.std_um) && self.common_um.iter().all(known)
    }

    /// Standard deviations to draw with: [moderated](runout_numerics::moderated), and as much wider as they are badly known.
    fn widened_um(&self) -> Vec<f64> {
        let variance: Vec<f64> = self.std_um.iter().map(|std| std * std).collect();
        let Moderated { variance, freedom } = moderated(&variance, self.freedom);
        let wider = if freedom.is_finite() { student_95(freedom) / NORMAL_95 } else { 1.0 };
        variance.iter().map(|variance| wider * variance.sqrt()).collect()
    }

    /// Power of the correlated errors of variance 1 at a phase step per position, in that of independent ones.
    fn power(&self, step: f64) -> f64 {
        let beside = self.correlation.iter().enumerate().skip(1);
        // A correlation that is cut off may have a spectrum below 0.
        (1.0 + 2.0 * beside.map(|(lag, share)| share * (step * lag as f64).cos()).sum::<f64>()).max(LEAST_POWER)
    }

    /// The profile less the power that its errors add, wave by wave: of a cosine with significant power its own variance, of the others
    /// the mean over their neighbours. Draws about it do not hold the noise twice ([`crate::drawn`]).
    #[must_use]
    pub fn without_noise(&self, profile_um: &[f64]) -> Vec<f64> {
        let count = profile_um.len();
        let std_um = self.widened_um();
        let variance = std_um.iter().map(|std| std * std).sum::<f64>() / count as f64;
        if count < 2 || variance.is_nan() || variance <= 0.0 {
            return profile_um.to_vec();
        }
        // Mirrored at its end, a profile is a sum of cosines.
        let mut fourier = Fourier::new(2 * count);
        let mut waves = vec![Complex64::ZERO; fourier.max_order() + 1];
        fourier.analyse(profile_um.iter().chain(profile_um.iter().rev()).copied(), &mut waves);
        let ratio: Vec<f64> = waves
            .iter()
            .enumerate()
            .map(|(wave, value)| {
                let noise = 2.0 * variance / count as f64 * self.power(PI * wave as f64 / count as f64);
                value.norm_sqr() / noise
            })
            .collect();
        // Sums before each wave, so that those over a window are differences.
        let mut sums = vec![(0.0, 0.0); ratio.len() + 1];
        for (wave, ratio) in ratio.iter().enumerate() {
            let (power, number) = if *ratio <= SIGNIFICANT && wave > 0 { (*ratio, 1.0) } else { (0.0, 0.0) };
            sums[wave + 1] = (sums[wave].0 + power, sums[wave].1 + number);
        }
        for (wave, (value, own)) in waves.iter_mut().zip(&ratio).enumerate().skip(1) {
            let kept = if *own > SIGNIFICANT {
                1.0 - own.recip()
            } else {
                let (from, to) = (wave.saturating_sub(WINDOW), (wave + WINDOW + 1).min(ratio.len()));
                1.0 - OF_NOISE * (sums[to].1 - sums[from].1) / (sums[to].0 - sums[from].0)
            };
            // NaN of a window without power keeps nothing either.
            *value *= kept.max(0.0).sqrt();
        }
        fourier.synthesise(waves)[..count].to_vec()
    }

    /// Draws values of a profile in pairs about the profile without its noise; `look` gives the values of one. `None` where the errors
    /// are not known at all of its positions.
    #[must_use]
    pub fn drawn(
        &self,
        profile_um: &[f64],
        pairs: usize,
        seed: u64,
        look: impl Fn(&[f64]) -> Vec<f64>,
    ) -> Option<Drawn> {
        let count = profile_um.len();
        if !self.are_known(count) {
            return None;
        }
        let about_um = self.without_noise(profile_um);
        let std_um = self.widened_um();
        let mut chance = Chance::new(self, count, seed);
        let next = |errors_um: &mut [f64]| {
            chance.fill(errors_um);
            errors_um.iter_mut().zip(&std_um).for_each(|(error, std)| *error *= std);
            for change in &self.common_um {
                let factor = chance.normal();
                errors_um.iter_mut().zip(change).for_each(|(error, change)| *error += factor * change);
            }
        };
        Some(in_pairs(&about_um, pairs, next, |both| {
            let [above, below] = both;
            let of_above = look(above);
            let of_below = if std::ptr::eq(above, below) { of_above.clone() } else { look(below) };
            [of_above, of_below]
        }))
    }
}

/// Numbers of variance 1 along a profile, correlated as its errors are.
struct Chance {
    random: ChaCha8Rng,
    /// Transform of a turn that holds the profile and the reach of the correlation, with the amplitude of each order; none of
    /// independent errors.
    correlated: Option<(Fourier, Vec<f64>)>,
}

impl Chance {
    fn new(errors: &OpenErrors, count: usize, seed: u64) -> Self {
        let correlated = (errors.correlation.len() > 1).then(|| {
            let length = (count + errors.correlation.len()).next_power_of_two();
            let fourier = Fourier::new(length);
            let step = TAU / length as f64;
            let power: Vec<f64> = (0..=fourier.max_order()).map(|order| errors.power(step * order as f64)).collect();
            // Re Σ c e^{inα} has the variance ½ Σ E|c|², and of order 0 its own.
            let all: f64 = power.iter().skip(1).sum::<f64>() + 0.5 * power[0];
            let amplitudes = power.iter().map(|power| (power / all).sqrt()).collect();
            (fourier, amplitudes)
        });
        Self { random: ChaCha8Rng::seed_from_u64(seed), correlated }
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.random)
    }

    fn fill(&mut self, numbers: &mut [f64]) {
        let Self { random, correlated } = self;
        let mut normal = || -> f64 { StandardNormal.sample(&mut *random) };
        match correlated {
            None => numbers.fill_with(normal),
            Some((fourier, amplitudes)) => {
                let waves = amplitudes.iter().enumerate().map(|(order, amplitude)| {
                    let part = if order == 0 { std::f64::consts::FRAC_1_SQRT_2 } else { 1.0 };
                    part * amplitude * Complex64::new(normal(), normal())
                });
                numbers.iter_mut().zip(fourier.synthesise(waves)).for_each(|(number, value)| *number = *value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spread(draws: &[Vec<f64>], lag: usize) -> f64 {
        let pairs = draws.iter().flat_map(|one| one.iter().zip(&one[lag..]));
        let (sum, count) = pairs.fold((0.0, 0.0), |(sum, count), (a, b)| (sum + a * b, count + 1.0));
        sum / count
    }

    #[test]
    fn drawn_numbers_have_their_variance_and_correlation() {
        for correlation in [vec![], vec![1.0, 0.6, 0.2]] {
            let errors = OpenErrors { std_um: vec![1.0; 200], correlation, ..OpenErrors::default() };
            let mut chance = Chance::new(&errors, 200, 7);
            let draws: Vec<Vec<f64>> = (0..400)
                .map(|_| {
                    let mut numbers = vec![0.0; 200];
                    chance.fill(&mut numbers);
                    numbers
                })
                .collect();
            for lag in 0..5 {
                let expected = if lag == 0 { 1.0 } else { errors.correlation.get(lag).copied().unwrap_or(0.0) };
                // 80 000 products, of which some two are correlated: 0.6 %.
                assert!((spread(&draws, lag) - expected).abs() < 0.03, "{lag}: {}", spread(&draws, lag));
            }
        }
    }

    /// Two waves stay and white noise goes, in the mean over 20 recordings.
    #[test]
    fn noise_is_taken_out_of_a_profile() {
        let count = 400;
        let truth: Vec<f64> =
            (0..count).map(|at| (0.02 * f64::from(at)).sin() + 0.3 * (0.31 * f64::from(at)).cos()).collect();
        let errors = OpenErrors { std_um: vec![0.2; count as usize], ..OpenErrors::default() };
        let squares = |from: &[f64]| {
            from.iter().zip(&truth).map(|(one, truth)| (one - truth).powi(2)).sum::<f64>() / f64::from(count)
        };
        let power = |of: &[f64]| of.iter().map(|value| value * value).sum::<f64>() / f64::from(count);
        let (mut before, mut after, mut added) = (0.0, 0.0, 0.0);
        for seed in 0..20 {
            let mut chance = Chance::new(&errors, count as usize, seed);
            let mut noise = vec![0.0; count as usize];
            chance.fill(&mut noise);
            let profile: Vec<f64> = truth.iter().zip(&noise).map(|(truth, noise)| truth + 0.2 * noise).collect();
            before += squares(&profile) / 20.0;
            let found = errors.without_noise(&profile);
            after += squares(&found) / 20.0;
            added += (power(&found) - power(&truth)) / 20.0;
        }
        let [before, after] = [before, after].map(f64::sqrt);
        // What stays is the noise of the cosines that the two waves have, and a tenth of the power of the others, by chance: half of it in amplitude.
        assert!(before > 0.18 && after < 0.5 * before, "{before} {after}");
        // The power of the noise is 0.04 µm²; that of one recording is known to √(2/400 + 4 · 0.55/0.04/400) of it, of 20 to 0.08: three of these.
        assert!(added.abs() < 0.24 * 0.04, "{added} µm²");
        let exact = OpenErrors { std_um: vec![0.0; count as usize], ..OpenErrors::default() };
        assert_eq!(exact.without_noise(&truth), truth);
    }

    #[test]
    fn errors_that_are_not_known_draw_nothing() {
        let drawn = |errors: OpenErrors| errors.drawn(&[1.0, 2.0, 3.0], 4, 1, |profile| vec![profile[0]]);
        assert!(drawn(OpenErrors { std_um: vec![0.1; 3], ..OpenErrors::default() }).is_some());
        assert!(drawn(OpenErrors { std_um: vec![0.1, f64::NAN, 0.1], ..OpenErrors::default() }).is_none());
        assert!(drawn(OpenErrors { std_um: vec![0.1; 2], ..OpenErrors::default() }).is_none());
    }
}
