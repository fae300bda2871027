//! Spindle angles of the setups that are known to a part of a sample only.

use runout_core::{
    Complex64,
    numerics::least_squares::{cholesky, invert_lower},
    separation::Residual,
};

use super::{
    algebra::{Blocks, leftover, pooled},
    operators::Operators,
    propagation::Propagation,
    readings::Readings,
};

/// Takes out of a residual's χ² what angles of the setups explain which are as well known as the readings say: the angles δ of
/// least Σ|W·(r − Σ δₖ·sₖ)|²/f + Σ δₖ²/2σₖ², f the mean of |W·r|² that noise leaves of a complex degree of freedom. sₖ is what the fit
/// leaves of −i·n·u, u the readings of setup k at order n. Nothing happens where all angles are known.
pub(super) fn explain(
    residual: &mut Residual,
    operators: &Operators,
    readings: &Readings,
    linear: &[Complex64],
    propagation: Option<&Propagation>,
) {
    let free: Vec<usize> = (0..readings.turns.len()).filter(|setup| readings.angle_std_rad[*setup] > 0.0).collect();
    let Some(propagation) = propagation.filter(|_| !free.is_empty() && readings.turns.len() > 1) else { return };
    let (count, sensors) = (readings.count, readings.count / readings.turns.len());
    let unweighted = Blocks::identity(sensors, readings.turns.len());
    let (mut normal, mut right) = (vec![0.0; free.len() * free.len()], vec![0.0; free.len()]);
    let (mut expected, mut freedom) = (0.0, 0);
    let mut each = Vec::new();
    for (index, (operator, system)) in operators.orders.iter().zip(&operators.systems).enumerate() {
        if operator.rank == count {
            continue;
        }
        let order = index + 1;
        let weights = operators.weights.as_ref().map_or(&unweighted, |weights| &weights[index]);
        let fit_leaves = weights.times(&leftover(&system.matrix, &operator.operator, count), count);
        let times = |values: &[Complex64], from: usize| -> Vec<Complex64> {
            let rows = fit_leaves.chunks_exact(count);
            rows.map(|row| row[from..].iter().zip(values).map(|(entry, value)| entry * value).sum()).collect()
        };
        let left = times(&linear[order * count..(order + 1) * count], 0);
        expected += match &operators.weights {
            Some(_) => propagation.weighted_squares[index],
            None => propagation.squares[index],
        };
        freedom += count - operator.rank;
        let turned: Vec<Vec<Complex64>> = (free.iter())
            .map(|setup| {
                let own = &readings.order(order)[setup * sensors..(setup + 1) * sensors];
                let rate = Complex64::new(0.0, -(order as f64));
                times(&own.iter().map(|value| rate * value).collect::<Vec<_>>(), setup * sensors)
            })
            .collect();
        let dot = |one: &[Complex64], other: &[Complex64]| -> f64 {
            one.iter().zip(other).map(|(one, other)| (one.conj() * other).re).sum()
        };
        for (row, one) in turned.iter().enumerate() {
            right[row] += dot(one, &left);
            for (column, other) in turned.iter().enumerate() {
                normal[row * free.len() + column] += dot(one, other);
            }
        }
        each.push((left, turned));
    }
    if freedom == 0 || expected <= 0.0 {
        return;
    }
    for (place, setup) in free.iter().enumerate() {
        normal[place * (free.len() + 1)] += 0.5 * expected / freedom as f64 / readings.angle_std_rad[*setup].powi(2);
    }
    let normal: Vec<Complex64> = normal.into_iter().map(Complex64::from).collect();
    let Some(lower) = cholesky(free.len(), &normal) else { return };
    // δ = normal⁻¹ · right; all orders together lose rightᵀ · δ.
    let inverse = invert_lower(free.len(), &lower);
    let row = |row: &[Complex64]| row.iter().zip(&right).map(|(entry, right)| entry.re * right).sum::<f64>();
    let half: Vec<f64> = inverse.chunks_exact(free.len()).map(row).collect();
    let taken: f64 = half.iter().map(|value| value * value).sum();
    let column = |column: usize| half.iter().zip(inverse.iter().skip(column).step_by(free.len()));
    let angles: Vec<f64> =
        (0..free.len()).map(|place| column(place).map(|(value, entry)| value * entry.re).sum()).collect();
    let lost: Vec<f64> = (each.iter())
        .map(|(left, turned)| {
            let explained = |place: usize| -> Complex64 {
                turned.iter().zip(&angles).map(|(turned, angle)| turned[place] * *angle).sum()
            };
            let squares =
                |(place, value): (usize, &Complex64)| value.norm_sqr() - (value - explained(place)).norm_sqr();
            left.iter().enumerate().map(squares).sum()
        })
        .collect();
    // What the angles' own uncertainty counts is shared out alike.
    let whole: f64 = lost.iter().sum();
    if whole <= 0.0 {
        return;
    }
    for (order, lost) in residual.by_order.iter_mut().zip(&lost) {
        order.squares = (order.squares - lost * taken / whole).max(0.0);
    }
    residual.chi2_per_dof = pooled(&residual.by_order);
}
