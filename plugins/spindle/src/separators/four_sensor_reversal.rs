//! Four-sensor reversal over two sections, in closed form.
//!
//! Qiao, Xu, Zhao, *3-D Surface Morphology Detection Method Based on Motion Error*, J. Northeastern Univ. 45(12) 1726
//! (2024): S1, S2 at right angles in section a, S3, S4 in section b, the part reversed by 180°. Half the sum of both
//! readings is form, half their difference motion; the difference between the sections over their distance is tilt.
//! The paper writes S2 with +L·ε_x; here ε_x is right-handed, of the opposite sign.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use runout_core::{
    Complex64, Result,
    pipeline::{
        error::Fault,
        registry::{Context, StageConfig},
    },
    rig::Rig,
    separation::{Assessment, Quantity, Separation},
    stage::{Separator, Station, StationSeparator, separator::require_rig},
};
use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    harmonic_least_squares::{Weighting, operators},
    readings::Readings,
    solution::{Operators, OrderOperator, Solver},
};
use crate::layout::{Layout, UM_PER_MM_URAD};

/// A reversal is one of exactly half a turn; what is off by more is for the general separator.
const ANGLE_TOLERANCE_RAD: f64 = 1e-9;

/// `plugin = "four-sensor-reversal"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FourSensorReversalConfig {
    /// Whether readings follow exact geometry (a line meets the displaced profile) or the paper's linear equations.
    #[serde(default = "yes")]
    pub second_order: bool,
    /// With sensors that were not reversed: assume, as the paper's equation (7) does, that motion after half a turn is
    /// the negative. That holds for odd orders only; without it, even orders are reported as lost.
    #[serde(default)]
    pub assume_odd_motion: bool,
}

fn yes() -> bool {
    true
}

impl StageConfig for FourSensorReversalConfig {
    type Stage = Separator;

    const NAME: &'static str = "four-sensor-reversal";
    const ABOUT: &'static str = "two sensors at right angles in each of two sections, part reversed by 180°";

    fn check(self, context: &Context) -> std::result::Result<Separator, Fault> {
        let rig = require_rig(context.rig)?;
        Ok(Separator::Stations(Box::new(FourSensorReversal::new(
            rig.clone(),
            self.second_order,
            self.assume_odd_motion,
        )?)))
    }
}

/// The paper's separator, for one rig.
#[derive(Debug, Clone)]
pub struct FourSensorReversal {
    rig: Rig,
    layout: Layout,
    second_order: bool,
    /// Sensor along the first direction and the one a quarter turn further, in each section.
    pairs: [[usize; 2]; 2],
    sensors_reversed: bool,
    assume_odd_motion: bool,
}

impl FourSensorReversal {
    /// For a rig of four sensors in two sections and two setups.
    ///
    /// # Errors
    /// When the rig is another one.
    pub fn new(rig: Rig, second_order: bool, assume_odd_motion: bool) -> std::result::Result<Self, Fault> {
        let refuse = |message: String| {
            Err(Fault::at("plugin", format!("four-sensor-reversal {message}"))
                .help("plugin = \"harmonic-least-squares\" takes any rig"))
        };
        if rig.sensors.len() != 4 || rig.sections.len() != 2 || rig.setups.len() != 2 {
            return refuse(format!(
                "needs 4 sensors in 2 sections and 2 setups; the rig has {} in {} and {}",
                rig.sensors.len(),
                rig.sections.len(),
                rig.setups.len()
            ));
        }
        if (rig.section_z_mm(0) - rig.section_z_mm(1)).abs() < f64::EPSILON {
            return refuse("needs its sections at different z".into());
        }
        let turn = rig.setups[1].part_rad - rig.setups[0].part_rad;
        if !same_angle(turn, PI) {
            return refuse(format!("needs the part reversed by 180°; the setups differ by {}°", turn.to_degrees()));
        }
        let moved = rig.setups[1].sensors_rad - rig.setups[0].sensors_rad;
        let sensors_reversed = same_angle(moved, PI);
        if !sensors_reversed && !same_angle(moved, 0.0) {
            return refuse(format!("needs sensors that stay or turn by 180°; they turn by {}°", moved.to_degrees()));
        }
        if assume_odd_motion && sensors_reversed {
            return Err(Fault::at(
                "assume_odd_motion",
                "the rig's sensors are reversed too: there is nothing to assume",
            )
            .help("leave assume_odd_motion out, or set sensors_deg = 0 where the sensors stayed"));
        }
        let mut pairs = [[0; 2]; 2];
        for (section, pair) in pairs.iter_mut().enumerate() {
            let found: Vec<usize> = (0..4).filter(|sensor| rig.sensors[*sensor].section == section).collect();
            let angle = |sensor: usize| rig.sensors[sensor].angle_rad;
            *pair = match found[..] {
                [first, second] if same_angle(angle(second) - angle(first), FRAC_PI_2) => [first, second],
                [first, second] if same_angle(angle(first) - angle(second), FRAC_PI_2) => [second, first],
                _ => {
                    return refuse(format!("needs two sensors at right angles in section `{}`", rig.sections[section]));
                }
            };
        }
        if !same_angle(rig.sensors[pairs[0][0]].angle_rad, rig.sensors[pairs[1][0]].angle_rad) {
            return refuse("needs the same two directions in both sections".into());
        }
        let layout = Layout::new(&rig, assume_odd_motion);
        Ok(Self { rig, layout, second_order, pairs, sensors_reversed, assume_odd_motion })
    }

