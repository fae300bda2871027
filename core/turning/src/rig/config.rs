//! `[rig]` of a file, and what a file can get wrong in it.

use std::collections::HashSet;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    BearingConfig, Calibration, InterruptionConfig, Looks, Rig, Rotation, Sensor, Setup, Unit,
    interruption::{gaps_of, radians},
};
use runout_error::Fault;

/// A kilometre: lengths above it are a mistake.
const FARTHEST_MM: f64 = 1e6;
/// Beyond, marks are of something else.
const TURNS_PER_MARK: std::ops::RangeInclusive<f64> = 0.01..=100.0;

/// Two sensors nearer than this along z look at the same circle: a tenth of a usual spot size.
const SAME_SECTION_MM: f64 = 0.1;

/// `[rig]` as written in a file.
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
    /// Where the surface is interrupted: a keyway, a cross hole. Readings there are bridged, and no value is taken there.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub interruptions: Vec<InterruptionConfig>,
    /// The spindle's rolling bearings: lines of asynchronous motion that fit one are named.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bearings: Vec<BearingConfig>,
}

/// One sensor as written in a file.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorConfig {
    /// Name of the channel in the recording.
    pub id: String,
    /// Angle of the sensor about +z, in degrees.
    pub angle_deg: f64,
    /// `radial` (across the axis, the default) or `axial` (along it, at a face or at the pole of a ball).
    #[serde(default, skip_serializing_if = "is_default")]
    pub looks: Looks,
    /// Distance of an axial sensor from the axis, in mm: 0 on the axis, as at the pole of a ball.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius_mm: Option<f64>,
    /// Largest form deviation of the sensor's section, peak to valley, in µm. The form is then taken as 0, and this bound is part
    /// of the uncertainty of the motion: for a master ball of known roundness, where the layout cannot separate the form.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub form_um: Option<f64>,
    /// Axial position relative to the spindle reference, in mm; the station's position is added to it.
    #[serde(default)]
    pub z_mm: f64,
    /// The section of the part that it measures; sensors of one section see the same circle. Axial sensors need a section of
    /// their own: the face.
    #[serde(default = "default_section")]
    pub section: String,
    /// +1 where the reading grows when the surface comes nearer, −1 where it shrinks. Of an axial sensor, +1 where it grows when the
    /// surface moves along +z.
    #[serde(default = "default_sign")]
    #[schemars(schema_with = "sign_schema")]
    pub sign: i8,
    /// Unit of the recorded numbers.
    #[serde(default, skip_serializing_if = "is_default")]
    pub unit: Unit,
    /// Displacement per volt, in µm; with `unit = "V"` or `"mV"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub um_per_volt: Option<f64>,
    /// Reading over displacement: 1.05 where the sensor reads 5 % too much. Readings are divided by it.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub gain: f64,
    /// Characteristic: reading / gain = u + `quadratic_per_um`·u² + `cubic_per_um2`·u³ for a displacement u in µm, counted from
    /// the sensor's zero. In 1/µm.
    #[serde(default, skip_serializing_if = "is_default")]
    pub quadratic_per_um: f64,
    /// In 1/µm².
    #[serde(default, skip_serializing_if = "is_default")]
    pub cubic_per_um2: f64,
}

impl Default for SensorConfig {
    /// A sensor without a name at 0°, whose numbers are displacements in µm.
    fn default() -> Self {
        Self {
            id: String::new(),
            angle_deg: 0.0,
            looks: Looks::default(),
            radius_mm: None,
            form_um: None,
            z_mm: 0.0,
            section: default_section(),
            sign: default_sign(),
            unit: Unit::default(),
            um_per_volt: None,
            gain: one(),
            quadratic_per_um: 0.0,
            cubic_per_um2: 0.0,
        }
    }
}

/// One setup as written in a file.
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
    /// Turns of the part from one mark to the next: 0.5 with two marks a turn. At the first mark, the angle is the declared one.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub turns_per_mark: f64,
}

impl Default for SetupConfig {
    fn default() -> Self {
        Self { id: String::new(), part_deg: 0.0, sensors_deg: 0.0, turns_per_mark: one() }
    }
}

fn default_section() -> String {
    "a".into()
}
fn default_sign() -> i8 {
    1
}
fn one() -> f64 {
    1.0
}

#[allow(clippy::trivially_copy_pass_by_ref, clippy::float_cmp, reason = "serde's signature; 1 as it was written")]
fn is_one(value: &f64) -> bool {
    *value == 1.0
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

fn sign_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
    schemars::json_schema!({ "type": "integer", "enum": [1, -1] })
}

