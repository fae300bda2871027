//! What a spindle measurement may have that its rig does not declare: one file an effect.
//!
//! An effect says what it is described by, how it changes the model when applied ([`Alterations`]), and how it changes the
//! readings per unit of each parameter. Readings are u = form + motion along the sensor (`docs/appendix/physics.md` section 1).
//! Partials are those of the averaged readings' harmonics, Re Σ c e^{−inΦ}, at the values that are applied. Parameters are in the units in
//! which a rig or a scenario is written: angles in degrees, places in mm.
//!
//! To add one: a type that implements [`SpindleEffect`], here and in [`all`], or in a crate of its own whose `register` adds it
//! by [`entry`] (`examples/13-own-effect`); one of a single channel may be no more than a [`ChannelTransfer`]. `tests/diagnose.rs` checks every effect's partials against finite differences.

mod asynchronous_line;
mod axial_motion;
mod channel_effect;
mod channel_response;
mod correct;
mod cross_talk;
mod even_order_motion;
mod mistakes;
mod part_radius;
mod pattern;
mod predicted;
mod reversal_angle;
mod second_order_geometry;
mod sensor_angle;
mod sensor_axial_position;
mod sensor_gain;
mod sensor_line;
mod sensor_nonlinearity;
mod sensors_angle;
mod setup_motion_change;
mod speed_ripple;
mod thermal_drift;
mod unlike_shares;

use std::sync::Arc;

use runout_core::{
    Complex64, Error,
    closed_loop::{Parameter, diagnosis::Estimated, in_tolerances},
    effects::EffectEntry,
    rig::Rig,
};

pub use crate::alterations::{Alterations, Harmonic, Pattern, PatternOf, SensorAlteration, SetupAlteration, Transfer};
pub use channel_effect::{ChannelEffect, ChannelTransfer, differences};
pub use correct::creep;
use mistakes::ordered_pairs;
pub use mistakes::{Mistake, pair_of, pairs};
pub use predicted::Predicted;

use crate::layout::Layout;
use channel_response::ChannelResponse;

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

    /// Whether it can act at a target of a layout: what a sensor's place across the axis does is nothing to one that looks along it.
    fn suits(&self, _target: usize, _layout: &Layout) -> bool {
        true
    }

    /// ∂(mean creep of a sensor over one turn, in µm)/∂(parameter): the levels of the turns observe it besides the averaged turn.
    /// Nothing where the effect changes no level.
    fn creep_partials(&self, _target: usize, _sensor: usize) -> Vec<f64> {
        Vec::new()
    }

    /// The order of an effect that is there at several orders, each by itself.
    fn order(&self) -> Option<usize> {
        None
    }

    /// Whether it is one of a long list of effects that are alike: foresight leaves them out, and a few of them only are tried at a time.
    fn is_one_of_many(&self) -> bool {
        false
    }

    /// The effect that has the same partials while it is small: of both, foresight lists that one.
    fn first_order_like(&self) -> Option<&'static str> {
        None
    }

    /// Which mistake in the rig file it is, where it is one.
    fn mistake(&self) -> Option<Mistake> {
        None
    }

    /// Whether its parameters can have these values.
    fn is_possible(&self, _values: &[f64]) -> bool {
        true
    }

    /// In µm rms, what it has to move readings by at its usual size so that it is said where a layout does not see it.
    fn negligible_um(&self) -> f64 {
        0.0
    }

    /// How unusual these values are: the largest, in tolerances; a factor counts by its logarithm.
    fn size(&self, values: &[f64]) -> f64 {
        in_tolerances(&self.about().parameters, values)
    }

    /// Values of its only parameter at which a fit may begin besides 0: an angle that is far off turns high orders by whole periods.
    fn far_values(&self) -> Vec<f64> {
        Vec::new()
    }

    /// What ends the list of effects (orders, lines) of which this one is the last.
    fn last_of_list(&self) -> Option<String> {
        None
    }

    /// The keys of the rig that declare what it changes; nothing where a rig has none for it.
    fn rig_key(&self) -> Option<RigKey> {
        None
    }

    /// What single turns show of it besides their average, where they do.
    fn turn_evidence(&self) -> Option<TurnEvidence> {
        None
    }

    /// The number of the line in the turns' spectrum that it is, where it is one.
    fn line(&self) -> Option<usize> {
        match self.turn_evidence()? {
            TurnEvidence::Line(number) => Some(number),
            TurnEvidence::Levels => None,
        }
    }

    /// Why it cannot say what it does, once that has failed: the work that uses it then fails with this error.
    fn failure(&self) -> Option<Error> {
        None
    }

    /// Its parameters as people say them.
    fn present(&self, estimated: Vec<Estimated>) -> Vec<Estimated> {
        estimated
    }
}

