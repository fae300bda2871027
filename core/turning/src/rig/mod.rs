//! The rig: where the sensors look, and how part and sensors stand in each setup.

mod calibration;

use std::collections::HashSet;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use calibration::{Calibration, Unit, straightened};
pub use runout_standards::gaps::Gaps;

use runout_error::Fault;

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
    /// Where the surface is interrupted: a keyway, a cross hole. Readings there are bridged, and no value is taken there.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub interruptions: Vec<InterruptionConfig>,
}

/// One interruption as it stands in a file: from one part angle on, counter-clockwise, to another.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct InterruptionConfig {
    /// The part's own angle at which it begins, in degrees.
    pub from_deg: f64,
    /// The angle at which it ends, in degrees; with `from_deg` above, it passes through 0.
    pub to_deg: f64,
    /// Ids of the sections that it crosses; without it, all around the part.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sections: Option<Vec<String>>,
}

/// One sensor as it stands in a file.
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
    /// The section of the part that it looks at; sensors of one section see the same circle. Axial sensors need a section of
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
    /// Displacement that one volt stands for, in µm; with `unit = "V"` or `"mV"`.
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
        within(self.part_radius_mm, MOST_MM)
            .map_err(|problem| Fault::at("part_radius_mm", format!("the part's radius {problem} mm")))?;
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
            within(sensor.angle_deg, MOST_DEG)
                .map_err(|problem| fault("angle_deg", format!("a sensor's angle {problem}°")))?;
            within(sensor.z_mm, MOST_MM)
                .map_err(|problem| fault("z_mm", format!("a sensor's axial position {problem} mm")))?;
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
                angle_rad: sensor.angle_deg.to_radians(),
                z_mm: sensor.z_mm,
                section,
                axial_radius_mm,
                sign: f64::from(sensor.sign),
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
            within(setup.part_deg, MOST_DEG)
                .map_err(|problem| fault("part_deg", format!("the part's angle {problem}°")))?;
            let of_sensors = within(setup.sensors_deg, MOST_DEG);
            of_sensors.map_err(|problem| fault("sensors_deg", format!("the sensors' angle {problem}°")))?;
            setups.push(Setup {
                id: setup.id,
                part_rad: setup.part_deg.to_radians(),
                sensors_rad: setup.sensors_deg.to_radians(),
            });
        }
        let gaps = gaps_of(&self.interruptions, &sections, &faces)?;
        let (part_radius_mm, rotation) = (self.part_radius_mm, self.rotation);
        Ok(Rig { part_radius_mm, rotation, sensors, setups, sections, gaps, faces, form_bounds_um })
    }
}

/// Refuses a number whose size is not at most this, or that is none.
fn within(number: f64, most: f64) -> Result<(), String> {
    if number.abs() <= most {
        Ok(())
    } else {
        Err(format!("must be a number from −{most} to {most}, found {number:e}"))
    }
}

impl SensorConfig {
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
            (Looks::Axial, Some(radius_mm)) if radius_mm.is_finite() && radius_mm >= 0.0 => Ok(Some(radius_mm)),
            (Looks::Axial, Some(radius_mm)) => {
                let message = format!("the sensor's distance from the axis must be 0 mm or more, found {radius_mm}");
                Err(Fault::at("radius_mm", message).help("the side on which it stands is its angle_deg"))
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
                "axial sensors of section `{}` must share one radius: it is seen at {one_mm} mm, by `{}` at {other_mm} mm",
                sensor.section, sensor.id
            );
            Err(Fault::at("radius_mm", message).help("give the sensor a section of its own"))
        }
        _ => {
            let message = format!("section `{}` is seen both radially and axially", sensor.section);
            Err(Fault::at("looks", message).help(own))
        }
    }
}

/// Of each section, where it is interrupted.
fn gaps_of(
    interruptions: &[InterruptionConfig],
    sections: &[String],
    faces: &[Option<f64>],
) -> Result<Vec<Gaps>, Fault> {
    let mut gaps = vec![Gaps::default(); sections.len()];
    for (index, interruption) in interruptions.iter().enumerate() {
        let fault = |key: &'static str, message: String| Fault::at(key, message).under_item("interruptions", index);
        let [from, to] =
            [("from_deg", interruption.from_deg), ("to_deg", interruption.to_deg)].map(|(key, angle_deg)| {
                let known = within(angle_deg, MOST_DEG).map(|()| angle_deg);
                known.map_err(|problem| fault(key, format!("the angle {problem}°")))
            });
        let length_deg = (to? - from?).rem_euclid(360.0);
        if !(length_deg > 0.0 && length_deg <= MOST_INTERRUPTED_DEG) {
            let message = format!("expected at most {MOST_INTERRUPTED_DEG}° from `from_deg` on, found {length_deg}°");
            return Err(fault("to_deg", message));
        }
        for ((section, face), gaps) in sections.iter().zip(faces).zip(&mut gaps) {
            // A keyway along the part is none of its face, unless that is named.
            if interruption.sections.as_ref().map_or(face.is_none(), |named| named.contains(section)) {
                gaps.add(interruption.from_deg.to_radians(), length_deg.to_radians());
            }
        }
        if let Some(unknown) = interruption.sections.iter().flatten().find(|named| !sections.contains(named)) {
            return Err(fault(
                "sections",
                format!("there is no section `{unknown}`; there are {}", sections.join(", ")),
            ));
        }
    }
    match gaps.iter().position(|gaps| gaps.coverage(ANGLES_LOOKED_AT) < LEAST_LEFT) {
        None => Ok(gaps),
        Some(section) => Err(Fault::at(
            "interruptions",
            format!("they leave less than half of section `{}`, too little to bridge them", sections[section]),
        )),
    }
}

/// Longer interruptions leave too little to bridge them by, in degrees.
const MOST_INTERRUPTED_DEG: f64 = 120.0;
/// Share of a circle that has to be there.
const LEAST_LEFT: f64 = 0.5;
const ANGLES_LOOKED_AT: usize = 3600;

/// Two sensors nearer than this along z look at the same circle: a tenth of a usual spot size.
const SAME_SECTION_MM: f64 = 0.1;
/// Angles and lengths are at most so large, either way: a hundred turns, and a kilometre. The digits of larger ones are no part of a rig.
const MOST_DEG: f64 = 36_000.0;
const MOST_MM: f64 = 1e6;

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
