//! Intervals of values that errors shift: errors drawn in pairs about a form without its noise.
//!
//! A measured form m is the true one t and errors e. They shift a value f that is not linear: noise raises a mean of |z|, a
//! gradient, a peak. Draws about m repeat the shift on a form that has it already, and show too little of it. Draws are therefore
//! made about a form t̂ whose harmonics have the power of those of t, and each error is taken with both signs, so that the mean
//! shift b of f(t̂ ± e) from f(t̂) is known far better than a single draw. With the standard deviation s of the draws about their
//! mean, f(t) lies in f(m) − b ± q·s, with Student's q for as many degrees of freedom as there are pairs less 1.
//!
//! Where b is large against s, the interval depends on how well t̂ resembles t, which no recording shows: such a value has no
//! interval, but the reason why.

use runout_draws::Uncertainty;
use runout_numerics::{
    Complex64,
    lanes::product,
    statistics::{NORMAL_95, student_95},
};

/// Pairs of draws of a section's values: Student's factor is then 9 % above the normal distribution's.
pub const PAIRS: usize = 16;
/// A harmonic whose power exceeds its variance by this factor is not noise alone: exceeded by noise in e⁻⁶ = 0.25 %.
const SIGNIFICANT: f64 = 6.0;
/// Orders on each side over which the power of harmonics that may be noise is averaged.
const WINDOW: usize = 20;

/// How far the errors may shift a value, in standard deviations of the draws, before it has no interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sensitivity {
    /// Means over the profile or surface: the shift is a smooth function of the errors' variance.
    Mean,
    /// Extremes: several places compete, and which of them wins depends on how well the form is known.
    Extreme,
}

impl Sensitivity {
    /// Largest shift in standard deviations. By simulation: `cargo test -p runout-evaluate --lib intervals_of -- --ignored`.
    fn largest_shift(self) -> f64 {
        match self {
            Self::Mean => 3.0,
            Self::Extreme => 4.0,
        }
    }

    /// Largest share of the errors in the variance of the profile or surface.
    fn largest_share(self) -> f64 {
        match self {
            Self::Mean => 0.1,
            Self::Extreme => 0.003,
        }
    }
}

/// Takes out of forms (harmonics by order from 0, one variance E|δ|² each) the power that their errors add: of a harmonic with
/// significant power its own variance; of the others the mean over neighbouring orders and over all forms. Phases stay. Orders
/// below `lowest`, the level, and harmonics without a known variance are left as they are.
pub fn remove_noise(forms: &mut [Vec<Complex64>], variance: &[Vec<f64>], lowest: usize) {
    let orders = forms.iter().map(Vec::len).max().unwrap_or(0);
    let ratio = |order: usize, value: Complex64, variance: Option<&f64>| {
        let known = variance.copied().filter(|variance| variance.is_finite() && *variance > 0.0);
        known.filter(|_| order >= lowest.max(1)).map(|variance| value.norm_sqr() / variance)
    };
    // Sums before each order, so that those over a window are differences.
    let mut sums = vec![(0.0, 0.0); orders + 1];
    for (form, variance) in forms.iter().zip(variance) {
        for (order, value) in form.iter().enumerate() {
            if let Some(ratio) = ratio(order, *value, variance.get(order)).filter(|ratio| *ratio <= SIGNIFICANT) {
                sums[order + 1].0 += ratio;
                sums[order + 1].1 += 1.0;
            }
        }
    }
    for order in 0..orders {
        sums[order + 1].0 += sums[order].0;
        sums[order + 1].1 += sums[order].1;
    }
    // Mean power of noise of variance 1 below the significant: 1 − s·e⁻ˢ/(1 − e⁻ˢ).
    let of_noise = 1.0 - SIGNIFICANT / SIGNIFICANT.exp_m1();
    for (form, variance) in forms.iter_mut().zip(variance) {
        for (order, value) in form.iter_mut().enumerate() {
            let Some(own) = ratio(order, *value, variance.get(order)) else { continue };
            let kept = if own > SIGNIFICANT {
                1.0 - own.recip()
            } else {
                let (from, to) = (order.saturating_sub(WINDOW), (order + WINDOW + 1).min(orders));
                let mean = (sums[to].0 - sums[from].0) / (sums[to].1 - sums[from].1);
                1.0 - of_noise / mean
            };
            // NaN of a window without power keeps nothing either.
            *value *= kept.max(0.0).sqrt();
        }
    }
}

/// Values of a form without its noise, and of draws about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    about: Vec<f64>,
    /// Of each value, every draw.
    draws: Vec<Vec<f64>>,
    /// Mean square of the errors over the variance of what the values are taken from.
    share: f64,
}

