//! Orders of lobing, and the pre-travel that they make.

use runout_core::numerics::statistics::f_tail;

use crate::{
    config::TouchProbeConfig,
    design::{Fitted, Parameter, lobing_order},
    second_order::SecondOrder,
    waves::{Part, wave},
};

/// Chance of noise making as large an amplitude in any order, below which an order is evident.
const EVIDENT: f64 = 1e-3;

/// Lobing of an order.
#[derive(Debug, Clone)]
pub(crate) struct Lobe {
    pub order: usize,
    /// Whether it is a number: separated from the form of the ring, or with a bound of it.
    pub observable: bool,
    /// Whether the form of the ring is in it, within its declared bound.
    pub bounded: bool,
    /// a cos nφ + b sin nφ, in µm.
    pub parts_um: [f64; 2],
    /// Their covariance, in µm², bound included.
    pub covariance: [[f64; 2]; 2],
    /// Whether noise (and the bound) hardly makes it.
    pub evident: bool,
}

impl Lobe {
    /// All orders from 2.
    pub(crate) fn all(config: &TouchProbeConfig, fit: &Fitted) -> Vec<Self> {
        let orders: Vec<usize> = (fit.design.parameters.iter())
            .filter_map(|parameter| match parameter {
                Parameter::Lobing { order, part: Part::Cosine, .. } => Some(*order),
                _ => None,
            })
            .collect();
        let count = orders.len() as f64;
        let second_order = SecondOrder::of(config, fit);
        let lobe = |order: usize| {
            let places = fit.design.pair(lobing_order, order).unwrap_or_default();
            let shared = matches!(fit.design.parameters[places[0]], Parameter::Lobing { shared: true, .. });
            let bound = config.ring_form_um.filter(|_| shared);
            let observable = fit.is_observable(&places) && (!shared || bound.is_some());
            let parts_um = places.map(|place| fit.solved.coefficients[place]);
            let mut covariance = places.map(|row| places.map(|column| fit.covariance(row, column)));
            for index in 0..2 {
                covariance[index][index] +=
                    bound.map_or(0.0, of_bound) + 0.5 * second_order.amplitude_um(order).powi(2);
            }
            // T² of both parts against noise; covariances of repeats or of the residual have degrees of freedom.
            let [[a, b], [_, d]] = covariance;
            let [cosine, sine] = parts_um;
            let squares = (d * cosine * cosine - 2.0 * b * cosine * sine + a * sine * sine) / (a * d - b * b);
            let evident = observable && f_tail(0.5 * squares, 2.0, fit.solved.dof as f64) * count < EVIDENT;
            Self { order, observable, bounded: bound.is_some(), parts_um, covariance, evident }
        };
        orders.into_iter().map(lobe).collect()
    }

    pub(crate) fn amplitude_um(&self) -> f64 {
        self.parts_um[0].hypot(self.parts_um[1])
    }

    /// Of a cos nφ + b sin nφ = A cos(nφ + phase), in degrees.
    pub(crate) fn phase_deg(&self) -> f64 {
        (-self.parts_um[1]).atan2(self.parts_um[0]).to_degrees()
    }

    /// Standard uncertainty along and across the amplitude.
    pub(crate) fn std_um(&self) -> [f64; 2] {
        let amplitude = self.amplitude_um();
        let [a, b] = self.parts_um.map(|part| part / amplitude);
        let along = |[a, b]: [f64; 2]| {
            let [[aa, ab], [_, bb]] = self.covariance;
            (a * a * aa + 2.0 * a * b * ab + b * b * bb).max(0.0).sqrt()
        };
        [along([a, b]), along([-b, a])]
    }
}

/// Variance of what is within ±bound/2 as a sine is: 1/8 of the bound squared (GUM 4.3.9, arcsine distribution). Between a uniform
/// distribution (1/12) and the two ends (1/4).
fn of_bound(bound_um: f64) -> f64 {
    bound_um * bound_um / 8.0
}

/// Pre-travel at a direction in the probe's frame, without mean and order 1, with its standard uncertainty; by lobes that are
/// observable. `besides_um2` is the variance of what the model leaves out.
pub(crate) fn pretravel_um(
    fit: &Fitted,
    lobes: &[Lobe],
    direction: f64,
    bound_um: Option<f64>,
    besides_um2: f64,
) -> [f64; 2] {
    let used: Vec<&Lobe> = lobes.iter().filter(|lobe| lobe.observable).collect();
    if used.is_empty() {
        return [f64::NAN; 2];
    }
    let mut places = Vec::new();
    let mut factors = Vec::new();
    for lobe in &used {
        let pair = fit.design.pair(lobing_order, lobe.order).unwrap_or_default();
        for (place, part) in pair.into_iter().zip([Part::Cosine, Part::Sine]) {
            places.push(place);
            factors.push(wave(lobe.order, part, direction));
        }
    }
    let number: f64 = places.iter().zip(&factors).map(|(place, factor)| fit.solved.coefficients[*place] * factor).sum();
    let covariance = fit.covariance_of(&places);
    let mut variance = besides_um2;
    for (row, one) in factors.iter().enumerate() {
        for (column, other) in factors.iter().enumerate() {
            variance += one * other * covariance[(row, column)];
        }
    }
    // The bound is of the whole form, not of each order.
    if used.iter().any(|lobe| lobe.bounded) {
        variance += bound_um.map_or(0.0, of_bound);
    }
    [number, variance.max(0.0).sqrt()]
}
