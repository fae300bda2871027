//! What a sensor sees of the part at its z: the form and what is on it for this sensor and setup, or their mean over the arc under a wide
//! spot, by quadrature.

use runout_core::Complex64;

use super::{
    form::Form,
    series::{self, LANES, Phasor},
    world::{TrueSensor, TrueSetup, World},
};

/// Points of the arc: the midpoint rule is then good to 1e-5 of an order that has most of a period under the spot.
const POINTS: usize = 512;

/// A profile in one capture.
pub(super) struct Profile {
    harmonics: Vec<Complex64>,
    /// What of it is not the form, in µm.
    besides: Vec<Complex64>,
    /// Points of the spot, as e^{iδ} from its middle; one where it is a point.
    arc: Vec<Complex64>,
    /// Means over them of e^{inδ}, by order; nothing where it is a point.
    means: Vec<Complex64>,
}

impl Profile {
    /// Of a sensor in a setup.
    pub(crate) fn new(world: &World, setup: &TrueSetup, sensor: &TrueSensor, z_mm: f64) -> Self {
        let mut besides = Vec::new();
        for of_part in [&setup.clamping_form_um, &sensor.run_out_um] {
            of_part.iter().enumerate().for_each(|(order, value)| series::add(&mut besides, order, *value));
        }
        // On the part, the chuck is behind by the part's angle.
        let chuck = world.chuck_um.iter().enumerate();
        let turned = chuck.map(|(order, value)| (order, value * Complex64::cis(order as f64 * setup.part_rad)));
        turned.for_each(|(order, value)| series::add(&mut besides, order, value));
        let mut harmonics = world.form.at(z_mm);
        besides.iter().enumerate().for_each(|(order, value)| series::add(&mut harmonics, order, *value));
        let spot_rad = sensor.spot_mm / world.rig.part_radius_mm;
        if spot_rad == 0.0 {
            return Self { harmonics, besides, arc: vec![Complex64::ONE], means: Vec::new() };
        }
        let points = (0..POINTS).map(|point| (point as f64 + 0.5) / POINTS as f64 - 0.5);
        let arc: Vec<Complex64> = points.map(|place| Complex64::cis(spot_rad * place)).collect();
        let mean = |order: usize| arc.iter().map(|point| point.powu(order as u32)).sum::<Complex64>() / POINTS as f64;
        let means: Vec<Complex64> = (0..harmonics.len()).map(mean).collect();
        harmonics.iter_mut().zip(&means).for_each(|(value, mean)| *value *= mean);
        Self { harmonics, besides, arc, means }
    }

    /// As harmonics, in µm.
    pub(crate) fn harmonics(&self) -> &[Complex64] {
        &self.harmonics
    }

    /// Changes the form of another circle into what the sensor sees there, in µm.
    pub(crate) fn see(&self, form: &mut Vec<Phasor<LANES>>) {
        form.resize(self.harmonics.len(), Phasor::ZERO);
        for (value, besides) in form.iter_mut().zip(&self.besides) {
            value.re.iter_mut().for_each(|re| *re += besides.re);
            value.im.iter_mut().for_each(|im| *im += besides.im);
        }
        form.iter_mut().zip(&self.means).for_each(|(value, mean)| *value = value.times(*mean));
    }

    /// How deep grooves are under it, in µm.
    pub(crate) fn groove_um(&self, form: &Form, toward: Complex64) -> f64 {
        self.arc.iter().map(|point| form.groove_um(toward * point)).sum::<f64>() / self.arc.len() as f64
    }
}
