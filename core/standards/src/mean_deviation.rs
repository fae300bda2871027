//! What errors do to the mean absolute deviation of a closed profile, in closed form.
//!
//! Errors e of a form z are normal with one variance s² at every angle. The mean of |z + e| exceeds |z| by
//! s·√(2/π)·exp(−z²/2s²) − |z|·erfc(|z|/(s√2)), and changes with e by erf(z/(s√2)) in the mean: the sign of z, but near its crossings.
//! With W the harmonics of that over the angle and σₙ² = E|δₙ|² those of the errors, the mean deviation has the variance Σ σₙ²|Wₙ|²/8. Where
//! z is near 0, errors change it by their squares too: with the curvature h = √(2/π)/s·exp(−z²/2s²) and the covariance C of errors over
//! angles, that adds half of the mean of h·h'·C² over all pairs of angles (the second term of Hermite's series).

use std::f64::consts::{FRAC_2_PI, SQRT_2};

use crate::drawn::Moments;
use runout_numerics::{Complex64, fourier::Fourier};

/// Beyond so many standard deviations, no error changes a sign.
const FAR: f64 = 6.0;

/// The mean absolute deviation of a form on the equal angles that `fourier` has, about its mean, and what errors with these variances
/// do to it, by order from 0; those below 2 are taken as exact. `None` where a point of the form is missing or no variance is known.
#[must_use]
pub fn of_mean_deviation(form_um: &[f64], variance: &[f64], fourier: &mut Fourier) -> Option<Moments> {
    let known = |order: usize| variance.get(order).copied().filter(|variance| order >= 2 && *variance > 0.0);
    let square = 0.5 * (0..variance.len()).filter_map(known).sum::<f64>();
    if square <= 0.0 || form_um.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let (count, std_um) = (form_um.len() as f64, square.sqrt());
    let mean = form_um.iter().sum::<f64>() / count;
    let (mut about, mut shift, mut squares) = (0.0, 0.0, 0.0);
    let (mut signs, mut bends) = (Vec::with_capacity(form_um.len()), vec![0.0; form_um.len()]);
    for (value, bend) in form_um.iter().zip(&mut bends) {
        let (height, ratio) = ((value - mean).abs(), (value - mean) / std_um);
        about += height;
        squares += height * height;
        signs.push(if ratio.abs() > FAR {
            ratio.signum()
        } else {
            let beyond = ratio.abs() / SQRT_2;
            let density = FRAC_2_PI.sqrt() * (-beyond * beyond).exp();
            shift += std_um * density - height * libm::erfc(beyond);
            *bend = density / std_um;
            libm::erf(ratio / SQRT_2)
        });
    }
    let mut weights = vec![Complex64::ZERO; fourier.max_order() + 1];
    fourier.analyse_in_place(&mut signs, &mut weights);
    let weighted = weights.iter().enumerate();
    let spread: f64 = weighted.filter_map(|(order, weight)| Some(known(order)? * weight.norm_sqr())).sum();
    let covariance = (0..variance.len()).map(|order| Complex64::from(0.5 * known(order).unwrap_or(0.0)));
    let mut squared: Vec<f64> = fourier.synthesise(covariance).iter().map(|value| value * value).collect();
    let mut of_squares = vec![Complex64::ZERO; fourier.max_order() + 1];
    fourier.analyse_in_place(&mut squared, &mut of_squares);
    fourier.analyse_in_place(&mut bends, &mut weights);
    let pairs = weights.iter().zip(&of_squares).map(|(bend, square)| bend.norm_sqr() * square.re);
    let share = |order: usize| if order == 0 { 1.0 } else { 0.25 };
    let of_bends: f64 = pairs.enumerate().map(|(order, pair)| share(order) * pair).sum();
    Some(Moments {
        about: about / count,
        shift: shift / count,
        std: (spread / 8.0 + 0.5 * of_bends).sqrt(),
        share: square / (squares / count),
        draws: 0,
        lowest: 0.0,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::{texture::ra_um, uncertainty::Errors};

    /// Against 4000 draws, for errors from far below the form to a third of it.
    #[test]
    fn closed_forms_are_those_of_draws() {
        let mut fourier = Fourier::new(720);
        let mut form = vec![Complex64::ZERO; 100];
        for (order, value) in form.iter_mut().enumerate().skip(2) {
            *value = Complex64::from_polar((order as f64).powf(-1.2), 2.3 * order as f64 * order as f64);
        }
        let form_um = fourier.synthesise(form).to_vec();
        for std_um in [0.003, 0.03, 0.3] {
            let of_order =
                |order: usize| 2.0 * std_um * std_um * if order.is_multiple_of(7) { 3.0 } else { 0.7 } / 98.0;
            let variance: Vec<f64> = (0..100).map(of_order).collect();
            let found = of_mean_deviation(&form_um, &variance, &mut fourier).unwrap();
            let mut errors = Errors::new(&variance, 2, 9).unwrap();
            let (mut sum, mut squares, draws) = (0.0, 0.0, 4000.0);
            let mut drawn_um = vec![0.0; form_um.len()];
            for _ in 0..4000 {
                errors.fresh(&mut fourier, &mut drawn_um);
                drawn_um.iter_mut().zip(&form_um).for_each(|(error, form)| *error += form);
                let change = ra_um(&drawn_um) - found.about;
                (sum, squares) = (sum + change, squares + change * change);
            }
            let mean = sum / draws;
            let std = (squares / draws - mean * mean).sqrt();
            assert!((found.about - ra_um(&form_um)).abs() < 1e-12);
            // 1.1 % and 1.6 % of one standard deviation, four of them.
            assert!((found.std / std - 1.0).abs() < 0.05, "{std_um}: {} {std}", found.std);
            assert!((found.shift - mean).abs() < 0.07 * std, "{std_um}: {} {mean} {std}", found.shift);
        }
        assert!(of_mean_deviation(&[f64::NAN; 720], &[1.0; 9], &mut fourier).is_none());
        assert!(of_mean_deviation(&form_um, &[f64::NAN; 9], &mut fourier).is_none());
    }
}