/// Draws `pairs` errors (`next` fills as many as the form has points) and evaluates the form with and without each of them
/// added; `look` gives the same values of both of two forms.
pub fn in_pairs(
    form_um: &[f64],
    pairs: usize,
    mut next: impl FnMut(&mut [f64]),
    mut look: impl FnMut([&[f64]; 2]) -> [Vec<f64>; 2],
) -> Drawn {
    let [about, _] = look([form_um, form_um]);
    let mut draws: Vec<Vec<f64>> = about.iter().map(|_| Vec::with_capacity(2 * pairs)).collect();
    let mut errors_um = vec![0.0; form_um.len()];
    let [mut above, mut below] = [form_um.to_vec(), form_um.to_vec()];
    let mut squares = 0.0;
    for _ in 0..pairs {
        next(&mut errors_um);
        squares += product(&errors_um, &errors_um);
        for ((above, below), (form, error)) in above.iter_mut().zip(&mut below).zip(form_um.iter().zip(&errors_um)) {
            (*above, *below) = (form + error, form - error);
        }
        for values in look([&above, &below]) {
            draws.iter_mut().zip(values).for_each(|(all, value)| all.push(value));
        }
    }
    let known = || form_um.iter().filter(|value| value.is_finite());
    let count = known().count() as f64;
    let mean = known().sum::<f64>() / count;
    let variance = known().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
    let share = squares / (pairs * form_um.len()) as f64 / variance;
    Drawn { about, draws, share }
}

impl Drawn {
    /// The draws where values are taken from what a filter leaves of the form: value number `rms` is its root mean square, and
    /// errors raise its square by their own.
    #[must_use]
    pub fn behind_filter(mut self, rms: usize) -> Self {
        if let (Some(about), Some(draws)) = (self.about.get(rms), self.draws.get(rms)) {
            let mean = draws.iter().map(|draw| draw * draw).sum::<f64>() / draws.len() as f64;
            self.share = mean / (about * about) - 1.0;
        }
        self
    }

    /// Mean square of the errors over the variance of what the values are taken from.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.share
    }

    /// Takes a value that comes round again after `period` in every draw where it is nearest to that of the form.
    pub fn unwrap_period(&mut self, index: usize, period: f64) {
        if let (Some(about), Some(draws)) = (self.about.get(index), self.draws.get_mut(index)) {
            for draw in draws {
                *draw -= period * ((*draw - about) / period).round();
            }
        }
    }

    /// What is known of the error of value number `index`, which was found as `value`; or why nothing is stated.
    ///
    /// # Errors
    /// The reason why no interval is stated.
    pub fn uncertainty(&self, index: usize, value: f64, sensitivity: Sensitivity) -> Result<Uncertainty, String> {
        let (Some(about), Some(draws)) = (self.about.get(index), self.draws.get(index)) else {
            return Err("no errors were drawn for it".into());
        };
        let pairs = draws.len() / 2;
        if !(value.is_finite() && about.is_finite() && pairs > 1 && draws.iter().all(|draw| draw.is_finite())) {
            return Err("not every profile or surface within the errors has this value".into());
        }
        let count = draws.len() as f64;
        let shift = draws.iter().map(|draw| draw - about).sum::<f64>() / count;
        let squares: f64 = draws.iter().map(|draw| (draw - about - shift).powi(2)).sum();
        let std = (squares / (count - 1.0)).sqrt();
        let lowest = draws.iter().copied().fold(f64::INFINITY, f64::min);
        Moments { about: *about, shift, std, share: self.share, draws: draws.len(), lowest }
            .uncertainty(value, sensitivity)
    }
}

/// How much errors are of what a value is taken from, as their mean square over its variance.
#[must_use]
pub fn share_in_words(share: f64) -> String {
    let of = "the variance of what it is taken from";
    if share.is_nan() {
        return format!("{of} is 0, or errors are not known everywhere");
    }
    if share > 1.0 {
        format!("errors are more than {of}")
    } else {
        format!("errors are {:.2} % of {of}", 100.0 * share)
    }
}

/// What errors do to a value of a form without its noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moments {
    /// The value of that form.
    pub about: f64,
    /// By how much errors raise it in the mean.
    pub shift: f64,
    /// Standard deviation of the value with errors.
    pub std: f64,
    /// Mean square of the errors over the variance of what the value is taken from.
    pub share: f64,
    /// Draws, in pairs, that the standard deviation was taken from; 0 where it is a closed form.
    pub draws: usize,
    /// The lowest that the value can be, or was in a draw: an interval of values from 0 on ends there.
    pub lowest: f64,
}

