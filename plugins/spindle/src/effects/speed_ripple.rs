//! `speed-ripple`: between two index pulses the spindle runs unevenly; a recording in time believes to be at φ when the spindle
//! is at φ + ε(φ), ε = a (cos nφ − 1) + b sin nφ, 0 at the pulses. ∂/∂a = u'(Φ) (cos nΦ − 1), ∂/∂b = u'(Φ) sin nΦ.

use runout_core::{Complex64, model::diagnosis::Estimated};

use super::{About, ActsOn, Alterations, Harmonic, Predicted, SpindleEffect, as_amplitude, parameter};

/// Uneven speed of one order.
pub struct SpeedRipple {
    /// Per turn.
    pub order: usize,
}

impl SpindleEffect for SpeedRipple {
    fn about(&self) -> About {
        let parameters = vec![parameter("cosine", "rad", 1e-3), parameter("sine", "rad", 1e-3)];
        About {
            id: "speed-ripple",
            does: "the spindle turns unevenly within the turn",
            acts_on: ActsOn::Rig,
            parameters,
        }
    }

    fn alter(&self, _target: usize, values: &[f64], alterations: &mut Alterations) {
        alterations.ripples.push(Harmonic { order: self.order, cosine: values[0], sine: values[1] });
    }

    fn partials(&self, _target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let slope = |order: usize, at: usize| Complex64::new(0.0, -(order as f64)) * predicted.readings[at];
        let slope = predicted.each(|_| true, slope);
        let order = self.order as f64;
        vec![
            predicted.curves(&slope, |_| true, |angle, value| value * ((order * angle).cos() - 1.0)),
            predicted.curves(&slope, |_| true, |angle, value| value * (order * angle).sin()),
        ]
    }

    fn present(&self, estimated: Vec<Estimated>) -> Vec<Estimated> {
        as_amplitude(self.order, &estimated)
    }
}
