//! Predictions from a fit, with what the variance needs of the factors.

use faer::{
    Accum, Mat, MatRef, Par,
    linalg::matmul::matmul,
    reborrow::{Reborrow, ReborrowMut},
};
use nalgebra::DVector;

use super::{BLOCK, Joint, inverse};

/// A prediction at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Predicted {
    /// Trend and field.
    pub mean_um: f64,
    /// Its variance; NaN where it was not asked for.
    pub variance_um2: f64,
}

impl Predicted {
    /// Nothing.
    pub(crate) const LOST: Self = Self { mean_um: f64::NAN, variance_um2: f64::NAN };
}

/// What is to be predicted.
pub struct Query<'a> {
    /// Places, in mm.
    pub places: &'a [[f64; 3]],
    /// Columns of the trend there, places × columns.
    pub design: MatRef<'a, f64>,
    /// Whether n² is variation of the field that a prediction has to cover.
    pub nugget_counts: bool,
}

/// Predicts one field after the other, with what the variance needs of the factors.
pub struct Predictor<'a> {
    joint: &'a Joint,
    places: &'a [[f64; 3]],
    /// L⁻¹ of each field that differs from the one before it.
    inverse: Vec<Option<Mat<f64>>>,
}

impl<'a> Predictor<'a> {
    /// `places` are those of the data; `variance` says whether it will be asked for.
    #[must_use]
    pub fn new(joint: &'a Joint, places: &'a [[f64; 3]], variance: bool) -> Self {
        let inverse = joint.fields.iter().map(|field| variance.then(|| inverse(&field.factor)));
        Self { joint, places, inverse: inverse.collect() }
    }

    /// Predicts a field.
    #[must_use]
    pub fn predict(&self, field: usize, query: &Query) -> Vec<Predicted> {
        let known = &self.joint.fields[field];
        let covariance = &known.covariance;
        let (sill, nugget) = (covariance.sill_um.powi(2), covariance.nugget_um.powi(2));
        let scaled = |place: &[f64; 3]| [0, 1, 2].map(|axis| place[axis] / covariance.range_mm[axis]);
        let queries: Vec<[f64; 3]> = query.places.iter().map(scaled).collect();
        let weights: Vec<f64> = known.alpha.iter().map(|alpha| alpha * sill).collect();
        let mut field_um = vec![0.0; queries.len()];
        let columns = self.joint.trend.len();
        let Some(inverse) = &self.inverse[field] else {
            covariance.family.sums(&known.cloud, &weights, &queries, &mut field_um);
            return field_um
                .iter()
                .enumerate()
                .map(|(row, field_um)| {
                    let trend: f64 =
                        (0..columns).map(|column| query.design[(row, column)] * self.joint.trend[column]).sum();
                    Predicted { mean_um: trend + field_um, variance_um2: f64::NAN }
                })
                .collect();
        };
        let count = known.cloud.len();
        let same =
            if query.nugget_counts && nugget > 0.0 { at_measured(self.places, query.places) } else { Vec::new() };
        let alpha = faer::ColRef::from_slice(&known.alpha);
        let mut block = Mat::<f64>::zeros(count, BLOCK);
        let mut white = Mat::<f64>::zeros(count, BLOCK);
        let mut predicted = Vec::with_capacity(queries.len());
        let own = sill + if query.nugget_counts { nugget } else { 0.0 };
        for (start, queries) in queries.chunks(BLOCK).enumerate().map(|(index, part)| (index * BLOCK, part)) {
            let width = queries.len();
            let mut block = block.as_mut().subcols_mut(0, width);
            let mut white = white.as_mut().subcols_mut(0, width);
            for (column, at) in queries.iter().enumerate() {
                if let Some(out) = block.rb_mut().col_mut(column).try_as_col_major_mut() {
                    covariance.family.correlations(known.cloud.from(0), sill, *at, out.as_slice_mut());
                }
            }
            for (row, place) in same.iter().filter(|(row, _)| (start..start + width).contains(row)) {
                block[(*place, row - start)] += nugget;
            }
            multiply_lower(inverse.as_ref(), block.rb(), white.rb_mut());
            let mut means = Mat::<f64>::zeros(width, 1);
            matmul(means.as_mut(), Accum::Replace, block.rb().transpose(), alpha.as_mat(), 1.0, Par::Seq);
            // L⁻¹X against L⁻¹k: what the trend's uncertainty adds.
            let mut shared = Mat::<f64>::zeros(columns, width);
            matmul(shared.as_mut(), Accum::Replace, known.white.transpose(), white.rb(), 1.0, Par::Seq);
            for column in 0..width {
                let row = start + column;
                let mean = means[(column, 0)];
                let trend: f64 = (0..columns).map(|at| query.design[(row, at)] * self.joint.trend[at]).sum();
                let left = DVector::from_fn(columns, |at, _| query.design[(row, at)] - shared[(at, column)]);
                let of_trend = if columns == 0 { 0.0 } else { (&self.joint.trend_covariance * &left).dot(&left) };
                let of_field: f64 = white.rb().col(column).squared_norm_l2();
                let variance_um2 = (own - of_field).max(0.0) + of_trend;
                predicted.push(Predicted { mean_um: trend + mean, variance_um2 });
            }
        }
        predicted
    }
}

/// Queries that are at a measured place, with this place.
#[must_use]
pub(crate) fn at_measured(places: &[[f64; 3]], queries: &[[f64; 3]]) -> Vec<(usize, usize)> {
    let key = |place: &[f64; 3]| place.map(|value| (value * 1e6).round() as i64);
    let known: std::collections::HashMap<[i64; 3], usize> =
        places.iter().enumerate().map(|(index, place)| (key(place), index)).collect();
    queries.iter().enumerate().filter_map(|(row, place)| Some((row, *known.get(&key(place))?))).collect()
}

/// Rows of a lower triangle that are multiplied at once.
const ROWS: usize = 96;

/// lower·right, by rectangles of rows: an eighth more products than needed, each at the speed of a full matrix.
fn multiply_lower(lower: MatRef<f64>, right: MatRef<f64>, mut out: faer::MatMut<f64>) {
    let count = lower.nrows();
    for start in (0..count).step_by(ROWS) {
        let rows = ROWS.min(count - start);
        let end = start + rows;
        let out = out.rb_mut().subrows_mut(start, rows);
        matmul(out, Accum::Replace, lower.submatrix(start, 0, rows, end), right.subrows(0, end), 1.0, Par::Seq);
    }
}
