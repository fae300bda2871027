//! The predicted error at many places together, and its root mean square.

use faer::Mat;
use nalgebra::DVector;

use crate::{
    campaign::Campaign,
    joint::{Posterior, Query},
    solve::Solution,
};

/// The predicted error of all measured components at all places, and its covariance.
pub(crate) struct Whole {
    /// Component by component, in µm.
    pub mean_um: DVector<f64>,
    /// In µm².
    pub covariance: Mat<f64>,
}

impl Whole {
    pub(crate) fn new(campaign: &Campaign, fitted: &Solution, places: &[[f64; 3]], factors: [f64; 3]) -> Self {
        let nugget_counts = Solution::nugget_counts(campaign);
        let fields: Vec<(usize, Posterior)> = (fitted.measured.iter().enumerate())
            .map(|(field, axis)| {
                let design = fitted.design(campaign, places, *axis);
                (*axis, fitted.joint.posterior(field, &Query { places, design: design.as_ref(), nugget_counts }))
            })
            .collect();
        let (count, columns) = (places.len(), fitted.terms.len());
        let total = count * fields.len();
        let trend = Mat::from_fn(columns, columns, |row, column| fitted.joint.trend_covariance[(row, column)]);
        let by_trend =
            Mat::from_fn(total, columns, |row, column| fields[row / count].1.by_trend[(row % count, column)]);
        let mut covariance = &by_trend * &trend * by_trend.transpose();
        for (field, (_, posterior)) in fields.iter().enumerate() {
            for column in 0..count {
                for row in 0..count {
                    covariance[(field * count + row, field * count + column)] += posterior.own[(row, column)];
                }
            }
        }
        let factor = |row: usize| factors[fields[row / count].0];
        let covariance =
            Mat::from_fn(total, total, |row, column| factor(row) * factor(column) * covariance[(row, column)]);
        let mean_um = DVector::from_fn(total, |row, _| fields[row / count].1.mean_um[row % count]);
        Self { mean_um, covariance }
    }
}

/// Root mean square length of errors at places, and its standard uncertainty: mean and variance of a quadratic form of normal errors with
/// this mean and covariance (Searle, *Linear Models* (1971), section 2.5).
pub(crate) fn root_mean_square(mean: &DVector<f64>, spread: &Mat<f64>, places: usize) -> [f64; 2] {
    let total = mean.len();
    let trace: f64 = (0..total).map(|at| spread[(at, at)]).sum();
    let (mut squares, mut shifted) = (0.0, 0.0);
    for column in 0..total {
        for row in 0..total {
            squares += spread[(row, column)].powi(2);
            shifted += mean[row] * spread[(row, column)] * mean[column];
        }
    }
    let sum = mean.norm_squared() + trace;
    let rms = (sum / places as f64).sqrt();
    let std = (2.0 * squares + 4.0 * shifted).max(0.0).sqrt() / (2.0 * places as f64 * rms);
    [rms, if rms > 0.0 { std } else { 0.0 }]
}
