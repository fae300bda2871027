//! What the true form may be, given the one found.
//!
//! A harmonic that was found, c = t + e, has an error e of variance σ². Where forms have the power S at its order in the mean, the true
//! harmonic t is normal about w·c with the variance w·σ², w = S/(S + σ²) (Wiener). Draws of t show what a value of the true form may be:
//! noise that the form found has and the true one has not is no part of them. Draws of errors about the form found add noise to
//! noise instead, and taking back what they add takes back too little.
//!
//! S is the mean power over the orders beside less the noise, which itself is known to noise/√number. With even odds it is 0; else every S up to
//! ten of that standard deviation is as likely. Of what it may be, five quantiles are taken, the same one at all orders. An order that
//! stands out from its noise has the power that it shows.

use std::sync::LazyLock;

use runout_numerics::{Complex64, fourier::Fourier};

use crate::{
    errors::{Errors, Noise, TURNS_OF_A_DRAW},
    errors_at::{Covariance, ErrorsAt},
};

/// What S may be is looked at here, each as likely as the others.
const QUANTILES: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];
/// Largest S that is likely before anything is found, in standard deviations of the noise's mean.
const MOST: f64 = 10.0;
/// Power over the mean of the orders beside (over the noise) from which on an order is a line (stands out): noise alone exceeds it once in 8000 cases.
const LINE: f64 = 9.0;
/// Orders to each side, at least.
const BESIDE: usize = 4;
/// Looks for lines: large ones hide others.
const LOOKS: usize = 3;
/// Weights that differ by less are one.
const EQUAL: f64 = 0.02;

/// Weights w by order, and the share of all draws that are to be made with them.
#[derive(Debug, Clone, PartialEq)]
pub struct Likely {
    weights: Vec<f64>,
    share: f64,
}

/// Sums before an order: power, noise, and number of the orders that count.
type Sums = (f64, f64, f64);

/// What the true form may be, from harmonics by order from 0 and the variance E|δ|² of each. Orders below `lowest`, and those without a known
/// variance, are exact.
#[must_use]
pub fn likely_forms(harmonics: &[Complex64], variance: &[f64], lowest: usize) -> Vec<Likely> {
    let count = harmonics.len();
    let noise = |order: usize| variance.get(order).copied().filter(|noise| order >= lowest && *noise > 0.0);
    let power: Vec<f64> = harmonics.iter().map(Complex64::norm_sqr).collect();
    let mut is_line = vec![false; count];
    let mut before: Vec<Sums> = vec![(0.0, 0.0, 0.0); count + 1];
    let window = |order: usize| {
        let beside = (order / 3).max(BESIDE);
        (order.saturating_sub(beside).max(lowest), (order + beside + 1).min(count))
    };
    for look in 0..LOOKS {
        for order in 0..count {
            let (powers, noises, number) = before[order];
            before[order + 1] = match noise(order).filter(|_| !is_line[order]) {
                Some(noise) => (powers + power[order], noises + noise, number + 1.0),
                None => (powers, noises, number),
            };
        }
        if look + 1 == LOOKS {
            break;
        }
        let is_above = |order: usize| {
            let (from, to) = window(order);
            let own = if is_line[order] { (0.0, 0.0) } else { (power[order], 1.0) };
            let number = before[to].2 - before[from].2 - own.1;
            let others = (before[to].0 - before[from].0 - own.0).max(0.0) / number;
            number > 0.0 && power[order] > LINE * others
        };
        is_line = (0..count)
            .map(|order| noise(order).is_some_and(|noise| power[order] > LINE * noise) && is_above(order))
            .collect();
    }
    let weights = |quantile: usize| -> Vec<f64> {
        let weight = |order: usize| {
            let Some(own) = noise(order) else { return 1.0 };
            let (from, to) = window(order);
            let number = before[to].2 - before[from].2;
            let signal = if number > 0.0 {
                let [power, noise] =
                    [before[to].0 - before[from].0, before[to].1 - before[from].1].map(|sum| sum / number);
                let known_to = noise / number.sqrt();
                known_to * signal_at(quantile, (power - noise) / known_to)
            } else {
                0.0
            };
            let weight = signal / (signal + own);
            if power[order] > LINE * own { weight.max(1.0 - own / power[order]) } else { weight }
        };
        (0..count).map(weight).collect()
    };
    let mut found: Vec<Likely> = Vec::new();
    for quantile in 0..QUANTILES.len() {
        let (weights, share) = (weights(quantile), 1.0 / QUANTILES.len() as f64);
        let same = |other: &Likely| weights.iter().zip(&other.weights).all(|(one, other)| (one - other).abs() <= EQUAL);
        match found.last_mut().filter(|last| same(last)) {
            Some(last) => last.share += share,
            None => found.push(Likely { weights, share }),
        }
    }
    found
}

/// Steps of the table of [`signal_at`] and its range.
const STEP: f64 = 0.05;
const TABLED: [f64; 2] = [-4.0, 8.0];

