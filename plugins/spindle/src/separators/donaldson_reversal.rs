//! Donaldson reversal in closed form.
//!
//! R. R. Donaldson, *A Simple Method for Separating Spindle Error from Test Ball Roundness Error*, CIRP Annals 21(1)
//! (1972) 125; ISO 230-7:2015 annex B. Part and sensor are both turned by 180°: form reads as before, motion with the
//! opposite sign. Half the sum of both readings is form, half their difference motion along the sensor.

use std::f64::consts::PI;

use runout_core::{Complex64, rig::Rig};

use super::{
    closed_form::{ClosedForm, Method, same_angle},
    one_direction::OneDirection,
};
use crate::layout::Layout;

/// One sensor in one or two sections; part and sensor reversed.
#[derive(Debug, Clone)]
pub struct DonaldsonReversal {
    sensors: OneDirection,
}

/// That part and sensors both turn by half a turn from one setup to another.
fn reversed(rig: &Rig, from: usize, to: usize) -> bool {
    let (from, to) = (&rig.setups[from], &rig.setups[to]);
    same_angle(to.part_rad - from.part_rad, PI) && same_angle(to.sensors_rad - from.sensors_rad, PI)
}

impl Method for DonaldsonReversal {
    const NAME: &'static str = "donaldson-reversal";
    const ABOUT: &'static str =
        "one sensor a section, part and sensor reversed by 180°: half the sum, half the difference";

    fn choose(rig: &Rig) -> (Vec<usize>, Vec<usize>) {
        let setups = 0..rig.setups.len();
        let pairs = setups.clone().flat_map(|from| (from + 1..rig.setups.len()).map(move |to| (from, to)));
        let pair = pairs.into_iter().find(|(from, to)| reversed(rig, *from, *to));
        (OneDirection::choose(rig), pair.map_or_else(|| setups.collect(), |(from, to)| vec![from, to]))
    }

    fn new(rig: &Rig) -> Result<Self, String> {
        let sensors = OneDirection::new(rig)?;
        if rig.setups.len() != 2 {
            return Err(format!("needs 2 setups, part and sensor reversed; {} are given", rig.setups.len()));
        }
        if !reversed(rig, 0, 1) {
            let [part, moved] = [
                rig.setups[1].part_rad - rig.setups[0].part_rad,
                rig.setups[1].sensors_rad - rig.setups[0].sensors_rad,
            ]
            .map(f64::to_degrees);
            return Err(format!("needs part and sensor reversed by 180°; they turn by {part:.4}° and {moved:.4}°"));
        }
        Ok(Self { sensors })
    }
}

impl ClosedForm for DonaldsonReversal {
    fn operator(&self, layout: &Layout, order: usize) -> Option<Vec<Complex64>> {
        self.sensors.operator(layout, order, |phases| {
            let form = phases.iter().map(|phase| phase.conj() * 0.5).collect();
            Some([form, vec![Complex64::from(0.5), Complex64::from(-0.5)]])
        })
    }
}
