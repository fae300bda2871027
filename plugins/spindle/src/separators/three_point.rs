//! Three-point method in closed form.
//!
//! H. Ozono, *On a New Method of Roundness Measurement Based on the Three Points Method*, Proc. ICPE Tokyo (1974) 457;
//! D. J. Whitehouse, J. Phys. E 9 (1976) 531. Weights with Σ c_i cos θ_i = Σ c_i sin θ_i = 0 take the motion out of
//! Σ c_i u_i, which leaves form times the transfer function W_n = Σ c_i e^{inθ_i}. Form carries ‖c‖/|W_n| times the
//! readings' noise: an order near a zero of W_n is lost, by `max_noise_gain`.

use runout_core::{Complex64, rig::Rig, separation::Quantity};

use super::closed_form::{ClosedForm, Method, SectionMotion, add_motion, sections_with};
use crate::layout::Layout;

/// |W_n| relative to ‖c‖ that counts as zero: the layout's rank tolerance.
const POLE: f64 = 1e-9;
/// Weights of three directions of which two coincide, relative to 1.
const NO_TRIANGLE: f64 = 1e-6;

/// Three sensors in each of one or two sections, one setup.
#[derive(Debug, Clone)]
pub struct ThreePoint {
    sections: Vec<Probes>,
}

/// The three sensors of one section.
#[derive(Debug, Clone)]
struct Probes {
    sensors: [usize; 3],
    /// c, from the angles.
    weights: [f64; 3],
}

impl Probes {
    fn new(rig: &Rig, sensors: [usize; 3]) -> Self {
        let [a, b, c] = sensors.map(|sensor| rig.sensors[sensor].angle_rad);
        Self { sensors, weights: [(c - b).sin(), (a - c).sin(), (b - a).sin()] }
    }

    /// How many of the sensors the weights use: 2 where two others are opposite or the same.
    fn used(&self) -> usize {
        self.weights.iter().filter(|weight| weight.abs() > NO_TRIANGLE).count()
    }

    fn norm(&self) -> f64 {
        self.weights.iter().map(|weight| weight * weight).sum::<f64>().sqrt()
    }

    /// The two sensors nearest to a right angle: they measure motion best.
    fn squarest(&self) -> [usize; 2] {
        let opposite = (0..3).max_by(|a, b| self.weights[*a].abs().total_cmp(&self.weights[*b].abs())).unwrap_or(0);
        [(opposite + 1) % 3, (opposite + 2) % 3]
    }
}

impl Method for ThreePoint {
    const NAME: &'static str = "three-point";
    const ABOUT: &'static str = "three sensors around each of one or two sections, one setup";
    const MAX_NOISE_GAIN: f64 = 30.0;

    fn choose(rig: &Rig) -> (Vec<usize>, Vec<usize>) {
        let mut sensors: Vec<usize> = Vec::new();
        for section in sections_with(rig, 3) {
            let triples = (2..section.len()).flat_map(|c| (1..c).flat_map(move |b| (0..b).map(move |a| [a, b, c])));
            let probes = triples.map(|triple| Probes::new(rig, triple.map(|index| section[index])));
            // The first triple that uses all of its sensors.
            let best = probes.reduce(|best, next| if next.used() > best.used() { next } else { best });
            sensors.extend(best.into_iter().flat_map(|probes| probes.sensors));
        }
        if sensors.is_empty() {
            sensors = (0..rig.sensors.len()).collect();
        }
        sensors.sort_unstable();
        (sensors, vec![0])
    }

    fn new(rig: &Rig) -> Result<Self, String> {
        if rig.setups.len() != 1 {
            return Err(format!("needs 1 setup; {} are given", rig.setups.len()));
        }
        let sections: Vec<Probes> = (sections_with(rig, 3).into_iter())
            .filter_map(|sensors| <[usize; 3]>::try_from(sensors).ok())
            .map(|sensors| Probes::new(rig, sensors))
            .collect();
        if sections.is_empty() || 3 * sections.len() != rig.sensors.len() {
            return Err(format!(
                "needs 3 sensors in each of one or two sections; the rig has {} in {}",
                rig.sensors.len(),
                rig.sections.len()
            ));
        }
        if sections.iter().any(|probes| probes.used() < 2) {
            return Err("needs sensors in three directions; these are along one line".into());
        }
        Ok(Self { sections })
    }
}

impl ClosedForm for ThreePoint {
    fn operator(&self, layout: &Layout, order: usize) -> Option<Vec<Complex64>> {
        let count = layout.readings.len();
        let mut operator = vec![Complex64::ZERO; layout.unknowns.len() * count];
        let [mut along_x, mut along_y] = [Vec::new(), Vec::new()];
        for probes in &self.sections {
            let readings = probes.sensors.map(|sensor| &layout.readings[sensor]);
            let phases = readings.map(|reading| layout.part_phase(reading, order));
            let transfer: Complex64 = phases.iter().zip(probes.weights).map(|(phase, weight)| phase * weight).sum();
            if transfer.norm() <= POLE * probes.norm() {
                return None;
            }
            let mut form = vec![Complex64::ZERO; count];
            for (sensor, weight) in probes.sensors.iter().zip(probes.weights) {
                form[*sensor] = weight / transfer;
            }
            // What form leaves of a reading is motion along its sensor; two of them make x and y.
            let motion = |probe: usize| -> Vec<Complex64> {
                let mut row: Vec<Complex64> = form.iter().map(|share| -phases[probe] * share).collect();
                row[probes.sensors[probe]] += 1.0;
                row
            };
            let [first, second] = probes.squarest();
            let rows = [motion(first), motion(second)];
            let angles = [first, second].map(|probe| readings[probe].angle_rad);
            let across = (angles[1] - angles[0]).sin();
            let combine =
                |a: f64, b: f64| rows[0].iter().zip(&rows[1]).map(|(p, q)| (p * a + q * b) / across).collect();
            let lever_mm = readings[0].lever_mm;
            along_x.push(SectionMotion { lever_mm, row: combine(angles[1].sin(), -angles[0].sin()) });
            along_y.push(SectionMotion { lever_mm, row: combine(-angles[1].cos(), angles[0].cos()) });
            let unknown = layout.unknowns.iter().position(|known| *known == Quantity::Form(readings[0].section))?;
            operator[unknown * count..(unknown + 1) * count].copy_from_slice(&form);
        }
        add_motion(&mut operator, layout, [1.0, 0.0], &along_x);
        add_motion(&mut operator, layout, [0.0, 1.0], &along_y);
        Some(operator)
    }

    fn notes(&self) -> Vec<String> {
        vec!["one clamping: 1/rev motion cannot be distinguished from eccentricity".into()]
    }
}
