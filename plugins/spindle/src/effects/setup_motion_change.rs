//! `setup-motion-change`: in a setup the spindle moves (1 + r) times as much as in the first. ∂/∂r = motion along the
//! sensor.

use runout_core::{Complex64, closed_loop::diagnosis::Estimated};

use super::{About, ActsOn, Alterations, Predicted, SpindleEffect, parameter};

/// The size of the motion in a setup.
pub(crate) struct SetupMotionChange;

impl SpindleEffect for SetupMotionChange {
    fn about(&self) -> About {
        let parameters = vec![parameter("ratio less 1", "1", 0.1)];
        About {
            id: "setup-motion-change",
            does: "the spindle moved more or less in one setup",
            acts_on: ActsOn::OddSetup,
            parameters,
        }
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        alterations.setups[target].motion += values[0];
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let ratio = 1.0 + predicted.alterations.setups[target].motion;
        vec![predicted.each(|reading| reading.setup == target, |_, at| predicted.along[at] / ratio)]
    }

    fn present(&self, estimated: Vec<Estimated>) -> Vec<Estimated> {
        estimated
            .into_iter()
            .map(|ratio| Estimated { name: "ratio".into(), value: 1.0 + ratio.value, ..ratio })
            .collect()
    }
}
