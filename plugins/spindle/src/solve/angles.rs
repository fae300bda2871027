//! Spindle angles of the setups that are known to a part of a sample only.

use runout_core::{
    Complex64,
    numerics::least_squares::{cholesky, invert_lower},
};

use super::{
    algebra::{Blocks, leftover},
    operators::Operators,
    propagation::Propagation,
    readings::Readings,
};

/// The share of a residual's χ² that angles of the setups take away which are as well known as the readings say: the angles δ of
/// least Σ|W·(r − Σ δₖ·sₖ)|²/f + Σ δₖ²/2σₖ², f the mean of |W·r|² that noise leaves of a complex degree of freedom. sₖ is what the fit
/// leaves of −i·n·u, u the readings of setup k at order n. 0 where all angles are known.
pub(crate) fn explained_share(
    operators: &Operators,
    readings: &Readings,
    linear: &[Complex64],
    propagation: Option<&Propagation>,
) -> f64 {
    let free: Vec<usize> = (0..readings.turns.len()).filter(|setup| readings.angle_std_rad[*setup] > 0.0).collect();
    let Some(propagation) = propagation.filter(|_| !free.is_empty() && readings.turns.len() > 1) else { return 0.0 };
    let (count, sensors) = (readings.count, readings.count / readings.turns.len());
    let unweighted = Blocks::identity(sensors, readings.turns.len());
    let (mut normal, mut right) = (vec![0.0; free.len() * free.len()], vec![0.0; free.len()]);
    let (mut squares, mut expected, mut freedom) = (0.0, 0.0, 0);
    for (index, (operator, system)) in operators.orders.iter().zip(&operators.systems).enumerate() {
        if operator.rank == count {
            continue;
        }
        let order = index + 1;
        let weights = operators.weights.as_ref().map_or(&unweighted, |weights| &weights[index]);
        let left = weights.times(&leftover(&system.matrix, &operator.operator, count), count);
        let times = |values: &[Complex64], from: usize| -> Vec<Complex64> {
            let rows = left.chunks_exact(count);
            rows.map(|row| row[from..].iter().zip(values).map(|(entry, value)| entry * value).sum()).collect()
        };
        let residual = times(&linear[order * count..(order + 1) * count], 0);
        squares += residual.iter().map(Complex64::norm_sqr).sum::<f64>();
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
            right[row] += dot(one, &residual);
            for (column, other) in turned.iter().enumerate() {
                normal[row * free.len() + column] += dot(one, other);
            }
        }
    }
    if freedom == 0 || expected <= 0.0 || squares <= 0.0 {
        return 0.0;
    }
    for (place, setup) in free.iter().enumerate() {
        normal[place * (free.len() + 1)] += 0.5 * expected / freedom as f64 / readings.angle_std_rad[*setup].powi(2);
    }
    let normal: Vec<Complex64> = normal.into_iter().map(Complex64::from).collect();
    let Some(lower) = cholesky(free.len(), &normal) else { return 0.0 };
    // Rightᵀ · normal⁻¹ · right.
    let inverse = invert_lower(free.len(), &lower);
    let rows = inverse.chunks_exact(free.len());
    let taken: f64 =
        rows.map(|row| row.iter().zip(&right).map(|(entry, right)| entry.re * right).sum::<f64>().powi(2)).sum();
    taken / squares
}
