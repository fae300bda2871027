//! Orthogonal columns: fits, and what they predict of points left out.

#![allow(clippy::inline_always, reason = "see `lanes`")]

use nalgebra::{DMatrix, DVectorView, SymmetricEigen};

use crate::lanes::{NullaryFnOnce, vectorised};

/// A column whose part outside the span of those before it is smaller than this, relative, depends on them.
const INDEPENDENT: f64 = 1e-9;
/// Directions that the remaining points determine with less than this share of their weight are not determined at all.
const DETERMINED: f64 = 1e-12;

/// Sums that a scalar product is made of, so that additions do not wait for each other.
const LANES: usize = 8;

/// Scalar product.
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    if a.len() < LONG { summed(a, b) } else { vectorised(Dot(a, b)) }
}

/// Entries from which on wide registers are worth a choice between them.
const LONG: usize = 64;

struct Dot<'a>(&'a [f64], &'a [f64]);

impl NullaryFnOnce for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        summed(self.0, self.1)
    }
}

#[inline(always)]
fn summed(a: &[f64], b: &[f64]) -> f64 {
    let count = a.len().min(b.len());
    let (a, a_rest) = a[..count].as_chunks::<LANES>();
    let (b, b_rest) = b[..count].as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// Euclidean norm.
#[must_use]
pub fn norm(vector: &[f64]) -> f64 {
    dot(vector, vector).sqrt()
}

/// Columns made orthonormal to a basis and to each other. A column of which less than `tolerance`, relative, is outside the
/// span of those before it is left out.
#[must_use]
pub fn orthonormal(columns: Vec<Vec<f64>>, basis: &[Vec<f64>], tolerance: f64) -> Vec<Vec<f64>> {
    let mut made: Vec<Vec<f64>> = Vec::with_capacity(columns.len());
    for mut column in columns {
        let whole = norm(&column);
        let one = std::slice::from_mut(&mut column);
        take_out(&basis.iter().chain(&made), one, &mut [vec![0.0; basis.len() + made.len()]]);
        let left = norm(&column);
        if left > tolerance * whole {
            divide(&mut column, left);
            made.push(column);
        }
    }
    made
}

/// Takes the span of orthonormal columns out of some columns, and adds what each was to their `shares`. Twice is enough (Giraud, Langou,
/// Rozložník, Comput. Math. Appl. 50 (2005) 1069).
fn take_out<'a>(
    span: &(impl Iterator<Item = &'a Vec<f64>> + Clone),
    columns: &mut [Vec<f64>],
    shares: &mut [Vec<f64>],
) {
    vectorised(TakeOut { span, columns, shares });
}

struct TakeOut<'a, I> {
    span: &'a I,
    columns: &'a mut [Vec<f64>],
    shares: &'a mut [Vec<f64>],
}

impl<'a, I: Iterator<Item = &'a Vec<f64>> + Clone> NullaryFnOnce for TakeOut<'_, I> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { span, columns, shares } = self;
        for _ in 0..2 {
            for (place, other) in span.clone().enumerate() {
                for (column, shares) in columns.iter_mut().zip(shares.iter_mut()) {
                    let part = summed(other, column);
                    shares[place] += part;
                    column.iter_mut().zip(other).for_each(|(entry, other)| *entry -= part * other);
                }
            }
        }
    }
}

/// Columns that are made orthogonal to those before them at once: each of these comes from memory once for all of them.
const PANEL: usize = 8;

fn divide(column: &mut [f64], by: f64) {
    for entry in column {
        *entry /= by;
    }
}

/// A = Q·R by modified Gram-Schmidt, twice; a column that depends on those before it has none in Q, and the parameter 0.
///
/// ```
/// use runout_numerics::least_squares::Basis;
///
/// // A line through (0, 1), (1, 3), (2, 5).
/// let line = Basis::of(vec![vec![1.0, 1.0, 1.0], vec![0.0, 1.0, 2.0]]);
/// let found = line.coefficients(&[1.0, 3.0, 5.0]);
/// assert!((found[0] - 1.0).abs() < 1e-12 && (found[1] - 2.0).abs() < 1e-12);
/// ```
#[derive(Debug, Clone)]
pub struct Basis {
    /// Q, `[column][point]`.
    orthonormal: Vec<Vec<f64>>,
    /// R, `[column]`: the column's shares of those of Q so far, its own the last where it is independent.
    shares: Vec<Vec<f64>>,
    /// Of each independent column, its place in A.
    independent: Vec<usize>,
}

