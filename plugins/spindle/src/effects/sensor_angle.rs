//! `sensor-angle`: a sensor stands at θ + δ and sees part and motion from there.
//! ∂/∂δ = h'(α) + motion across the sensor, y cos θ' − x sin θ'. δ is in degrees.

use runout_core::Complex64;

use super::{About, ActsOn, Alterations, Predicted, RAD_PER_DEG, RigKey, SpindleEffect, far_angles_deg, parameter};
use crate::layout::{Layout, View};

/// A sensor's angle.
pub(crate) struct SensorAngle {
    /// Whether it was put back at another angle in one setup, or stands there in all.
    pub in_one_setup: bool,
}

impl SensorAngle {
    /// The sensor, and the only setup.
    fn place(&self, target: usize, setups: usize) -> (usize, Option<usize>) {
        if self.in_one_setup { (target / setups, Some(target % setups)) } else { (target, None) }
    }
}

impl SpindleEffect for SensorAngle {
    fn about(&self) -> About {
        // A degree: sensors are set up by eye and scale.
        About {
            id: "sensor-angle",
            does: if self.in_one_setup {
                "a sensor is at another angle in one setup"
            } else {
                "a sensor is at another angle"
            },
            acts_on: if self.in_one_setup { ActsOn::SensorInSetup } else { ActsOn::Sensor },
            parameters: vec![parameter("angle", "deg", 1.0)],
        }
    }

    /// On the axis a sensor has no angle.
    fn suits(&self, target: usize, layout: &Layout) -> bool {
        let setups = layout.readings.last().map_or(1, |reading| reading.setup + 1);
        let (sensor, _) = self.place(target, setups);
        layout.readings.iter().any(|reading| reading.sensor == sensor && reading.view != View::OnAxis)
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        let angle_rad = values[0].to_radians();
        match self.place(target, alterations.setups.len()) {
            (sensor, None) => alterations.sensors[sensor].angle_rad += angle_rad,
            (sensor, Some(setup)) => alterations.sensors[sensor].angles_in_setups.push((setup, angle_rad)),
        }
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let turned = |order: usize| Complex64::I * predicted.layout.direction * order as f64;
        let (sensor, setup) = self.place(target, predicted.alterations.setups.len());
        let on = |reading: &crate::layout::Reading| {
            reading.sensor == sensor && setup.is_none_or(|only| only == reading.setup)
        };
        let seen = |order: usize, at: usize| turned(order) * predicted.part[at] + predicted.across[at];
        vec![predicted.each(on, |order, at| seen(order, at) * RAD_PER_DEG)]
    }

    fn far_values(&self) -> Vec<f64> {
        if self.in_one_setup { Vec::new() } else { far_angles_deg() }
    }

    fn rig_key(&self) -> Option<RigKey> {
        (!self.in_one_setup).then_some(RigKey::SensorAngle)
    }
}
