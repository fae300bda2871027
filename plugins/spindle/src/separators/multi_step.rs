//! Multi-step in closed form: one sensor that stays, the part at any number of angles, equal or not.
//!
//! D. J. Whitehouse, *Some Theoretical Aspects of Error Separation Techniques in Surface Metrology*, J. Phys. E 9 (1976)
//! 531. At one order u_k = a_k H + m with a_k = e^{in(θ−β_k)}; with ā their mean, H = Σ (a_k − ā)* u_k / Σ |a_k − ā|² and
//! m = ū − ā H. Where all a_k are equal (multiples of the number of equal steps), the order is lost.

use runout_core::{Complex64, rig::Rig};

use super::{
    closed_form::{ClosedForm, Method, same_angle},
    one_direction::OneDirection,
};
use crate::layout::Layout;

/// Σ |a_k − ā|² relative to the number of steps, below which all a_k are equal: as the layout's rank tolerance 1e-9 of
/// an amplitude.
const POLE: f64 = 1e-18;

/// One sensor in one or two sections; the part at several angles.
#[derive(Debug, Clone)]
pub struct MultiStep {
    sensors: OneDirection,
}

impl Method for MultiStep {
    const NAME: &'static str = "multi-step";
    const ABOUT: &'static str = "one sensor a section that stays, the part at any number of angles, equal steps or not";

    fn choose(rig: &Rig) -> (Vec<usize>, Vec<usize>) {
        let stay = |setup: &usize| same_angle(rig.setups[*setup].sensors_rad, rig.setups[0].sensors_rad);
        (OneDirection::choose(rig), (0..rig.setups.len()).filter(stay).collect())
    }

    fn new(rig: &Rig) -> Result<Self, String> {
        let sensors = OneDirection::new(rig)?;
        let first = &rig.setups[0];
        if rig.setups.iter().all(|setup| same_angle(setup.part_rad, first.part_rad)) {
            return Err("needs the part at two or more angles with the sensor in one place".into());
        }
        if let Some(moved) = rig.setups.iter().find(|setup| !same_angle(setup.sensors_rad, first.sensors_rad)) {
            return Err(format!("needs a sensor that stays; in setup `{}` it is elsewhere", moved.id));
        }
        Ok(Self { sensors })
    }
}

impl ClosedForm for MultiStep {
    fn operator(&self, layout: &Layout, order: usize) -> Option<Vec<Complex64>> {
        self.sensors.operator(layout, order, |phases| {
            let steps = phases.len() as f64;
            let mean = phases.iter().sum::<Complex64>() / steps;
            let spread: f64 = phases.iter().map(|phase| (phase - mean).norm_sqr()).sum();
            if spread <= POLE * steps {
                return None;
            }
            let form: Vec<Complex64> = phases.iter().map(|phase| (phase - mean).conj() / spread).collect();
            let motion = form.iter().map(|share| steps.recip() - mean * share).collect();
            Some([form, motion])
        })
    }
}
