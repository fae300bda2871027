//! What a sensor sees of the part at its z: the form itself, or its mean over the arc under a wide spot, by quadrature.

use runout_core::Complex64;

use super::{
    form::Form,
    series::{LANES, Phasor},
};

/// Points of the arc: the midpoint rule is then good to 1e-5 of an order that has most of a period under the spot.
const POINTS: usize = 512;

/// A profile in one capture.
pub(super) struct Profile {
    harmonics: Vec<Complex64>,
    /// Points of the spot, as e^{iδ} from its middle; one where it is a point.
    arc: Vec<Complex64>,
    /// Means over them of e^{inδ}, by order; nothing where it is a point.
    means: Vec<Complex64>,
}

impl Profile {
    /// Of a sensor whose spot is so wide.
    pub(crate) fn new(form: &Form, spot_rad: f64, z_mm: f64) -> Self {
        let mut harmonics = form.at(z_mm);
        if spot_rad == 0.0 {
            return Self { harmonics, arc: vec![Complex64::ONE], means: Vec::new() };
        }
        let points = (0..POINTS).map(|point| (point as f64 + 0.5) / POINTS as f64 - 0.5);
        let arc: Vec<Complex64> = points.map(|place| Complex64::cis(spot_rad * place)).collect();
        let mean = |order: usize| arc.iter().map(|point| point.powu(order as u32)).sum::<Complex64>() / POINTS as f64;
        let means: Vec<Complex64> = (0..harmonics.len()).map(mean).collect();
        harmonics.iter_mut().zip(&means).for_each(|(value, mean)| *value *= mean);
        Self { harmonics, arc, means }
    }

    /// As harmonics, in µm.
    pub(crate) fn harmonics(&self) -> &[Complex64] {
        &self.harmonics
    }

    /// The same of another circle: of the form there.
    pub(crate) fn see(&self, form: &mut [Phasor<LANES>]) {
        form.iter_mut().zip(&self.means).for_each(|(value, mean)| *value = value.times(*mean));
    }

    /// How deep grooves are under it, in µm.
    pub(crate) fn groove_um(&self, form: &Form, toward: Complex64) -> f64 {
        self.arc.iter().map(|point| form.groove_um(toward * point)).sum::<f64>() / self.arc.len() as f64
    }
}