/// Quantiles of S in standard deviations of the noise's mean, by what was found of it in the same unit.
static SIGNALS: LazyLock<[Vec<f64>; QUANTILES.len()]> = LazyLock::new(|| {
    let steps = ((TABLED[1] - TABLED[0]) / STEP) as usize;
    QUANTILES.map(|quantile| (0..=steps).map(|step| signal_of(quantile, TABLED[0] + STEP * step as f64)).collect())
});

/// The same from the table.
fn signal_at(quantile: usize, found: f64) -> f64 {
    let table = &SIGNALS[quantile];
    let place = (found.max(TABLED[0]) - TABLED[0]) / STEP;
    let below = place as usize;
    match (table.get(below), table.get(below + 1)) {
        (Some(low), Some(high)) => low + (high - low) * place.fract(),
        // Far above, S is normal about what was found.
        _ => found + table.last().map_or(0.0, |last| last - TABLED[1]),
    }
}

/// A quantile of S, by bisection.
fn signal_of(quantile: f64, found: f64) -> f64 {
    let above = |at: f64| 0.5 * libm::erfc(at / std::f64::consts::SQRT_2);
    let density = (-0.5 * found * found).exp() / std::f64::consts::TAU.sqrt();
    // Far above, the limit is none.
    let most = MOST.max(found + MOST);
    // Of all S above one.
    let rest = |signal: f64| (above(signal - found) - above(most - found)) / MOST;
    let all = density + rest(0.0);
    let (mut low, mut high) = (0.0, most);
    if rest(0.0) <= (1.0 - quantile) * all {
        return 0.0;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if rest(middle) > (1.0 - quantile) * all { low = middle } else { high = middle }
    }
    low
}

/// The form as it may be by one set of weights, on equal angles: its mean, and errors about it.
pub struct LikelyForm {
    /// Its mean, in µm.
    pub mean_um: Vec<f64>,
    /// Of all draws, those that are to be made of it.
    pub draws: usize,
    /// Variance of the errors, by order from 0.
    variance: Vec<f64>,
    /// Variance of the noise of the form found.
    of_noise: f64,
    noise: Noise,
}

/// The forms that so many draws are to be made of, on the angles that `fourier` has. Harmonics and their variances are those behind a filter.
#[must_use]
pub fn forms_to_draw(
    likely: &[Likely],
    harmonics: &[Complex64],
    variance: &[f64],
    draws: usize,
    noise: &Noise,
    fourier: &mut Fourier,
) -> Vec<LikelyForm> {
    let of_noise = sum_of_known(variance);
    let form = |(number, likely): (usize, &Likely)| {
        let mean = harmonics.iter().zip(&likely.weights).map(|(harmonic, weight)| harmonic * weight);
        let variance = variance.iter().zip(&likely.weights).map(|(noise, weight)| noise * weight).collect();
        let (mean_um, noise) = (fourier.synthesise(mean).to_vec(), noise.another(number as u64));
        LikelyForm { mean_um, variance, of_noise, draws: (likely.share * draws as f64).round() as usize, noise }
    };
    likely.iter().enumerate().map(form).collect()
}

/// Sum of the variances that are known, of orders from 2 on.
fn sum_of_known(variance: &[f64]) -> f64 {
    variance.iter().skip(2).filter(|variance| **variance > 0.0).sum()
}

impl LikelyForm {
    /// Standard deviation of an error at any one angle.
    #[must_use]
    pub fn std_um(&self) -> f64 {
        (0.5 * sum_of_known(&self.variance)).sqrt()
    }

    /// The share that the form found has of noise, not of form, in the variance of its errors.
    #[must_use]
    pub fn share_of_noise(&self) -> f64 {
        1.0 - sum_of_known(&self.variance) / self.of_noise
    }

    /// Draws of the errors as whole profiles; `None` where the form is exact.
    #[must_use]
    pub fn errors(&self) -> Option<Errors> {
        Errors::sharing(&self.variance, 2, &self.noise)
    }

    /// Draws of the errors at some of the angles, by their numbers; `None` where the form is exact.
    #[must_use]
    pub fn errors_at(&self, points: &[usize], fourier: &mut Fourier) -> Option<ErrorsAt> {
        Some(ErrorsAt::new(&Covariance::new(&self.variance, fourier)?, points, &self.noise))
    }

