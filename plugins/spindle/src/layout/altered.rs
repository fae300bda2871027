//! The layout with effects applied: where sensors and part are, if not where the rig says.

use std::f64::consts::PI;

use runout_core::Complex64;

use super::{Layout, Reading, SeenPattern};
use crate::alterations::Alterations;

impl Layout {
    /// The layout as effects change it: where sensors and part truly are, how much the spindle moves.
    #[must_use]
    pub fn altered(&self, alterations: &Alterations) -> Self {
        let mut layout = self.clone();
        layout.odd_motion &= !alterations.even_order_motion;
        layout.part_radius_mm /= 1.0 + alterations.curvature;
        if alterations.rotation_reversed {
            layout.direction = -layout.direction;
        }
        for reading in &mut layout.readings {
            let (sensor, setup) = (&alterations.sensors[reading.sensor], &alterations.setups[reading.setup]);
            let place = alterations.clampings[reading.setup] * alterations.places.len()
                + alterations.place_in(reading.setup, reading.sensor);
            let declared = &self.readings[place];
            reading.section = declared.section;
            reading.view = declared.view;
            reading.lever_mm = declared.lever_mm;
            reading.angle_rad = declared.angle_rad;
            reading.part_angle_rad = declared.part_angle_rad;
            reading.turned_rad = declared.turned_rad;
            if alterations.part_angles_reversed {
                // θ' + β for θ' − β.
                reading.part_angle_rad = 2.0 * reading.angle_rad - reading.part_angle_rad;
            }
            if alterations.sensor_angles_reversed {
                // −θ + σ for θ + σ.
                let angle_rad = reading.angle_rad - reading.turned_rad;
                reading.angle_rad -= 2.0 * angle_rad;
                reading.part_angle_rad -= 2.0 * angle_rad;
            }
            if setup.sensors_otherwise {
                let by = reading.turned_otherwise_rad();
                reading.angle_rad += by;
                reading.part_angle_rad += by;
            }
            if let Some(other) = self.other_section(declared).filter(|_| sensor.in_other_section) {
                (reading.section, reading.lever_mm) = (other.section, other.lever_mm);
            }
            let opposite = if sensor.opposite { PI } else { 0.0 };
            let turned = sensor.turned_rad(reading.setup) + setup.sensors_rad + opposite;
            reading.angle_rad += turned;
            reading.part_angle_rad += turned - setup.part_rad;
            if !reading.view.is_axial() {
                reading.lever_mm += sensor.z_mm;
            }
            reading.motion_ratio *= (1.0 + setup.motion) * (1.0 - sensor.bracket_share);
            reading.spot_rad2 = sensor.spot_mm2 / (layout.part_radius_mm * layout.part_radius_mm);
        }
        for index in 0..layout.readings.len() {
            let reading = &layout.readings[index];
            let patterns = alterations.patterns.iter();
            let own = patterns.map(|pattern| SeenPattern {
                order: pattern.order,
                value: layout.on_part(reading, pattern),
                is_form: pattern.of.is_form(),
            });
            let own = own.filter(|pattern| pattern.value != Complex64::ZERO).collect();
            layout.readings[index].patterns = own;
        }
        layout
    }

    /// A reading of the section that a radial sensor does not look at, where there are two.
    pub(crate) fn other_section(&self, reading: &Reading) -> Option<&Reading> {
        let others = self.readings.iter().filter(|other| !other.view.is_axial() && other.section != reading.section);
        others
            .clone()
            .next()
            .filter(|first| !reading.view.is_axial() && others.clone().all(|other| other.section == first.section))
    }
}

impl Reading {
    /// By how much the sensor is turned where all of them were turned with the part and not as declared: not at all, or as the part.
    pub(crate) fn turned_otherwise_rad(&self) -> f64 {
        let part_rad = self.angle_rad - self.part_angle_rad;
        if self.turned_rad == 0.0 { part_rad } else { -self.turned_rad }
    }
}
