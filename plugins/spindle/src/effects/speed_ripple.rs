//! `speed-ripple`: between two index pulses the spindle runs unevenly; a recording in time assumes φ when the spindle
//! is at φ + ε(φ), ε = a (cos nφ − 1) + b sin nφ, 0 at the pulses. ∂/∂a = u'(Φ) (cos nΦ − 1), ∂/∂b = u'(Φ) sin nΦ.
//! a and b are in degrees, as in a scenario.

use runout_core::{Complex64, closed_loop::diagnosis::Estimated};

use super::{
    About, ActsOn, Alterations, Harmonic, Predicted, RAD_PER_DEG, SpindleEffect, as_amplitude, last_order, parameter,
};

/// Uneven speed of one order.
pub(crate) struct SpeedRipple {
    /// Per turn.
    pub order: usize,
    /// Whether each setup has one of its own, or all have the same.
    pub in_one_setup: bool,
}

impl SpindleEffect for SpeedRipple {
    fn about(&self) -> About {
        let parameters = vec![parameter("cosine", "deg", 0.06), parameter("sine", "deg", 0.06)];
        About {
            id: "speed-ripple",
            does: "the spindle turns unevenly within the turn",
            acts_on: if self.in_one_setup { ActsOn::Setup } else { ActsOn::Rig },
            parameters,
        }
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        let [cosine, sine] = [values[0], values[1]].map(f64::to_radians);
        let ripple = Harmonic { order: self.order, cosine, sine };
        let setups = alterations.setups.iter_mut().enumerate();
        setups
            .filter(|(setup, _)| !self.in_one_setup || *setup == target)
            .for_each(|(_, setup)| setup.ripples.push(ripple));
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let slope =
            |order: usize, at: usize| Complex64::new(0.0, -(order as f64) * RAD_PER_DEG) * predicted.readings[at];
        let on = |reading: &crate::layout::Reading| !self.in_one_setup || reading.setup == target;
        let slope = predicted.each(on, slope);
        let [mut cosine, sine] = predicted.modulated(&slope, self.order, on);
        cosine.iter_mut().zip(&slope).for_each(|(cosine, slope)| *cosine -= slope);
        vec![cosine, sine]
    }

    fn order(&self) -> Option<usize> {
        Some(self.order)
    }

    fn last_of_list(&self) -> Option<String> {
        last_order(self.order)
    }

    fn present(&self, estimated: Vec<Estimated>) -> Vec<Estimated> {
        as_amplitude(self.order, &estimated)
    }
}
