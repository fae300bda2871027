//! Which single added setup or sensor helps most.

use std::{
    f64::consts::{PI, TAU},
    ops::RangeInclusive,
};

use runout_core::rig::{Calibration, Rig, Sensor, Setup, Unit};

use super::{
    gain::{Criterion, FormGain, Score},
    spacing::distance_deg,
};

/// Two angles nearer than this are the same, in degrees.
const SAME_DEG: f64 = 1e-6;
/// Multiples of these, in degrees, are round angles, the first more so than the last.
const ROUND_DEG: [usize; 4] = [90, 45, 15, 5];

/// Something that can be added to a rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Addition {
    /// One more clamping of the part.
    Setup {
        /// β, in degrees.
        part_deg: f64,
        /// Whether the sensors are turned by 180° from where they stand in the first setup.
        sensors_turned: bool,
    },
    /// One more sensor.
    Sensor {
        /// Index of the section that it looks at.
        section: usize,
        /// θ, in degrees.
        angle_deg: f64,
    },
}

/// An addition and what it does to the noise gain of form.
#[derive(Debug, Clone, PartialEq)]
pub struct Suggestion {
    /// What to add.
    pub addition: Addition,
    /// The rig with it.
    pub rig: Rig,
    /// How well the rig does with it.
    pub after: Score,
}

/// How well a rig does as it is.
#[must_use]
pub fn score(rig: &Rig, orders: &RangeInclusive<usize>) -> Score {
    FormGain::new(rig).score(&angles_rad(rig), orders)
}

/// The best setup with the sensors fixed, the best with them turned, and the best sensor in each section, best first;
/// without those that help nothing.
#[must_use]
pub fn suggest(rig: &Rig, orders: &RangeInclusive<usize>, clearance_deg: f64) -> Vec<Suggestion> {
    let grid = grid_deg(*orders.end());
    let setups = |sensors_turned| {
        grid.iter().map(|part_deg| Addition::Setup { part_deg: *part_deg, sensors_turned }).collect::<Vec<_>>()
    };
    let sensors = |section| grid.iter().map(|angle_deg| Addition::Sensor { section, angle_deg: *angle_deg }).collect();
    let kinds = [setups(false), setups(true)].into_iter().chain((0..rig.sections.len()).map(sensors));
    let before = score(rig, orders);
    let mut found: Vec<Suggestion> =
        kinds.filter_map(|candidates| best(rig, orders, clearance_deg, before, candidates)).collect();
    found.sort_by(|a, b| a.after.compare(&b.after, Criterion::Worst));
    found
}

/// Angles to try, round ones first: where several do as well as one another, the first is taken, which is easy to set.
///
/// With a grid of M places a turn nothing is observable at orders that are multiples of M, and little beside them.
fn grid_deg(highest_order: usize) -> Vec<f64> {
    let per_deg = match highest_order {
        ..=180 => 1,
        181..=360 => 2,
        _ => 10,
    };
    let mut steps: Vec<usize> = (0..360 * per_deg).collect();
    steps.sort_by_key(|step| ROUND_DEG.iter().filter(|round| !step.is_multiple_of(**round * per_deg)).count());
    steps.into_iter().map(|step| step as f64 / per_deg as f64).collect()
}

fn best(
    rig: &Rig,
    orders: &RangeInclusive<usize>,
    clearance_deg: f64,
    before: Score,
    candidates: Vec<Addition>,
) -> Option<Suggestion> {
    let mut best: Option<Suggestion> = None;
    for addition in candidates {
        let Some(larger) = addition.to(rig, clearance_deg) else { continue };
        let limit = best.as_ref().map_or(before, |best| best.after);
        if let Some(after) = FormGain::new(&larger).better(&angles_rad(&larger), orders, &limit, Criterion::Worst) {
            best = Some(Suggestion { addition, rig: larger, after });
        }
    }
    best
}

impl Addition {
    /// The rig with this added; `None` where the rig has it already or a sensor would break the clearance.
    pub(super) fn to(self, rig: &Rig, clearance_deg: f64) -> Option<Rig> {
        let mut rig = rig.clone();
        match self {
            Self::Setup { part_deg, sensors_turned } => {
                let turned = if sensors_turned { PI } else { 0.0 };
                let sensors_rad = (rig.setups.first()?.sensors_rad + turned).rem_euclid(TAU);
                let same = |a_rad: f64, b_rad: f64| distance_deg(a_rad.to_degrees(), b_rad.to_degrees()) < SAME_DEG;
                let part_rad = part_deg.to_radians();
                if rig.setups.iter().any(|known| same(known.part_rad, part_rad) && same(known.sensors_rad, sensors_rad))
                {
                    return None;
                }
                rig.setups.push(Setup { id: "added".into(), part_rad, sensors_rad, turns_per_mark: 1.0 });
            }
            Self::Sensor { section, angle_deg } => {
                // On the axis there is one place.
                if rig.faces[section] == Some(0.0) {
                    return None;
                }
                let mut neighbours = rig.sensors.iter().filter(|sensor| sensor.section == section);
                let smallest = clearance_deg.max(SAME_DEG) - SAME_DEG / 2.0;
                if neighbours.any(|other| distance_deg(other.angle_rad.to_degrees(), angle_deg) < smallest) {
                    return None;
                }
                let z_mm = rig.section_z_mm(section);
                let id = "added".into();
                let (angle_rad, calibration) = (angle_deg.to_radians(), Calibration::NONE);
                let axial_radius_mm = rig.faces[section];
                let (sign, unit) = (1.0, Unit::default());
                rig.sensors.push(Sensor { id, angle_rad, z_mm, section, axial_radius_mm, sign, unit, calibration });
            }
        }
        Some(rig)
    }
}

fn angles_rad(rig: &Rig) -> Vec<f64> {
    rig.sensors.iter().map(|sensor| sensor.angle_rad).collect()
}