/// What single turns show of an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TurnEvidence {
    /// The levels of the turns creep.
    Levels,
    /// The spectrum of the turns has a line: its number among those found.
    Line(usize),
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
    /// Any two sensors: the target is first · (number of sensors) + second.
    SensorPair,
    /// Any two sensors, in either order: the second instead of the first is another target.
    SensorCopy,
    /// Any sensor in any one setup: the target is sensor · (number of setups) + setup.
    SensorInSetup,
    /// Any two sensors in any one setup: the target is the pair's · (number of setups) + setup.
    SensorPairInSetup,
    /// Any setup.
    Setup,
    /// A setup unlike all others: of two the second, which counts from the first; of more, any.
    OddSetup,
    /// Any two setups: the target is first · (number of setups) + second.
    SetupPair,
    /// Any two setups, in either order.
    SetupCopy,
    /// The rig as a whole.
    Rig,
}

impl ActsOn {
    /// Everything that it may act on in a rig of so many sensors and setups.
    #[must_use]
    pub fn targets(self, sensors: usize, setups: usize) -> Vec<usize> {
        match self {
            Self::Sensor => (0..sensors).collect(),
            // Of one setup, it is the sensor's everywhere.
            Self::SensorInSetup | Self::SensorPairInSetup if setups < 2 => Vec::new(),
            Self::SensorInSetup => (0..sensors * setups).collect(),
            Self::SensorPairInSetup => {
                pairs(sensors).flat_map(|pair| (0..setups).map(move |setup| pair * setups + setup)).collect()
            }
            Self::SensorPair => pairs(sensors).collect(),
            Self::SensorCopy => ordered_pairs(sensors).collect(),
            Self::Setup => (0..setups).collect(),
            Self::OddSetup => (usize::from(setups < 3)..setups).collect(),
            Self::SetupPair => pairs(setups).collect(),
            Self::SetupCopy => ordered_pairs(setups).collect(),
            Self::Rig => vec![0],
        }
    }

    /// Ids of what a target stands for.
    #[must_use]
    pub fn ids(self, target: usize, rig: &Rig) -> Vec<String> {
        let sensor = |index: usize| rig.sensors[index].id.clone();
        let setup = |index: usize| rig.setups[index].id.clone();
        let (sensors, setups) = (rig.sensors.len(), rig.setups.len());
        match self {
            Self::Sensor => vec![sensor(target)],
            Self::SensorPair | Self::SensorCopy => pair_of(target, sensors).map(sensor).to_vec(),
            Self::SensorInSetup => vec![sensor(target / setups), setup(target % setups)],
            Self::SensorPairInSetup => {
                let pair = pair_of(target / setups, sensors).map(sensor);
                pair.into_iter().chain([setup(target % setups)]).collect()
            }
            Self::Setup | Self::OddSetup => vec![setup(target)],
            Self::SetupPair | Self::SetupCopy => pair_of(target, setups).map(setup).to_vec(),
            Self::Rig => Vec::new(),
        }
    }
}

/// What a rig declares and effects change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RigKey {
    /// `gain` of a sensor.
    SensorGain,
    /// `angle_deg` of a sensor.
    SensorAngle,
    /// `quadratic_per_um` and `cubic_per_um2` of a sensor.
    SensorCharacteristic,
    /// `part_deg` of a setup.
    PartAngle,
    /// `sensors_deg` of a setup.
    SensorsAngle,
    /// `part_radius_mm`.
    PartRadius,
}

/// A parameter with its unit and usual size.
#[must_use]
pub fn parameter(name: &str, unit: &str, tolerance: f64) -> Parameter {
    Parameter { name: name.into(), unit: unit.into(), tolerance }
}

/// Size of a gain, in tolerances: that of its logarithm, so that the inverse gain of another sensor is as large.
fn size_of_gain(values: &[f64]) -> f64 {
    values.iter().map(|gain| gain.ln_1p().abs() / GAIN_TOLERANCE).fold(0.0, f64::max)
}

