//! What single sensors see of form and motion.

use runout_core::fault::Fault;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Acts, sensors::on_sensors};
use crate::simulate::{check, world::World};

/// A sensor averages the form over an arc.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeSpot {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// Length of the arc on the part, in mm.
    pub width_mm: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for ProbeSpot {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::not_negative("width_mm", self.width_mm)?;
        on_sensors(world, &self.targets, |sensor| sensor.spot_mm = self.width_mm)
    }
}

/// A sensor's bracket moves by a share of the spindle's motion.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BracketMotion {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// Relative: at 0.02 the sensor sees 98 % of the motion.
    pub share: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for BracketMotion {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("share", self.share)?;
        on_sensors(world, &self.targets, |sensor| sensor.bracket_share = self.share)
    }
}
