//! Dense least squares by Householder QR with scaled columns.

use nalgebra::{DMatrix, DVector};

/// Columns of norm 1 whose part outside the span of those before them is smaller than this cannot be told apart.
const INDEPENDENT: f64 = 1e-9;

/// A least-squares solution.
#[derive(Debug, Clone)]
pub struct Solution {
    /// One value a column.
    pub values: Vec<f64>,
    /// Diagonal of (AᵀA)⁻¹: variance of each value for uncorrelated errors of unit variance.
    pub unit_variance: Vec<f64>,
}

/// Minimises |A·x − b|; `None` where the columns of A are dependent, or more than its rows.
#[must_use]
pub fn solve(mut matrix: DMatrix<f64>, mut right: DVector<f64>) -> Option<Solution> {
    let columns = matrix.ncols();
    if matrix.nrows() < columns {
        return None;
    }
    let mut scale = Vec::with_capacity(columns);
    for mut column in matrix.column_iter_mut() {
        let norm = column.norm();
        if !(norm.is_finite() && norm > 0.0) {
            return None;
        }
        column /= norm;
        scale.push(norm.recip());
    }
    let factored = matrix.qr();
    let upper = factored.r();
    if upper.diagonal().iter().any(|entry| entry.abs() < INDEPENDENT) {
        return None;
    }
    factored.q_tr_mul(&mut right);
    let values = upper.solve_upper_triangular(&right.rows(0, columns))?;
    let inverse = upper.solve_upper_triangular(&DMatrix::identity(columns, columns))?;
    Some(Solution {
        values: values.iter().zip(&scale).map(|(value, scale)| value * scale).collect(),
        unit_variance: inverse.row_iter().zip(&scale).map(|(row, scale)| row.norm_squared() * scale * scale).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_and_its_variances() {
        // Through (0, 1), (1, 3), (2, 5), (3, 7): 1 + 2x. Var(slope) = 1/Σ(x−x̄)² = 1/5, Var(offset) = Σx²/(n·5) = 14/20.
        let matrix = DMatrix::from_row_slice(4, 2, &[1.0, 0.0, 1.0, 1.0, 1.0, 2.0, 1.0, 3.0]);
        let found = solve(matrix, DVector::from_vec(vec![1.0, 3.0, 5.0, 7.0])).unwrap();
        let expected = [(found.values[0], 1.0), (found.values[1], 2.0)];
        let variances = [(found.unit_variance[0], 0.7), (found.unit_variance[1], 0.2)];
        for (found, expected) in expected.into_iter().chain(variances) {
            // 1e-13: rounding of numbers near 1.
            assert!((found - expected).abs() < 1e-13, "{found} instead of {expected}");
        }
    }

    #[test]
    fn dependent_columns_have_no_solution() {
        let matrix = DMatrix::from_row_slice(3, 2, &[1.0, 2.0, 2.0, 4.0, 3.0, 6.0]);
        assert!(solve(matrix, DVector::zeros(3)).is_none());
        assert!(solve(DMatrix::identity(2, 3), DVector::zeros(2)).is_none());
    }
}
