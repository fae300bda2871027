//! Fields with a common trend: generalised least squares with a covariance of each field, and what it predicts.
//!
//! y_c = X_c·b + f_c + noise, with f_c of covariance s²R(d) + n²·1 and one b for all fields c. b, its covariance and the weights
//! of the prediction follow from the Cholesky factors of the fields' covariance matrices (Rasmussen, Williams, *Gaussian Processes
//! for Machine Learning* (2006), section 2.7; Chilès, Delfiner, *Geostatistics* (2012), section 3.4).
//!
//! Long because fit and prediction share the factors of the covariance matrices.

use faer::{
    Accum, Mat, MatRef, Par, Side,
    linalg::{matmul::matmul, triangular_inverse::invert_lower_triangular},
    reborrow::{Reborrow, ReborrowMut},
};
use nalgebra::{Cholesky, DMatrix, DVector};

use crate::correlation::{Family, Scaled};

/// A stationary covariance: s²R(d) + n² at one place, d scaled by the range of each axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Covariance {
    /// R.
    pub family: Family,
    /// s, a standard deviation.
    pub sill_um: f64,
    /// Range of each axis.
    pub range_mm: [f64; 3],
    /// n, a standard deviation.
    pub nugget_um: f64,
}

/// What was measured of one field.
#[derive(Debug, Clone, Default)]
pub struct Observed {
    /// Mean of the readings at each place, in µm.
    pub mean_um: Vec<f64>,
    /// Variance of their noise where it is known, else 0, in µm².
    pub noise_um2: Vec<f64>,
    /// Share of n² in their variance: 1 where the noise is known and n is real variation, else 1/count.
    pub share: Vec<f64>,
}

/// Scatter of repeats within places, weighted by the noise: what it adds to the sums of the trend.
#[derive(Debug, Clone)]
pub struct Within {
    /// Products of the columns.
    pub design: DMatrix<f64>,
    /// Products of the columns with the readings.
    pub readings: DVector<f64>,
    /// Sum of squares of the readings.
    pub squares: f64,
    /// Readings less places.
    pub dof: usize,
}

/// All that a fit needs besides covariances.
#[derive(Debug, Clone)]
pub struct Data {
    /// Distinct places, in mm.
    pub places: Vec<[f64; 3]>,
    /// What was measured of each field at each of them.
    pub observed: Vec<Observed>,
    /// Columns of the trend in each field, places × columns.
    pub design: Vec<Mat<f64>>,
    /// Repeats, where the noise is known.
    pub within: Option<Within>,
}

impl Data {
    /// Number of the trend's columns.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.design.first().map_or(0, Mat::ncols)
    }
}

/// One field of a [`Joint`].
#[derive(Debug, Clone)]
pub struct Field {
    /// Its covariance.
    pub covariance: Covariance,
    /// K⁻¹(y − X·b).
    pub alpha: Vec<f64>,
    pub(crate) cloud: Scaled,
    /// L of K = L·Lᵀ.
    pub(crate) factor: Mat<f64>,
    /// L⁻¹X.
    pub(crate) white: Mat<f64>,
}

/// A fit of all fields.
#[derive(Debug, Clone)]
pub struct Joint {
    /// The fields.
    pub fields: Vec<Field>,
    /// b.
    pub trend: DVector<f64>,
    /// Its covariance.
    pub trend_covariance: DMatrix<f64>,
    /// ln |K| of all fields.
    pub(crate) ln_determinant: f64,
    /// ln |XᵀK⁻¹X|.
    pub(crate) ln_trend: f64,
    /// (y − X·b)ᵀK⁻¹(y − X·b).
    pub(crate) squares: f64,
}

/// Places that are predicted at once: as many columns as the caches hold beside 1000 places.
const BLOCK: usize = 256;
/// A covariance of the trend with a smaller relative pivot is singular.
const SINGULAR: f64 = 1e-13;

/// Lower half of s²R + diagonal.
pub(crate) fn matrix(covariance: &Covariance, cloud: &Scaled, observed: &Observed) -> Mat<f64> {
    let count = cloud.len();
    let mut all = Mat::<f64>::zeros(count, count);
    let sill = covariance.sill_um * covariance.sill_um;
    let nugget = covariance.nugget_um * covariance.nugget_um;
    for column in 0..count {
        if let Some(out) = all.as_mut().col_mut(column).try_as_col_major_mut() {
            let below = &mut out.as_slice_mut()[column..];
            covariance.family.correlations(cloud.from(column), sill, cloud.at(column), below);
        }
        all[(column, column)] = sill + nugget * observed.share[column] + observed.noise_um2[column];
    }
    all
}

