//! Likelihood of covariances, and their estimation.
//!
//! Restricted likelihood (Patterson, Thompson, Biometrika 58 (1971) 545) where the covariance is what counts; the likelihood itself
//! where trends of different columns are compared. Steps use the average information (Gilmour, Thompson, Cullis, Biometrics 51
//! (1995) 1440), damped after Levenberg and Marquardt: no general optimiser knows this matrix, and with it an estimate takes about
//! ten factorisations.

#![allow(clippy::inline_always, reason = "what is not inlined is compiled for narrow registers")]

use faer::{
    Accum, Mat, Par,
    linalg::matmul::{
        matmul,
        triangular::{self, BlockStructure},
    },
};
use nalgebra::{Cholesky, DMatrix, DVector};
use runout_core::numerics::lanes::fused;

use crate::{
    correlation::{Dots, Family},
    joint::{Covariance, Data, Joint, inverse},
};

/// Parameters of one field: ln of sill, of three ranges, of nugget.
pub(crate) const PARAMETERS: usize = 5;
/// Steps of an estimate at most.
const STEPS: usize = 60;
/// A step that raises ln of the likelihood by less is the last.
const ENOUGH: f64 = 1e-3;
/// Longest step of a logarithm.
const LONGEST: f64 = 1.5;

/// Which likelihood.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Criterion {
    /// Of the readings, the trend at its best.
    Full,
    /// Of what the trend leaves.
    Restricted,
}

/// What is usual of the parameters: normal in their logarithms, wide against what data say. It keeps a range that the data do not
/// determine from running away.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Prior {
    /// Centres.
    pub centre: DVector<f64>,
    /// Inverse variances; infinite for what is fixed at its centre.
    pub precision: DVector<f64>,
}

impl Prior {
    /// ln of its density, but for a constant.
    pub(crate) fn ln(&self, at: &DVector<f64>) -> f64 {
        let term = |((at, centre), precision): ((&f64, &f64), &f64)| {
            if precision.is_finite() { -0.5 * precision * (at - centre).powi(2) } else { 0.0 }
        };
        at.iter().zip(&self.centre).zip(&self.precision).map(term).sum()
    }

    /// That of one field's parameters.
    pub(crate) fn of(&self, field: usize) -> Self {
        let part = |all: &DVector<f64>| all.rows(field * PARAMETERS, PARAMETERS).into_owned();
        Self { centre: part(&self.centre), precision: part(&self.precision) }
    }

    fn is_free(&self, parameter: usize) -> bool {
        self.precision[parameter].is_finite()
    }
}

/// An estimate.
#[derive(Debug, Clone)]
pub(crate) struct Estimate {
    /// Covariance of each field.
    pub covariances: Vec<Covariance>,
    /// Its parameters.
    pub parameters: DVector<f64>,
    /// Their covariance, prior included.
    pub covariance: DMatrix<f64>,
    /// ln of the likelihood and the prior.
    pub ln_likelihood: f64,
    /// The fit.
    pub joint: Joint,
}

/// Covariances of parameters, each of a family of its own.
#[must_use]
pub(crate) fn covariances(families: &[Family], parameters: &DVector<f64>) -> Vec<Covariance> {
    let one = |(family, field): (&Family, &[f64])| Covariance {
        family: *family,
        sill_um: field[0].exp(),
        range_mm: [1, 2, 3].map(|axis| field[axis].exp()),
        nugget_um: field[4].exp(),
    };
    families.iter().zip(parameters.as_slice().chunks_exact(PARAMETERS)).map(one).collect()
}

/// ln of the likelihood of a fit.
#[must_use]
pub(crate) fn ln_likelihood(joint: &Joint, criterion: Criterion) -> f64 {
    let of_trend = if criterion == Criterion::Restricted { joint.ln_trend } else { 0.0 };
    -0.5 * (joint.ln_determinant + of_trend + joint.squares)
}

