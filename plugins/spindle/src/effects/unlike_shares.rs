//! Effects of a sensor that sees form and motion with unlike shares.
//!
//! `probe-spot`: it averages the form over an arc of the width w, which leaves sinc(n·w/2R) of order n and no delay; motion moves the whole
//! arc and is not changed. The share is even in w, so that its square is fitted: ∂/∂(w²) = (∂ln share/∂(w²)) · form, while small
//! −n²/24R² · form. A round spot of the diameter d has the same share to second order as an arc of 0.87 d.
//!
//! `bracket-motion`: its bracket moves by a share s of the spindle's motion, of which it reads (1 − s); form is not changed. ∂/∂s = −motion
//! along the sensor. A signal that the spindle's motion adds to one channel (`s` of either sign) is the same.

use runout_core::{Complex64, closed_loop::diagnosis::Estimated};

use super::{About, ActsOn, Alterations, Predicted, SpindleEffect, parameter};
use crate::layout::{ENOUGH, Layout, Reading};

/// The spot of a sensor.
pub(crate) struct ProbeSpot;

/// The bracket of a sensor.
pub(crate) struct BracketMotion;

impl SpindleEffect for ProbeSpot {
    fn about(&self) -> About {
        About {
            id: "probe-spot",
            does: "a sensor averages the form over an arc",
            acts_on: ActsOn::Sensor,
            // An arc of 2 mm.
            parameters: vec![parameter("squared width", "mm2", 4.0)],
        }
    }

    fn suits(&self, target: usize, layout: &Layout) -> bool {
        layout.readings.iter().any(|reading| reading.sensor == target && !reading.view.is_axial())
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        alterations.sensors[target].spot_mm2 += values[0];
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let layout = predicted.layout;
        let square_mm2 = layout.part_radius_mm * layout.part_radius_mm;
        let change = |order: usize, at: usize| {
            let reading = &layout.readings[at % layout.readings.len()];
            reading.form_share_slope(order) / square_mm2 * predicted.part[at]
        };
        vec![predicted.each(|reading| reading.sensor == target, change)]
    }

    fn is_possible(&self, values: &[f64]) -> bool {
        // Another sensor's spot is wider where this one's would have to be negative.
        values.iter().all(|square| *square > 0.0)
    }

    fn present(&self, estimated: Vec<Estimated>) -> Vec<Estimated> {
        let width = |square: Estimated| {
            let value = square.value.max(0.0).sqrt();
            let std = square.std.map(|std| 0.5 * std / value.max(f64::MIN_POSITIVE));
            Estimated { name: "width".into(), value, std, unit: "mm".into() }
        };
        estimated.into_iter().map(width).collect()
    }
}

impl SpindleEffect for BracketMotion {
    fn about(&self) -> About {
        About {
            id: "bracket-motion",
            does: "a sensor's bracket moves by a share of the spindle's motion",
            acts_on: ActsOn::Sensor,
            parameters: vec![parameter("share", "1", 0.02)],
        }
    }

    /// Two sensors of a section do not distinguish it from motion.
    fn suits(&self, target: usize, layout: &Layout) -> bool {
        let radial = |reading: &&Reading| reading.setup == 0 && !reading.view.is_axial();
        let section = layout.readings.iter().filter(radial).find(|reading| reading.sensor == target);
        section.is_some_and(|reading| layout.radial_sensors(reading.section) >= ENOUGH)
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        alterations.sensors[target].bracket_share += values[0];
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let seen = 1.0 - predicted.alterations.sensors[target].bracket_share;
        vec![predicted.each(|reading| reading.sensor == target, |_, at| -predicted.along[at] / seen)]
    }
}
