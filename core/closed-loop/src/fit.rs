//! Joint refit of all effects that are applied: Gauss-Newton with halved steps, relinearised with the effects applied.

use super::{Fit, Model, OpenWithinBound, Remainder, Setting};
use runout_error::Result;
use runout_numerics::least_squares::Basis;

/// Steps of a refit.
const MAX_STEPS: usize = 12;
/// Halvings of a step that made it worse.
const MAX_HALVINGS: usize = 6;
/// A refit ends when a step changes χ² by less than this share of a degree of freedom's, or promises less.
const SETTLED: f64 = 1e-3;
/// A column that adds less than this, relative, to those before it is no other effect.
pub(super) const INDEPENDENT: f64 = 1e-9;

/// Effects applied at their best values.
#[non_exhaustive]
pub struct Refit<F> {
    /// The effects and values; fixed ones first.
    pub settings: Vec<Setting>,
    /// The model's fit with them.
    pub fit: F,
    /// χ² of the data alone.
    pub chi2: f64,
    /// Covariance of the free parameters, `[parameter][parameter]`, for noise of size 1 in the residual, with what is
    /// [open within bounds](Fit::open_within_bounds).
    pub covariance: Vec<Vec<f64>>,
    /// Whether χ² is lower still at [values that are not possible](Model::is_possible).
    pub ends_at_bound: bool,
}

impl<F: Fit> Refit<F> {
    /// The refit with what the fit leaves in place of the fit.
    pub(super) fn remainder_only(self) -> Refit<Remainder> {
        let Self { settings, fit, chi2, covariance, ends_at_bound } = self;
        Refit { settings, fit: fit.remainder().clone(), chi2, covariance, ends_at_bound }
    }
}

/// Fits the parameters of all settings but the first `fixed` ones.
///
/// # Errors
/// When the model cannot be fitted even where the refit starts.
pub fn refit<M: Model>(model: &M, start: Vec<Setting>, fixed: usize) -> Result<Refit<M::Fit>> {
    let mut settings = start;
    let mut fit = model.fit(&settings)?;
    let mut chi2 = fit.remainder().chi2();
    let mut system = linearised(&fit, &settings[fixed..]);
    let mut ends_at_bound = false;
    for _ in 0..MAX_STEPS {
        ends_at_bound = false;
        if system.explained(&fit.remainder().residual) < settled(fit.remainder()) {
            break;
        }
        let step = system.coefficients(&fit.remainder().residual);
        let mut share = 1.0;
        let mut better = None;
        for _ in 0..MAX_HALVINGS {
            let mut trial = settings.clone();
            let values = trial[fixed..].iter_mut().flat_map(|setting| &mut setting.values);
            values.zip(&step).for_each(|(value, step)| *value -= share * step);
            let is_possible = trial[fixed..].iter().all(|setting| model.is_possible(setting.effect, &setting.values));
            ends_at_bound |= !is_possible;
            // A trial beyond all bounds is as bad as a worse one.
            if is_possible && let Ok(found) = model.fit(&trial) {
                let found_chi2 = found.remainder().chi2();
                if found_chi2 < chi2 {
                    better = Some((trial, found, found_chi2));
                    break;
                }
            }
            share *= 0.5;
        }
        let Some((trial, found, found_chi2)) = better else { break };
        let gained = chi2 - found_chi2;
        (settings, fit, chi2) = (trial, found, found_chi2);
        system = linearised(&fit, &settings[fixed..]);
        if gained < settled(fit.remainder()) {
            break;
        }
    }
    let mut covariance = system.covariance();
    widen_by_open_parameters(&mut covariance, &system, &settings[fixed..]);
    for open in fit.open_within_bounds() {
        widen(&mut covariance, &system, &open);
    }
    Ok(Refit { settings, fit, chi2, covariance, ends_at_bound })
}

/// What is to be taken off the parameters of free effects, to first order, `[parameter]`.
pub(super) fn first_step(fit: &impl Fit, free: &[Setting]) -> Vec<f64> {
    linearised(fit, free).coefficients(&fit.remainder().residual)
}

/// Change of χ² that is none.
fn settled(remainder: &Remainder) -> f64 {
    SETTLED * remainder.chi2_per_dof()
}

/// The linearised system J δ ≈ −r.
fn linearised(fit: &impl Fit, free: &[Setting]) -> Basis {
    Basis::of(free.iter().flat_map(|setting| fit.signature(setting.effect)).collect())
}

/// Adds what the data leave open within an effect: a parameter whose trace is that of others of the same effect may be as large as those are
/// found, and the others with it.
fn widen_by_open_parameters(covariance: &mut [Vec<f64>], system: &Basis, free: &[Setting]) {
    for (column, open) in system.null_directions() {
        let mut before = 0;
        let effect = free.iter().find(|setting| {
            before += setting.values.len();
            column < before
        });
        let Some(Setting { values, .. }) = effect else { continue };
        let found = values.iter().filter(|value| **value != 0.0).count().max(1);
        let square = values.iter().map(|value| value * value).sum::<f64>() / found as f64;
        for (row, of_row) in covariance.iter_mut().zip(&open) {
            row.iter_mut().zip(&open).for_each(|(entry, of_column)| *entry += square * of_row * of_column);
        }
    }
}

/// Adds to the variance of each parameter the square of what the harmonic to which it is most sensitive moves it by, at the phase
/// that moves it most.
fn widen(covariance: &mut [Vec<f64>], system: &Basis, open: &OpenWithinBound) {
    let mut largest = vec![0.0_f64; covariance.len()];
    for [cosine, sine] in &open.harmonics {
        let moved = system.coefficients(cosine).into_iter().zip(system.coefficients(sine));
        for (largest, (cosine, sine)) in largest.iter_mut().zip(moved) {
            *largest = largest.max(cosine * cosine + sine * sine);
        }
    }
    for (parameter, square) in largest.into_iter().enumerate() {
        covariance[parameter][parameter] += square;
    }
}
