//! Joint refit of all effects that are applied: Gauss-Newton with halved steps, relinearised with the effects applied.

use super::{Fit, Model, Setting};
use runout_error::Result;

/// Steps of a refit.
const MAX_STEPS: usize = 12;
/// Halvings of a step that made it worse.
const MAX_HALVINGS: usize = 6;
/// A refit ends when a step changes χ² by less than this share of a degree of freedom's.
const SETTLED: f64 = 1e-3;
/// A parameter whose column adds less than this, relative, to those before it cannot be told from them.
const INDEPENDENT: f64 = 1e-9;

/// Effects applied at their best values.
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
        let step = System::new(&fit, &settings[fixed..]).step();
        let mut share = 1.0;
        let mut better = None;
        for _ in 0..MAX_HALVINGS {
            let mut trial = settings.clone();
            let values = trial[fixed..].iter_mut().flat_map(|setting| &mut setting.values);
            values.zip(&step).for_each(|(value, step)| *value += share * step);
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
    let covariance = System::new(&fit, &settings[fixed..]).covariance();
    Ok(Refit { settings, fit, chi2, covariance })
}

/// The linearised system J δ ≈ −r, factored J = Q R by modified Gram-Schmidt on scaled columns.
struct System {
    /// Qᵀ r.
    projected: Vec<f64>,
    /// R, `[row][column]`, of columns scaled to norm 1; a dependent column has a zero row.
    upper: Vec<Vec<f64>>,
    scale: Vec<f64>,
}

impl System {
    fn new(fit: &impl Fit, free: &[Setting]) -> Self {
        let mut columns: Vec<Vec<f64>> = free.iter().flat_map(|setting| fit.signature(setting.effect)).collect();
        let right = &fit.remainder().residual;
        let count = columns.len();
        let mut scale = Vec::with_capacity(count);
        for column in &mut columns {
            let norm = norm(column);
            let factor = if norm > 0.0 { norm.recip() } else { 0.0 };
            for entry in column.iter_mut() {
                *entry *= factor;
            }
            scale.push(factor);
        }
        let mut upper = vec![vec![0.0; count]; count];
        for index in 0..count {
            let (done, rest) = columns.split_at_mut(index);
            let column = &mut rest[0];
            // Twice is enough (Giraud, Langou, Rozložník, Comput. Math. Appl. 50 (2005) 1069).
            for _ in 0..2 {
                for (row, basis) in done.iter().enumerate() {
                    let share = dot(basis, column);
                    upper[row][index] += share;
                    column.iter_mut().zip(basis).for_each(|(entry, basis)| *entry -= share * basis);
                }
            }
            let left = norm(column);
            if left > INDEPENDENT {
                upper[index][index] = left;
                for entry in column.iter_mut() {
                    *entry /= left;
                }
            } else {
                column.fill(0.0);
            }
        }
        Self { projected: columns.iter().map(|basis| dot(basis, right)).collect(), upper, scale }
    }

    fn back_substitute(&self, mut right: Vec<f64>) -> Vec<f64> {
        for row in (0..right.len()).rev() {
            let diagonal = self.upper[row][row];
            let known: f64 = (row + 1..right.len()).map(|column| self.upper[row][column] * right[column]).sum();
            right[row] = if diagonal > 0.0 { (right[row] - known) / diagonal } else { 0.0 };
        }
        right
    }

    fn step(&self) -> Vec<f64> {
        let solved = self.back_substitute(self.projected.iter().map(|value| -value).collect());
        solved.into_iter().zip(&self.scale).map(|(value, scale)| value * scale).collect()
    }

    /// R⁻¹ R⁻ᵀ, scaled back.
    fn covariance(&self) -> Vec<Vec<f64>> {
        let count = self.scale.len();
        let unit = |index: usize| (0..count).map(|row| if row == index { 1.0 } else { 0.0 }).collect();
        let inverse: Vec<Vec<f64>> = (0..count).map(|column| self.back_substitute(unit(column))).collect();
        let entry = |row: usize, column: usize| -> f64 {
            let product: f64 = inverse.iter().map(|each| each[row] * each[column]).sum();
            product * self.scale[row] * self.scale[column]
        };
        (0..count).map(|row| (0..count).map(|column| entry(row, column)).collect()).collect()
    }
}

/// Scalar product.
#[must_use]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Euclidean norm.
#[must_use]
pub(super) fn norm(vector: &[f64]) -> f64 {
    dot(vector, vector).sqrt()
}
