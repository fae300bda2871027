//! `sensor-nonlinearity`: reading u + a·u² + b·u³. ∂/∂a = u², ∂/∂b = u³, u the displacement with its level.

use runout_core::Complex64;

use super::{About, ActsOn, Alterations, Predicted, RigKey, SpindleEffect, parameter};

/// Largest coefficients, in 1/µm and 1/µm²: a hundred and a thousand times what is usual. Where a characteristic leaves next to no
/// trace, as of a sensor that nothing but itself checks, a far larger one can reproduce noise.
const LARGEST: f64 = 0.1;

/// A sensor's characteristic.
pub(crate) struct SensorNonlinearity;

impl SpindleEffect for SensorNonlinearity {
    fn about(&self) -> About {
        let parameters = vec![parameter("quadratic", "1/um", 1e-3), parameter("cubic", "1/um^2", 1e-4)];
        About {
            id: "sensor-nonlinearity",
            does: "a sensor's characteristic is bent",
            acts_on: ActsOn::Sensor,
            parameters,
        }
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        alterations.sensors[target].quadratic_per_um += values[0];
        alterations.sensors[target].cubic_per_um2 += values[1];
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let sensor = &predicted.alterations.sensors[target];
        let (a, b) = (sensor.quadratic_per_um, sensor.cubic_per_um2);
        // Seen on the displacements, to which readings are converted.
        let slope = |u: f64| 1.0 + u * (2.0 * a + 3.0 * b * u);
        let on = |reading: &crate::layout::Reading| reading.sensor == target;
        vec![
            predicted.curves(&predicted.readings, on, |_, u| u * u / slope(u)),
            predicted.curves(&predicted.readings, on, |_, u| u * u * u / slope(u)),
        ]
    }

    fn is_possible(&self, values: &[f64]) -> bool {
        values.iter().all(|value| value.abs() <= LARGEST)
    }

    fn rig_key(&self) -> Option<RigKey> {
        Some(RigKey::SensorCharacteristic)
    }
}