/// The most likely covariances of a family a field, from a start on. `None` where no step is possible.
#[must_use]
pub(crate) fn estimate(
    data: &Data,
    families: &[Family],
    prior: &Prior,
    start: &DVector<f64>,
    criterion: Criterion,
) -> Option<Estimate> {
    let at = |parameters: &DVector<f64>| {
        let joint = Joint::new(data, &covariances(families, parameters))?;
        let value = ln_likelihood(&joint, criterion) + prior.ln(parameters);
        value.is_finite().then_some((value, joint))
    };
    let mut parameters = start.clone();
    let (mut value, mut joint) = at(&parameters)?;
    let mut slope = slope(data, &joint, prior, &parameters, criterion);
    let mut damping = 1e-2;
    for _ in 0..STEPS {
        let mut moved = false;
        while damping < 1e8 {
            let step = step(&slope, prior, damping)?;
            let next = &parameters + &step;
            match at(&next) {
                Some((better, fit)) if better >= value => {
                    moved = better - value > ENOUGH;
                    (parameters, value, joint) = (next, better, fit);
                    damping = (damping * 0.15_f64).max(1e-6);
                    break;
                }
                _ => damping *= 6.0,
            }
        }
        if !moved {
            break;
        }
        slope = self::slope(data, &joint, prior, &parameters, criterion);
    }
    let covariance = inverse_of(&slope.information, prior);
    let covariances = covariances(families, &parameters);
    Some(Estimate { covariances, parameters, covariance, ln_likelihood: value, joint })
}

/// Gradient and average information, prior included.
#[derive(Debug, Clone)]
struct Slope {
    gradient: DVector<f64>,
    information: DMatrix<f64>,
}

fn step(slope: &Slope, prior: &Prior, damping: f64) -> Option<DVector<f64>> {
    let mut system = slope.information.clone();
    for index in 0..system.nrows() {
        system[(index, index)] += damping * (system[(index, index)] + 0.1);
        if !prior.is_free(index) {
            system.row_mut(index).fill(0.0);
            system.column_mut(index).fill(0.0);
            system[(index, index)] = 1.0;
        }
    }
    let gradient =
        DVector::from_fn(
            slope.gradient.len(),
            |index, _| if prior.is_free(index) { slope.gradient[index] } else { 0.0 },
        );
    let mut step = Cholesky::new(system)?.solve(&gradient);
    // A field that is far from its best does not hold the others back.
    for field in step.as_mut_slice().chunks_exact_mut(PARAMETERS) {
        let longest = field.iter().fold(0.0_f64, |longest, one| longest.max(one.abs()));
        if longest > LONGEST {
            field.iter_mut().for_each(|one| *one *= LONGEST / longest);
        }
    }
    Some(step)
}

fn inverse_of(information: &DMatrix<f64>, prior: &Prior) -> DMatrix<f64> {
    let count = information.nrows();
    let free: Vec<usize> = (0..count).filter(|index| prior.is_free(*index)).collect();
    let part = DMatrix::from_fn(free.len(), free.len(), |row, column| information[(free[row], free[column])]);
    let mut whole = DMatrix::zeros(count, count);
    if let Some(factored) = Cholesky::new(part) {
        let inverse = factored.inverse();
        for (row, to_row) in free.iter().enumerate() {
            for (column, to_column) in free.iter().enumerate() {
                whole[(*to_row, *to_column)] = inverse[(row, column)];
            }
        }
    }
    whole
}

