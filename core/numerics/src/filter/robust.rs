//! The robust Gaussian regression filter (ISO 16610-31).

use super::Smoother;
use crate::statistics::upper_median;

/// c over the median |z − w|: the biweight's limit at three standard deviations of normal noise (ISO 16610-31).
const LIMIT: f64 = 4.4478;
/// The iteration ends when the limit moves by less than this share.
const SETTLED: f64 = 1e-4;
/// Iterations at most; ordinary profiles need 5 to 15.
pub(super) const MOST_ITERATIONS: usize = 50;

/// What a robust filter makes of a profile.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Robust {
    /// The waviness; NaN where the profile is.
    pub low_pass: Vec<f64>,
    /// Say of each point, 0 (a scratch) to 1.
    pub weights: Vec<f64>,
    /// Iterations made.
    pub iterations: usize,
    /// Whether the limit came to rest.
    pub settled: bool,
}

/// The robust Gaussian filter (ISO 16610-31): a Gaussian regression is repeated with Tukey's biweight
/// δ = (1 − (r/c)²)² for |r| ≤ c and 0 beyond, of r = z − w with c = 4.4478 median |r|.
///
/// The standard takes a smoother of [`Degree::Two`](super::Degree::Two).
#[must_use]
pub fn robust_gaussian(smoother: &Smoother, profile: &[f64]) -> Robust {
    let mut weights = vec![1.0; profile.len()];
    let mut low_pass = smoother.low_pass(profile, None);
    let mut biweight = Biweight::default();
    for iterations in 1..=MOST_ITERATIONS {
        if biweight.next(profile, &low_pass, &mut weights) {
            return Robust { low_pass, weights, iterations, settled: true };
        }
        low_pass = smoother.low_pass(profile, Some(&weights));
    }
    Robust { low_pass, weights, iterations: MOST_ITERATIONS, settled: false }
}

/// Tukey's biweight from iteration to iteration.
#[derive(Debug, Clone, Copy)]
pub(super) struct Biweight {
    previous: f64,
}

impl Default for Biweight {
    fn default() -> Self {
        Self { previous: f64::INFINITY }
    }
}

impl Biweight {
    /// Weights by what the filter leaves; or that its limit has come to rest, and weights are as they were.
    pub(super) fn next(&mut self, profile: &[f64], low_pass: &[f64], weights: &mut [f64]) -> bool {
        let residual = || profile.iter().zip(low_pass).map(|(value, waviness)| (value - waviness).abs());
        let mut known: Vec<f64> = residual().filter(|value| value.is_finite()).collect();
        let limit = LIMIT * upper_median(&mut known).unwrap_or(0.0);
        // Half of the points lie on the waviness: there is nothing left to weigh by.
        if limit == 0.0 || !limit.is_finite() || (limit - self.previous).abs() <= SETTLED * limit {
            return true;
        }
        for (weight, residual) in weights.iter_mut().zip(residual()) {
            *weight = if residual < limit { (1.0 - (residual / limit).powi(2)).powi(2) } else { 0.0 };
        }
        self.previous = limit;
        false
    }
}
