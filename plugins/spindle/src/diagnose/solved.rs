//! One station solved with effects applied.

use runout_core::{
    Complex64,
    separation::{Quantity, Residual},
};

use super::{
    data::{Shared, StationData},
    drift::Part,
};
use crate::{
    alterations::Alterations,
    effects::Predicted,
    layout::{FirstOrder, Layout},
    solve::{Estimate, Operators, Propagation, Readings, Solver, apply, judged_residual, leftover},
};

/// One station's solution.
pub(super) struct Solved {
    pub operators: Operators,
    /// Effects as they act on the turns fitted.
    pub alterations: Alterations,
    /// Nothing of a part of the turns, once what is held out has been predicted.
    pub propagation: Option<Propagation>,
    /// The propagation with the uncertainty beyond noise: of angles, of turns that change, and of what the residual refutes.
    /// Nothing where there is none, and of a part of the turns.
    pub stated: Option<Propagation>,
    pub estimate: Estimate,
    /// Readings converted to displacements, without their covariance.
    pub corrected: Readings,
    /// The corrected readings without what exact geometry adds.
    pub linear: Vec<Complex64>,
    /// W (I − A P) of each order from 1, over the noise of a real degree of freedom.
    pub whitened: Vec<Vec<Complex64>>,
    /// The highest order that [says something of effects](StationData::signal_orders).
    pub signal_orders: usize,
    /// Noise of the residual's degrees of freedom, by order from 1, as a standard deviation of weighted residuals.
    pub floor_std: Vec<f64>,
    /// Mean slope of the characteristics, `[reading]`.
    pub slopes: Vec<f64>,
    /// The residual of the readings, as a run states it.
    pub residual: Residual,
}

impl Shared {
    pub(super) fn solver<'a>(&'a self, layout: &'a Layout, alterations: &Alterations) -> Solver<'a> {
        Solver { selection: &self.selection, layout, second_order: self.second_order || alterations.exact_geometry }
    }
}

impl Solved {
    pub(crate) fn new(shared: &Shared, data: &StationData, layout: &Layout, alterations: &Alterations) -> Self {
        let mut corrected = data.readings(alterations).clone();
        if let Some(covariance) = data.recorded_covariance(alterations) {
            corrected.covariance = Some(covariance.clone());
        }
        for (number, (line, leak)) in data.seen.lines.found.iter().zip(&data.leaks).enumerate() {
            if alterations.lines.contains(&(number, line.row().0)) {
                line.take_out(leak, layout, &mut corrected.mean);
            }
        }
        let altered = data.altered(alterations, data.part);
        altered.correct(layout, &mut corrected);
        let max_order = corrected.max_order;
        // Displacements are weighed by the noise of the readings that they were.
        let slopes = alterations.slopes(layout, &corrected.mean);
        let weights: Vec<_> = (1..=max_order).map(|order| data.weights_of(order, layout, &altered, &slopes)).collect();
        let mut operators = Operators::least_squares(layout, max_order, Some(weights.clone()));
        if data.weights.is_none() {
            operators.weights = None;
        }
        let solver = shared.solver(layout, alterations);
        let (estimate, linear) = solver.iterate(&corrected, &operators, |estimate, excess| {
            axial(layout, alterations, &corrected, estimate, excess);
        });
        let count = corrected.count;
        let floor_std = data.floor_std(layout, alterations, &corrected, &weights);
        let whitened = (1..=max_order)
            .map(|order| {
                let system = &operators.systems[order - 1];
                let left = leftover(&system.matrix, &operators.orders[order - 1].operator, count);
                let mut left = weights[order - 1].times(&left, count);
                // A real degree of freedom has half of a complex one's square.
                let scale = std::f64::consts::SQRT_2 / floor_std[order - 1];
                for entry in &mut left {
                    *entry *= scale;
                }
                left
            })
            .collect();
        let propagation = Propagation::of(&corrected, &operators);
        let (residual, mut factors) = judged_residual(&operators, &corrected, &linear, propagation.as_ref());
        if data.part == Part::All {
            let coupled = solver.coupled_noise(&corrected, &operators, &estimate).unwrap_or_default();
            factors.iter_mut().zip(coupled).for_each(|(factor, coupled)| *factor *= coupled);
        }
        let is_wider = corrected.has_more_than_noise() || factors.iter().any(|factor| *factor > 1.0);
        let mut stated = None;
        if data.part == Part::All && is_wider {
            let mut uncertain = corrected.clone();
            uncertain.add_more_than_noise();
            stated = Propagation::of(&uncertain, &operators);
            stated.iter_mut().for_each(|stated| stated.times(&factors));
        }
        // A loop holds several fits of all stations: what is not asked for again goes.
        operators.weights = None;
        (corrected.covariance, corrected.scatter) = (None, None);
        let alterations = altered;
        Self {
            operators,
            alterations,
            propagation,
            stated,
            estimate,
            corrected,
            linear,
            whitened,
            signal_orders: data.signal_orders,
            floor_std,
            slopes,
            residual,
        }
    }
}

