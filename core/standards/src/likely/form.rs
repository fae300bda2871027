//! The form as it may be, on equal angles: its mean, errors about it, and whether that is what was found.

use runout_numerics::{Complex64, fourier::Fourier, statistics::NORMAL_95};

use super::{Likely, distinct, sum_of_known};
use crate::{
    drawn_angles::crest_order,
    errors::{Errors, Noise, TURNS_OF_A_DRAW},
    errors_at::{Covariance, ErrorsAt},
};

/// What a form leaves of the one found, of k orders, is noise up to √(2 ln 20k) of its standard deviations: noise exceeds that at some angle in one
/// of 50 cases.
const ANGLES_AN_ORDER: f64 = 20.0;
/// An extreme is alone where no other height is within so many standard deviations of the noise.
const ALONE: f64 = 3.0;
/// What is left is no matter below this share of the errors' standard deviation.
const NO_MATTER: f64 = 0.5;

/// The form as it may be by one set of weights, on equal angles: its mean, and errors about it.
pub struct LikelyForm {
    /// Its mean, in µm.
    pub mean_um: Vec<f64>,
    /// Of all draws, those that are to be made of it.
    pub draws: usize,
    /// Whether its draws are for the lower end of intervals alone, as those of the least form are. Where that is also one of the others, it is the
    /// first, too.
    pub least: bool,
    /// Variance of the errors, by order from 0.
    variance: Vec<f64>,
    /// Orders below are exact.
    lowest: usize,
    /// Variance of the noise of the form found, and the [`crest_order`] of it.
    of_noise: f64,
    noise_order: f64,
    /// How many orders have what the mean leaves of the form found: (Σ v)²/Σ v² of their variances v = (1 − w) σ².
    orders_left: f64,
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
    let of_noise = sum_of_known(variance, likely.first().map_or(0, |likely| likely.lowest));
    let lowest = likely.first().map_or(0, |likely| likely.lowest);
    let noise_order = crest_order((0..).zip(variance).map(|(order, noise)| if order < lowest { 0.0 } else { *noise }));
    let form = |(number, likely): (usize, &Likely)| {
        let mean = harmonics.iter().zip(&likely.weights).map(|(harmonic, weight)| harmonic * weight);
        let left = variance.iter().zip(&likely.weights).skip(likely.lowest).filter(|(noise, _)| **noise > 0.0);
        let (sum, squares) = left
            .map(|(noise, weight)| (1.0 - weight) * noise)
            .fold((0.0, 0.0), |(sum, squares), left| (sum + left, squares + left * left));
        let orders_left = if squares > 0.0 { sum * sum / squares } else { 1.0 };
        let variance = variance.iter().zip(&likely.weights).map(|(noise, weight)| noise * weight).collect();
        let (mean_um, noise) = (fourier.synthesise(mean).to_vec(), noise.another(number as u64));
        let draws = (likely.share * draws as f64).round() as usize;
        LikelyForm {
            mean_um,
            variance,
            lowest: likely.lowest,
            of_noise,
            noise_order,
            orders_left,
            draws,
            least: likely.least,
            noise,
        }
    };
    distinct(likely, harmonics, variance).iter().enumerate().map(form).collect()
}

/// Standard deviation of the noise at any one angle, where most of these forms lack something of the one found that noise does not explain.
/// Draws of them do not show its values then.
#[must_use]
pub fn overlooked_by(forms: &[LikelyForm], found_um: &[f64]) -> Option<f64> {
    let likely = || forms.iter().filter(|form| !form.least);
    let draws: usize = likely().map(|form| form.draws).sum();
    let overlooking: usize = likely().filter(|form| form.overlooks(found_um)).map(|form| form.draws).sum();
    let of_noise = forms.first()?.of_noise;
    (2 * overlooking > draws).then(|| (0.5 * of_noise).sqrt())
}

/// What the forms may lack of an extreme, in µm.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Lacking {
    /// By how much that of their means is less than the one found.
    pub left_um: f64,
    /// By how much the errors at one angle reach farther than those of draws.
    pub wider_um: f64,
    /// Standard deviation of the errors at one angle.
    pub std_um: f64,
}

impl std::ops::Add for Lacking {
    type Output = Self;

    /// Of a distance of two extremes, of which the errors do not depend on each other.
    fn add(self, other: Self) -> Self {
        Self {
            left_um: self.left_um + other.left_um,
            wider_um: self.wider_um.hypot(other.wider_um),
            std_um: self.std_um.hypot(other.std_um),
        }
    }
}

