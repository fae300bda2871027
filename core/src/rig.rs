//! The rig: where the sensors look, and how part and sensors stand in each setup.

use std::collections::HashSet;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::pipeline::error::Fault;

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

/// `[rig]` as it stands in a file.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RigConfig {
    /// Nominal radius of the part at the sensors, in mm.
    pub part_radius_mm: f64,
    /// Which way the part turns about +z.
    #[serde(default)]
    pub rotation: Rotation,
    /// The displacement sensors.
    pub sensors: Vec<SensorConfig>,
    /// The setups: how the part was clamped and where the sensors stood, one recording each.
    pub setups: Vec<SetupConfig>,
}

/// One sensor as it stands in a file.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorConfig {
    /// Name of the channel in the recording.
    pub id: String,
    /// Angle of the sensor about +z, in degrees.
    pub angle_deg: f64,
    /// Axial position relative to the spindle reference, in mm; the station's position is added to it.
    #[serde(default)]
    pub z_mm: f64,
    /// The section of the part that it looks at; sensors of one section see the same circle.
    #[serde(default = "default_section")]
    pub section: String,
    /// +1 where the reading grows when the surface comes nearer, −1 where it shrinks.
    #[serde(default = "default_sign")]
    #[schemars(schema_with = "sign_schema")]
    pub sign: i8,
}

/// One setup as it stands in a file.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SetupConfig {
    /// Name of the setup in the recording.
    pub id: String,
    /// Angle at which the part is clamped relative to the spindle, in degrees.
    #[serde(default)]
    pub part_deg: f64,
    /// Angle by which all sensors were moved, in degrees.
    #[serde(default)]
    pub sensors_deg: f64,
}

fn default_section() -> String {
    "a".into()
}

fn default_sign() -> i8 {
    1
}

fn sign_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
    schemars::json_schema!({ "type": "integer", "enum": [1, -1] })
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
    /// +1 or −1.
    pub sign: f64,
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
}

impl RigConfig {
    /// Checks everything that a file can get wrong.
    ///
    /// # Errors
    /// The first value that cannot be, with its place.
    pub fn check(self) -> Result<Rig, Fault> {
        if !(self.part_radius_mm.is_finite() && self.part_radius_mm > 0.0) {
            return Err(Fault::at("part_radius_mm", "the part's radius must be above 0 mm"));
        }
        if self.sensors.is_empty() {
            return Err(Fault::at("sensors", "a rig needs at least one sensor"));
        }
        if self.setups.is_empty() {
            return Err(Fault::at("setups", "a rig needs at least one setup"));
        }
        let mut sections: Vec<String> = Vec::new();
        let mut sensors = Vec::with_capacity(self.sensors.len());
        let mut ids = HashSet::new();
        for (index, sensor) in self.sensors.into_iter().enumerate() {
            let fault = |key: &'static str, message: String| Fault::at(key, message).under_item("sensors", index);
            if sensor.id.is_empty() || !ids.insert(sensor.id.clone()) {
                return Err(fault("id", format!("sensor ids must differ and not be empty, found `{}`", sensor.id)));
            }
            if !sensor.angle_deg.is_finite() {
                return Err(fault("angle_deg", "a sensor's angle must be a finite number".into()));
            }
            if !sensor.z_mm.is_finite() {
                return Err(fault("z_mm", "a sensor's axial position must be a finite number".into()));
            }
            if sensor.section.is_empty() {
                return Err(fault("section", "a section's id must not be empty".into()));
            }
            if sensor.sign.abs() != 1 {
                return Err(fault("sign", format!("the sign must be 1 or -1, found {}", sensor.sign)));
            }
            let section = sections.iter().position(|id| *id == sensor.section).unwrap_or_else(|| {
                sections.push(sensor.section.clone());
                sections.len() - 1
            });
            let checked = Sensor {
                id: sensor.id,
                angle_rad: sensor.angle_deg.to_radians(),
                z_mm: sensor.z_mm,
                section,
                sign: f64::from(sensor.sign),
            };
            if let Some(first) = sensors.iter().find(|other: &&Sensor| other.section == section)
                && (first.z_mm - checked.z_mm).abs() > SAME_SECTION_MM
            {
                return Err(fault(
                    "z_mm",
                    format!(
                        "sensors of section `{}` must share one z: `{}` is at {} mm, `{}` at {} mm",
                        sections[section], first.id, first.z_mm, checked.id, checked.z_mm
                    ),
                )
                .help("give the sensor a section of its own"));
            }
            sensors.push(checked);
        }
        let mut setups = Vec::with_capacity(self.setups.len());
        let mut ids = HashSet::new();
        for (index, setup) in self.setups.into_iter().enumerate() {
            let fault = |key: &'static str, message: String| Fault::at(key, message).under_item("setups", index);
            if setup.id.is_empty() || !ids.insert(setup.id.clone()) {
                return Err(fault("id", format!("setup ids must differ and not be empty, found `{}`", setup.id)));
            }
            if setup.id == "truth" || setup.id.contains('/') {
                return Err(fault("id", format!("`{}` cannot name a setup: `truth` and `/` are reserved", setup.id)));
            }
            if !setup.part_deg.is_finite() {
                return Err(fault("part_deg", "the part's angle must be a finite number".into()));
            }
            if !setup.sensors_deg.is_finite() {
                return Err(fault("sensors_deg", "the sensors' angle must be a finite number".into()));
            }
            setups.push(Setup {
                id: setup.id,
                part_rad: setup.part_deg.to_radians(),
                sensors_rad: setup.sensors_deg.to_radians(),
            });
        }
        Ok(Rig { part_radius_mm: self.part_radius_mm, rotation: self.rotation, sensors, setups, sections })
    }
}

/// Two sensors nearer than this along z look at the same circle: a tenth of a usual spot size.
const SAME_SECTION_MM: f64 = 0.1;

impl Rig {
    /// z of a section before the station's position is added, in mm: that of its first sensor.
    #[must_use]
    pub fn section_z_mm(&self, section: usize) -> f64 {
        self.sensors.iter().find(|sensor| sensor.section == section).map_or(0.0, |sensor| sensor.z_mm)
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
