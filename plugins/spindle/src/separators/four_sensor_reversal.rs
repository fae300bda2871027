//! Four-sensor reversal over two sections, in closed form.
//!
//! Qiao, Xu, Zhao, *3-D Surface Morphology Detection Method Based on Motion Error*, J. Northeastern Univ. 45(12) 1726
//! (2024): S1, S2 at right angles in section a, S3, S4 in section b, the part reversed by 180°. Half the sum of both
//! readings is form, half their difference motion; the difference between the sections over their distance is tilt.
//! The paper writes S2 with +L·ε_x; here ε_x is right-handed, of the opposite sign.

use std::f64::consts::{FRAC_PI_2, PI};

use runout_core::{
    Complex64,
    fault::Fault,
    pipeline::{Context, StageConfig},
    rig::Rig,
    separation::Quantity,
    stage::{Separator, require_rig},
};
use schemars::JsonSchema;
use serde::Deserialize;

use super::closed_form::{
    ClosedForm, ClosedFormSeparator, SectionMotion, add_motion, refusal, same_angle, sections_with, takes_sensors,
};
use super::keys::yes;
use crate::{layout::Layout, selection::Selection};

const NAME: &str = "four-sensor-reversal";

/// `plugin = "four-sensor-reversal"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FourSensorReversalConfig {
    /// Sensors to use; without it, the first of the rig that the method can take.
    #[serde(default)]
    pub sensors: Option<Vec<String>>,
    /// Setups to use; without it, the first of the rig that the method can take.
    #[serde(default)]
    pub setups: Option<Vec<String>>,
    /// Whether readings follow exact geometry (a line meets the displaced profile) or the paper's linear equations.
    #[serde(default = "yes")]
    pub second_order: bool,
    /// With sensors that were not reversed: assume, as the paper's equation (7) does, that motion after half a turn is
    /// the negative. That holds for odd orders only; without it, even orders are reported as lost.
    #[serde(default)]
    pub assume_odd_motion: bool,
}

impl StageConfig for FourSensorReversalConfig {
    type Stage = Separator;

    const NAME: &'static str = NAME;
    const ABOUT: &'static str = "two sensors at right angles in each of two sections, part reversed by 180°";

    fn check(self, context: &Context) -> Result<Separator, Fault> {
        let rig = require_rig(context.rig)?;
        let selection = Selection::named(rig, self.sensors.as_deref(), self.setups.as_deref(), choose)?;
        Ok(Separator::Stations(Box::new(separator(selection, self.second_order, self.assume_odd_motion)?)))
    }
}

/// The paper's separator, for a rig of four sensors in two sections and two setups.
///
/// # Errors
/// When the rig is another one.
pub fn separator(
    selection: Selection,
    second_order: bool,
    assume_odd_motion: bool,
) -> Result<ClosedFormSeparator, Fault> {
    takes_sensors(&selection.rig).map_err(|problem| refusal(NAME, &problem))?;
    let method =
        FourSensorReversal::new(&selection.rig, assume_odd_motion).map_err(|problem| refusal(NAME, &problem))?;
    if assume_odd_motion && method.sensors_reversed {
        return Err(Fault::at("assume_odd_motion", "the rig's sensors are reversed too: there is nothing to assume")
            .help("leave assume_odd_motion out, or set sensors_deg = 0 where the sensors stayed"));
    }
    let layout = Layout::new(&selection.rig, assume_odd_motion);
    Ok(ClosedFormSeparator::new(selection, layout, second_order, Box::new(method)))
}

/// Two sensors at right angles in each of two sections, the same two directions; two setups with the part reversed,
/// sensors too where there are such.
#[must_use]
pub fn choose(rig: &Rig) -> (Vec<usize>, Vec<usize>) {
    let setups = 0..rig.setups.len();
    let pairs: Vec<[usize; 2]> =
        setups.clone().flat_map(|first| (first + 1..setups.end).map(move |second| [first, second])).collect();
    let pair = (pairs.iter().find(|pair| reversal(rig, **pair) == Some(true)))
        .or_else(|| pairs.iter().find(|pair| reversal(rig, **pair).is_some()));
    let radial = (0..rig.sensors.len()).filter(|sensor| rig.sensors[*sensor].axial_radius_mm.is_none());
    let mut sensors: Vec<usize> = match &sections_with(rig, 2)[..] {
        [near, far] => square_pairs(rig, near)
            .find_map(|[along, across]| {
                let mut same = square_pairs(rig, far);
                let parallel =
                    same.find(|[other, _]| same_angle(rig.sensors[*other].angle_rad, rig.sensors[along].angle_rad));
                parallel.map(|[first, second]| vec![along, across, first, second])
            })
            .unwrap_or_else(|| radial.collect()),
        _ => radial.collect(),
    };
    sensors.sort_unstable();
    (sensors, pair.map_or_else(|| setups.collect(), |pair| pair.to_vec()))
}

/// Sensors of which the second is a quarter turn further than the first.
fn square_pairs<'a>(rig: &'a Rig, sensors: &'a [usize]) -> impl Iterator<Item = [usize; 2]> + 'a {
    let pairs = sensors.iter().flat_map(move |first| sensors.iter().map(move |second| [*first, *second]));
    pairs
        .filter(|[first, second]| same_angle(rig.sensors[*second].angle_rad - rig.sensors[*first].angle_rad, FRAC_PI_2))
}

