//! What the true form may be, given the one found.
//!
//! A harmonic that was found, c = t + e, has an error e of variance σ². Where forms have the power S at its order in the mean, the true
//! harmonic t is normal about w·c with the variance w·σ², w = S/(S + σ²) (Wiener). Draws of t show what a value of the true form may be:
//! noise that the form found has and the true one has not is no part of them. Draws of errors about the form found add noise to
//! noise instead, and taking back what they add takes back too little.
//!
//! S is the mean power over the orders beside less the noise, in which orders with little noise count for more. Noise's mean of k orders is
//! known to 1/√k of itself, and as a sum of squares it is no normal number: few orders have twice their noise now and then. With even
//! odds S is 0; else every S up to ten standard deviations of the noise's mean is as likely. Of what it may be, five quantiles are taken, the same one at
//! all orders. A sixth, of the least that it may be, is for the lower end of intervals alone: of a form that is a few lines, S is 0 at all
//! orders, which even odds at each of them do not expect. An order that stands out from its noise has the power that it shows.

mod form;
mod signal;
mod sums;

use runout_numerics::Complex64;

pub use form::{Lacking, LikelyForm, forms_to_draw, lacking_at_extreme, overlooked_by};
use signal::QUANTILES;
use sums::{Sliding, Sums};

/// Power over the mean of the orders beside (over the noise) from which on an order is a line (stands out): noise alone exceeds it once in 8000 cases.
const LINE: f64 = 9.0;
/// The same for the least form: noise alone exceeds it at one of 1000 orders once in 1000 cases.
const CERTAIN_LINE: f64 = 14.0;
/// Orders to each side, at least.
const BESIDE: usize = 4;
/// Looks for lines: large ones hide others.
const LOOKS: usize = 3;
/// Orders that have their variance from the same turns: it is known no better from several.
const ORDERS_TOGETHER: f64 = 5.0;
/// Of fewer squares, the mean of 1/v² is taken as of so many: that of four or fewer has none.
const FEWEST_SQUARES: f64 = 8.0;
/// Forms are the same where the variances of their errors differ by less than this share of the noise, and their means by less than this share of
/// its standard deviation.
const SAME_FORM: f64 = 0.01;
/// Weights w by order, and the share of all draws that are to be made with them.
#[derive(Debug, Clone, PartialEq)]
pub struct Likely {
    weights: Vec<f64>,
    share: f64,
    /// Whether they are those of the least form that is likely.
    least: bool,
    /// Orders below are exact.
    lowest: usize,
}

/// Whether a harmonic stands out from its noise of this variance; not where that is not known.
#[must_use]
pub fn stands_out(harmonic: Complex64, variance: f64) -> bool {
    variance > 0.0 && harmonic.norm_sqr() > LINE * variance
}

