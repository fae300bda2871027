//! What a rig says that is possible and looks like a mistake.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::{Rig, Sensor};

/// Degrees are written to so many digits.
const WRITTEN_DEG: f64 = 1e-9;
/// Multiples of a quarter turn in rad are recognised within this.
const QUARTER_RAD: f64 = 5e-3;
/// No measured part is thinner, in mm: a smaller number is a radius in another unit.
const THINNEST_MM: f64 = 0.1;

impl Rig {
    /// What is possible and unusual enough to be a mistake: angles beyond a turn, angles in radians, a radius in another unit.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        let beyond = |rad: f64| rad.abs() > TAU + WRITTEN_DEG;
        let mut far = |what: String, rad: f64| {
            if beyond(rad) {
                let (found, within) = (rad.to_degrees(), rad.rem_euclid(TAU).to_degrees());
                remarks.push(format!("{what} = {found:.6} is beyond a turn and counts as {within:.6}: check it"));
            }
        };
        for sensor in &self.sensors {
            far(format!("`angle_deg` of the sensor `{}`", sensor.id), sensor.angle_rad);
        }
        for setup in &self.setups {
            far(format!("`part_deg` of the setup `{}`", setup.id), setup.part_rad);
            far(format!("`sensors_deg` of the setup `{}`", setup.id), setup.sensors_rad);
        }
        if self.sensors_in_radians() {
            remarks.push(
                "the sensors of a section are within 6.3° of each other: `angle_deg` is in degrees, and these numbers may be in \
                 radians"
                    .into(),
            );
        }
        if self.setups_in_radians() {
            remarks.push(
                "`part_deg` and `sensors_deg` of the setups are multiples of π/2: they are in degrees, and these numbers may be in \
                 radians"
                    .into(),
            );
        }
        if self.part_radius_mm < THINNEST_MM {
            let um = 1e3 * self.part_radius_mm;
            remarks.push(format!(
                "`part_radius_mm` = {} is a radius of {um} µm: it is in mm, and this number may be in another unit",
                self.part_radius_mm
            ));
        }
        remarks
    }

    /// Whether sensors around one section have different angles that as degrees are all next to 0, and as radians go around it.
    fn sensors_in_radians(&self) -> bool {
        let radial = || self.sensors.iter().filter(|sensor| sensor.axial_radius_mm.is_none());
        let small = radial().all(|sensor| sensor.angle_rad.to_degrees().abs() <= TAU + QUARTER_RAD);
        let apart = |one: &Sensor| {
            radial().any(|other| one.section == other.section && (one.angle_rad - other.angle_rad).abs() > WRITTEN_DEG)
        };
        small && radial().any(apart)
    }

    /// Whether angles of the setups are quarter turns in radians, and not all 0.
    fn setups_in_radians(&self) -> bool {
        let angles = || self.setups.iter().flat_map(|setup| [setup.part_rad, setup.sensors_rad]).map(f64::to_degrees);
        let is_quarter = |angle: f64| {
            let turns = angle / FRAC_PI_2;
            (turns - turns.round()).abs() * FRAC_PI_2 < QUARTER_RAD && angle.abs() <= TAU + QUARTER_RAD
        };
        angles().all(is_quarter) && angles().any(|angle| angle.abs() > QUARTER_RAD)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use crate::rig::{RigConfig, Rotation, SensorConfig, SetupConfig};

    fn remarks(part_radius_mm: f64, sensors_deg: &[f64], parts_deg: &[f64]) -> Vec<String> {
        let sensor = |(index, angle_deg): (usize, &f64)| SensorConfig {
            id: format!("S{index}"),
            angle_deg: *angle_deg,
            ..SensorConfig::default()
        };
        let setup = |(index, part_deg): (usize, &f64)| SetupConfig {
            id: format!("k{index}"),
            part_deg: *part_deg,
            ..SetupConfig::default()
        };
        let config = RigConfig {
            interruptions: Vec::new(),
            bearings: Vec::new(),
            part_radius_mm,
            rotation: Rotation::Ccw,
            sensors: sensors_deg.iter().enumerate().map(sensor).collect(),
            setups: parts_deg.iter().enumerate().map(setup).collect(),
        };
        config.check().unwrap().remarks()
    }

    #[test]
    fn usual_rigs_have_none() {
        for (sensors, parts) in [
            (&[0.0, 99.844, 202.5][..], &[0.0][..]),
            (&[0.0, 90.0], &[0.0, 180.0]),
            (&[-90.0, 360.0, 0.0], &[0.0, 45.0, 3.0]),
            (&[0.0], &[0.0, 90.0, 180.0, 270.0, 360.0]),
            (&[5.0], &[0.0]),
        ] {
            assert_eq!(remarks(30.0, sensors, parts), Vec::<String>::new(), "{sensors:?}, {parts:?}");
        }
    }

    #[test]
    fn angles_beyond_a_turn_and_in_radians_and_a_radius_in_metres_are_named() {
        for (radius_mm, sensors, parts, expected) in [
            (30.0, &[0.0, 450.0][..], &[0.0][..], "`angle_deg` of the sensor `S1` = 450.000000 is beyond a turn"),
            (30.0, &[0.0, 90.0], &[0.0, -540.0], "`part_deg` of the setup `k1`"),
            (30.0, &[0.0, 1.571], &[0.0], "may be in radians"),
            (30.0, &[0.0, 1.7426, 3.5343], &[0.0], "may be in radians"),
            (30.0, &[0.0, 90.0], &[0.0, std::f64::consts::PI], "`part_deg` and `sensors_deg` of the setups"),
            (0.03, &[0.0, 90.0], &[0.0, 180.0], "is a radius of 30 µm"),
        ] {
            let found = remarks(radius_mm, sensors, parts);
            assert!(found.len() == 1 && found[0].contains(expected), "{expected}: {found:?}");
        }
    }
}
