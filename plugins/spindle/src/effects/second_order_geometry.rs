//! `second-order-geometry`: a sensor's line meets the displaced profile, which a separator with `second_order = false` leaves
//! out. R is known, so it has no parameter.

use runout_core::Complex64;

use super::{About, ActsOn, Alterations, Predicted, SpindleEffect};
use crate::layout::Layout;

/// Exact geometry.
pub(crate) struct SecondOrderGeometry;

impl SpindleEffect for SecondOrderGeometry {
    fn about(&self) -> About {
        About {
            id: "second-order-geometry",
            does: "exact geometry, where the separator leaves it linear",
            acts_on: ActsOn::Rig,
            parameters: Vec::new(),
        }
    }

    fn alter(&self, _target: usize, _values: &[f64], alterations: &mut Alterations) {
        alterations.exact_geometry = true;
    }

    fn partials(&self, _target: usize, _predicted: &Predicted) -> Vec<Vec<Complex64>> {
        Vec::new()
    }

    fn is_declared(&self, _layout: &Layout, second_order: bool) -> bool {
        second_order
    }
}