impl RigConfig {
    /// Checks everything that a file can get wrong.
    ///
    /// # Errors
    /// The first value that cannot be, with its place.
    pub fn check(self) -> Result<Rig, Fault> {
        if !(self.part_radius_mm > 0.0 && self.part_radius_mm <= FARTHEST_MM) {
            let message =
                format!("expected a part's radius above 0 and up to {FARTHEST_MM} mm, found {:?}", self.part_radius_mm);
            return Err(Fault::at("part_radius_mm", message));
        }
        if self.sensors.is_empty() {
            return Err(Fault::at("sensors", "a rig needs at least one sensor"));
        }
        if self.setups.is_empty() {
            return Err(Fault::at("setups", "a rig needs at least one setup"));
        }
        let mut sections: Vec<String> = Vec::new();
        let (mut faces, mut form_bounds_um) = (Vec::new(), Vec::new());
        let mut sensors = Vec::with_capacity(self.sensors.len());
        let mut ids = HashSet::new();
        for (index, sensor) in self.sensors.into_iter().enumerate() {
            let fault = |key: &'static str, message: String| Fault::at(key, message).under_item("sensors", index);
            if sensor.id.is_empty() || !ids.insert(sensor.id.clone()) {
                return Err(fault("id", format!("sensor ids must differ and not be empty, found `{}`", sensor.id)));
            }
            let angle_rad = radians(sensor.angle_deg).map_err(|message| fault("angle_deg", message))?;
            if sensor.z_mm.is_nan() || sensor.z_mm.abs() > FARTHEST_MM {
                let message = format!("expected an axial position within ±{FARTHEST_MM} mm, found {:?}", sensor.z_mm);
                return Err(fault("z_mm", message));
            }
            if sensor.section.is_empty() {
                return Err(fault("section", "a section's id must not be empty".into()));
            }
            if sensor.sign.abs() != 1 {
                return Err(fault("sign", format!("the sign must be 1 or -1, found {}", sensor.sign)));
            }
            let calibration = sensor.calibration().map_err(|fault| fault.under_item("sensors", index))?;
            let axial_radius_mm = sensor.axial_radius_mm().map_err(|fault| fault.under_item("sensors", index))?;
            let section = sections.iter().position(|id| *id == sensor.section).unwrap_or_else(|| {
                sections.push(sensor.section.clone());
                faces.push(axial_radius_mm);
                form_bounds_um.push(None);
                sections.len() - 1
            });
            same_face(&sensor, faces[section], axial_radius_mm).map_err(|fault| fault.under_item("sensors", index))?;
            if let Some(bound_um) = sensor.form_um {
                let declared = form_bounds_um[section].replace(bound_um);
                if let Some(other) = declared.filter(|other: &f64| other.total_cmp(&bound_um).is_ne()) {
                    let id = &sections[section];
                    let message = format!("section `{id}` has one form: {other} µm is declared for it already");
                    return Err(fault("form_um", message));
                }
            }
            let checked = Sensor {
                id: sensor.id,
                angle_rad,
                z_mm: sensor.z_mm,
                section,
                axial_radius_mm,
                sign: f64::from(sensor.sign),
                unit: sensor.unit,
                calibration,
            };
            if let Some(first) = sensors.iter().find(|other: &&Sensor| other.section == section)
                && (first.z_mm - checked.z_mm).abs() > SAME_SECTION_MM
                && axial_radius_mm.is_none()
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
            let part_rad = radians(setup.part_deg).map_err(|message| fault("part_deg", message))?;
            let sensors_rad = radians(setup.sensors_deg).map_err(|message| fault("sensors_deg", message))?;
            let turns_per_mark = setup.turns_per_mark;
            if !TURNS_PER_MARK.contains(&turns_per_mark) {
                return Err(fault("turns_per_mark", format!("expected 0.01 to 100 turns, found {turns_per_mark}")));
            }
            setups.push(Setup { id: setup.id, part_rad, sensors_rad, turns_per_mark });
        }
        let gaps = gaps_of(&self.interruptions, &sections, &faces)?;
        let (part_radius_mm, rotation) = (self.part_radius_mm, self.rotation);
        let bearings = self.bearings.into_iter().enumerate();
        let checked = |(index, bearing): (usize, BearingConfig)| {
            bearing.check().map_err(|fault| fault.under_item("bearings", index))
        };
        let bearings = bearings.map(checked).collect::<Result<_, _>>()?;
        Ok(Rig { part_radius_mm, rotation, sensors, setups, sections, gaps, faces, form_bounds_um, bearings })
    }
}