    /// How many transforms its draws come from as whole profiles.
    #[must_use]
    pub fn transforms(&self) -> usize {
        self.draws.div_ceil(TURNS_OF_A_DRAW)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// Of powers drawn from what is likely before anything is found, those that give nearly the same.
    #[test]
    fn quantiles_of_power_are_those_of_draws() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        for found in [-0.5, 1.0, 2.5, 4.0, 7.0] {
            let mut of: Vec<f64> = Vec::new();
            while of.len() < 20_000 {
                let power = if random.random::<bool>() { 0.0 } else { MOST * random.random::<f64>() };
                let noise: f64 = StandardNormal.sample(&mut random);
                if (power + noise - found).abs() < 0.05 {
                    of.push(power);
                }
            }
            of.sort_by(f64::total_cmp);
            for (index, quantile) in QUANTILES.into_iter().enumerate() {
                let [low, high] = [-0.02, 0.02].map(|by| of[((quantile + by) * 20_000.0) as usize]);
                let signal = signal_at(index, found);
                // Shares of 20 000 are known to 0.0035; of equal shares the window of 0.1 moves them by less than 0.05.
                assert!(low - 0.05 <= signal && signal <= high + 0.05, "{found} {quantile}: {low} {signal} {high}");
            }
        }
        // Far above, S is what was found.
        assert!((signal_at(2, 100.0) - 100.0).abs() < 0.01);
    }

    /// Lines stay, noise goes, and of a spectrum as strong as the noise half is likely to be true.
    #[test]
    fn weights_are_shares_of_power() {
        let mut random = ChaCha8Rng::seed_from_u64(8);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let mut noise = |power: f64| (0.5 * power).sqrt() * Complex64::new(normal(), normal());
        let harmonics: Vec<Complex64> = (0..900)
            .map(|order| match order {
                0..10 => 1000.0 / Complex64::from(f64::from(order) + 1.0),
                50 => Complex64::from(30.0),
                500.. => noise(2.0),
                _ => noise(1.0),
            })
            .collect();
        let likely = likely_forms(&harmonics, &[1.0; 900], 2);
        let shares: f64 = likely.iter().map(|likely| likely.share).sum();
        assert!((shares - 1.0).abs() < 1e-12 && likely.len() > 1);
        for Likely { weights, .. } in &likely {
            assert!(weights[..2].iter().all(|weight| (weight - 1.0).abs() < 1e-12), "exact");
            assert!(weights[2..10].iter().all(|weight| *weight > 0.998) && weights[50] > 0.998);
            // The noise of 270 orders and more is known to 6 %.
            let middle = |from: usize, to: usize| {
                let mut all = weights[from..to].to_vec();
                all.sort_by(f64::total_cmp);
                all[all.len() / 2]
            };
            assert!(
                middle(200, 330) < 0.2 && (middle(750, 900) - 0.5).abs() < 0.1,
                "{} {}",
                middle(200, 330),
                middle(750, 900)
            );
        }
        // Without noise, the form is what was found.
        let exact = likely_forms(&harmonics, &[f64::NAN; 900], 2);
        assert!(exact.len() == 1 && exact[0].weights.iter().all(|weight| (weight - 1.0).abs() < 1e-12));
    }

    /// The form has the mean and the variance of what it may be, as whole profiles and at points.
    #[test]
    fn draws_are_about_what_the_form_may_be() {
        let (harmonics, variance) = (vec![Complex64::new(3.0, 1.0); 6], vec![0.5; 6]);
        let likely = [Likely { weights: vec![1.0, 1.0, 0.8, 0.6, 0.0, 0.4], share: 1.0 }];
        let mut fourier = Fourier::new(64);
        let forms = forms_to_draw(&likely, &harmonics, &variance, 4000, &Noise::new(6, 1), &mut fourier);
        let [form] = &forms[..] else { panic!("one set of weights, one form") };
        let angle = std::f64::consts::TAU * 5.0 / 64.0;
        let level = 3.0 + (Complex64::new(3.0, 1.0) * Complex64::cis(angle)).re;
        let mean: f64 = [(2, 0.8), (3, 0.6), (5, 0.4)]
            .iter()
            .map(|(n, weight)| weight * (Complex64::new(3.0, 1.0) * Complex64::cis(f64::from(*n) * angle)).re)
            .sum();
        assert!((form.mean_um[5] - level - mean).abs() < 1e-12);
        let square: f64 = 0.25 * (0.8 + 0.6 + 0.4);
        assert!((form.std_um().powi(2) - square).abs() < 1e-12);
        assert!((form.share_of_noise() - (1.0 - 1.8 / 4.0)).abs() < 1e-12);
        assert_eq!((form.draws, form.transforms()), (4000, 160));
        let mut at = form.errors_at(&[5, 9], &mut fourier).unwrap();
        let mut profiles = form.errors().unwrap();
        let (mut of_points, mut of_profiles) = (Vec::new(), Vec::new());
        for _ in 0..4000 {
            of_points.push(at.draw()[0]);
            of_profiles.push(profiles.turned(&mut fourier).at(5));
        }
        for (draws, independent) in [(of_points, 4000.0_f64), (of_profiles, 400.0)] {
            let found = draws.iter().sum::<f64>() / 4000.0;
            let squares = draws.iter().map(|draw| (draw - found).powi(2)).sum::<f64>() / 4000.0;
            assert!(found.abs() < 4.0 * (square / independent).sqrt(), "{found}");
            assert!((squares / square - 1.0).abs() < 4.0 * (2.0 / independent).sqrt(), "{squares} {square}");
        }
    }
}
