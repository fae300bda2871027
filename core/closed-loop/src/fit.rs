//! Joint refit of all effects that are applied: Gauss-Newton with halved steps, relinearised with the effects applied.

use super::{Fit, Model, Setting};
use runout_error::Result;
use runout_numerics::least_squares::Basis;

/// Steps of a refit.
const MAX_STEPS: usize = 12;
/// Halvings of a step that made it worse.
const MAX_HALVINGS: usize = 6;
/// A refit ends when a step changes χ² by less than this share of a degree of freedom's.
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
    /// Covariance of the free parameters, `[parameter][parameter]`, for noise of size 1 in the residual.
    pub covariance: Vec<Vec<f64>>,
}

/// Fits the parameters of all settings but the first `fixed` ones.
///
/// # Errors
/// When the model cannot be fitted even where the refit starts.
pub fn refit<M: Model>(model: &M, start: Vec<Setting>, fixed: usize) -> Result<Refit<M::Fit>> {
    let mut settings = start;
    let mut fit = model.fit(&settings)?;
    let mut chi2 = fit.remainder().chi2();
    for _ in 0..MAX_STEPS {
        let step = system(&fit, &settings[fixed..]).coefficients(&fit.remainder().residual);
        let mut share = 1.0;
        let mut better = None;
        for _ in 0..MAX_HALVINGS {
            let mut trial = settings.clone();
            let values = trial[fixed..].iter_mut().flat_map(|setting| &mut setting.values);
            values.zip(&step).for_each(|(value, step)| *value -= share * step);
            // A trial beyond all bounds is as bad as a worse one.
            if let Ok(found) = model.fit(&trial) {
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
        let unit = found.remainder().chi2_per_dof().min(1.0);
        (settings, fit, chi2) = (trial, found, found_chi2);
        if gained < SETTLED * unit {
            break;
        }
    }
    let covariance = system(&fit, &settings[fixed..]).covariance();
    Ok(Refit { settings, fit, chi2, covariance })
}

/// The linearised system J δ ≈ −r.
fn system(fit: &impl Fit, free: &[Setting]) -> Basis {
    Basis::of(free.iter().flat_map(|setting| fit.signature(setting.effect)).collect())
}
