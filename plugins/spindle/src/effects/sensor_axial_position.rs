//! `sensor-axial-position`: a sensor sits at z + ζ, with another lever arm on tilt, ∂/∂ζ = ε_y cos θ' − ε_x sin θ'. It sees
//! another circle of the part there: + ∂h/∂z, as the form changes from one section to the next. Both are tried: sections may
//! be too far apart to show the change between them.

use runout_core::Complex64;

use super::{About, ActsOn, Alterations, Predicted, SpindleEffect, parameter};
use crate::layout::{Layout, UM_PER_MM_URAD};

/// A sensor's axial position.
pub(crate) struct SensorAxialPosition {
    /// Whether the form there is taken to be another one.
    pub sees_another_circle: bool,
}

impl SpindleEffect for SensorAxialPosition {
    fn about(&self) -> About {
        let parameters = vec![parameter("shift", "mm", 1.0)];
        About {
            id: "sensor-axial-position",
            does: "a sensor is at another place along the axis",
            acts_on: ActsOn::Sensor,
            parameters,
        }
    }

    /// An axial sensor's place along the axis is its level.
    fn suits(&self, target: usize, layout: &Layout) -> bool {
        layout.readings.iter().any(|reading| reading.sensor == target && !reading.view.is_axial())
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        let sensor = &mut alterations.sensors[target];
        sensor.z_mm += values[0];
        if self.sees_another_circle {
            sensor.circle_mm += values[0];
        }
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let circle = if self.sees_another_circle { 1.0 } else { 0.0 };
        let change = |_, at: usize| predicted.tilt[at] * UM_PER_MM_URAD + predicted.along_z[at] * circle;
        vec![predicted.each(|reading| reading.sensor == target, change)]
    }
}
