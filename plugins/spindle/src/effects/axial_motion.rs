//! `axial-motion`: the part moves along z by w(Φ), so that sensors see it elsewhere; with its slope from one section to the
//! next, the reading changes by −w·∂h/∂z. For w = a cos nΦ + b sin nΦ: ∂/∂a = −cos nΦ ∂h/∂z, ∂/∂b = −sin nΦ ∂h/∂z.

use runout_core::{Complex64, closed_loop::diagnosis::Estimated};

use super::{About, ActsOn, Alterations, Harmonic, Predicted, SpindleEffect, as_amplitude, last_order, parameter};

/// Largest amplitude in µm. Spindles move by micrometres along their axes. Where the form has next to no slope along z, a far
/// larger motion can reproduce what other effects leave.
const LARGEST_UM: f64 = 200.0;

/// Axial error motion of one order.
pub(crate) struct AxialMotion {
    /// Per turn.
    pub order: usize,
}

impl SpindleEffect for AxialMotion {
    fn about(&self) -> About {
        let parameters = vec![parameter("cosine", "um", 3.0), parameter("sine", "um", 3.0)];
        About { id: "axial-motion", does: "the spindle moves along its axis", acts_on: ActsOn::Rig, parameters }
    }

    fn alter(&self, _target: usize, values: &[f64], alterations: &mut Alterations) {
        alterations.axial_um.push(Harmonic { order: self.order, cosine: values[0], sine: values[1] });
    }

    fn partials(&self, _target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let products = predicted.modulated(&predicted.along_z, self.order, |_| true);
        // µm of motion along z are 1e-3 mm.
        products.into_iter().map(|product| product.into_iter().map(|value| -1e-3 * value).collect()).collect()
    }

    fn is_possible(&self, values: &[f64]) -> bool {
        values.iter().map(|value| value * value).sum::<f64>().sqrt() <= LARGEST_UM
    }

    fn last_of_list(&self) -> Option<String> {
        last_order(self.order)
    }

    fn present(&self, estimated: Vec<Estimated>) -> Vec<Estimated> {
        as_amplitude(self.order, &estimated)
    }
}