impl Moments {
    /// What is known of the error of the value, which was found as `value`; or why nothing is stated.
    ///
    /// # Errors
    /// The reason why no interval is stated.
    pub fn uncertainty(&self, value: f64, sensitivity: Sensitivity) -> Result<Uncertainty, String> {
        let Self { about, shift, std, share, draws, lowest } = *self;
        if share.is_nan() || share > sensitivity.largest_share() {
            return Err(share_in_words(share) + "; no interval has 95 % coverage then");
        }
        let rounding = 1e-12 * about.abs();
        if shift.abs() > sensitivity.largest_shift() * std + rounding {
            let share = shift.abs() / std;
            let direction = if shift > 0.0 { "raise" } else { "lower" };
            return Err(format!(
                "errors {direction} it by {share:.1} standard uncertainties; no interval has 95 % coverage then"
            ));
        }
        let floor = if lowest >= 0.0 { 0.0 } else { f64::NEG_INFINITY };
        let quantile = if draws > 0 { student_95((draws / 2 - 1) as f64) } else { NORMAL_95 };
        let interval_95 = [-quantile, quantile].map(|end| (value - shift + end * std).max(floor));
        Ok(Uncertainty::new(std, interval_95, draws))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// Lines of 30 standard deviations keep their power, noise goes, and a wide spectrum as strong as the noise keeps half.
    #[test]
    fn noise_is_taken_out_of_power() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let mut noise = |power: f64| Complex64::new(normal(), normal()) * (0.5 * power).sqrt();
        let rings = 40;
        let mut forms: Vec<Vec<Complex64>> =
            (0..rings).map(|_| (0..200).map(|order| noise(if order >= 100 { 2.0 } else { 1.0 })).collect()).collect();
        for form in &mut forms {
            form[7] += 30.0;
        }
        let variance = vec![vec![1.0; 200]; rings];
        remove_noise(&mut forms, &variance, 2);
        let power = |orders: std::ops::Range<usize>| {
            let count = (orders.len() * rings) as f64;
            forms.iter().flat_map(|form| &form[orders.clone()]).map(Complex64::norm_sqr).sum::<f64>() / count
        };
        // 900 ± 2·30·√½/√40.
        assert!((power(7..8) - 900.0).abs() < 30.0, "{}", power(7..8));
        // Some single harmonics are taken for lines.
        assert!(power(10..70) < 0.05, "{}", power(10..70));
        assert!((power(130..200) - 1.0).abs() < 0.15, "{}", power(130..200));
    }

    /// The mean of squares of 100 numbers with errors of σ: shifted by σ², and known with √(4 σ² · mean square / 100).
    #[test]
    fn a_mean_square_has_its_closed_form() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let sigma = 0.2;
        let form: Vec<f64> = (0..100).map(|point| f64::from(point % 10) - 4.5).collect();
        let mean_square = |form: &[f64]| vec![form.iter().map(|value| value * value).sum::<f64>() / 100.0];
        let next = |errors: &mut [f64]| {
            errors.fill_with(|| sigma * Distribution::<f64>::sample(&StandardNormal, &mut random));
        };
        let drawn = in_pairs(&form, 400, next, |both| both.map(mean_square));
        let [truth] = mean_square(&form)[..] else { panic!() };
        let found = drawn.uncertainty(0, truth + sigma * sigma, Sensitivity::Mean).unwrap();
        let std = (4.0 * sigma * sigma * truth / 100.0).sqrt();
        // 400 independent draws: 3.5 % of one standard deviation.
        assert!((found.std / std - 1.0).abs() < 0.14, "{} for {std}", found.std);
        let middle = 0.5 * (found.interval_95[0] + found.interval_95[1]);
        // Second order only: σ² √(2/100)/√800.
        assert!((middle - truth).abs() < 1e-3, "{middle} for {truth}");
        assert_eq!(found.draws, 800);
        // As a root mean square, it gives the errors' share: σ² over the mean square.
        let rms = |form: &[f64]| vec![mean_square(form)[0].sqrt()];
        let next =
            |errors: &mut [f64]| errors.fill_with(|| sigma * Distribution::<f64>::sample(&StandardNormal, &mut random));
        let share = in_pairs(&form, 400, next, |both| both.map(rms)).behind_filter(0).share;
        assert!((share * truth / (sigma * sigma) - 1.0).abs() < 0.05, "{share}");
        let shifted = in_pairs(&form, 40, |errors: &mut [f64]| errors.fill(2.0), |both| both.map(mean_square));
        assert!(shifted.uncertainty(0, truth, Sensitivity::Extreme).is_err());
        assert!(shifted.uncertainty(1, truth, Sensitivity::Mean).unwrap_err().contains("no errors"));
    }
}
