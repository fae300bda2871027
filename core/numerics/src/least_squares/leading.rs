//! Nested models by Householder QR with scaled columns.

use nalgebra::{DMatrix, DVector};

/// Columns of norm 1 whose part outside the span of those before them is smaller than this are dependent.
const INDEPENDENT: f64 = 1e-9;

/// A least-squares solution.
#[derive(Debug, Clone)]
pub struct Solution {
    /// One value a column.
    pub values: Vec<f64>,
    /// Diagonal of (AᵀA)⁻¹: variance of each value for uncorrelated errors of unit variance.
    pub unit_variance: Vec<f64>,
}

/// A = Q·R with scaled columns. The leading columns of A are Q times the leading block of R, so that one factorisation
/// solves every model that uses leading columns only.
#[derive(Debug, Clone)]
pub struct Leading {
    upper: DMatrix<f64>,
    projected: DVector<f64>,
    scale: Vec<f64>,
    /// Leading columns that are independent.
    independent: usize,
}

impl Leading {
    /// Factors a matrix with at least as many rows as columns.
    #[must_use]
    pub fn new(mut matrix: DMatrix<f64>, mut right: DVector<f64>) -> Self {
        let columns = matrix.ncols();
        let mut scale = Vec::with_capacity(columns);
        for mut column in matrix.column_iter_mut() {
            let norm = column.norm();
            let usable = norm.is_finite() && norm > 0.0;
            column *= if usable { norm.recip() } else { 0.0 };
            scale.push(if usable { norm.recip() } else { 0.0 });
        }
        let factored = matrix.qr();
        let upper = factored.r();
        factored.q_tr_mul(&mut right);
        let projected = right.rows(0, columns.min(right.len())).into_owned();
        let independent = upper.diagonal().iter().take_while(|entry| entry.abs() >= INDEPENDENT).count();
        Self { upper, projected, scale, independent }
    }

    /// Minimises |A·x − b| over the first `columns` columns; `None` where these are dependent, or A has fewer.
    #[must_use]
    pub fn leading(&self, columns: usize) -> Option<Solution> {
        if columns > self.independent {
            return None;
        }
        let upper = self.upper.view((0, 0), (columns, columns));
        let values = upper.solve_upper_triangular(&self.projected.rows(0, columns))?;
        let inverse = upper.solve_upper_triangular(&DMatrix::identity(columns, columns))?;
        let unit_variance = inverse.row_iter().zip(&self.scale);
        Some(Solution {
            values: values.iter().zip(&self.scale).map(|(value, scale)| value * scale).collect(),
            unit_variance: unit_variance.map(|(row, scale)| row.norm_squared() * scale * scale).collect(),
        })
    }
}

/// Minimises |A·x − b|; `None` where the columns of A are dependent, or more than its rows.
#[must_use]
pub fn solve(matrix: DMatrix<f64>, right: DVector<f64>) -> Option<Solution> {
    let columns = matrix.ncols();
    if matrix.nrows() < columns {
        return None;
    }
    Leading::new(matrix, right).leading(columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_and_its_variances() {
        // Through (0, 1), (1, 3), (2, 5), (3, 7): 1 + 2x. Var(slope) = 1/Σ(x−x̄)² = 1/5, Var(offset) = Σx²/(n·5) = 14/20.
        let matrix = DMatrix::from_row_slice(4, 2, &[1.0, 0.0, 1.0, 1.0, 1.0, 2.0, 1.0, 3.0]);
        let right = DVector::from_vec(vec![1.0, 3.0, 5.0, 7.0]);
        let found = solve(matrix.clone(), right.clone()).unwrap();
        let expected = [(found.values[0], 1.0), (found.values[1], 2.0)];
        let variances = [(found.unit_variance[0], 0.7), (found.unit_variance[1], 0.2)];
        // The leading column alone: the mean.
        let mean = Leading::new(matrix, right).leading(1).unwrap();
        let alone = [(mean.values[0], 4.0), (mean.unit_variance[0], 0.25)];
        for (found, expected) in expected.into_iter().chain(variances).chain(alone) {
            // 1e-13: rounding of numbers near 1.
            assert!((found - expected).abs() < 1e-13, "{found} instead of {expected}");
        }
    }

    #[test]
    fn dependent_columns_have_no_solution() {
        let matrix = DMatrix::from_row_slice(3, 2, &[1.0, 2.0, 2.0, 4.0, 3.0, 6.0]);
        assert!(solve(matrix.clone(), DVector::zeros(3)).is_none());
        assert!(Leading::new(matrix, DVector::zeros(3)).leading(1).is_some());
        assert!(solve(DMatrix::zeros(3, 2), DVector::zeros(3)).is_none());
        assert!(solve(DMatrix::identity(2, 3), DVector::zeros(2)).is_none());
    }
}