/// What one field adds to the equations of the trend.
#[derive(Debug, Clone)]
pub(crate) struct Sums {
    /// XᵀK⁻¹X.
    pub normal: DMatrix<f64>,
    /// XᵀK⁻¹y.
    pub right: DVector<f64>,
    /// yᵀK⁻¹y.
    pub squares: f64,
    /// ln |K|.
    pub ln_determinant: f64,
}

impl Sums {
    /// Nothing but the scatter of repeats.
    pub fn within(data: &Data) -> Self {
        let columns = data.columns();
        let (mut normal, mut right, mut squares) = (DMatrix::zeros(columns, columns), DVector::zeros(columns), 0.0);
        if let Some(within) = &data.within {
            normal += &within.design;
            right += &within.readings;
            squares += within.squares;
        }
        Self { normal, right, squares, ln_determinant: 0.0 }
    }

    /// Adds those of a field.
    pub fn add(&mut self, other: &Self) {
        self.normal += &other.normal;
        self.right += &other.right;
        self.squares += other.squares;
        self.ln_determinant += other.ln_determinant;
    }

    /// Trend, its covariance, ln of the restricted likelihood.
    pub fn trend(&self) -> Option<(DVector<f64>, DMatrix<f64>, f64)> {
        let (trend, covariance, ln_trend) = solve(&self.normal, &self.right)?;
        let squares = self.squares - trend.dot(&self.right);
        Some((trend, covariance, -0.5 * (self.ln_determinant + ln_trend + squares)))
    }
}

impl Field {
    /// A field of `data` before the trend is known, L⁻¹y, and its sums. `None` where its covariance matrix is not positive definite.
    pub(crate) fn new(data: &Data, index: usize, covariance: &Covariance) -> Option<(Self, Vec<f64>, Sums)> {
        let (observed, design) = (&data.observed[index], &data.design[index]);
        let (columns, count) = (data.columns(), data.places.len());
        let cloud = Scaled::of(&data.places, covariance.range_mm);
        let factor = factor(&matrix(covariance, &cloud, observed))?;
        let mut white = Mat::<f64>::zeros(count, columns + 1);
        for row in 0..count {
            for column in 0..columns {
                white[(row, column)] = design[(row, column)];
            }
            white[(row, columns)] = observed.mean_um[row];
        }
        factor.as_ref().solve_lower_triangular_in_place(white.as_mut());
        let mut products = Mat::<f64>::zeros(columns + 1, columns + 1);
        matmul(products.as_mut(), Accum::Replace, white.transpose(), white.as_ref(), 1.0, Par::Seq);
        let ln_determinant = 2.0 * (0..count).map(|row| factor[(row, row)].ln()).sum::<f64>();
        let sums = Sums {
            normal: DMatrix::from_fn(columns, columns, |row, column| products[(row, column)]),
            right: DVector::from_fn(columns, |row, _| products[(row, columns)]),
            squares: products[(columns, columns)],
            ln_determinant,
        };
        let readings = (0..count).map(|row| white[(row, columns)]).collect();
        white.resize_with(count, columns, |_, _| 0.0);
        Some((Self { covariance: *covariance, alpha: Vec::new(), cloud, factor, white }, readings, sums))
    }
}

impl Joint {
    /// Fits the trend. `None` where a covariance matrix is not positive definite or the trend is not determined.
    #[must_use]
    pub fn new(data: &Data, covariances: &[Covariance]) -> Option<Self> {
        let columns = data.columns();
        let mut sums = Sums::within(data);
        let mut fields = Vec::with_capacity(covariances.len());
        let mut white_readings = Vec::with_capacity(covariances.len());
        for (index, covariance) in covariances.iter().enumerate() {
            let (field, readings, of_field) = Field::new(data, index, covariance)?;
            sums.add(&of_field);
            fields.push(field);
            white_readings.push(readings);
        }
        let (trend, trend_covariance, ln_trend) = solve(&sums.normal, &sums.right)?;
        let squares = sums.squares - trend.dot(&sums.right);
        for (field, readings) in fields.iter_mut().zip(white_readings) {
            let left = |row: usize| {
                readings[row] - (0..columns).map(|column| field.white[(row, column)] * trend[column]).sum::<f64>()
            };
            let mut alpha = Mat::from_fn(readings.len(), 1, |row, _| left(row));
            field.factor.transpose().solve_upper_triangular_in_place(alpha.as_mut());
            field.alpha = (0..readings.len()).map(|row| alpha[(row, 0)]).collect();
        }
        Some(Self { fields, trend, trend_covariance, ln_determinant: sums.ln_determinant, ln_trend, squares })
    }
}

