//! `thermal-drift`: a reading creeps along a straight line or by rate·τ·(1 − e^{−t/τ}), in each capture alike or by different
//! amounts. Over the averaged turn it rises by a mean creep s, a saw-tooth: ∂/∂s = Φ/2π − ½ (`creep`). Course, amounts and
//! τ follow from the levels of the turns (`diagnose/drift.rs`).

use runout_core::Complex64;

use super::{About, ActsOn, Alterations, Predicted, SpindleEffect, TurnEvidence, creep, parameter};

/// A sensor's drift.
pub(crate) struct ThermalDrift;

impl SpindleEffect for ThermalDrift {
    fn about(&self) -> About {
        let parameters = vec![parameter("creep", "um/rev", 0.05)];
        About {
            id: "thermal-drift",
            does: "a sensor's reading drifts over each capture",
            acts_on: ActsOn::Sensor,
            parameters,
        }
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        alterations.sensors[target].creep_um += values[0];
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let sensor = &predicted.alterations.sensors[target];
        let readings = &predicted.layout.readings;
        let value = |order, at: usize| {
            let share = sensor.creep_share(readings[at % readings.len()].setup);
            share * creep(order, predicted.turn_angles_of(at)) / (1.0 + sensor.gain)
        };
        vec![predicted.each(|reading| reading.sensor == target, value)]
    }

    fn turn_evidence(&self) -> Option<TurnEvidence> {
        Some(TurnEvidence::Levels)
    }

    fn creep_partials(&self, target: usize, sensor: usize) -> Vec<f64> {
        vec![if sensor == target { 1.0 } else { 0.0 }]
    }
}
