//! `sensor-gain`: a reading is too large by a factor, (1 + g)·u. ∂/∂g = u.

use runout_core::Complex64;

use super::{About, ActsOn, Alterations, GAIN_TOLERANCE, Predicted, RigKey, SpindleEffect, parameter, size_of_gain};

/// A channel in another unit than declared (mil, mm, inch, nm), or in another range.
const UNITS: [f64; 6] = [3.0, 10.0, 25.4, 100.0, 1e3, 2.54e4];

/// A sensor's relative gain.
pub(crate) struct SensorGain;

impl SpindleEffect for SensorGain {
    fn about(&self) -> About {
        About {
            id: "sensor-gain",
            does: "a sensor's readings are too large by a factor",
            acts_on: ActsOn::Sensor,
            parameters: vec![parameter("gain", "1", GAIN_TOLERANCE)],
        }
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        alterations.sensors[target].gain += values[0];
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let gain = 1.0 + predicted.alterations.sensors[target].gain;
        vec![predicted.each(|reading| reading.sensor == target, |_, at| predicted.readings[at] / gain)]
    }

    fn size(&self, values: &[f64]) -> f64 {
        size_of_gain(values)
    }

    fn far_values(&self) -> Vec<f64> {
        UNITS.iter().flat_map(|unit| [unit - 1.0, unit.recip() - 1.0]).collect()
    }

    fn rig_key(&self) -> Option<RigKey> {
        Some(RigKey::SensorGain)
    }
}