fn slope(data: &Data, joint: &Joint, prior: &Prior, at: &DVector<f64>, criterion: Criterion) -> Slope {
    let total = at.len();
    let mut gradient = DVector::zeros(total);
    let mut information = DMatrix::zeros(total, total);
    let columns = joint.trend.len();
    // L⁻¹X against L⁻¹a for each parameter.
    let mut shared = DMatrix::<f64>::zeros(columns, total);
    for (index, field) in joint.fields.iter().enumerate() {
        let first = index * PARAMETERS;
        let count = data.places.len();
        let projection = projection(joint, index, criterion);
        let alpha = &field.alpha;
        let Covariance { family, sill_um, nugget_um, .. } = field.covariance;
        let (sill, nugget) = (sill_um * sill_um, nugget_um * nugget_um);
        let mut pull = Mat::<f64>::zeros(count, PARAMETERS);
        let mut sums = [0.0; PARAMETERS];
        let mut values = vec![0.0; count];
        let mut slopes = vec![0.0; count];
        let mut by_axis = [vec![0.0; count], vec![0.0; count], vec![0.0; count]];
        for column in 0..count {
            let place = field.cloud.at(column);
            family.slopes(&field.cloud, place, &mut values, &mut slopes);
            for (axis, products) in by_axis.iter_mut().enumerate() {
                let coordinates = field.cloud.axes[axis].iter();
                for ((product, slope), coordinate) in products.iter_mut().zip(&slopes).zip(coordinates) {
                    *product = slope * (coordinate - place[axis]) * (coordinate - place[axis]);
                }
            }
            let [x, y, z] = &by_axis;
            let mut weighted = [0.0; 4];
            fused(Dots { one: alpha, others: [&values, x, y, z], out: &mut weighted });
            let mut traces = [0.0; 4];
            if let Some(of_place) = projection.col(column).try_as_col_major() {
                fused(Dots { one: of_place.as_slice(), others: [&values, x, y, z], out: &mut traces });
            }
            let share = data.observed[index].share[column];
            for (parameter, factor) in [2.0, 1.0, 1.0, 1.0].into_iter().enumerate() {
                pull[(column, parameter)] = factor * sill * weighted[parameter];
                sums[parameter] += factor * sill * traces[parameter];
            }
            pull[(column, 4)] = 2.0 * nugget * share * alpha[column];
            sums[4] += 2.0 * nugget * share * projection[(column, column)];
        }
        for (parameter, sum) in sums.iter().enumerate() {
            gradient[first + parameter] = -0.5 * sum;
        }
        field.factor.as_ref().solve_lower_triangular_in_place(pull.as_mut());
        let own = pull.transpose() * &pull;
        let with_trend = field.white.transpose() * &pull;
        for row in 0..PARAMETERS {
            for column in 0..PARAMETERS {
                information[(first + row, first + column)] += 0.5 * own[(row, column)];
            }
            for column in 0..columns {
                shared[(column, first + row)] = with_trend[(column, row)];
            }
        }
    }
    if columns > 0 {
        information -= 0.5 * shared.transpose() * &joint.trend_covariance * &shared;
    }
    for index in (0..total).filter(|index| prior.is_free(*index)) {
        gradient[index] -= prior.precision[index] * (at[index] - prior.centre[index]);
        information[(index, index)] += prior.precision[index];
    }
    Slope { gradient, information }
}

/// K⁻¹ − αα ᵀ, less what the trend takes where the likelihood is the restricted one.
fn projection(joint: &Joint, index: usize, criterion: Criterion) -> Mat<f64> {
    let field = &joint.fields[index];
    let count = field.alpha.len();
    let lower = inverse(&field.factor);
    let mut all = Mat::<f64>::zeros(count, count);
    triangular::matmul(
        all.as_mut(),
        BlockStructure::TriangularLower,
        Accum::Replace,
        lower.transpose(),
        BlockStructure::TriangularUpper,
        lower.as_ref(),
        BlockStructure::TriangularLower,
        1.0,
        Par::Seq,
    );
    for column in 0..count {
        for row in column + 1..count {
            all[(column, row)] = all[(row, column)];
        }
    }
    let columns = joint.trend.len();
    let with_trend = criterion == Criterion::Restricted && columns > 0;
    let rank = if with_trend { columns + 1 } else { 1 };
    let mut left = Mat::<f64>::zeros(count, rank);
    let mut right = Mat::<f64>::zeros(count, rank);
    for row in 0..count {
        left[(row, 0)] = field.alpha[row];
        right[(row, 0)] = field.alpha[row];
    }
    if with_trend {
        let mut back = field.white.clone();
        field.factor.transpose().solve_upper_triangular_in_place(back.as_mut());
        let covariance = Mat::from_fn(columns, columns, |row, column| joint.trend_covariance[(row, column)]);
        let weighted = &back * &covariance;
        for row in 0..count {
            for column in 0..columns {
                left[(row, column + 1)] = back[(row, column)];
                right[(row, column + 1)] = weighted[(row, column)];
            }
        }
    }
    matmul(all.as_mut(), Accum::Add, left.as_ref(), right.transpose(), -1.0, Par::Seq);
    all
}