/// Whether the sensors turn with the part in a reversal; `None` where it is none.
fn reversal(rig: &Rig, [first, second]: [usize; 2]) -> Option<bool> {
    let [first, second] = [&rig.setups[first], &rig.setups[second]];
    let moved = second.sensors_rad - first.sensors_rad;
    let reversed = same_angle(moved, PI);
    (same_angle(second.part_rad - first.part_rad, PI) && (reversed || same_angle(moved, 0.0))).then_some(reversed)
}

/// The paper's formulas, for one rig.
#[derive(Debug, Clone)]
struct FourSensorReversal {
    /// Sensor along the first direction and the one a quarter turn further, in each section.
    pairs: [[usize; 2]; 2],
    sensors_reversed: bool,
    assume_odd_motion: bool,
}

impl FourSensorReversal {
    fn new(rig: &Rig, assume_odd_motion: bool) -> Result<Self, String> {
        let mut sections: Vec<usize> = rig.sensors.iter().map(|sensor| sensor.section).collect();
        sections.sort_unstable();
        sections.dedup();
        let ([near, far], 4, 2) = (&sections[..], rig.sensors.len(), rig.setups.len()) else {
            return Err(format!(
                "needs 4 sensors in 2 sections and 2 setups; the rig has {} in {} and {}",
                rig.sensors.len(),
                sections.len(),
                rig.setups.len()
            ));
        };
        let (near, far) = (*near, *far);
        if (rig.section_z_mm(near) - rig.section_z_mm(far)).abs() < f64::EPSILON {
            return Err("needs its sections at different z".into());
        }
        let Some(sensors_reversed) = reversal(rig, [0, 1]) else {
            let [turn, moved] = [
                rig.setups[1].part_rad - rig.setups[0].part_rad,
                rig.setups[1].sensors_rad - rig.setups[0].sensors_rad,
            ]
            .map(f64::to_degrees);
            if same_angle(turn.to_radians(), PI) {
                return Err(format!("needs sensors that stay or turn by 180°; they turn by {moved}°"));
            }
            return Err(format!("needs the part reversed by 180°; the setups differ by {turn}°"));
        };
        let mut pairs = [[0; 2]; 2];
        for (section, pair) in [near, far].into_iter().zip(&mut pairs) {
            let found: Vec<usize> = (0..4).filter(|sensor| rig.sensors[*sensor].section == section).collect();
            *pair = square_pairs(rig, &found)
                .next()
                .filter(|_| found.len() == 2)
                .ok_or_else(|| format!("needs two sensors at right angles in section `{}`", rig.sections[section]))?;
        }
        if !same_angle(rig.sensors[pairs[0][0]].angle_rad, rig.sensors[pairs[1][0]].angle_rad) {
            return Err("needs the same two directions in both sections".into());
        }
        Ok(Self { pairs, sensors_reversed, assume_odd_motion })
    }
}

impl ClosedForm for FourSensorReversal {
    fn operator(&self, layout: &Layout, order: usize) -> Option<Vec<Complex64>> {
        if !self.sensors_reversed && !self.assume_odd_motion && order.is_multiple_of(2) {
            return None;
        }
        let count = layout.readings.len();
        let mut operator = vec![Complex64::ZERO; layout.unknowns.len() * count];
        // Form in the second setup, where motion counts with the opposite sign.
        let second = |sensor: usize| {
            let phases = layout.part_phase(&layout.readings[sensor], order).conj()
                * layout.part_phase(&layout.readings[4 + sensor], order);
            // Real and of size 1: +1 with the sensors reversed, (−1)ⁿ without.
            phases.re.signum()
        };
        for pair in &self.pairs {
            for sensor in *pair {
                let reading = &layout.readings[sensor];
                let phase = layout.part_phase(reading, order).conj();
                // Form is half the sum of both setups, the mean of what the section's two sensors say.
                let form = layout.unknowns.iter().position(|known| *known == Quantity::Form(reading.section))? * count;
                operator[form + sensor] = phase * 0.25;
                operator[form + 4 + sensor] = phase * 0.25 * second(sensor);
            }
        }
        let (sine, cosine) = layout.readings[self.pairs[0][0]].angle_rad.sin_cos();
        for (direction, along) in [[cosine, sine], [-sine, cosine]].into_iter().enumerate() {
            // Motion along a direction is half the difference of both setups.
            let sections = self.pairs.map(|pair| {
                let sensor = pair[direction];
                let mut row = vec![Complex64::ZERO; count];
                row[sensor] = Complex64::from(0.5);
                row[4 + sensor] = Complex64::from(-0.5 * second(sensor));
                SectionMotion { lever_mm: layout.readings[sensor].lever_mm, row }
            });
            add_motion(&mut operator, layout, along, &sections);
        }
        Some(operator)
    }

    fn notes(&self) -> Vec<String> {
        if self.assume_odd_motion {
            vec![
                "assume_odd_motion: the paper's equation (7) takes motion after half a turn for the negative, which \
                 holds for odd orders only; even-order motion goes into form, and shows only in the residual"
                    .into(),
            ]
        } else if self.sensors_reversed {
            Vec::new()
        } else {
            vec![
                "the sensors stay while the part is reversed: even orders of form and motion are the same in every \
                 reading and are lost; reverse the sensors too, or add a setup at another part angle"
                    .into(),
            ]
        }
    }
}