impl Basis {
    /// Of columns, one after the other.
    #[must_use]
    pub fn of(columns: Vec<Vec<f64>>) -> Self {
        Self { orthonormal: Vec::new(), shares: Vec::new(), independent: Vec::new() }.extended(columns)
    }

    /// With more columns.
    #[must_use]
    pub fn extended(&self, mut columns: Vec<Vec<f64>>) -> Self {
        let mut made = self.clone();
        for panel in columns.chunks_mut(PANEL) {
            let before = made.rank();
            let whole: Vec<f64> = panel.iter().map(|column| norm(column)).collect();
            let mut shares = vec![vec![0.0; before]; panel.len()];
            take_out(&made.orthonormal.iter(), panel, &mut shares);
            for ((column, mut shares), whole) in panel.iter_mut().zip(shares).zip(whole) {
                let mut column = std::mem::take(column);
                let mut own = [vec![0.0; made.rank() - before]];
                take_out(&made.orthonormal[before..].iter(), std::slice::from_mut(&mut column), &mut own);
                shares.extend(own.into_iter().flatten());
                let left = norm(&column);
                if left > INDEPENDENT * whole {
                    divide(&mut column, left);
                    made.independent.push(made.shares.len());
                    made.orthonormal.push(column);
                    shares.push(left);
                }
                made.shares.push(shares);
            }
        }
        made
    }

    /// Of the first columns only.
    #[must_use]
    pub fn first(mut self, columns: usize) -> Self {
        self.shares.truncate(columns);
        self.independent.retain(|column| *column < columns);
        self.orthonormal.truncate(self.independent.len());
        self
    }

    /// Columns before the first one that depends on those before it.
    #[must_use]
    pub fn leading(&self) -> usize {
        self.independent.iter().enumerate().take_while(|(place, column)| place == *column).count()
    }

    /// What each dependent column (its place in A) leaves open: coefficients x with A·x = 0 and 1 for that column.
    #[must_use]
    pub fn null_directions(&self) -> Vec<(usize, Vec<f64>)> {
        let dependent = (0..self.shares.len()).filter(|column| !self.independent.contains(column));
        let direction = |column: usize| {
            let mut shares = self.shares[column].clone();
            shares.resize(self.rank(), 0.0);
            let mut open: Vec<f64> = self.solve_upper(shares).iter().map(|value| -value).collect();
            open[column] = 1.0;
            (column, open)
        };
        dependent.map(direction).collect()
    }

