//! `even-order-motion`: the sensors stayed while the part was reversed, and motion of even orders did not change its sign, as
//! the separator was configured to assume. It has no parameter: with it, even orders are lost instead of wrong.

use runout_core::Complex64;

use super::{About, ActsOn, Alterations, Predicted, SpindleEffect};
use crate::layout::Layout;

/// Even orders of motion keep their sign.
pub(crate) struct EvenOrderMotion;

impl SpindleEffect for EvenOrderMotion {
    fn about(&self) -> About {
        About {
            id: "even-order-motion",
            does: "motion of even orders did not change its sign, as was assumed",
            acts_on: ActsOn::Rig,
            parameters: Vec::new(),
        }
    }

    fn alter(&self, _target: usize, _values: &[f64], alterations: &mut Alterations) {
        alterations.even_order_motion = true;
    }

    fn partials(&self, _target: usize, _predicted: &Predicted) -> Vec<Vec<Complex64>> {
        Vec::new()
    }

    fn is_declared(&self, layout: &Layout, _second_order: bool) -> bool {
        !layout.assumes_odd_motion()
    }
}