    /// Rows of H_a, H_b, X, Y, E_x, E_y at one order: sums and differences of the two setups.
    fn closed_form(&self, order: usize) -> Vec<Complex64> {
        let layout = &self.layout;
        let mut operator = vec![Complex64::ZERO; layout.unknowns.len() * 8];
        // Motion in the second setup counts with this sign where form counts +1.
        let second = |sensor: usize| {
            let phases = layout.part_phase(&layout.readings[sensor], order).conj()
                * layout.part_phase(&layout.readings[4 + sensor], order);
            // Real and of size 1: +1 with the sensors reversed, (−1)ⁿ without.
            phases.re.signum()
        };
        let row = |quantity: Quantity| layout.unknowns.iter().position(|unknown| *unknown == quantity).unwrap_or(0) * 8;
        for (section, pair) in self.pairs.iter().enumerate() {
            for sensor in *pair {
                let phase = layout.part_phase(&layout.readings[sensor], order).conj();
                // Form is half the sum of both setups, the mean of what the section's two sensors say.
                let form = row(Quantity::Form(section));
                operator[form + sensor] = phase * 0.25;
                operator[form + 4 + sensor] = phase * 0.25 * second(sensor);
            }
        }
        let (sine, cosine) = layout.readings[self.pairs[0][0]].angle_rad.sin_cos();
        for (direction, along) in [[cosine, sine], [-sine, cosine]].into_iter().enumerate() {
            let [near, far] = self.pairs.map(|pair| pair[direction]);
            let [near_mm, far_mm] = [near, far].map(|sensor| layout.readings[sensor].lever_mm);
            let distance_mm = far_mm - near_mm;
            // Motion m along a direction is half the difference of both setups. With m = shift + z·tilt in each
            // section, tilt = (m_b − m_a)/L and shift = (z_b m_a − z_a m_b)/L.
            for (sensor, shift, tilt) in [(near, far_mm, -1.0), (far, -near_mm, 1.0)] {
                let shift = 0.5 * shift / distance_mm;
                let tilt = 0.5 * tilt / (distance_mm * UM_PER_MM_URAD);
                for (quantity, share) in [
                    (Quantity::X, shift * along[0]),
                    (Quantity::Y, shift * along[1]),
                    (Quantity::TiltY, tilt * along[0]),
                    (Quantity::TiltX, -tilt * along[1]),
                ] {
                    operator[row(quantity) + sensor] += share;
                    operator[row(quantity) + 4 + sensor] -= share * second(sensor);
                }
            }
        }
        operator
    }

    fn operators(&self, readings: &Readings) -> Operators {
        // Order 1 follows the 1/rev rule, which is the general separator's.
        let general = operators(&self.layout, &Readings { max_order: 1, ..readings.clone() }, Weighting::None);
        let mut orders = general.orders;
        for order in 2..=readings.max_order {
            let qr = self.layout.factor(order);
            let lost = !self.sensors_reversed && !self.assume_odd_motion && order.is_multiple_of(2);
            // What is left of a lost order is still a residual: any least-squares solution shows it.
            let operator = if lost { qr.operator(None) } else { self.closed_form(order) };
            orders.push(OrderOperator { operator, rank: qr.rank() });
        }
        let observable = (1..=readings.max_order).map(|order| self.layout.observable(order)).collect();
        Operators { orders, observable, weights: None }
    }
}

impl StationSeparator for FourSensorReversal {
    fn assess(&self, max_order: usize) -> std::result::Result<Assessment, Fault> {
        let mut assessment = self.layout.assess(max_order);
        if self.assume_odd_motion {
            assessment.notes.push(
                "assume_odd_motion: the paper's equation (7) takes motion after half a turn for the negative, which \
                 holds for odd orders only; even-order motion goes into form, and shows only in the residual"
                    .into(),
            );
        } else if !self.sensors_reversed {
            assessment.notes.push(
                "the sensors stay while the part is reversed: even orders of form and motion are the same in every \
                 reading and are lost; reverse the sensors too, or add a setup at another part angle"
                    .into(),
            );
        }
        Ok(assessment)
    }

    fn separate(&self, station: &Station) -> Result<Separation> {
        let solver = Solver { rig: &self.rig, layout: &self.layout, second_order: self.second_order };
        solver.separate(station, |readings| self.operators(readings))
    }
}

fn same_angle(angle_rad: f64, other_rad: f64) -> bool {
    let difference = (angle_rad - other_rad).rem_euclid(TAU);
    difference.min(TAU - difference) < ANGLE_TOLERANCE_RAD
}
