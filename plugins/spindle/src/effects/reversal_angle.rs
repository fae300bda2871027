//! `reversal-angle`: in a setup the part was clamped at β + δ. ∂/∂δ = −h'(α). δ is in degrees.

use runout_core::Complex64;

use super::{About, ActsOn, Alterations, Predicted, RAD_PER_DEG, RigKey, SpindleEffect, far_angles_deg, parameter};

/// The part's angle in a setup.
pub(crate) struct ReversalAngle;

impl SpindleEffect for ReversalAngle {
    fn about(&self) -> About {
        let parameters = vec![parameter("angle", "deg", 0.3)];
        About {
            id: "reversal-angle",
            does: "the part was clamped at another angle",
            acts_on: ActsOn::OddSetup,
            parameters,
        }
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        alterations.setups[target].part_rad += values[0].to_radians();
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let turned = |order: usize| -Complex64::I * predicted.layout.direction * order as f64 * RAD_PER_DEG;
        vec![predicted.each(|reading| reading.setup == target, |order, at| turned(order) * predicted.part[at])]
    }

    fn far_values(&self) -> Vec<f64> {
        far_angles_deg()
    }

    fn rig_key(&self) -> Option<RigKey> {
        Some(RigKey::PartAngle)
    }
}
