//! Weighted least squares by QR and a singular value decomposition, with what the touches do not tell.

use nalgebra::{DMatrix, DVector};

/// Singular values below this share of the largest, of columns scaled to norm 1, are 0.
const SINGULAR: f64 = 1e-7;
/// A parameter with more than this share in the directions that are not told is lost.
const LOST: f64 = 1e-6;

/// A solved system.
#[derive(Debug, Clone)]
pub(crate) struct Solved {
    /// Of least norm where they are not told.
    pub coefficients: Vec<f64>,
    /// For noise of variance 1 of the weighted values.
    pub covariance: DMatrix<f64>,
    /// Which parameters are not told.
    pub lost: Vec<bool>,
    /// What is left of the weighted values.
    pub residual: Vec<f64>,
    /// Values less independent parameters.
    pub dof: usize,
}

/// Solves columns·x = values in the least-squares sense; both are weighted already.
pub(crate) fn solve(columns: &[Vec<f64>], values: &[f64]) -> Solved {
    let (rows, count) = (values.len(), columns.len());
    let norms: Vec<f64> =
        columns.iter().map(|column| column.iter().map(|value| value * value).sum::<f64>().sqrt()).collect();
    let scale: Vec<f64> = norms.iter().map(|norm| if *norm > 0.0 { norm.recip() } else { 0.0 }).collect();
    // Zero rows below make the triangular factor square.
    let height = rows.max(count);
    let entry = |row: usize, column: usize| if row < rows { columns[column][row] * scale[column] } else { 0.0 };
    let factored = DMatrix::from_fn(height, count, entry).qr();
    let mut right = DVector::from_fn(height, |row, _| values.get(row).copied().unwrap_or(0.0));
    factored.q_tr_mul(&mut right);
    let decomposed = factored.r().svd(true, true);
    let (Some(u), Some(vt)) = (&decomposed.u, &decomposed.v_t) else {
        // Never: both were asked for.
        return Solved {
            coefficients: vec![f64::NAN; count],
            covariance: DMatrix::from_element(count, count, f64::NAN),
            lost: vec![true; count],
            residual: values.to_vec(),
            dof: 0,
        };
    };
    let largest = decomposed.singular_values.iter().copied().fold(0.0, f64::max);
    let told: Vec<bool> = decomposed.singular_values.iter().map(|value| *value > SINGULAR * largest).collect();
    let top = right.rows(0, count).into_owned();
    let along = u.tr_mul(&top);
    let mut coefficients = vec![0.0; count];
    let mut root = DMatrix::zeros(count, count);
    let mut open = vec![0.0; count];
    for (index, value) in decomposed.singular_values.iter().enumerate() {
        for column in 0..count {
            let share = vt[(index, column)];
            if told[index] {
                coefficients[column] += share * along[index] / value;
                root[(column, index)] = share / value * scale[column];
            } else {
                open[column] += share * share;
            }
        }
    }
    let coefficients: Vec<f64> = coefficients.iter().zip(&scale).map(|(value, scale)| value * scale).collect();
    let mut residual = values.to_vec();
    for (column, coefficient) in columns.iter().zip(&coefficients) {
        residual.iter_mut().zip(column).for_each(|(left, entry)| *left -= coefficient * entry);
    }
    let rank = told.iter().filter(|told| **told).count();
    let lost = open.iter().zip(&norms).map(|(open, norm)| *open > LOST || *norm <= 0.0).collect();
    Solved { coefficients, covariance: &root * root.transpose(), lost, residual, dof: rows.saturating_sub(rank) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two columns are one; the third is told. The line through it has the closed form of a mean.
    #[test]
    fn what_is_not_told_is_lost_and_the_rest_is_not() {
        let shared = vec![1.0, 1.0, 0.0, 0.0];
        let own = vec![0.0, 0.0, 10.0, 10.0];
        let solved = solve(&[shared.clone(), own, shared], &[3.0, 5.0, 10.0, 30.0]);
        assert_eq!(solved.lost, [true, false, true]);
        assert!((solved.coefficients[1] - 2.0).abs() < 1e-12);
        assert!((solved.coefficients[0] + solved.coefficients[2] - 4.0).abs() < 1e-12);
        assert!((solved.covariance[(1, 1)] - 1.0 / 200.0).abs() < 1e-12);
        assert_eq!(solved.dof, 2);
        assert!((solved.residual[3] - 10.0).abs() < 1e-9);
    }

    #[test]
    fn fewer_values_than_parameters_lose_some() {
        let solved = solve(&[vec![1.0], vec![2.0]], &[3.0]);
        assert_eq!((solved.lost, solved.dof), (vec![true, true], 0));
    }
}