/// What the true form may be, from harmonics by order from 0, the variance E|δ|² of each, and the real degrees of freedom that it comes from (0:
/// exact). Orders below `lowest`, and those without a known variance, are exact.
#[must_use]
pub fn likely_forms(harmonics: &[Complex64], variance: &[f64], freedom: &[usize], lowest: usize) -> Vec<Likely> {
    let count = harmonics.len();
    let noise = |order: usize| variance.get(order).copied().filter(|noise| order >= lowest && *noise > 0.0);
    let power: Vec<f64> = harmonics.iter().map(Complex64::norm_sqr).collect();
    let window = |order: usize| {
        let beside = (order / 3).max(BESIDE);
        (order.saturating_sub(beside).max(lowest), (order + beside + 1).min(count))
    };
    // A variance from ν squares has the variance 2/ν of its square, and so have those of the orders that share it.
    let widened = |order: usize| match freedom.get(order) {
        Some(freedom) if *freedom > 0 => 1.0 + 2.0 * ORDERS_TOGETHER / *freedom as f64,
        _ => 1.0,
    };
    // Orders whose variance is found too small weigh too much, and have too much power for it: E 1/v² is ν/((ν − 4) σ²) times E 1/v.
    let too_small = |order: usize| match freedom.get(order) {
        Some(freedom) if *freedom > 0 => {
            let freedom = (*freedom as f64).max(FEWEST_SQUARES);
            freedom / (freedom - 4.0)
        }
        _ => 1.0,
    };
    let summed = |is_line: &[bool], signal: &[f64]| -> Vec<Sums> {
        let sums = |order: usize| match noise(order).filter(|_| !is_line[order]) {
            Some(noise) => {
                // A square is known to itself.
                let weight = (signal[order] + noise).powi(-2);
                let variance = (weight * noise).powi(2) * widened(order);
                Sums { weight, power: weight * power[order], noise: weight * noise * too_small(order), variance }
            }
            None => Sums::default(),
        };
        (0..count).map(sums).collect()
    };
    let (mut is_line, mut signal) = (vec![false; count], vec![0.0; count]);
    let mut sums = summed(&is_line, &signal);
    for _ in 1..LOOKS {
        let (mut before, mut after) = (Sliding::new(&sums), Sliding::new(&sums));
        for order in lowest..count {
            let (from, to) = window(order);
            let others = before.over(from, order) + after.over(order + 1, to);
            signal[order] = others.signal();
            is_line[order] =
                noise(order).is_some_and(|noise| others.weight > 0.0 && power[order] > LINE * (signal[order] + noise));
        }
        sums = summed(&is_line, &signal);
    }
    let (mut beside, mut weights) = (Sliding::new(&sums), QUANTILES.map(|_| Vec::with_capacity(count)));
    for order in 0..count {
        let (from, to) = window(order);
        let of_order = match noise(order) {
            Some(own) => {
                let shown = |line: f64| if power[order] > line * own { 1.0 - own / power[order] } else { 0.0 };
                let (of_least, of_others) = (shown(CERTAIN_LINE), shown(LINE));
                let mut weights = beside.over(from, to).likely_signals().map(|signal| signal / (signal + own));
                for (quantile, weight) in weights.iter_mut().enumerate() {
                    *weight = weight.max(if quantile == 0 { of_least } else { of_others });
                }
                weights
            }
            None => [1.0; QUANTILES.len()],
        };
        weights.iter_mut().zip(of_order).for_each(|(all, weight)| all.push(weight));
    }
    let share = 1.0 / (QUANTILES.len() - 1) as f64;
    let likely = |(quantile, weights)| Likely { weights, share, least: quantile == 0, lowest };
    weights.into_iter().enumerate().map(likely).collect()
}

/// Sets of weights that make nearly the same of harmonics with these variances are one, the middle one of them, with the shares of all. The least form
/// is one of those that are as likely where it is the same as they are.
fn distinct(likely: &[Likely], harmonics: &[Complex64], variance: &[f64]) -> Vec<Likely> {
    let lowest = likely.first().map_or(0, |likely| likely.lowest);
    let most = SAME_FORM * sum_of_known(variance, lowest);
    let is_same = |one: &Likely, other: &Likely| {
        let (mut of_variance, mut of_mean) = (0.0, 0.0);
        for (order, (one, other)) in one.weights.iter().zip(&other.weights).enumerate().skip(lowest) {
            let differ = (one - other).abs();
            of_variance += variance.get(order).filter(|noise| **noise > 0.0).map_or(0.0, |noise| differ * noise);
            of_mean += harmonics.get(order).map_or(0.0, |harmonic| differ * differ * harmonic.norm_sqr());
        }
        of_variance <= most && of_mean <= SAME_FORM * most
    };
    let mut groups: Vec<Vec<&Likely>> = Vec::new();
    for next in likely {
        match groups.last_mut().filter(|group| is_same(group[0], next)) {
            Some(group) => group.push(next),
            None => groups.push(vec![next]),
        }
    }
    let one = |group: Vec<&Likely>| {
        let least = group.iter().all(|likely| likely.least);
        let counted = group.iter().filter(|likely| least || !likely.least);
        Likely {
            weights: group[group.len() / 2].weights.clone(),
            share: counted.map(|likely| likely.share).sum(),
            least,
            lowest,
        }
    };
    groups.into_iter().map(one).collect()
}

