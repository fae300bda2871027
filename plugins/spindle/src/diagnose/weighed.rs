//! Readings with their weights, and the noise of what a fit leaves of them.

use crate::{
    layout::Layout,
    solve::{Blocks, Operators, Propagation, Readings, leak, whitening},
};

/// Orders to each side over which the noise in the residual's space is averaged, beyond what covariances are.
const FLOOR_SMOOTHING: usize = 4;

/// Readings with what lost orders carry into others, and what follows from their uncertainty.
pub(super) struct Weighed {
    pub readings: Readings,
    pub weights: Option<Vec<Blocks>>,
    pub floor: Vec<f64>,
    /// Share of the readings' variance that lost orders carry into an order from 1.
    pub carried: Vec<f64>,
}

impl Weighed {
    pub(super) fn new(layout: &Layout, mut readings: Readings) -> Self {
        let before = variances(&readings);
        leak::widen(layout, &mut readings);
        let after = variances(&readings);
        let weights = whitening(&readings);
        let floor = weights.as_ref().map_or_else(Vec::new, |weights| floor(layout, &readings, weights));
        let carried =
            before.iter().zip(&after).map(|(before, after)| if *after > 0.0 { 1.0 - before / after } else { 0.0 });
        Self { readings, weights, floor, carried: carried.collect() }
    }
}

/// Variance of the readings that weights are made of, summed over all readings, by order from 1.
fn variances(readings: &Readings) -> Vec<f64> {
    let sensors = readings.count / readings.turns.len().max(1);
    let of = |order: usize| {
        let matrices = readings.scatter.iter().flatten();
        let diagonal =
            matrices.filter_map(|matrix| matrix.get(order * sensors * sensors..(order + 1) * sensors * sensors));
        diagonal.flat_map(|matrix| matrix.iter().step_by(sensors + 1)).map(|entry| entry.re).sum()
    };
    (1..=readings.max_order).map(of).collect()
}

/// The covariance of the mean, projected to where the fit cannot reach, beside that of independent turns.
pub(super) fn floor(layout: &Layout, readings: &Readings, weights: &[Blocks]) -> Vec<f64> {
    let operators = Operators::least_squares(layout, readings.max_order, Some(weights.to_vec()));
    let count = readings.count;
    let (mut sums, mut dofs) = (vec![0.0; readings.max_order], vec![0.0; readings.max_order]);
    if let Some(propagation) = Propagation::of(readings, &operators) {
        for (index, operator) in operators.orders.iter().enumerate().filter(|(_, operator)| operator.rank < count) {
            sums[index] = propagation.weighted_squares[index];
            dofs[index] = (count - operator.rank) as f64;
        }
    }
    let mean = |from: usize, to: usize| {
        let dof: f64 = dofs[from..to].iter().sum();
        if dof > 0.0 { sums[from..to].iter().sum::<f64>() / dof } else { 1.0 }
    };
    let orders = readings.max_order;
    (0..orders)
        .map(|index| {
            // What shakes the eccentricity shakes no other order.
            if index == 0 {
                return mean(0, 1);
            }
            mean(index.saturating_sub(FLOOR_SMOOTHING).max(1), (index + FLOOR_SMOOTHING + 1).min(orders))
        })
        .map(|square| if square > 0.0 { square } else { 1.0 })
        .collect()
}
