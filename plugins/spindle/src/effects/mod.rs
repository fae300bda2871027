//! What a spindle measurement may have that its rig does not declare: one file an effect.
//!
//! An effect says what it is described by, how it changes the model when applied ([`Alterations`]), and how it changes the
//! readings per unit of each parameter. Readings are u = form + motion along the sensor (`physics.md` section 1). Partials are
//! those of the averaged readings' harmonics, Re Σ c e^{−inΦ}, at the values that are applied.
//!
//! To add one: a type that implements [`SpindleEffect`], here and in [`all`], or in a crate of its own whose `register` adds it
//! by [`entry`] (`examples/14-own-effect`). `tests/diagnose.rs` checks every effect's partials against finite differences.

mod alterations;
mod asynchronous_line;
mod axial_motion;
mod even_order_motion;
mod filter_attenuation;
mod predicted;
mod reversal_angle;
mod second_order_geometry;
mod sensor_angle;
mod sensor_axial_position;
mod sensor_gain;
mod sensor_nonlinearity;
mod setup_motion_change;
mod speed_ripple;
mod thermal_drift;

use std::sync::Arc;

use runout_core::{
    Complex64,
    model::{Parameter, diagnosis::Estimated},
    pipeline::effects::EffectEntry,
};

pub use alterations::{Alterations, Harmonic, SensorAlteration, SetupAlteration, Transfer, creep};
pub use predicted::Predicted;

use crate::layout::Layout;

/// An effect on a spindle measurement.
pub trait SpindleEffect: Send + Sync {
    /// What it is.
    fn about(&self) -> About;

    /// Puts it into the model: `target` is the index of a sensor or a setup, `values` has one entry a parameter.
    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations);

    /// ∂(reading)/∂(parameter) of all readings, `[parameter][order][reading]`.
    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>>;

    /// Whether the declared model has it anyway, and cannot lack it.
    fn is_declared(&self, _layout: &Layout, _second_order: bool) -> bool {
        false
    }

    /// ∂(mean creep of a sensor over one turn, in µm)/∂(parameter): the levels of the turns observe it besides the averaged turn.
    /// Nothing where the effect changes no level.
    fn creep_partials(&self, _target: usize, _sensor: usize) -> Vec<f64> {
        Vec::new()
    }

    /// Its parameters as people say them.
    fn present(&self, estimated: Vec<Estimated>) -> Vec<Estimated> {
        estimated
    }
}

/// What an effect is.
#[derive(Debug, Clone, PartialEq)]
pub struct About {
    /// Its id.
    pub id: &'static str,
    /// One line for lists.
    pub does: &'static str,
    /// Where it acts.
    pub acts_on: ActsOn,
    /// What it is described by; nothing where it only can be there or not.
    pub parameters: Vec<Parameter>,
}

/// Where an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ActsOn {
    /// Any one sensor.
    Sensor,
    /// Any setup but the first, which the others are counted from.
    LaterSetup,
    /// The rig as a whole.
    Rig,
}

/// A parameter with its unit and usual size.
#[must_use]
pub fn parameter(name: &str, unit: &str, tolerance: f64) -> Parameter {
    Parameter { name: name.into(), unit: unit.into(), tolerance }
}

/// Orders of uneven speed and of axial motion that are looked for.
const LOW_ORDERS: std::ops::RangeInclusive<usize> = 1..=6;

/// Asynchronous lines that are looked for.
pub(crate) const MOST_LINES: usize = 3;

/// An effect for the registry.
#[must_use]
pub fn entry(effect: Arc<dyn SpindleEffect>) -> EffectEntry {
    let About { id, does, parameters, .. } = effect.about();
    EffectEntry::new(id, does, parameters, effect)
}

/// Every effect of this crate.
#[must_use]
pub fn all() -> Vec<Arc<dyn SpindleEffect>> {
    let mut all: Vec<Arc<dyn SpindleEffect>> = vec![
        Arc::new(sensor_gain::SensorGain),
        Arc::new(sensor_angle::SensorAngle),
        Arc::new(sensor_axial_position::SensorAxialPosition { sees_another_circle: false }),
        Arc::new(sensor_axial_position::SensorAxialPosition { sees_another_circle: true }),
        Arc::new(sensor_nonlinearity::SensorNonlinearity),
        Arc::new(reversal_angle::ReversalAngle),
        Arc::new(setup_motion_change::SetupMotionChange),
        Arc::new(thermal_drift::ThermalDrift),
        Arc::new(filter_attenuation::FilterAttenuation),
        Arc::new(even_order_motion::EvenOrderMotion),
        Arc::new(second_order_geometry::SecondOrderGeometry),
    ];
    all.extend(
        (0..MOST_LINES)
            .map(|number| -> Arc<dyn SpindleEffect> { Arc::new(asynchronous_line::AsynchronousLine { number }) }),
    );
    for order in LOW_ORDERS {
        all.push(Arc::new(speed_ripple::SpeedRipple { order }));
        all.push(Arc::new(axial_motion::AxialMotion { order }));
    }
    all
}

/// Amplitude, phase and order of cosine·cos(nΦ) + sine·sin(nΦ) = amplitude·cos(nΦ − phase), from the estimates of cosine
/// and sine.
fn as_amplitude(order: usize, estimated: &[Estimated]) -> Vec<Estimated> {
    let [cosine, sine] = estimated else { return estimated.to_vec() };
    let amplitude = cosine.value.hypot(sine.value);
    let share = |part: f64| if amplitude > 0.0 { part / amplitude } else { 1.0 };
    let [along, across] = [share(cosine.value), share(sine.value)];
    let std = (along * cosine.std).hypot(across * sine.std);
    let turned = (across * cosine.std).hypot(along * sine.std) / amplitude.max(f64::MIN_POSITIVE);
    let exact =
        |name: &str, value: f64, unit: &str, std: f64| Estimated { name: name.into(), value, std, unit: unit.into() };
    vec![
        exact("amplitude", amplitude, &cosine.unit, std),
        exact("order", order as f64, "1/rev", 0.0),
        exact("phase", sine.value.atan2(cosine.value), "rad", turned),
    ]
}