/// Sum of the variances that are known, of orders from `lowest` on.
fn sum_of_known(variance: &[f64], lowest: usize) -> f64 {
    variance.iter().skip(lowest).filter(|variance| **variance > 0.0).sum()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};
    use runout_numerics::fourier::Fourier;

    use super::*;
    use crate::errors::Noise;

    /// One order in four has a hundredth of the others' noise (as with three sensors, whose gain depends on the order): what little form there
    /// is between a few lines is seen in these, and noise of the others is not taken for form.
    #[test]
    fn quiet_orders_count_for_more() {
        let mut random = ChaCha8Rng::seed_from_u64(12);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let variance: Vec<f64> = (0..200).map(|order| if order % 4 == 0 { 0.01 } else { 1.0 }).collect();
        let (mut hidden, trials) = (0, 100);
        for _ in 0..trials {
            let mut noise = |power: f64| (0.5 * power).sqrt() * Complex64::new(normal(), normal());
            let found: Vec<Complex64> = variance.iter().map(|variance| noise(*variance)).collect();
            // The least form is none: the least and the first of the others are one where the data say nothing against it.
            let least = &likely_forms(&found, &variance, &[], 2)[0].weights;
            hidden += usize::from(least[2..].iter().all(|weight| *weight < 0.01));
        }
        // Of a dozen stretches that share few orders, each is above the 1 % point of none once in several hundred cases.
        assert!(hidden >= 90, "{hidden} of {trials}");
        let mut noise = |power: f64| (0.5 * power).sqrt() * Complex64::new(normal(), normal());
        let found: Vec<Complex64> = variance.iter().map(|variance| noise(*variance) + noise(0.1)).collect();
        for likely in likely_forms(&found, &variance, &[], 2) {
            // S of 0.1 is 0.9 of what a quiet order has, and 0.09 of what the others have.
            let mean = |quiet: bool| {
                let weights = (40..200).filter(|order| (order % 4 == 0) == quiet).map(|order| likely.weights[order]);
                weights.clone().sum::<f64>() / weights.count() as f64
            };
            assert!(
                (0.8..0.97).contains(&mean(true)) && (0.04..0.2).contains(&mean(false)),
                "{} {}",
                mean(true),
                mean(false)
            );
        }
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
        let likely = likely_forms(&harmonics, &[1.0; 900], &[], 2);
        let shares: f64 = likely.iter().filter(|likely| !likely.least).map(|likely| likely.share).sum();
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
        let exact = distinct(&likely_forms(&harmonics, &[f64::NAN; 900], &[], 2), &harmonics, &[f64::NAN; 900]);
        assert!(exact.len() == 1 && exact[0].weights.iter().all(|weight| (weight - 1.0).abs() < 1e-12));
    }

    /// Whether two sets are one depends on what they make of the noise, not on where their weights differ.
    #[test]
    fn sets_are_one_where_their_forms_are() {
        let likely = |weight: f64, least: bool| Likely {
            weights: vec![1.0, 1.0, 1.0, weight, 0.5],
            share: 0.2,
            least,
            lowest: 2,
        };
        let sets = [likely(0.1, true), likely(0.1, false), likely(0.4, false), likely(0.402, false)];
        let shares = |third: f64| -> Vec<(f64, bool)> {
            let harmonics = [0.0, 0.0, 5.0, third, 0.1].map(Complex64::from);
            let found = distinct(&sets, &harmonics, &[0.0, 0.0, 0.01, 0.01, 1.0]);
            found.iter().map(|likely| ((10.0 * likely.share).round(), likely.least)).collect()
        };
        // A hundredth of the noise is of order 3: 0.3 of it makes no difference, unless the mean has that order.
        assert_eq!(shares(0.0), [(6.0, false)]);
        assert_eq!(shares(0.2), [(2.0, false), (4.0, false)]);
        assert_eq!(distinct(&[sets[0].clone(), sets[2].clone()], &[Complex64::from(9.0); 5], &[0.1; 5]).len(), 2);
    }

    /// The form has the mean and the variance of what it may be, as whole profiles and at points.
    #[test]
    fn draws_are_about_what_the_form_may_be() {
        let (harmonics, variance) = (vec![Complex64::new(3.0, 1.0); 6], vec![0.5; 6]);
        let likely = [Likely { weights: vec![1.0, 1.0, 0.8, 0.6, 0.0, 0.4], share: 1.0, least: false, lowest: 2 }];
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
