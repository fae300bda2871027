//! Orthogonal columns: fits, and what they predict of points left out.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::fit::{dot, norm};

/// A column whose part outside the span of those before it is smaller than this, relative, cannot be told from them.
const INDEPENDENT: f64 = 1e-9;
/// Directions that the remaining points tell with less than this share of their weight are not told at all.
const TOLD: f64 = 1e-12;

/// A = Q·R by modified Gram-Schmidt, twice; dependent columns have none in Q.
#[derive(Debug, Clone)]
pub struct Basis {
    /// Q, `[column][point]`.
    orthonormal: Vec<Vec<f64>>,
    /// R, `[column]`: the column's shares of those of Q so far.
    shares: Vec<Vec<f64>>,
}

impl Basis {
    /// Of columns, one after the other.
    #[must_use]
    pub fn of(columns: Vec<Vec<f64>>) -> Self {
        Self { orthonormal: Vec::new(), shares: Vec::new() }.extended(columns)
    }

    /// With more columns.
    #[must_use]
    pub fn extended(&self, columns: Vec<Vec<f64>>) -> Self {
        let mut made = self.clone();
        for mut column in columns {
            let whole = norm(&column);
            let mut shares = vec![0.0; made.orthonormal.len()];
            for _ in 0..2 {
                for (share, other) in shares.iter_mut().zip(&made.orthonormal) {
                    let part = dot(other, &column);
                    *share += part;
                    column.iter_mut().zip(other).for_each(|(entry, other)| *entry -= part * other);
                }
            }
            let left = norm(&column);
            if left > INDEPENDENT * whole {
                for entry in &mut column {
                    *entry /= left;
                }
                made.orthonormal.push(column);
                shares.push(left);
            }
            made.shares.push(shares);
        }
        made
    }

    /// Number of independent columns.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.orthonormal.len()
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

    /// Takes out of `values` what the columns can make.
    pub fn remove_from(&self, values: &mut [f64]) {
        for column in &self.orthonormal {
            let share = dot(column, values);
            values.iter_mut().zip(column).for_each(|(entry, column)| *entry -= share * column);
        }
    }

    /// x with |A·x − values| least, for independent columns: R·x = Qᵀ·values.
    #[must_use]
    pub fn coefficients(&self, values: &[f64]) -> Vec<f64> {
        self.solve_upper(self.orthonormal.iter().map(|column| dot(column, values)).collect())
    }

    /// Diagonal of (AᵀA)⁻¹ = R⁻¹·R⁻ᵀ.
    #[must_use]
    pub fn unit_variance(&self) -> Vec<f64> {
        let count = self.rank();
        let mut variance = vec![0.0; count];
        for unit in 0..count {
            let column = self.solve_upper((0..count).map(|row| if row == unit { 1.0 } else { 0.0 }).collect());
            variance.iter_mut().zip(column).for_each(|(sum, entry)| *sum += entry * entry);
        }
        variance
    }

    fn solve_upper(&self, mut right: Vec<f64>) -> Vec<f64> {
        for row in (0..right.len()).rev() {
            let known: f64 = (row + 1..right.len()).map(|column| self.shares[column][row] * right[column]).sum();
            right[row] = (right[row] - known) / self.shares[row][row];
        }
        right
    }

    /// Each point less what the fit to the points outside its group predicts of it.
    ///
    /// With r what the fit to all points leaves, it is r_g + Q_g·(1 − Q_gᵀQ_g)⁻¹·Q_gᵀr_g: the others' normal matrix is
    /// 1 − Q_gᵀQ_g, well conditioned because Q is orthonormal. A direction that only the group tells is predicted as 0.
    #[must_use]
    pub fn left_out(&self, values: &[f64], groups: &[Vec<usize>]) -> Vec<f64> {
        let count = self.rank();
        let full: Vec<f64> = self.orthonormal.iter().map(|column| dot(column, values)).collect();
        let mut left = values.to_vec();
        self.remove_from(&mut left);
        let mut found = left.clone();
        for points in groups {
            let (inside, told) = self.without(points);
            let mut change = vec![0.0; count];
            for (direction, weight) in told.eigenvectors.column_iter().zip(told.eigenvalues.iter()) {
                let step = if *weight > TOLD {
                    let shown = &inside * direction;
                    shown.iter().zip(points).map(|(entry, point)| entry * left[*point]).sum::<f64>() / weight
                } else {
                    direction.iter().zip(&full).map(|(entry, full)| entry * full).sum()
                };
                change.iter_mut().zip(direction.iter()).for_each(|(sum, entry)| *sum += step * entry);
            }
            for (row, point) in points.iter().enumerate() {
                found[*point] += (0..count).map(|column| inside[(row, column)] * change[column]).sum::<f64>();
            }
        }
        found
    }

    /// Root mean square of [`left_out`](Self::left_out) of independent noise of standard deviation 1 in `points` values.
    ///
    /// A group's own noise has the covariance 1, that of its prediction Q_g·(1 − Q_gᵀQ_g)⁻¹·Q_gᵀ.
    #[must_use]
    pub fn left_out_gain(&self, groups: &[Vec<usize>], points: usize) -> f64 {
        let predicted = groups.iter().map(|group| {
            let (inside, told) = self.without(group);
            let directions = told.eigenvectors.column_iter().zip(told.eigenvalues.iter());
            let told = directions.filter(|(_, weight)| **weight > TOLD);
            told.map(|(direction, weight)| (&inside * direction).norm_squared() / weight).sum::<f64>()
        });
        (1.0 + predicted.sum::<f64>() / points.max(1) as f64).sqrt()
    }

    /// What some points decide of a fit, in parameters: tr Q_gᵀQ_g.
    #[must_use]
    pub fn weight(&self, points: &[usize]) -> f64 {
        self.orthonormal.iter().flat_map(|column| points.iter().map(|point| column[*point].powi(2))).sum()
    }

    /// The rows of Q of some points, and the normal matrix of the others, 1 − Q_gᵀQ_g, by its eigenvalues.
    fn without(&self, points: &[usize]) -> (DMatrix<f64>, SymmetricEigen<f64, nalgebra::Dyn>) {
        let count = self.rank();
        let inside = DMatrix::from_fn(points.len(), count, |row, column| self.orthonormal[column][points[row]]);
        let others = DMatrix::identity(count, count) - inside.tr_mul(&inside);
        (inside, SymmetricEigen::new(others))
    }
}
