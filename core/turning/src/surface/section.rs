//! Sections of a surface: their orders, and the noise that their errors are made of.

use crate::separation::{Quantity, Separation};
use runout_draws::stands_out;
use runout_numerics::Complex64;
use runout_standards::gaps::Gaps;

/// One section's form, order by order from 0; `None` where it is not known.
#[derive(Debug)]
pub struct Section {
    /// Id of the section.
    pub id: String,
    /// Name of the station.
    pub station: String,
    /// Place along the axis, in mm.
    pub z_mm: f64,
    /// Where around it there is no surface.
    pub gaps: Gaps,
    /// Share of what was measured that was used.
    pub used: f64,
    /// Order of which filters before the average pass half.
    pub half_power_upr: Option<f64>,
    /// Form above the highest order, as far as it shows: root mean square in µm.
    pub absent_um: f64,
    /// One entry an order from 0; `None` where it is lost.
    pub orders: Vec<Option<Order>>,
    /// What noise its errors are made of, as wide as their variance is badly known.
    pub noise: Vec<Noise>,
    /// Degrees of freedom of the readings that all orders have their variance from; nothing where they do not have it from one.
    pub readings_freedom: Option<usize>,
}

/// A source of noise of a station, shared by its sections.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Noise {
    /// The section whose own noise it is, by its place in the station.
    pub of: usize,
    /// What noise of E|g|² = 1 makes of each order, by order from 0; 0 where it is not known.
    pub amplitudes: Vec<Complex64>,
}

/// One order of a form.
#[derive(Debug, Clone, Copy)]
pub struct Order {
    pub value: Complex64,
    /// E|δ|², µm²; NaN where not known.
    pub variance: f64,
}

impl Section {
    /// Orders from 2 that are not known, ascending.
    pub fn lost_orders(&self) -> impl Iterator<Item = usize> + '_ {
        let orders = self.orders.iter().enumerate().skip(2);
        orders.filter(|(_, known)| known.is_none()).map(|(order, _)| order)
    }

    /// Whether form stands out from the noise at orders that a filter before the average has weakened: from half of that on of which half of the
    /// power passes.
    #[must_use]
    pub fn shows_weakened(&self) -> bool {
        let Some(half_power_upr) = self.half_power_upr else { return false };
        let weakened = self.orders.iter().enumerate().skip(2).filter(|(order, _)| *order as f64 > 0.5 * half_power_upr);
        weakened.filter_map(|(_, known)| *known).any(|known| stands_out(known.value, known.variance))
    }

    pub(super) fn label(&self) -> String {
        format!("{}@{}", self.id, self.station)
    }
}

/// Standard deviations of own noise below this share of the whole are rounding.
pub(super) const ROUNDING: f64 = 1e-6;

/// Of each section, the noise that its errors are made of: own noise, and where covariances are known a part of that of the
/// sections before it (Cholesky's factor of the covariance, order by order).
pub(super) fn noise(separation: &Separation, orders: usize) -> Vec<Vec<Noise>> {
    let (width, sections) = (separation.unknowns.len(), separation.sections.len());
    let forms: Vec<Option<usize>> = (0..sections).map(|index| separation.position(Quantity::Form(index))).collect();
    let count = forms.iter().flatten().count();
    let joint = separation.form_covariance.as_ref().filter(|_| count == sections);
    let widening = separation.widening();
    let orders = orders.min(widening.len());
    let shared = |index: usize| if joint.is_some() { 0..=index } else { index..=index };
    let mut noise: Vec<Vec<Noise>> = (0..sections)
        .map(|index| shared(index).map(|of| Noise { of, amplitudes: vec![Complex64::ZERO; orders] }).collect())
        .collect();
    let (mut factor, mut total) = (vec![Complex64::ZERO; sections * sections], vec![0.0; sections]);
    for order in 0..orders {
        for row in 0..sections {
            let variance = forms[row].map(|form| separation.variance_of(order * width + form));
            // Of what is not known, nothing is drawn.
            let variance = variance.filter(|variance| variance.is_finite() && *variance > 0.0).unwrap_or(0.0);
            let mut left = variance;
            total[row] = variance.sqrt();
            for column in 0..row {
                let before: Complex64 =
                    (0..column).map(|k| factor[row * sections + k] * factor[column * sections + k].conj()).sum();
                let own = factor[column * sections + column].re;
                let entry = joint.and_then(|joint| joint.get((order * sections + row) * sections + column));
                // A section whose noise is all that of others has none of its own, but for rounding.
                let entry = entry.filter(|entry| entry.is_finite() && own > ROUNDING * total[column] && variance > 0.0);
                let share = entry.map_or(Complex64::ZERO, |entry| (entry - before) / own);
                // Never more than there is, whatever rounding says.
                let share = share * (left.sqrt() / share.norm()).min(1.0);
                let share = if share.is_finite() { share } else { Complex64::ZERO };
                left = (left - share.norm_sqr()).max(0.0);
                factor[row * sections + column] = share;
            }
            factor[row * sections + row] = Complex64::from(left.sqrt());
            for noise in &mut noise[row] {
                noise.amplitudes[order] = factor[row * sections + noise.of] * widening[order];
            }
        }
    }
    noise
}

pub(super) fn orders(separation: &Separation, unknown: usize) -> Vec<Option<Order>> {
    let width = separation.unknowns.len();
    let seen = separation.observable.iter().skip(unknown).step_by(width);
    let variances = (0..).map(|order| separation.variance_of(order * width + unknown));
    separation
        .coefficients(unknown)
        .zip(seen)
        .zip(variances)
        .map(|((value, seen), variance)| (*seen && value.is_finite()).then_some(Order { value, variance }))
        .collect()
}

/// The mean of sections at one z, order by order over those that know it; its variance is NaN where not known.
pub(super) fn mean(group: &[Section]) -> impl Iterator<Item = Order> + '_ {
    let orders = group.iter().map(|section| section.orders.len()).max().unwrap_or(0);
    (0..orders).map(move |order| {
        let known = || group.iter().filter_map(move |section| *section.orders.get(order)?);
        let weighted = known().all(|known| known.variance.is_finite() && known.variance > 0.0);
        let weight = |order: &Order| if weighted { order.variance.recip() } else { 1.0 };
        let weights: f64 = known().map(|order| weight(&order)).sum();
        let sum: Complex64 = known().map(|order| order.value * weight(&order)).sum();
        let spread: f64 = known().map(|order| order.variance * weight(&order).powi(2)).sum();
        if weights > 0.0 {
            Order { value: sum / weights, variance: spread / weights.powi(2) }
        } else {
            Order { value: Complex64::ZERO, variance: f64::NAN }
        }
    })
}
