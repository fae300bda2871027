//! `part-radius`: the part's radius is R/(1 + c). A sensor's line meets a part that is off centre by second order in eccentricity over radius: what exact
//! geometry adds to linear readings is, nearly, in proportion to the curvature 1/R. ∂/∂c is its difference over a small change of R.

use runout_core::Complex64;

use super::{About, ActsOn, Alterations, Predicted, RigKey, SpindleEffect, parameter};
use crate::layout::Layout;

/// A diameter that was written for a radius.
const USUAL: f64 = 1.0;
/// The change of the curvature over which readings are differenced, relative.
const STEP: f64 = 1e-4;
/// Near the centre it moves readings by less than sensors resolve, in µm rms.
const NEGLIGIBLE_UM: f64 = 1e-3;

/// The radius of the part.
pub(crate) struct PartRadius;

impl SpindleEffect for PartRadius {
    fn about(&self) -> About {
        About {
            id: "part-radius",
            does: "the part's radius is another than declared",
            acts_on: ActsOn::Rig,
            parameters: vec![parameter("curvature", "1", USUAL)],
        }
    }

    fn alter(&self, _target: usize, values: &[f64], alterations: &mut Alterations) {
        alterations.curvature += values[0];
    }

    fn partials(&self, _target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let per_unit = STEP * (1.0 + predicted.alterations.curvature);
        let [here, larger] = [1.0, 1.0 + STEP].map(|curvature| predicted.beyond_linear(curvature));
        vec![larger.iter().zip(&here).map(|(larger, here)| (larger - here) / per_unit).collect()]
    }

    fn negligible_um(&self) -> f64 {
        NEGLIGIBLE_UM
    }

    fn is_declared(&self, _layout: &Layout, second_order: bool) -> bool {
        !second_order
    }

    fn size(&self, values: &[f64]) -> f64 {
        values.iter().map(|curvature| curvature.ln_1p().abs() / USUAL.ln_1p()).fold(0.0, f64::max)
    }

    fn rig_key(&self) -> Option<RigKey> {
        Some(RigKey::PartRadius)
    }
}
