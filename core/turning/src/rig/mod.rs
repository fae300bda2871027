//! The rig: where the sensors look, and how part and sensors stand in each setup.

mod bearing;
mod calibration;
mod config;
mod interruption;
mod remarks;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use bearing::{Bearing, BearingConfig, BearingLine, Ring, bearing_lines_near};
pub use calibration::{Calibration, Unit, straightened};
pub use config::{RigConfig, SensorConfig, SetupConfig};
pub use interruption::InterruptionConfig;
pub use runout_standards::gaps::Gaps;

/// Which way the part turns, seen against +z.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Rotation {
    /// Counter-clockwise about +z.
    #[default]
    Ccw,
    /// Clockwise about +z.
    Cw,
}

impl Rotation {
    /// +1 for counter-clockwise, −1 for clockwise: part angle α = θ' − direction·Φ − β.
    #[must_use]
    pub fn direction(self) -> f64 {
        match self {
            Self::Ccw => 1.0,
            Self::Cw => -1.0,
        }
    }
}

/// Which way a sensor looks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Looks {
    /// Across the axis, at the circumference.
    #[default]
    Radial,
    /// Along the axis, at a face or at the pole of a ball.
    Axial,
}

/// A checked rig.
#[derive(Debug, Clone, PartialEq)]
pub struct Rig {
    /// Nominal radius of the part, in mm.
    pub part_radius_mm: f64,
    /// Which way the part turns.
    pub rotation: Rotation,
    /// At least one.
    pub sensors: Vec<Sensor>,
    /// At least one.
    pub setups: Vec<Setup>,
    /// Section ids in order of first appearance.
    pub sections: Vec<String>,
    /// Of each section, the part angles at which it is interrupted.
    pub gaps: Vec<Gaps>,
    /// Of each section, the radius at which axial sensors look at it, in mm; `None` for a circle around the part.
    pub faces: Vec<Option<f64>>,
    /// Of each section, the declared peak-to-valley bound of its form, in µm; `None` where the form is to be found.
    pub form_bounds_um: Vec<Option<f64>>,
    /// The spindle's rolling bearings.
    pub bearings: Vec<Bearing>,
}

/// A displacement sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    /// Name of the channel.
    pub id: String,
    /// θ, in rad.
    pub angle_rad: f64,
    /// z relative to the spindle reference, in mm, before the station's position is added.
    pub z_mm: f64,
    /// Index into [`Rig::sections`].
    pub section: usize,
    /// Distance from the axis of a sensor that looks along it, in mm; `None` where it looks across.
    pub axial_radius_mm: Option<f64>,
    /// +1 or −1.
    pub sign: f64,
    /// Unit of its numbers.
    pub unit: Unit,
    /// From its numbers to displacements. Loaders give numbers with their sign; the pipeline calibrates them.
    pub calibration: Calibration,
}

/// One clamping of the part.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// Name of the setup.
    pub id: String,
    /// β, in rad.
    pub part_rad: f64,
    /// σ, in rad.
    pub sensors_rad: f64,
    /// Turns of the part from one mark to the next.
    pub turns_per_mark: f64,
}

impl Rig {
    /// z of a section before the station's position is added, in mm: that of its first sensor.
    #[must_use]
    pub fn section_z_mm(&self, section: usize) -> f64 {
        self.sensors.iter().find(|sensor| sensor.section == section).map_or(0.0, |sensor| sensor.z_mm)
    }

    /// Whether a section is a face that axial sensors look at.
    #[must_use]
    pub fn is_face(&self, section: usize) -> bool {
        self.faces.get(section).is_some_and(Option::is_some)
    }

    /// Whether some sensor looks along the axis.
    #[must_use]
    pub fn has_axial(&self) -> bool {
        self.sensors.iter().any(|sensor| sensor.axial_radius_mm.is_some())
    }

    /// Where a section is interrupted, by part angle; nowhere if there is no such section.
    #[must_use]
    pub fn gaps_of(&self, section: &str) -> Gaps {
        let index = self.sections.iter().position(|id| id == section);
        index.and_then(|index| self.gaps.get(index)).cloned().unwrap_or_default()
    }

    /// Where a sensor looks into an interruption in a setup, by the spindle's angle Φ: α = θ′ − direction·Φ − β.
    #[must_use]
    pub fn gaps_seen(&self, setup: usize, sensor: usize) -> Gaps {
        let (Some(setup), Some(sensor)) = (self.setups.get(setup), self.sensors.get(sensor)) else {
            return Gaps::default();
        };
        let direction = self.rotation.direction();
        let origin = direction * (sensor.angle_rad + setup.sensors_rad - setup.part_rad);
        self.gaps.get(sensor.section).map_or_else(Gaps::default, |gaps| gaps.seen_from(origin, -direction))
    }

    /// Index of a setup by its id.
    #[must_use]
    pub fn setup(&self, id: &str) -> Option<usize> {
        self.setups.iter().position(|setup| setup.id == id)
    }

    /// Index of a sensor by its id.
    #[must_use]
    pub fn sensor(&self, id: &str) -> Option<usize> {
        self.sensors.iter().position(|sensor| sensor.id == id)
    }
}