/// What these forms lack of the highest of the heights found (the lowest by `sign` −1), where nothing competes with it: farther from it than a wave of the highest noise,
/// no height is within [`ALONE`] standard deviations of the noise. Noise then raises it as often as it lowers it, whatever the form, so that
/// the true extreme is about the one found as the noise is; forms of waves at random expect it where their waves are. An interval that holds both holds
/// the truth whatever the form. `None` where others compete.
#[must_use]
pub fn lacking_at_extreme(forms: &[LikelyForm], found_um: &[f64], sign: f64) -> Option<Lacking> {
    let likely = || forms.iter().filter(|form| !form.least && form.draws > 0);
    let (first, count) = (forms.first()?, found_um.len());
    let std_um = (0.5 * first.of_noise).sqrt();
    let heights = || found_um.iter().map(|height| sign * height);
    let highest = heights().enumerate().fold((0, f64::NEG_INFINITY), |best, at| if at.1 > best.1 { at } else { best });
    let near = (count as f64 / first.noise_order.max(1.0)).ceil() as usize;
    let competes = |(place, height): (usize, f64)| {
        let aside = place.abs_diff(highest.0);
        aside.min(count - aside) > near && height > highest.1 - ALONE * std_um
    };
    if std_um.is_nan() || heights().enumerate().any(competes) {
        return None;
    }
    let draws: f64 = likely().map(|form| form.draws as f64).sum();
    let mean = |of: &dyn Fn(&LikelyForm) -> f64| likely().map(|form| form.draws as f64 * of(form)).sum::<f64>() / draws;
    let left_um = mean(&|form| highest.1 - sign * form.mean_um[highest.0]);
    let wider_um = NORMAL_95 * (std_um - mean(&LikelyForm::std_um));
    Some(Lacking { left_um, wider_um, std_um })
}

impl LikelyForm {
    fn sum_of_known(&self) -> f64 {
        sum_of_known(&self.variance, self.lowest)
    }

    /// Standard deviation of an error at any one angle.
    #[must_use]
    pub fn std_um(&self) -> f64 {
        (0.5 * self.sum_of_known()).sqrt()
    }

    /// The share that the form found has of noise, not of form, in the variance of its errors.
    #[must_use]
    pub fn share_of_noise(&self) -> f64 {
        1.0 - self.sum_of_known() / self.of_noise
    }

    /// Whether it lacks something of the form found that noise does not explain, at some angle. Phases are taken to be at random; those of a
    /// scratch or a burr are such that all orders add up at one angle, and there their parts that noise hides add up too.
    ///
    /// What is left of an order is (1 − w) c with the variance (1 − w) σ².
    fn overlooks(&self, found_um: &[f64]) -> bool {
        let std_um = (0.5 * self.of_noise * self.share_of_noise().max(0.0)).sqrt();
        let most_um =
            ((2.0 * (ANGLES_AN_ORDER * self.orders_left).ln()).max(0.0).sqrt() * std_um).max(NO_MATTER * self.std_um());
        found_um.iter().zip(&self.mean_um).any(|(found, mean)| (found - mean).abs() > most_um)
    }

    /// Draws of the errors as whole profiles; `None` where the form is exact.
    #[must_use]
    pub fn errors(&self) -> Option<Errors> {
        Errors::sharing(&self.variance, self.lowest, &self.noise)
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

    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::super::likely_forms;
    use super::*;

    /// A bump of 1 µm, a fiftieth of a turn wide, in noise of 0.05 µm at each angle: whether that is seen depends on its phases only.
    #[test]
    fn orders_that_add_up_at_one_angle_are_seen() {
        const ORDERS: usize = 128;
        let mut random = ChaCha8Rng::seed_from_u64(21);
        let variance = vec![2.0 * 0.05_f64.powi(2) / ORDERS as f64; ORDERS];
        let shape: Vec<f64> = (0..ORDERS).map(|order| (-0.5 * (0.03 * order as f64).powi(2)).exp()).collect();
        let height: f64 = shape[2..].iter().sum();
        let mut fourier = Fourier::new(6 * ORDERS);
        let mut overlooked = |aligned: bool| {
            let mut found = Vec::new();
            for (order, shape) in shape.iter().enumerate() {
                let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
                let noise = Complex64::new(normal(), normal()) * (0.5 * variance[order]).sqrt();
                let phase = if aligned { 1.3 * order as f64 } else { 100.0 * normal() };
                found.push(if order < 2 {
                    Complex64::ZERO
                } else {
                    noise + Complex64::from_polar(shape / height, phase)
                });
            }
            let likely = likely_forms(&found, &variance, &[], 2);
            let forms = forms_to_draw(&likely, &found, &variance, 400, &Noise::new(ORDERS, 5), &mut fourier);
            let profile_um = fourier.synthesise(found).to_vec();
            overlooked_by(&forms, &profile_um)
        };
        let (aligned, at_random): (Vec<_>, Vec<_>) = (0..60).map(|_| (overlooked(true), overlooked(false))).unzip();
        let seen = |all: &[Option<f64>]| all.iter().flatten().count();
        assert!(seen(&aligned) >= 54 && seen(&at_random) <= 6, "{} {}", seen(&aligned), seen(&at_random));
        // Of all orders from 2 on.
        let std = aligned.iter().flatten().next().unwrap();
        assert!((std / 0.05 - 1.0).abs() < 0.02, "{std}");
    }
}
