//! Correlation of touches that follow one another in time.
//!
//! Noise of a machine varies slowly: the air, the spindle, the probe's seat. Least squares then keeps its values and loses its
//! covariance. The noise is taken as autoregressive of first order, R = ρ^|i−j| over the touches in the order of time. A fit leaves
//! M·noise, M = 1 − X·C·Xᵀ, so that ρ is the one with which the lag-one sum of M·R·M is what the residual has; the covariance of
//! the parameters is C·XᵀRX·C (H. White, Econometrica 48 (1980) 817, with this R).

use nalgebra::DMatrix;

/// Standard deviations of white noise by which the lag-one sum has to be larger.
const CHANCE: f64 = 4.0;
/// Correlations below this change a standard uncertainty by less than a tenth.
const SMALL: f64 = 0.1;
/// Largest correlation: above it, what is left is a drift.
const LARGEST: f64 = 0.95;
/// Halvings of the interval of ρ.
const HALVINGS: usize = 24;

/// A correlation and what it makes of the covariance.
pub(crate) struct Correlated {
    /// ρ.
    pub lag_one: f64,
    /// For noise of variance 1.
    pub covariance: DMatrix<f64>,
}

/// Correlation of the noise, where it is more than chance; `columns` and `residual` in the order of time, of weight 1.
pub(crate) fn of(
    columns: &DMatrix<f64>,
    covariance: &DMatrix<f64>,
    residual: &[f64],
    dof: usize,
) -> Option<Correlated> {
    let count = residual.len();
    let lag_one: f64 = residual.windows(2).map(|pair| pair[0] * pair[1]).sum();
    let squares: f64 = residual.iter().map(|left| left * left).sum();
    let gains = columns * covariance;
    let white = expected(columns, &gains, 0.0);
    let ratio = lag_one / squares;
    let std = (count as f64).sqrt() / dof as f64 * (dof as f64 / count as f64);
    if (ratio - white) / std <= CHANCE {
        return None;
    }
    let (mut low, mut high) = (0.0, LARGEST);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if expected(columns, &gains, middle) < ratio { low = middle } else { high = middle }
    }
    let rho = 0.5 * (low + high);
    (rho > SMALL).then(|| Correlated {
        lag_one: rho,
        covariance: covariance * (columns.transpose() * smeared(columns, rho)) * covariance,
    })
}

/// Lag-one sum over sum of squares that noise of correlation ρ leaves on average.
fn expected(columns: &DMatrix<f64>, gains: &DMatrix<f64>, rho: f64) -> f64 {
    let smeared = smeared(columns, rho);
    let both = gains * (columns.transpose() * &smeared);
    let entry = |one: usize, other: usize, own: f64| {
        own - gains.row(one).dot(&smeared.row(other)) - smeared.row(one).dot(&gains.row(other))
            + both.row(one).dot(&gains.row(other))
    };
    let squares: f64 = (0..columns.nrows()).map(|row| entry(row, row, 1.0)).sum();
    let lag_one: f64 = (1..columns.nrows()).map(|row| entry(row - 1, row, rho)).sum();
    lag_one / squares
}

/// R·X, by a pass forward and one back.
fn smeared(columns: &DMatrix<f64>, rho: f64) -> DMatrix<f64> {
    let mut sum = columns.clone();
    let (rows, count) = columns.shape();
    for column in 0..count {
        let (mut before, mut after) = (0.0, 0.0);
        for row in 1..rows {
            before = rho * (before + columns[(row - 1, column)]);
            sum[(row, column)] += before;
            let back = rows - 1 - row;
            after = rho * (after + columns[(back + 1, column)]);
            sum[(back, column)] += after;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smearing_is_the_product_with_all_powers() {
        let columns = DMatrix::from_fn(9, 2, |row, column| ((row * row + 3 * column) as f64).sin());
        let whole = DMatrix::from_fn(9, 9, |one, other| 0.6_f64.powf(one.abs_diff(other) as f64));
        assert!((smeared(&columns, 0.6) - whole * &columns).norm() < 1e-12);
    }

    #[test]
    fn what_a_fit_leaves_is_that_of_the_dense_matrices() {
        let columns = DMatrix::from_fn(12, 3, |row, column| ((row * (column + 1)) as f64 * 0.7).cos());
        let covariance = (columns.transpose() * &columns).try_inverse().unwrap_or_default();
        let whole = DMatrix::from_fn(12, 12, |one, other| 0.5_f64.powf(one.abs_diff(other) as f64));
        let left = DMatrix::identity(12, 12) - &columns * &covariance * columns.transpose();
        let noise = &left * whole * &left;
        let lag_one: f64 = (1..12).map(|row| noise[(row - 1, row)]).sum();
        let found = expected(&columns, &(&columns * &covariance), 0.5);
        assert!((found - lag_one / noise.trace()).abs() < 1e-12, "{found}");
    }
}
