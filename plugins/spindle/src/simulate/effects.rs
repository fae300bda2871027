//! What happens besides: each effect changes the simulated world where it would change the real one.

use runout_core::{
    Complex64,
    pipeline::error::{Fault, known_names},
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    chain::{Drift, LowPass},
    check,
    config::{Geometry, LineConfig, MotionHarmonic},
    motion::{add_harmonic, random_harmonics},
    random::Purpose,
    series,
    spin::Ripple,
    world::{Clamping, TrueSensor, TrueSetup, World},
};

/// `[[effect]]`: one entry, named by `plugin`. `declared` says whether the separation will be told of it.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "plugin", rename_all = "kebab-case")]
pub enum Effect {
    /// Readings are too large or too small by a factor.
    SensorGain(SensorGain),
    /// The sensor looks at the part from another angle.
    SensorAngle(SensorAngle),
    /// The sensor sits at another z: another lever arm on tilt, and another circle of the part.
    SensorAxialPosition(SensorAxialPosition),
    /// Readings gain a part in u² and u³.
    SensorNonlinearity(SensorNonlinearity),
    /// The part was clamped at another angle.
    ReversalAngle(ReversalAngle),
    /// The part was clamped further off, at a known place.
    PartEccentricity(PartEccentricity),
    /// Says that readings follow the exact geometry, which they do unless `geometry = "linear"`.
    SecondOrderGeometry(SecondOrderGeometry),
    /// The synchronous motion is larger or smaller in a setup.
    SetupMotionChange(SetupMotionChange),
    /// Random synchronous motion of even orders in addition.
    EvenOrderMotion(EvenOrderMotion),
    /// The reading creeps from the start of each capture, ever slower.
    ThermalDrift(ThermalDrift),
    /// Motion to and fro at an order that is not whole.
    AsynchronousLine(AsynchronousLine),
    /// The spindle runs unevenly within the turn.
    SpeedRipple(SpeedRipple),
    /// The part moves along z, so that sensors see it elsewhere.
    AxialMotion(AxialMotion),
    /// A low-pass in one channel.
    FilterAttenuation(FilterAttenuation),
}

/// Reading × (1 + gain).
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorGain {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// Relative: 0.01 reads 1 % too much.
    pub relative_gain: f64,
    /// Whether the separation will be told.
    #[serde(default)]
    pub declared: bool,
}

/// True angle = stated angle + this.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorAngle {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// In degrees about +z.
    pub angle_deg: f64,
    /// Whether the separation will be told.
    #[serde(default)]
    pub declared: bool,
}

/// True z = stated z + this.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorAxialPosition {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// In mm.
    pub shift_mm: f64,
    /// Whether the separation will be told.
    #[serde(default)]
    pub declared: bool,
}

/// Reading = u + quadratic · u² + cubic · u³, before any gain.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorNonlinearity {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// In 1/µm.
    #[serde(default)]
    pub quadratic_per_um: f64,
    /// In 1/µm².
    #[serde(default)]
    pub cubic_per_um2: f64,
    /// Whether the separation will be told.
    #[serde(default)]
    pub declared: bool,
}

/// True part angle = stated part angle + this.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReversalAngle {
    /// Ids of setups.
    pub targets: Vec<String>,
    /// In degrees.
    pub angle_deg: f64,
    /// Whether the separation will be told.
    #[serde(default)]
    pub declared: bool,
}

/// Added to the random clamping of the setups named, in the part's own coordinates.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PartEccentricity {
    /// Ids of setups.
    pub targets: Vec<String>,
    /// Id of a section, where only that one is off.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub section: Option<String>,
    /// At the first section of the first station, in µm.
    pub offset_um: f64,
    /// Towards this angle of the part, in degrees.
    #[serde(default)]
    pub direction_deg: f64,
    /// Growth of the offset along z, in µrad.
    #[serde(default)]
    pub tilt_urad: f64,
    /// Towards this angle of the part, in degrees.
    #[serde(default)]
    pub tilt_direction_deg: f64,
    /// Whether the separation will be told.
    #[serde(default)]
    pub declared: bool,
}

/// No parameters: the radius is known.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SecondOrderGeometry {
    /// Whether the separation will be told.
    #[serde(default)]
    pub declared: bool,
}

/// Synchronous motion × ratio.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SetupMotionChange {
    /// Ids of setups.
    pub targets: Vec<String>,
    /// 1 leaves the motion as it is.
    pub ratio: f64,
    /// Whether the separation will be told.
    #[serde(default)]
    pub declared: bool,
}

/// Orders 2, 4, … with amplitudes falling as 1/order.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EvenOrderMotion {
    /// Root mean square along x, in µm.
    pub x_rms_um: f64,
    /// Root mean square along y, in µm.
    pub y_rms_um: f64,
    /// Highest order.
    pub max_order: usize,
    /// Whether the separation will be told.
    #[serde(default)]
    pub declared: bool,
}

