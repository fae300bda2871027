//! `thermal-drift`: a reading creeps by rate·τ·(1 − e^{−t/τ}) in each capture. Over the averaged turn it rises by a mean
//! creep s, a saw-tooth: ∂/∂s = Φ/2π − ½ (`creep`). Rate and τ follow from the levels of the turns (`diagnose/drift.rs`).

use runout_core::Complex64;

use super::{About, ActsOn, Alterations, Predicted, SpindleEffect, creep, parameter};

/// A sensor's drift.
pub struct ThermalDrift;

impl SpindleEffect for ThermalDrift {
    fn about(&self) -> About {
        let parameters = vec![parameter("creep", "um/rev", 0.05)];
        About {
            id: "thermal-drift",
            does: "a sensor's reading creeps over each capture",
            acts_on: ActsOn::Sensor,
            parameters,
        }
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        alterations.sensors[target].creep_um += values[0];
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let gain = 1.0 + predicted.alterations.sensors[target].gain;
        let value = |order, at| creep(order, predicted.turn_angles_of(at)) / gain;
        vec![predicted.each(|reading| reading.sensor == target, value)]
    }

    fn creep_partials(&self, target: usize, sensor: usize) -> Vec<f64> {
        vec![if sensor == target { 1.0 } else { 0.0 }]
    }
}