/// Adds what places along z other than the declared ones do to the readings.
fn axial(
    layout: &Layout,
    alterations: &Alterations,
    readings: &Readings,
    estimate: &Estimate,
    excess: &mut [Complex64],
) {
    let moved = alterations.sensors.iter().any(|sensor| sensor.circle_mm != 0.0);
    if alterations.axial_um.is_empty() && !moved {
        return;
    }
    let predicted = Predicted::new(layout, alterations, estimate, readings);
    if !alterations.axial_um.is_empty() {
        let along = predicted.curves(
            &predicted.along_z,
            |_| true,
            |angle, slope| -1e-3 * slope * alterations.axial_um.iter().map(|harmonic| harmonic.at(angle)).sum::<f64>(),
        );
        excess.iter_mut().zip(along).for_each(|(excess, along)| *excess += along);
    }
    for (index, slope) in predicted.along_z.iter().enumerate() {
        let reading = &layout.readings[index % readings.count];
        excess[index] += slope * alterations.sensors[reading.sensor].circle_mm;
    }
}

impl Solved {
    /// [Whitened](Self::whitened), of the orders that say something of effects.
    pub(crate) fn traced(&self) -> &[Vec<Complex64>] {
        &self.whitened[..self.signal_orders]
    }

    /// Degrees of freedom of an order from 1.
    pub(crate) fn freedom(&self, order: usize) -> usize {
        2 * self.corrected.count.saturating_sub(self.operators.orders[order - 1].rank)
    }

    /// How an unknown moves with a parameter, by order from 2: its operator on the readings' partials.
    pub(crate) fn moved_by<'a>(
        &'a self,
        partial: &'a [Complex64],
        unknown: usize,
    ) -> impl Iterator<Item = (usize, Complex64)> + 'a {
        let count = self.corrected.count;
        self.observable_orders(unknown).map(move |order| {
            let row = &self.operators.orders[order - 1].operator[unknown * count..(unknown + 1) * count];
            let readings = &partial[order * count..(order + 1) * count];
            (order, row.iter().zip(readings).map(|(a, b)| a * b).sum())
        })
    }

    /// How the unknowns of order 1 move with a parameter.
    pub(crate) fn first_moved(&self, partial: &[Complex64]) -> Vec<Complex64> {
        let count = self.corrected.count;
        apply(&self.operators.orders[0].operator, &partial[count..2 * count])
    }

    /// How z at 1/rev moves with a parameter, where it is observable.
    pub(crate) fn first_moved_by(&self, partial: &[Complex64], layout: &Layout) -> Option<Complex64> {
        let z = layout.unknowns.iter().position(|unknown| *unknown == Quantity::Z)?;
        let place = layout.first_order_unknowns().iter().position(|unknown| *unknown == FirstOrder::Axial)?;
        self.operators.observable(1)[z].then(|| self.first_moved(partial)[place])
    }

    /// Orders from 2 at which an unknown is observable.
    fn observable_orders(&self, unknown: usize) -> impl Iterator<Item = usize> + '_ {
        (2..=self.corrected.max_order).filter(move |order| self.operators.observable(*order)[unknown])
    }
}
