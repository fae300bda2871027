//! `sensors-angle`: in a setup all sensors stood at σ + δ. ∂/∂δ = h'(α) + motion across the sensor.

use runout_core::Complex64;

use super::{About, ActsOn, Alterations, Predicted, RAD_PER_DEG, RigKey, SpindleEffect, far_angles_deg, parameter};

/// The angle of all sensors in a setup.
pub(crate) struct SensorsAngle;

impl SpindleEffect for SensorsAngle {
    fn about(&self) -> About {
        About {
            id: "sensors-angle",
            does: "all sensors are at another angle in one setup",
            acts_on: ActsOn::OddSetup,
            parameters: vec![parameter("angle", "deg", 0.3)],
        }
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        alterations.setups[target].sensors_rad += values[0].to_radians();
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let turned = |order: usize| Complex64::I * predicted.layout.direction * order as f64;
        let on = |reading: &crate::layout::Reading| reading.setup == target;
        let seen = |order: usize, at: usize| turned(order) * predicted.part[at] + predicted.across[at];
        vec![predicted.each(on, |order, at| seen(order, at) * RAD_PER_DEG)]
    }

    fn far_values(&self) -> Vec<f64> {
        far_angles_deg()
    }

    fn rig_key(&self) -> Option<RigKey> {
        Some(RigKey::SensorsAngle)
    }
}