/// rate · τ · (1 − e^{−t/τ}), t in turns at the nominal speed since the capture began.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ThermalDrift {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// At the start, in µm per turn.
    pub rate_um_per_rev: f64,
    /// τ, in turns.
    pub time_constant_turns: f64,
    /// Whether the separation will be told.
    #[serde(default)]
    pub declared: bool,
}

/// Its phase is random in each capture.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AsynchronousLine {
    /// Periods per turn, not a whole number.
    pub order: f64,
    /// In µm.
    pub amplitude_um: f64,
    /// About +z from x, in degrees.
    #[serde(default)]
    pub direction_deg: f64,
    /// Whether the separation will be told.
    #[serde(default)]
    pub declared: bool,
}

/// Angle = nominal + amplitude · (sin(order · nominal + phase) − sin phase).
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpeedRipple {
    /// Periods per turn.
    pub order: f64,
    /// In degrees of the spindle's angle.
    pub amplitude_deg: f64,
    /// In degrees.
    #[serde(default)]
    pub phase_deg: f64,
    /// Whether the separation will be told.
    #[serde(default)]
    pub declared: bool,
}

/// The part is at z + a(Φ) when it should be at z.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxialMotion {
    /// a(Φ) = Σ amplitude · cos(order · Φ − phase).
    pub harmonics: Vec<MotionHarmonic>,
    /// Whether the separation will be told.
    #[serde(default)]
    pub declared: bool,
}

/// Causal digital Butterworth low-pass, made by the bilinear transform with the cut-off kept.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FilterAttenuation {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// −3 dB, in Hz.
    pub cutoff_hz: f64,
    /// 1 to 8.
    #[serde(default = "first_order")]
    pub order: usize,
    /// Whether the separation will be told.
    #[serde(default)]
    pub declared: bool,
}

fn first_order() -> usize {
    1
}

impl Effect {
    /// Whether the separation will be told of it.
    #[must_use]
    pub fn declared(&self) -> bool {
        match self {
            Self::SensorGain(effect) => effect.declared,
            Self::SensorAngle(effect) => effect.declared,
            Self::SensorAxialPosition(effect) => effect.declared,
            Self::SensorNonlinearity(effect) => effect.declared,
            Self::ReversalAngle(effect) => effect.declared,
            Self::PartEccentricity(effect) => effect.declared,
            Self::SecondOrderGeometry(effect) => effect.declared,
            Self::SetupMotionChange(effect) => effect.declared,
            Self::EvenOrderMotion(effect) => effect.declared,
            Self::ThermalDrift(effect) => effect.declared,
            Self::AsynchronousLine(effect) => effect.declared,
            Self::SpeedRipple(effect) => effect.declared,
            Self::AxialMotion(effect) => effect.declared,
            Self::FilterAttenuation(effect) => effect.declared,
        }
    }

    /// Changes the world; `index` is the effect's place in the list.
    pub(super) fn apply(&self, world: &mut World, index: usize) -> Result<(), Fault> {
        match self {
            Self::SensorGain(effect) => {
                check::finite("relative_gain", effect.relative_gain)?;
                on_sensors(world, &effect.targets, |sensor| sensor.chain.gain *= 1.0 + effect.relative_gain)
            }
            Self::SensorAngle(effect) => {
                check::finite("angle_deg", effect.angle_deg)?;
                on_sensors(world, &effect.targets, |sensor| sensor.angle_rad += effect.angle_deg.to_radians())
            }
            Self::SensorAxialPosition(effect) => {
                check::finite("shift_mm", effect.shift_mm)?;
                on_sensors(world, &effect.targets, |sensor| sensor.z_mm += effect.shift_mm)
            }
            Self::SensorNonlinearity(effect) => {
                check::finite("quadratic_per_um", effect.quadratic_per_um)?;
                check::finite("cubic_per_um2", effect.cubic_per_um2)?;
                on_sensors(world, &effect.targets, |sensor| {
                    sensor.chain.quadratic_per_um += effect.quadratic_per_um;
                    sensor.chain.cubic_per_um2 += effect.cubic_per_um2;
                })
            }
            Self::ThermalDrift(effect) => {
                check::finite("rate_um_per_rev", effect.rate_um_per_rev)?;
                check::positive("time_constant_turns", effect.time_constant_turns)?;
                let drift =
                    Drift { rate_um_per_rev: effect.rate_um_per_rev, time_constant_turns: effect.time_constant_turns };
                on_sensors(world, &effect.targets, |sensor| sensor.chain.drifts.push(drift))
            }
            Self::FilterAttenuation(effect) => {
                let filter = LowPass::butterworth(effect.order, effect.cutoff_hz, world.sample_rate_hz)?;
                on_sensors(world, &effect.targets, |sensor| sensor.chain.filters.push(filter.clone()))
            }
            Self::ReversalAngle(effect) => {
                check::finite("angle_deg", effect.angle_deg)?;
                on_setups(world, &effect.targets, |setup| setup.part_rad += effect.angle_deg.to_radians())
            }
            Self::SetupMotionChange(effect) => {
                check::finite("ratio", effect.ratio)?;
                on_setups(world, &effect.targets, |setup| setup.motion_ratio *= effect.ratio)
            }
            Self::PartEccentricity(effect) => effect.apply(world),
            Self::SecondOrderGeometry(_) => match world.geometry {
                Geometry::Exact => Ok(()),
                Geometry::Linear => Err(Fault::at("plugin", "`geometry = \"linear\"` leaves out the second order")
                    .help("leave out `geometry` or this effect")),
            },
            Self::EvenOrderMotion(effect) => effect.apply(world, index),
            Self::AsynchronousLine(effect) => world.asynchronous.add_line(&LineConfig {
                order: effect.order,
                amplitude_um: effect.amplitude_um,
                direction_deg: effect.direction_deg,
            }),
            Self::SpeedRipple(effect) => {
                check::positive("order", effect.order)?;
                check::finite("amplitude_deg", effect.amplitude_deg)?;
                check::finite("phase_deg", effect.phase_deg)?;
                world.course.add_ripple(Ripple {
                    order: effect.order,
                    amplitude_turns: effect.amplitude_deg / 360.0,
                    phase_rad: effect.phase_deg.to_radians(),
                })
            }
            Self::AxialMotion(effect) => {
                let orders = world.orders();
                for (index, harmonic) in effect.harmonics.iter().enumerate() {
                    let size = ("amplitude_um", harmonic.amplitude_um);
                    add_harmonic(&mut world.axial_um, harmonic.order, size, harmonic.phase_deg, orders)
                        .map_err(|fault| fault.under_item("harmonics", index))?;
                }
                Ok(())
            }
        }
    }
}

