//! Effects of the whole rig: how the spindle moves and turns.

use runout_core::fault::Fault;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Acts, places, setup_ids};
use crate::simulate::{
    check,
    config::{Geometry, LineConfig, MotionHarmonic},
    motion::{add_harmonic, random_harmonics},
    random::Purpose,
    series,
    spin::Ripple,
    world::World,
};

/// No parameters: the radius is known.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SecondOrderGeometry {
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for SecondOrderGeometry {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        match world.geometry {
            Geometry::Exact => Ok(()),
            Geometry::Linear => Err(Fault::at("plugin", "`geometry = \"linear\"` leaves out the second order")
                .help("leave out `geometry` or this effect")),
        }
    }
}

/// True radius of the part = stated radius · (1 + this).
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PartRadius {
    /// −0.5 where a diameter is stated for the radius.
    pub relative_error: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for PartRadius {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("relative_error", self.relative_error)?;
        if self.relative_error <= -1.0 {
            return Err(Fault::at("relative_error", "expected more than −1: a radius is above 0"));
        }
        world.radius_um *= 1.0 + self.relative_error;
        Ok(())
    }
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
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for EvenOrderMotion {
    fn declared(&self) -> bool {
        self.declared
    }

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
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for AsynchronousLine {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        world.asynchronous.add_line(&LineConfig {
            order: self.order,
            amplitude_um: self.amplitude_um,
            direction_deg: self.direction_deg,
        })
    }
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
    /// Ids of the setups in which the spindle runs so; all without it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub targets: Vec<String>,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for SpeedRipple {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::positive("order", self.order)?;
        check::finite("amplitude_deg", self.amplitude_deg)?;
        check::finite("phase_deg", self.phase_deg)?;
        let setups = if self.targets.is_empty() {
            None
        } else {
            Some(places("targets", &self.targets, &setup_ids(world), "setup")?)
        };
        let ripple = Ripple {
            order: self.order,
            amplitude_turns: self.amplitude_deg / 360.0,
            phase_rad: self.phase_deg.to_radians(),
        };
        world.course.add_ripple(ripple, setups)
    }
}

/// The part is at z + a(Φ) when it should be at z.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxialMotion {
    /// a(Φ) = Σ amplitude · cos(order · Φ − phase).
    pub harmonics: Vec<MotionHarmonic>,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for AxialMotion {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        let orders = world.orders();
        for (index, harmonic) in self.harmonics.iter().enumerate() {
            let size = ("amplitude_um", harmonic.amplitude_um);
            add_harmonic(&mut world.axial_um, harmonic.order, size, harmonic.phase_deg, orders)
                .map_err(|fault| fault.under_item("harmonics", index))?;
        }
        Ok(())
    }
}
