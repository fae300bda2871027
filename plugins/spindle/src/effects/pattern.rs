//! Effects of a pattern of one order, a cos nα + b sin nα, that certain readings have besides the part's form.
//!
//! | effect | has it | α counts from |
//! | --- | --- | --- |
//! | `chuck-form` | all readings: what turns with the spindle and not with the part, as lobes of a thin part in a chuck | the spindle |
//! | `clamping-form` | those of a later setup: the part was clamped otherwise | the part |
//! | `electrical-run-out` | those of one sensor: what the material does to it | the part |
//!
//! ∂/∂a = e^{inα₀}, ∂/∂b = −i·e^{inα₀}, α₀ being the angle under the sensor at Φ = 0. All sections have the same pattern.

use std::f64::consts::TAU;

use runout_core::{Complex64, model::diagnosis::Estimated};

use super::{About, ActsOn, Alterations, Predicted, SpindleEffect, as_amplitude, parameter};
use crate::{
    alterations::{Pattern, PatternOf},
    layout::{ENOUGH, Layout, Reading},
};

/// Orders that are looked for: jaws and pads are 2 to 6, and come with their multiples.
pub(super) const ORDERS: std::ops::RangeInclusive<usize> = 2..=12;

/// Angles of the part by which all setups are turned by whole periods, up to this: its pattern is then that of the form.
const SAME_RAD: f64 = 1e-6;

/// A pattern of one order.
pub(crate) struct OfOrder {
    order: usize,
    of: fn(usize) -> PatternOf,
}

impl OfOrder {
    /// All of them.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        let kinds: [fn(usize) -> PatternOf; 3] = [|_| PatternOf::Spindle, PatternOf::Setup, PatternOf::Sensor];
        ORDERS.flat_map(move |order| kinds.map(|of| Self { order, of }))
    }

    /// With an amplitude of 1 of its cosine.
    fn unit(&self, target: usize) -> Pattern {
        Pattern { order: self.order, cosine: 1.0, sine: 0.0, of: (self.of)(target) }
    }
}

impl SpindleEffect for OfOrder {
    fn about(&self) -> About {
        let (id, does, acts_on) = match (self.of)(0) {
            PatternOf::Spindle => ("chuck-form", "a form turns with the spindle and not with the part", ActsOn::Rig),
            PatternOf::Setup(_) => {
                ("clamping-form", "the part has another form as it is clamped in one setup", ActsOn::LaterSetup)
            }
            PatternOf::Sensor(_) => {
                ("electrical-run-out", "a sensor reads a pattern of the part that is no form", ActsOn::Sensor)
            }
        };
        About { id, does, acts_on, parameters: vec![parameter("cosine", "um", 0.1), parameter("sine", "um", 0.1)] }
    }

    fn suits(&self, target: usize, layout: &Layout) -> bool {
        let radial = || layout.readings.iter().filter(|reading| !reading.view.is_axial());
        let beside = |reading: &Reading, count: usize| layout.radial_sensors(reading.section) >= count;
        match (self.of)(target) {
            PatternOf::Spindle => {
                // Of what turns with the part in all setups, the form has it.
                let turned = |reading: &Reading| reading.angle_rad - reading.part_angle_rad;
                let periods = |reading: &Reading| {
                    let other = radial().find(|other| other.sensor == reading.sensor && other.setup == 0);
                    self.order as f64 * (turned(reading) - other.map_or(0.0, turned)) / TAU
                };
                let differs = |reading: &Reading| (periods(reading) - periods(reading).round()).abs() > SAME_RAD;
                radial().any(|reading| beside(reading, ENOUGH) && differs(reading))
            }
            PatternOf::Setup(_) => radial().count() > 0,
            PatternOf::Sensor(sensor) => radial().any(|reading| reading.sensor == sensor && beside(reading, 2)),
        }
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        alterations.patterns.push(Pattern { cosine: values[0], sine: values[1], ..self.unit(target) });
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let (layout, count) = (predicted.layout, predicted.layout.readings.len());
        let parts = [(1.0, 0.0), (0.0, 1.0)].map(|(cosine, sine)| {
            let pattern = Pattern { cosine, sine, ..self.unit(target) };
            let mut partial = predicted.nothing();
            let of_order = partial.iter_mut().skip(self.order * count);
            for (reading, value) in layout.readings.iter().zip(of_order) {
                *value = layout.on_part(reading, &pattern) * layout.part_phase(reading, self.order);
            }
            partial
        });
        parts.into()
    }

    fn order(&self) -> Option<usize> {
        Some(self.order)
    }

    fn is_one_of_many(&self) -> bool {
        true
    }

    fn last_of_list(&self) -> Option<String> {
        (self.order == *ORDERS.end()).then(|| format!("order {} is the highest one looked for", self.order))
    }

    fn present(&self, estimated: Vec<Estimated>) -> Vec<Estimated> {
        as_amplitude(self.order, &estimated)
    }
}
