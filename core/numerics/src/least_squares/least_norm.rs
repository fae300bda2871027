//! Least squares of unknown rank, by QR and a singular value decomposition.

use nalgebra::{DMatrix, DVector};

/// Singular values below this share of the largest, of columns scaled to norm 1, are usually those of directions that nothing but
/// rounding determines.
pub const SINGULAR: f64 = 1e-7;
/// A parameter with more than this share in the directions that are not determined is lost.
const LOST: f64 = 1e-6;

/// The solution of least norm, and what the data do not determine.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct LeastNorm {
    /// One a column; of least norm (with columns scaled to norm 1) where they are not determined.
    pub coefficients: Vec<f64>,
    /// Covariance of the coefficients for uncorrelated noise of variance 1 in the values.
    pub covariance: DMatrix<f64>,
    /// Which parameters the data do not determine.
    pub lost: Vec<bool>,
    /// The residual of the values.
    pub residual: Vec<f64>,
    /// Values less independent parameters.
    pub dof: usize,
}

/// Solves columns·x = values in the least-squares sense, both divided by the values' standard uncertainties already. Singular
/// values up to `singular` times the largest count as 0, of columns scaled to norm 1; [`SINGULAR`] is the usual share.
///
/// ```
/// use runout_numerics::least_squares::{SINGULAR, least_norm};
///
/// // Two columns are one: neither is determined, the third is.
/// let same = vec![1.0, 1.0, 0.0];
/// let found = least_norm(&[same.clone(), same, vec![0.0, 0.0, 2.0]], &[3.0, 3.0, 8.0], SINGULAR);
/// assert_eq!(found.lost, [true, true, false]);
/// assert!((found.coefficients[2] - 4.0).abs() < 1e-12);
/// ```
#[must_use]
pub fn least_norm(columns: &[Vec<f64>], values: &[f64], singular: f64) -> LeastNorm {
    let (rows, count) = (values.len(), columns.len());
    if rows == 0 || count == 0 {
        let (coefficients, covariance) = (vec![0.0; count], DMatrix::zeros(count, count));
        return LeastNorm { coefficients, covariance, lost: vec![true; count], residual: values.to_vec(), dof: rows };
    }
    let norms: Vec<f64> =
        columns.iter().map(|column| column.iter().map(|value| value * value).sum::<f64>().sqrt()).collect();
    let scale: Vec<f64> = norms.iter().map(|norm| if *norm > 0.0 { norm.recip() } else { 0.0 }).collect();
    // Zero rows below make the triangular factor square.
    let height = rows.max(count);
    let entry = |row: usize, column: usize| {
        if row < rows { columns[column].get(row).map_or(0.0, |entry| entry * scale[column]) } else { 0.0 }
    };
    let factored = DMatrix::from_fn(height, count, entry).qr();
    let mut right = DVector::from_fn(height, |row, _| values.get(row).copied().unwrap_or(0.0));
    factored.q_tr_mul(&mut right);
    let decomposed = factored.r().svd(true, true);
    let (Some(u), Some(vt)) = (&decomposed.u, &decomposed.v_t) else {
        // Never: both were asked for.
        return LeastNorm {
            coefficients: vec![f64::NAN; count],
            covariance: DMatrix::from_element(count, count, f64::NAN),
            lost: vec![true; count],
            residual: values.to_vec(),
            dof: 0,
        };
    };
    let largest = decomposed.singular_values.iter().copied().fold(0.0, f64::max);
    let determined: Vec<bool> = decomposed.singular_values.iter().map(|value| *value > singular * largest).collect();
    let top = right.rows(0, count).into_owned();
    let along = u.tr_mul(&top);
    let mut coefficients = vec![0.0; count];
    let mut root = DMatrix::zeros(count, count);
    let mut open = vec![0.0; count];
    for (index, value) in decomposed.singular_values.iter().enumerate() {
        for column in 0..count {
            let share = vt[(index, column)];
            if determined[index] {
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
    let rank = determined.iter().filter(|determined| **determined).count();
    let lost = open.iter().zip(&norms).map(|(open, norm)| *open > LOST || *norm <= 0.0).collect();
    LeastNorm { coefficients, covariance: &root * root.transpose(), lost, residual, dof: rows.saturating_sub(rank) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two columns are one; the third is determined. The line through it has the closed form of a mean.
    #[test]
    fn what_is_not_determined_is_lost_and_the_rest_is_not() {
        let shared = vec![1.0, 1.0, 0.0, 0.0];
        let own = vec![0.0, 0.0, 10.0, 10.0];
        let solved = least_norm(&[shared.clone(), own, shared], &[3.0, 5.0, 10.0, 30.0], SINGULAR);
        assert_eq!(solved.lost, [true, false, true]);
        assert!((solved.coefficients[1] - 2.0).abs() < 1e-12);
        assert!((solved.coefficients[0] + solved.coefficients[2] - 4.0).abs() < 1e-12);
        assert!((solved.covariance[(1, 1)] - 1.0 / 200.0).abs() < 1e-12);
        assert_eq!(solved.dof, 2);
        assert!((solved.residual[3] - 10.0).abs() < 1e-9);
    }

    #[test]
    fn fewer_values_than_parameters_lose_some() {
        let solved = least_norm(&[vec![1.0], vec![2.0]], &[3.0], SINGULAR);
        assert_eq!((solved.lost, solved.dof), (vec![true, true], 0));
    }
}
