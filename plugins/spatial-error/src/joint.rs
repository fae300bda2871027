//! Fields with a common trend: generalised least squares with a covariance of each field, and what it predicts.
//!
//! y_c = X_c·b + f_c + noise, with f_c of covariance s²R(d) + n²·1 and one b for all fields c. b, its covariance and the weights
//! of the prediction follow from the Cholesky factors of the fields' covariance matrices (Rasmussen, Williams, *Gaussian Processes
//! for Machine Learning* (2006), section 2.7; Chilès, Delfiner, *Geostatistics* (2012), section 3.4).

mod posterior;
mod predict;

pub(crate) use posterior::Posterior;
pub(crate) use predict::at_measured;
pub use predict::{Predicted, Predictor, Query};

use faer::{
    Accum, Mat, Par, Side,
    linalg::{matmul::matmul, triangular_inverse::invert_lower_triangular},
};
use nalgebra::{Cholesky, DMatrix, DVector};

use crate::{
    correlation::{Family, Scaled},
    shared_errors::SharedErrors,
};

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
    /// Errors that the means share, where they depend on each other in time.
    pub shared: Option<SharedErrors>,
}

impl Observed {
    /// Variance of the noise of a mean, with what it shares with others, in µm².
    #[must_use]
    pub(crate) fn variance_um2(&self, place: usize) -> f64 {
        self.noise_um2[place] + self.shared.as_ref().map_or(0.0, |shared| shared.covariance_um2(place, place))
    }
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
        if let Some(shared) = &observed.shared {
            (column..count).for_each(|row| all[(row, column)] += shared.covariance_um2(row, column));
        }
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
    pub(crate) fn within(data: &Data) -> Self {
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
    pub(crate) fn add(&mut self, other: &Self) {
        self.normal += &other.normal;
        self.right += &other.right;
        self.squares += other.squares;
        self.ln_determinant += other.ln_determinant;
    }

    /// Trend, its covariance, ln of the restricted likelihood.
    pub(crate) fn trend(&self) -> Option<(DVector<f64>, DMatrix<f64>, f64)> {
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

/// Reading less prediction from all other places.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LeftOut {
    /// Mean of the readings at the place less prediction, in µm.
    pub residual_um: f64,
    /// Standard deviation expected of it, noise included, in µm.
    pub std_um: f64,
}

impl LeftOut {
    /// Nothing.
    pub(crate) const LOST: Self = Self { residual_um: f64::NAN, std_um: f64::NAN };
}

/// L⁻¹.
pub(crate) fn inverse(factor: &Mat<f64>) -> Mat<f64> {
    let mut inverse = Mat::<f64>::zeros(factor.nrows(), factor.nrows());
    invert_lower_triangular(inverse.as_mut(), factor.as_ref(), Par::Seq);
    inverse
}
