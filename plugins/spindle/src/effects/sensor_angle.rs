//! `sensor-angle`: a sensor stands at θ + δ and sees part and motion from there.
//! ∂/∂δ = h'(α) + motion across the sensor, y cos θ' − x sin θ'. δ is in degrees.

use runout_core::Complex64;

use super::{About, ActsOn, Alterations, Predicted, RAD_PER_DEG, RigKey, SpindleEffect, parameter};
use crate::layout::{Layout, View};

/// A sensor's angle.
pub(crate) struct SensorAngle;

impl SpindleEffect for SensorAngle {
    fn about(&self) -> About {
        // A degree: sensors are set up by eye and scale.
        About {
            id: "sensor-angle",
            does: "a sensor stands at another angle",
            acts_on: ActsOn::Sensor,
            parameters: vec![parameter("angle", "deg", 1.0)],
        }
    }

    /// On the axis a sensor has no angle.
    fn suits(&self, target: usize, layout: &Layout) -> bool {
        layout.readings.iter().any(|reading| reading.sensor == target && reading.view != View::OnAxis)
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        alterations.sensors[target].angle_rad += values[0].to_radians();
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let turned = |order: usize| Complex64::I * predicted.layout.direction * order as f64;
        let on = |reading: &crate::layout::Reading| reading.sensor == target;
        let seen = |order: usize, at: usize| turned(order) * predicted.part[at] + predicted.across[at];
        vec![predicted.each(on, |order, at| seen(order, at) * RAD_PER_DEG)]
    }

    fn rig_key(&self) -> Option<RigKey> {
        Some(RigKey::SensorAngle)
    }
}