impl PartEccentricity {
    fn apply(&self, world: &mut World) -> Result<(), Fault> {
        check::finite("offset_um", self.offset_um)?;
        check::finite("direction_deg", self.direction_deg)?;
        check::finite("tilt_urad", self.tilt_urad)?;
        check::finite("tilt_direction_deg", self.tilt_direction_deg)?;
        let clamping = Clamping {
            offset_um: Complex64::from_polar(self.offset_um, self.direction_deg.to_radians()),
            tilt_urad: Complex64::from_polar(self.tilt_urad, self.tilt_direction_deg.to_radians()),
        };
        let section = match &self.section {
            None => None,
            Some(id) => {
                let known = &world.rig.sections;
                let found = known.iter().position(|section| section == id).ok_or_else(|| {
                    Fault::at("section", format!("the rig has no section `{id}`"))
                        .help(known_names(id, known.iter().map(String::as_str)))
                })?;
                Some(found)
            }
        };
        on_setups(world, &self.targets, |setup| {
            let clampings = setup.clamping.iter_mut().enumerate();
            for (_, of_section) in clampings.filter(|(index, _)| section.is_none_or(|section| section == *index)) {
                of_section.offset_um += clamping.offset_um;
                of_section.tilt_urad += clamping.tilt_urad;
            }
        })
    }
}

impl EvenOrderMotion {
    fn apply(&self, world: &mut World, index: usize) -> Result<(), Fault> {
        check::order("max_order", self.max_order, 2, world.orders())?;
        let sizes = [("x_rms_um", self.x_rms_um), ("y_rms_um", self.y_rms_um)];
        for (axis, (key, rms)) in sizes.into_iter().enumerate() {
            check::not_negative(key, rms)?;
            let orders = (2..=self.max_order).step_by(2);
            let item = 2 * index + axis;
            let harmonics = random_harmonics(rms, orders, 1.0, world.seed, Purpose::EvenMotion, item);
            for (order, value) in harmonics.into_iter().enumerate() {
                series::add(&mut world.motion.axes[axis], order, value);
            }
        }
        Ok(())
    }
}

fn on_sensors(world: &mut World, targets: &[String], change: impl Fn(&mut TrueSensor)) -> Result<(), Fault> {
    let known: Vec<&str> = world.rig.sensors.iter().map(|sensor| sensor.id.as_str()).collect();
    for index in places(targets, &known, "sensor")? {
        change(&mut world.sensors[index]);
    }
    Ok(())
}

fn on_setups(world: &mut World, targets: &[String], change: impl Fn(&mut TrueSetup)) -> Result<(), Fault> {
    let known: Vec<&str> = world.rig.setups.iter().map(|setup| setup.id.as_str()).collect();
    for index in places(targets, &known, "setup")? {
        change(&mut world.setups[index]);
    }
    Ok(())
}

fn places(targets: &[String], known: &[&str], noun: &str) -> Result<Vec<usize>, Fault> {
    if targets.is_empty() {
        return Err(
            Fault::at("targets", format!("name at least one {noun}")).help(known_names("", known.iter().copied()))
        );
    }
    let place = |id: &String| {
        known.iter().position(|other| other == id).ok_or_else(|| {
            Fault::at("targets", format!("the rig has no {noun} `{id}`")).help(known_names(id, known.iter().copied()))
        })
    };
    targets.iter().map(place).collect()
}
