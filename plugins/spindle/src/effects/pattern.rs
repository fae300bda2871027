//! Effects of one order, a cos nα + b sin nα, that certain readings have besides the part's form and the spindle's motion.
//!
//! | effect | has it | α counts from |
//! | --- | --- | --- |
//! | `chuck-form` | all readings: what turns with the spindle and not with the part, as lobes of a thin part in a chuck | the spindle |
//! | `clamping-form` | those of a later setup: the part was clamped otherwise | the part |
//! | `electrical-run-out` | those of one sensor: what the material does to it | the part |
//! | `synchronous-pick-up` | those of one sensor: what it picks up at a whole order | the spindle |
//! | `setup-motion-order` | those of a later setup, along x and along y: the axis moved otherwise | the spindle |
//!
//! ∂/∂a = e^{inα₀}, ∂/∂b = −i·e^{inα₀} where α counts from the part, α₀ being the angle under the sensor at Φ = 0; all sections have the same
//! pattern.

use std::f64::consts::TAU;

use runout_core::{
    Complex64,
    closed_loop::{Parameter, diagnosis::Estimated},
};

use super::{About, ActsOn, Alterations, Predicted, SpindleEffect, as_amplitude, parameter};
use crate::{
    alterations::{Pattern, PatternOf},
    layout::{ENOUGH, Layout, Reading},
};

/// Orders that are looked for: jaws and pads are 2 to 6, and come with their multiples.
pub(super) const ORDERS: std::ops::RangeInclusive<usize> = 2..=12;

/// Angles of the part by which all setups are turned by whole periods, up to this: its pattern is then that of the form.
const SAME_RAD: f64 = 1e-6;

/// What has the pattern.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Chuck,
    Clamping,
    RunOut,
    PickUp,
    Motion,
}

/// A pattern of one order.
pub(crate) struct OfOrder {
    order: usize,
    kind: Kind,
}

impl OfOrder {
    /// All of them.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        let kinds = [Kind::Chuck, Kind::Clamping, Kind::RunOut, Kind::PickUp, Kind::Motion];
        ORDERS.flat_map(move |order| kinds.map(|kind| Self { order, kind }))
    }

    /// With two parameters each, the amplitudes of cosine and sine.
    fn parts(&self, target: usize) -> Vec<PatternOf> {
        match self.kind {
            Kind::Chuck => vec![PatternOf::Spindle],
            Kind::Clamping => vec![PatternOf::Setup(target)],
            Kind::RunOut => vec![PatternOf::Sensor(target)],
            Kind::PickUp => vec![PatternOf::SensorOnSpindle(target)],
            Kind::Motion => vec![PatternOf::MotionX(target), PatternOf::MotionY(target)],
        }
    }
}

impl SpindleEffect for OfOrder {
    fn about(&self) -> About {
        let (id, does, acts_on) = match self.kind {
            Kind::Chuck => ("chuck-form", "a form turns with the spindle and not with the part", ActsOn::Rig),
            Kind::Clamping => {
                ("clamping-form", "the part has another form as it is clamped in one setup", ActsOn::OddSetup)
            }
            Kind::RunOut => {
                ("electrical-run-out", "a sensor reads a pattern of the part that is no form", ActsOn::Sensor)
            }
            Kind::PickUp => (
                "synchronous-pick-up",
                "a sensor picks up a whole order of the spindle that is no motion",
                ActsOn::Sensor,
            ),
            Kind::Motion => {
                ("setup-motion-order", "the spindle moves otherwise in one setup, at one order", ActsOn::OddSetup)
            }
        };
        let both = |prefix: &str| ["cosine", "sine"].map(|part| parameter(&format!("{prefix}{part}"), "um", 0.1));
        let parameters: Vec<Parameter> = match self.kind {
            Kind::Motion => [both("x-"), both("y-")].concat(),
            _ => both("").into(),
        };
        About { id, does, acts_on, parameters }
    }

    fn suits(&self, target: usize, layout: &Layout) -> bool {
        let radial = || layout.readings.iter().filter(|reading| !reading.view.is_axial());
        let beside = |reading: &Reading, count: usize| layout.radial_sensors(reading.section) >= count;
        match self.kind {
            Kind::Chuck => {
                // Of what turns with the part in all setups, the form has it.
                let turned = |reading: &Reading| reading.angle_rad - reading.part_angle_rad;
                let periods = |reading: &Reading| {
                    let other = radial().find(|other| other.sensor == reading.sensor && other.setup == 0);
                    self.order as f64 * (turned(reading) - other.map_or(0.0, turned)) / TAU
                };
                let differs = |reading: &Reading| (periods(reading) - periods(reading).round()).abs() > SAME_RAD;
                radial().any(|reading| beside(reading, ENOUGH) && differs(reading))
            }
            Kind::Clamping | Kind::Motion => radial().count() > 0,
            Kind::RunOut => radial().any(|reading| reading.sensor == target && beside(reading, 2)),
            // Of two sensors at right angles, each one's is a motion.
            Kind::PickUp => radial().any(|reading| reading.sensor == target && beside(reading, ENOUGH)),
        }
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        for (of, values) in self.parts(target).into_iter().zip(values.chunks_exact(2)) {
            alterations.patterns.push(Pattern { order: self.order, cosine: values[0], sine: values[1], of });
        }
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let (layout, count) = (predicted.layout, predicted.layout.readings.len());
        let units = self.parts(target).into_iter().flat_map(|of| [(1.0, 0.0), (0.0, 1.0)].map(|unit| (of, unit)));
        units
            .map(|(of, (cosine, sine))| {
                let pattern = Pattern { order: self.order, cosine, sine, of };
                let mut partial = predicted.nothing();
                let of_order = partial.iter_mut().skip(self.order * count);
                for (reading, value) in layout.readings.iter().zip(of_order) {
                    *value = layout.on_part(reading, &pattern) * layout.part_phase(reading, self.order);
                }
                partial
            })
            .collect()
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
        if self.kind != Kind::Motion {
            return as_amplitude(self.order, &estimated);
        }
        let named = |axis: &str, one: Estimated| {
            let name = if one.name == "order" { one.name } else { format!("{axis}{}", one.name) };
            Estimated { name, ..one }
        };
        let axes = ["x-", "y-"].into_iter().zip(estimated.chunks(2));
        let mut both: Vec<Estimated> = axes
            .flat_map(|(axis, own)| as_amplitude(self.order, own).into_iter().map(move |one| named(axis, one)))
            .collect();
        let mut orders = 0;
        both.retain(|one| {
            orders += usize::from(one.name == "order");
            one.name != "order" || orders == 1
        });
        both
    }
}