impl SensorConfig {
    /// From its numbers to displacements.
    fn calibration(&self) -> Result<Calibration, Fault> {
        let (scale, is_voltage) = self.unit.scale();
        let um_per_unit = match (self.um_per_volt, is_voltage) {
            (None, false) => scale,
            (Some(um_per_volt), true) if um_per_volt.is_finite() && um_per_volt > 0.0 => scale * um_per_volt,
            (Some(um_per_volt), true) => {
                let fault = Fault::at("um_per_volt", format!("expected a number above 0, found {um_per_volt}"));
                return Err(fault.help("a reading that shrinks when the surface comes nearer has `sign = -1`"));
            }
            (None, true) => {
                let fault = Fault::at("unit", "volts need `um_per_volt`, the displacement per volt");
                return Err(fault.help("take it from the sensor's certificate"));
            }
            (Some(_), false) => {
                let fault = Fault::at("um_per_volt", "the readings are no voltage");
                return Err(fault.help("add `unit = \"V\"`, or leave `um_per_volt` out"));
            }
        };
        if !(self.gain.is_finite() && self.gain > 0.0) {
            let fault = Fault::at("gain", format!("expected a number above 0, found {}", self.gain));
            return Err(fault.help("it is reading over displacement: 1.05 where the sensor reads 5 % too much"));
        }
        for (key, value) in [("quadratic_per_um", self.quadratic_per_um), ("cubic_per_um2", self.cubic_per_um2)] {
            if !value.is_finite() {
                return Err(Fault::at(key, format!("expected a finite number, found {value}")));
            }
        }
        Ok(Calibration {
            um_per_unit,
            gain: self.gain,
            quadratic_per_um: self.quadratic_per_um,
            cubic_per_um2: self.cubic_per_um2,
        })
    }

    /// Distance from the axis of a sensor that looks along it.
    fn axial_radius_mm(&self) -> Result<Option<f64>, Fault> {
        if let Some(bound_um) = self.form_um.filter(|bound_um| !(bound_um.is_finite() && *bound_um >= 0.0)) {
            return Err(Fault::at("form_um", format!("the bound of the form must be 0 µm or more, found {bound_um}")));
        }
        match (self.looks, self.radius_mm) {
            (Looks::Radial, None) => Ok(None),
            (Looks::Radial, Some(_)) => Err(Fault::at("radius_mm", "only an axial sensor has a radius")
                .help("add looks = \"axial\", or leave radius_mm out: the part's radius is part_radius_mm")),
            (Looks::Axial, None) => {
                let message = format!("the axial sensor `{}` needs `radius_mm`, its distance from the axis", self.id);
                Err(Fault::at("looks", message).help("radius_mm = 0 on the axis, as at the pole of a ball"))
            }
            (Looks::Axial, Some(radius_mm)) if (0.0..=FARTHEST_MM).contains(&radius_mm) => Ok(Some(radius_mm)),
            (Looks::Axial, Some(radius_mm)) => {
                let message =
                    format!("expected a distance from the axis of 0 to {FARTHEST_MM} mm, found {radius_mm:?}");
                Err(Fault::at("radius_mm", message).help("the side on which it is placed is its angle_deg"))
            }
        }
    }
}

/// Whether a sensor can look at a section, which its first sensor sees as a face at a radius or as a circle around the part.
fn same_face(sensor: &SensorConfig, face: Option<f64>, axial_radius_mm: Option<f64>) -> Result<(), Fault> {
    let own = "give the face a section of its own, as section = \"face\"";
    match (face, axial_radius_mm) {
        (None, None) => Ok(()),
        (Some(one_mm), Some(other_mm)) if (one_mm - other_mm).abs() <= SAME_SECTION_MM => Ok(()),
        (Some(one_mm), Some(other_mm)) => {
            let message = format!(
                "axial sensors of section `{}` must share one radius: it is measured at {one_mm} mm, by `{}` at {other_mm} mm",
                sensor.section, sensor.id
            );
            Err(Fault::at("radius_mm", message).help("give the sensor a section of its own"))
        }
        _ => {
            let message = format!("section `{}` is measured both radially and axially", sensor.section);
            Err(Fault::at("looks", message).help(own))
        }
    }
}
