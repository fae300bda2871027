//! What a solution leaves of the readings, beside what is expected from noise.

use runout_core::{
    Complex64,
    separation::{OrderResidual, ReadingResidual, Residual},
};

use super::{
    algebra::{apply, pooled},
    angles,
    consistency::judge,
    operators::{Operators, OrderOperator},
    propagation::Propagation,
    readings::Readings,
};

/// What the solution leaves of linear readings, `[order][reading]`, and what is expected of that from noise.
fn residual(
    operators: &Operators,
    readings: &Readings,
    linear: &[Complex64],
    propagation: Option<&Propagation>,
) -> Residual {
    let count = readings.count;
    let (mut squares, mut expected, mut dof) = (0.0, 0.0, 0);
    let mut orders: Option<[usize; 2]> = None;
    let mut by_order = Vec::new();
    for (index, (OrderOperator { operator, rank }, system)) in
        operators.orders.iter().zip(&operators.systems).enumerate()
    {
        if *rank == count {
            continue;
        }
        let freedom = 2 * (count - rank);
        dof += freedom;
        orders = Some([orders.map_or(index + 1, |[lowest, _]| lowest), index + 1]);
        let recorded = &linear[(index + 1) * count..(index + 2) * count];
        let fitted = apply(&system.matrix, &apply(operator, recorded));
        let residual: Vec<Complex64> =
            recorded.iter().zip(fitted).map(|(recorded, fitted)| recorded - fitted).collect();
        let plain = norm_sqr(&residual);
        squares += plain;
        let Some(propagation) = propagation else { continue };
        expected += propagation.squares[index];
        // Weighted as the fit is; set against its value expected from the covariance.
        let [squares, expected] = match &operators.weights {
            Some(weights) => [norm_sqr(&weights[index].times(&residual, 1)), propagation.weighted_squares[index]],
            None => [plain, propagation.squares[index]],
        };
        by_order.push(OrderResidual { order: index + 1, squares, expected, dof: freedom });
    }
    if dof == 0 {
        let nan = f64::NAN;
        return Residual { rms_um: nan, expected_rms_um: nan, chi2_per_dof: nan, orders, ..Residual::default() };
    }
    if expected <= 0.0 {
        by_order.clear();
    }
    // A coefficient of size c is a wave of mean square c²/2.
    let rms = |squares: f64| (0.5 * squares / count as f64).sqrt();
    Residual {
        rms_um: rms(squares),
        expected_rms_um: if propagation.is_some() { rms(expected) } else { f64::NAN },
        chi2_per_dof: pooled(&by_order),
        dof,
        orders,
        by_order,
        by_reading: Vec::new(),
        checks: Vec::new(),
    }
}

/// The residual without what uncertain angles of the setups explain, compared with noise and angles; and the factor for the covariance of each order.
pub(crate) fn judged_residual(
    operators: &Operators,
    readings: &Readings,
    linear: &[Complex64],
    propagation: Option<&Propagation>,
) -> (Residual, Vec<f64>) {
    let mut residual = residual(operators, readings, linear, propagation);
    angles::explain(&mut residual, operators, readings, linear, propagation);
    let sensors = readings.count / readings.turns.len().max(1);
    let factors = judge(&mut residual, &readings.turns, sensors, operators.orders.len());
    (residual, factors)
}

/// What the solution leaves of each of the linear readings `[order][reading]`, at the orders that are redundant.
pub(crate) fn by_reading(operators: &Operators, readings: &Readings, linear: &[Complex64]) -> Vec<ReadingResidual> {
    let count = readings.count;
    let of = |place: &usize| ReadingResidual { place: *place, harmonics: Vec::with_capacity(operators.orders.len()) };
    let mut found: Vec<_> = readings.places.iter().map(of).collect();
    let orders = operators.orders.iter().zip(&operators.systems).enumerate();
    for (index, (one, system)) in orders.filter(|(_, (one, _))| one.rank < count) {
        let recorded = &linear[(index + 1) * count..(index + 2) * count];
        let fitted = apply(&system.matrix, &apply(&one.operator, recorded));
        for ((reading, recorded), fitted) in found.iter_mut().zip(recorded).zip(fitted) {
            reading.harmonics.push((index + 1, recorded - fitted));
        }
    }
    found.retain(|reading| !reading.harmonics.is_empty());
    found
}

fn norm_sqr(values: &[Complex64]) -> f64 {
    values.iter().map(Complex64::norm_sqr).sum()
}