impl Joint {
    /// Normal equations of the same places with other columns of the trend: XᵀK⁻¹X and XᵀK⁻¹y.
    #[must_use]
    pub fn equations(&self, data: &Data) -> (DMatrix<f64>, DVector<f64>) {
        let (columns, count) = (data.columns(), data.places.len());
        let mut normal = DMatrix::<f64>::zeros(columns, columns);
        let mut right = DVector::<f64>::zeros(columns);
        for ((field, observed), design) in self.fields.iter().zip(&data.observed).zip(&data.design) {
            let entry = |row: usize, column: usize| {
                if column < columns { design[(row, column)] } else { observed.mean_um[row] }
            };
            let mut white = Mat::from_fn(count, columns + 1, entry);
            field.factor.as_ref().solve_lower_triangular_in_place(white.as_mut());
            let products = white.transpose() * &white;
            for row in 0..columns {
                for column in 0..columns {
                    normal[(row, column)] += products[(row, column)];
                }
                right[row] += products[(row, columns)];
            }
        }
        if let Some(within) = &data.within {
            normal += &within.design;
            right += &within.readings;
        }
        (normal, right)
    }
}

/// L of a positive definite matrix of which the lower half is given.
pub(crate) fn factor(matrix: &Mat<f64>) -> Option<Mat<f64>> {
    // A matrix with something that is not a number has no factor.
    let all = matrix.llt(Side::Lower).ok()?.L().to_owned();
    (0..all.nrows()).all(|row| all[(row, row)].is_finite() && all[(row, row)] > 0.0).then_some(all)
}

/// Solution, inverse and ln of the determinant of a small positive definite system.
fn solve(normal: &DMatrix<f64>, right: &DVector<f64>) -> Option<(DVector<f64>, DMatrix<f64>, f64)> {
    if right.is_empty() {
        return Some((right.clone(), normal.clone(), 0.0));
    }
    let scale = normal.diagonal().map(|entry| entry.max(f64::MIN_POSITIVE).sqrt().recip());
    let scaled = DMatrix::from_diagonal(&scale) * normal * DMatrix::from_diagonal(&scale);
    let factored = Cholesky::new(scaled)?;
    let diagonal = factored.l_dirty().diagonal();
    if diagonal.iter().any(|entry| entry.is_nan() || entry * entry <= SINGULAR) {
        return None;
    }
    let inverse = DMatrix::from_diagonal(&scale) * factored.inverse() * DMatrix::from_diagonal(&scale);
    let solution = factored.solve(&right.component_mul(&scale)).component_mul(&scale);
    let ln_determinant = 2.0 * diagonal.iter().zip(&scale).map(|(entry, scale)| (entry / scale).ln()).sum::<f64>();
    Some((solution, inverse, ln_determinant))
}

/// A prediction at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Predicted {
    /// Trend and field.
    pub mean_um: f64,
    /// Its variance; NaN where it was not asked for.
    pub variance_um2: f64,
}

/// Reading less prediction from all other places.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOut {
    /// Mean of the readings at the place less prediction, in µm.
    pub residual_um: f64,
    /// Standard deviation expected of it, noise included, in µm.
    pub std_um: f64,
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
        let same = if query.nugget_counts && nugget > 0.0 { self.same(query.places) } else { Vec::new() };
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

    /// Queries that are at a measured place, with this place.
    fn same(&self, queries: &[[f64; 3]]) -> Vec<(usize, usize)> {
        let key = |place: &[f64; 3]| place.map(|value| (value * 1e6).round() as i64);
        let known: std::collections::HashMap<[i64; 3], usize> =
            self.places.iter().enumerate().map(|(index, place)| (key(place), index)).collect();
        queries.iter().enumerate().filter_map(|(row, place)| Some((row, *known.get(&key(place))?))).collect()
    }
}

/// L⁻¹.
pub(crate) fn inverse(factor: &Mat<f64>) -> Mat<f64> {
    let mut inverse = Mat::<f64>::zeros(factor.nrows(), factor.nrows());
    invert_lower_triangular(inverse.as_mut(), factor.as_ref(), Par::Seq);
    inverse
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