    /// Number of independent columns.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.orthonormal.len()
    }

    /// The orthonormal columns Q, `[column][point]`.
    #[must_use]
    pub fn columns(&self) -> &[Vec<f64>] {
        &self.orthonormal
    }

    /// What each coefficient is of the values, `[coefficient][point]`: x = weights·values; 0 for a dependent column.
    #[must_use]
    pub fn weights(&self) -> Vec<Vec<f64>> {
        let points = self.orthonormal.first().map_or(0, Vec::len);
        let mut weights = vec![vec![0.0; points]; self.shares.len()];
        for (column, orthonormal) in self.inverse().iter().zip(&self.orthonormal) {
            for (weights, share) in weights.iter_mut().zip(column).filter(|(_, share)| **share != 0.0) {
                weights.iter_mut().zip(orthonormal).for_each(|(weight, entry)| *weight += share * entry);
            }
        }
        weights
    }

    /// ln √det AᵀA of the independent columns: the sum of ln R_kk.
    #[must_use]
    pub fn log_determinant(&self) -> f64 {
        self.independent.iter().filter_map(|column| self.shares[*column].last()).map(|own| own.ln()).sum()
    }

    /// Whether a column is in the span of those before it.
    #[must_use]
    pub fn dependent(&self) -> bool {
        self.rank() < self.shares.len()
    }

    /// Share of each place in the span: the diagonal of Q·Qᵀ.
    #[must_use]
    pub fn leverage(&self) -> Vec<f64> {
        let places = self.orthonormal.first().map_or(0, Vec::len);
        (0..places).map(|place| self.orthonormal.iter().map(|column| column[place] * column[place]).sum()).collect()
    }

    /// By how much the squares of `values` are less without what the columns can make.
    #[must_use]
    pub fn explained(&self, values: &[f64]) -> f64 {
        self.orthonormal.iter().map(|column| dot(column, values).powi(2)).sum()
    }

    /// Takes out of `values` what the columns can make.
    pub fn remove_from(&self, values: &mut [f64]) {
        for column in &self.orthonormal {
            let share = dot(column, values);
            values.iter_mut().zip(column).for_each(|(entry, column)| *entry -= share * column);
        }
    }

    /// x with |A·x − values| least, one a column of A: R·x = Qᵀ·values, and 0 for a dependent column.
    #[must_use]
    pub fn coefficients(&self, values: &[f64]) -> Vec<f64> {
        self.solve_upper(self.orthonormal.iter().map(|column| dot(column, values)).collect())
    }

    /// Diagonal of [`covariance`](Self::covariance).
    #[must_use]
    pub fn unit_variance(&self) -> Vec<f64> {
        let mut variance = vec![0.0; self.shares.len()];
        for column in self.inverse() {
            variance.iter_mut().zip(column).for_each(|(sum, entry)| *sum += entry * entry);
        }
        variance
    }

    /// (AᵀA)⁻¹ = R⁻¹·R⁻ᵀ: the covariance of the coefficients for uncorrelated errors of variance 1; 0 for a dependent column.
    #[must_use]
    pub fn covariance(&self) -> Vec<Vec<f64>> {
        let (count, inverse) = (self.shares.len(), self.inverse());
        let entry = |row: usize, column: usize| inverse.iter().map(|each| each[row] * each[column]).sum();
        (0..count).map(|row| (0..count).map(|column| entry(row, column)).collect()).collect()
    }

    /// The columns of R⁻¹, one an independent column: of the leading columns alone it has the first of them.
    #[must_use]
    pub fn inverse(&self) -> Vec<Vec<f64>> {
        let unit = |unit: usize| (0..self.rank()).map(|row| if row == unit { 1.0 } else { 0.0 }).collect();
        (0..self.rank()).map(|row| self.solve_upper(unit(row))).collect()
    }

    fn solve_upper(&self, mut right: Vec<f64>) -> Vec<f64> {
        let mut solution = vec![0.0; self.shares.len()];
        for (row, column) in self.independent.iter().enumerate().rev() {
            if right[row] == 0.0 {
                continue;
            }
            let shares = &self.shares[*column];
            let found = right[row] / shares[row];
            solution[*column] = found;
            right[..row].iter_mut().zip(shares).for_each(|(right, share)| *right -= share * found);
        }
        solution
    }

    /// Each point less what the fit to the points outside its group predicts of it.
    ///
    /// With r what the fit to all points leaves, it is r_g + Q_g·(1 − Q_gᵀQ_g)⁻¹·Q_gᵀr_g: the others' normal matrix is
    /// 1 − Q_gᵀQ_g, well conditioned because Q is orthonormal. A direction that only the group shows is predicted as 0.
    #[must_use]
    pub fn left_out(&self, values: &[f64], groups: &[Vec<usize>]) -> Vec<f64> {
        let mut left = values.to_vec();
        self.remove_from(&mut left);
        let mut found = left.clone();
        for points in groups {
            for (direction, share) in self.followed(points) {
                let along = |of: &[f64]| direction.iter().zip(points).map(|(entry, point)| entry * of[*point]).sum();
                let own: f64 = along(&left);
                let step = if 1.0 - share > DETERMINED { own * share / (1.0 - share) } else { along(values) - own };
                direction.iter().zip(points).for_each(|(entry, point)| found[*point] += step * entry);
            }
        }
        found
    }

    /// Root mean square of [`left_out`](Self::left_out) of independent noise of standard deviation 1 in `points` values.
    ///
    /// A group's own noise has the covariance 1, that of its prediction Q_g·(1 − Q_gᵀQ_g)⁻¹·Q_gᵀ.
    #[must_use]
    pub fn left_out_gain(&self, groups: &[Vec<usize>], points: usize) -> f64 {
        let shares = groups.iter().flat_map(|group| self.followed(group)).map(|(_, share)| share);
        let predicted = shares.filter(|share| 1.0 - share > DETERMINED).map(|share| share / (1.0 - share));
        (1.0 + predicted.sum::<f64>() / points.max(1) as f64).sqrt()
    }

    /// What some points decide of a fit, in parameters: tr Q_gᵀQ_g.
    #[must_use]
    pub fn weight(&self, points: &[usize]) -> f64 {
        self.orthonormal.iter().flat_map(|column| points.iter().map(|point| column[*point].powi(2))).sum()
    }

    /// The directions of some points that a fit follows, each with the share of it that it takes: Q_gQ_gᵀ by its eigenvectors and
    /// eigenvalues, of which that matrix or Q_gᵀQ_g, whichever is smaller, has all.
    fn followed(&self, points: &[usize]) -> Vec<(Vec<f64>, f64)> {
        let inside = DMatrix::from_fn(points.len(), self.rank(), |row, column| self.orthonormal[column][points[row]]);
        let by_points = points.len() <= self.rank();
        let eigen = SymmetricEigen::new(if by_points { &inside * inside.transpose() } else { inside.tr_mul(&inside) });
        let of = |(direction, share): (DVectorView<f64>, &f64)| {
            if *share <= f64::EPSILON {
                return None;
            }
            let of_points = if by_points { direction.into_owned() } else { &inside * direction / share.sqrt() };
            Some((of_points.as_slice().to_vec(), *share))
        };
        eigen.eigenvectors.column_iter().zip(eigen.eigenvalues.iter()).filter_map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dependent_column_has_the_parameter_0_and_no_variance() {
        let (one, slope) = (vec![1.0, 1.0, 1.0, 1.0], vec![0.0, 1.0, 2.0, 3.0]);
        let both: Vec<f64> = one.iter().zip(&slope).map(|(one, slope)| 2.0 * one - slope).collect();
        let basis = Basis::of(vec![one, both, slope]);
        assert!(basis.dependent() && basis.rank() == 2);
        let found = basis.coefficients(&[1.0, 3.0, 5.0, 7.0]);
        // 1 + 2s is 5 − 2·(2 − s).
        for (found, expected) in found.iter().zip([5.0, -2.0, 0.0]) {
            assert!((found - expected).abs() < 1e-12, "{found} instead of {expected}");
        }
        let covariance = basis.covariance();
        assert_eq!((covariance[2][2], covariance[0][2]), (0.0, 0.0));
        // Var(slope) = 1/Σ(s − s̄)².
        assert!((covariance[1][1] - 0.2).abs() < 1e-12 && (basis.unit_variance()[1] - 0.2).abs() < 1e-12);
        // 1, both and slope: both = 2·one − slope, so that slope + both − 2·one is nothing.
        let [(column, open)] = &basis.null_directions()[..] else { panic!("one direction") };
        assert_eq!(*column, 2);
        assert!(
            open.iter().zip([-2.0, 1.0, 1.0]).all(|(found, expected)| (found - expected).abs() < 1e-12),
            "{open:?}"
        );
        assert!(Basis::of(vec![vec![0.0; 3]]).dependent(), "a column of zeros");
        let slope = basis.weights().iter().map(|weights| dot(weights, &[1.0, 3.0, 5.0, 7.0])).collect::<Vec<f64>>();
        assert!(slope.iter().zip(found).all(|(one, other)| (one - other).abs() < 1e-12), "{slope:?}");
        // det of [4 6; 6 14] is 20, and a dependent column has no part in it.
        let line = Basis::of(vec![vec![1.0; 4], vec![0.0, 1.0, 2.0, 3.0], vec![2.0; 4]]);
        assert!((line.log_determinant() - 0.5 * 20.0_f64.ln()).abs() < 1e-12);
    }

    #[test]
    fn the_tolerance_decides_what_is_another_column() {
        let columns = || vec![vec![1.0, 0.0], vec![1.0, 1e-4]];
        assert_eq!(orthonormal(columns(), &[], 1e-3).len(), 1);
        let made = orthonormal(columns(), &[], 1e-9);
        assert!(made.len() == 2 && dot(&made[0], &made[1]).abs() < 1e-15);
        assert!(orthonormal(columns(), &made, 1e-9).is_empty());
    }
}