/// Usual error of a gain.
const GAIN_TOLERANCE: f64 = 0.01;

/// ∂(angle in rad)/∂(angle in degrees).
const RAD_PER_DEG: f64 = std::f64::consts::PI / 180.0;

/// Orders of uneven speed and of axial motion that are looked for.
const LOW_ORDERS: std::ops::RangeInclusive<usize> = 1..=6;

/// Lines of the turns' spectrum that are looked for.
pub(crate) const MOST_LINES: usize = 6;

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
        Arc::new(sensor_angle::SensorAngle { in_one_setup: false }),
        Arc::new(sensor_angle::SensorAngle { in_one_setup: true }),
        Arc::new(sensor_axial_position::SensorAxialPosition { sees_another_circle: false }),
        Arc::new(sensor_axial_position::SensorAxialPosition { sees_another_circle: true }),
        Arc::new(sensor_nonlinearity::SensorNonlinearity),
        Arc::new(reversal_angle::ReversalAngle),
        Arc::new(sensors_angle::SensorsAngle),
        Arc::new(setup_motion_change::SetupMotionChange),
        Arc::new(thermal_drift::ThermalDrift),
        Arc::new(even_order_motion::EvenOrderMotion),
        Arc::new(second_order_geometry::SecondOrderGeometry),
        Arc::new(part_radius::PartRadius),
    ];
    all.extend(ChannelResponse::all().map(|response| -> Arc<dyn SpindleEffect> { Arc::new(response) }));
    all.push(Arc::new(unlike_shares::ProbeSpot));
    all.push(Arc::new(unlike_shares::BracketMotion));
    all.push(Arc::new(cross_talk::OfOneChannel));
    all.push(Arc::new(cross_talk::ChannelGhost));
    for number in 0..MOST_LINES {
        all.push(Arc::new(asynchronous_line::AsynchronousLine { number }));
        all.push(Arc::new(sensor_line::SensorLine { number }));
    }
    all.extend(pattern::OfOrder::all().map(|pattern| -> Arc<dyn SpindleEffect> { Arc::new(pattern) }));
    all.extend(Mistake::ALL.map(|mistake| -> Arc<dyn SpindleEffect> { Arc::new(mistake) }));
    for order in LOW_ORDERS {
        all.push(Arc::new(speed_ripple::SpeedRipple { order, in_one_setup: false }));
        all.push(Arc::new(speed_ripple::SpeedRipple { order, in_one_setup: true }));
        all.push(Arc::new(axial_motion::AxialMotion { order }));
    }
    all
}

/// Angles of 6° to 42° to either side, as near to each other as orders to 24 ask for, in degrees.
fn far_angles_deg() -> Vec<f64> {
    (2..=14).flat_map(|step| [-3.0, 3.0].map(|angle_deg| angle_deg * f64::from(step))).collect()
}

/// What ends a list of orders, where this one is the last.
fn last_order(order: usize) -> Option<String> {
    (order == *LOW_ORDERS.end()).then(|| format!("order {order} is the highest one looked for"))
}

/// Amplitude, phase and order of cosine·cos(nΦ) + sine·sin(nΦ) = amplitude·cos(nΦ − phase), from the estimates of cosine
/// and sine. The phase is in degrees.
fn as_amplitude(order: usize, estimated: &[Estimated]) -> Vec<Estimated> {
    let [cosine, sine] = estimated else { return estimated.to_vec() };
    let amplitude = cosine.value.hypot(sine.value);
    let share = |part: f64| if amplitude > 0.0 { part / amplitude } else { 1.0 };
    let [along, across] = [share(cosine.value), share(sine.value)];
    let combined = |of_cosine: f64, of_sine: f64| {
        let [cosine, sine] = [cosine.std?, sine.std?];
        Some((of_cosine * cosine).hypot(of_sine * sine))
    };
    let std = combined(along, across);
    let turned = combined(across, along).map(|std| std / amplitude.max(f64::MIN_POSITIVE));
    let exact = |name: &str, value: f64, unit: &str, std: Option<f64>| Estimated {
        name: name.into(),
        value,
        std,
        unit: unit.into(),
    };
    vec![
        exact("amplitude", amplitude, &cosine.unit, std),
        exact("order", order as f64, "1/rev", std.map(|_| 0.0)),
        exact("phase", sine.value.atan2(cosine.value).to_degrees(), "deg", turned.map(f64::to_degrees)),
    ]
}
