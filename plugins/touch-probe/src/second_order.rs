//! What the model of first order leaves out.
//!
//! A touch triggers along the normal of the wall. Form of the ring turns the normal by F'/R, so that lobing is read at another direction:
//! the reading gains L'·F'/R, and of the second order of each alone about F'²/(2R) and L'²/(2R). Orders p and q make orders p + q and
//! |p − q|, each of about p·q/(2R) times the product of their amplitudes. Their phases are not modelled, so that this is
//! part of the uncertainty, and no order below it is accepted.

use crate::{
    config::TouchProbeConfig,
    design::{Fitted, form_order, lobing_order},
};

/// Amplitudes of lobing and of the form of the ring, by which the second order is known to its size.
pub(crate) struct SecondOrder {
    /// By order from 0, in µm: lobing, and form.
    amplitudes_um: [Vec<f64>; 2],
    radius_um: f64,
}

impl SecondOrder {
    /// Of what a fit found.
    pub(crate) fn of(config: &TouchProbeConfig, fit: &Fitted) -> Self {
        let orders =
            fit.design.parameters.iter().filter_map(|parameter| lobing_order(parameter).or(form_order(parameter)));
        let highest = orders.max().unwrap_or(config.max_order);
        let amplitude = |pair: Option<[usize; 2]>| {
            let places = pair.filter(|places| fit.is_observable(places));
            places.map_or(0.0, |[a, b]| fit.solved.coefficients[a].hypot(fit.solved.coefficients[b]))
        };
        let of = |pair: &dyn Fn(usize) -> Option<[usize; 2]>| {
            (0..=highest).map(|order| if order < 2 { 0.0 } else { amplitude(pair(order)) }).collect::<Vec<f64>>()
        };
        let amplitudes_um =
            [of(&|order| fit.design.pair(lobing_order, order)), of(&|order| fit.design.pair(form_order, order))];
        Self { amplitudes_um, radius_um: 1e3 * config.ring_radius_mm }
    }

    /// Root sum of squares of what pairs of orders make of this order, in µm.
    pub(crate) fn amplitude_um(&self, order: usize) -> f64 {
        let [lobing, form] = &self.amplitudes_um;
        let mut squares = 0.0;
        for (p, (lobe, own)) in lobing.iter().zip(form).enumerate() {
            for q in [order.checked_sub(p), Some(order + p), p.checked_sub(order)].into_iter().flatten() {
                let (Some(other_lobe), Some(other_form)) = (lobing.get(q), form.get(q)) else { continue };
                let factor = (p * q) as f64 / (2.0 * self.radius_um);
                let terms = [lobe * other_form, 0.5 * lobe * other_lobe, 0.5 * own * other_form];
                squares += terms.iter().map(|term| (factor * term).powi(2)).sum::<f64>();
            }
        }
        squares.sqrt()
    }

    /// Variance of a reading by all orders from 2, in µm².
    pub(crate) fn variance_um2(&self) -> f64 {
        let highest = 2 * self.amplitudes_um[0].len();
        (2..=highest).map(|order| 0.5 * self.amplitude_um(order).powi(2)).sum()
    }
}
