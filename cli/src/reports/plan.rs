//! What `runout plan` says.

use std::path::PathBuf;

use runout_core::{closed_loop::foresight::Foresight, rig::Rig, stage::PointPlan};
use runout_spindle::plan::{self, Addition, Change, Optimum, Suggestion};
use schemars::JsonSchema;
use serde::Serialize;

use super::check::{Order, RigSize, Separability};
use crate::args::{Criterion, PlanArgs};

/// What a rig can separate and how well, what to add to it, and better angles for its sensors.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Report {
    /// The rig in numbers.
    pub rig: RigSize,
    /// Unknowns, lost orders, and each order with its rank and the noise gain of every unknown.
    #[serde(flatten)]
    pub separability: Separability,
    /// Noise gain by order.
    pub noise_gain: NoiseGain,
    /// Readings (complex) that are left over for a residual, by order.
    pub residual_dof: Vec<ResidualDof>,
    /// Effects that would show, be blind or confounded.
    #[serde(flatten)]
    pub foresight: Foresight,
    /// What to add to the rig, best for form first: the best setup of each kind, the best sensor in each section, and the
    /// cheapest addition for each effect that is blind or confounded.
    pub suggestions: Vec<Suggested>,
    /// What stays blind or confounded with every single addition that was tried.
    pub unresolved: Unresolved,
    /// What to know of axial sensors and of forms that are declared.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// Better angles, where they were asked for.
    pub optimised: Option<Optimised>,
    /// The map that was written.
    pub map: Option<PathBuf>,
}

/// Noise gain by order.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct NoiseGain {
    /// Of form, each order's worst over the sections.
    pub form: Vec<Gain>,
}

/// Noise gain at an order.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Gain {
    /// Undulations per revolution.
    pub order: usize,
    /// Standard deviation for 1 in every reading; null where it is lost.
    pub gain: Option<f64>,
}

/// What is left over at an order.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct ResidualDof {
    /// Undulations per revolution.
    pub order: usize,
    /// Readings (complex) less the rank.
    pub dof: usize,
}

/// Noise gain of form over all the orders.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Score {
    /// Orders at which some section's form is lost, or its noise gain is above a million.
    pub lost_form_orders: usize,
    /// Worst noise gain over the other orders; null where there are none.
    pub worst: Option<f64>,
    /// The first order with it.
    pub worst_order: Option<usize>,
    /// Root mean square over the other orders.
    pub rms: Option<f64>,
}

/// What no single addition changes.
#[derive(Debug, Default, Serialize, JsonSchema)]
pub(crate) struct Unresolved {
    /// Blind effects, "effect target".
    pub blind_to: Vec<String>,
    /// Confounded sets.
    pub confounded: Vec<Vec<String>>,
}

/// Something to add to the rig.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Suggested {
    /// "setup" or "sensor".
    pub add: &'static str,
    /// In words.
    pub text: String,
    /// Of a setup: how the part is clamped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub part_deg: Option<f64>,
    /// Of a setup: by how much the sensors are moved.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensors_deg: Option<f64>,
    /// Of a sensor: the section that it measures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub section: Option<String>,
    /// Of a sensor: its angle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f64>,
    /// Blind effects, "effect target", that would show with this.
    pub reveals: Vec<String>,
    /// Confounded sets that would be distinguished.
    pub distinguishes: Vec<Vec<String>>,
    /// The rig as it is.
    pub before: Score,
    /// The rig with this.
    pub after: Score,
}

/// Better angles.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Optimised {
    /// "worst" or "rms".
    pub criterion: &'static str,
    /// Smallest angle between two sensors of one section.
    pub clearance_deg: f64,
    /// Largest deviation of each sensor from its nominal angle.
    pub angle_tolerance_deg: f64,
    /// Seed of the search.
    pub seed: u64,
    /// Ids of the radial sensors, in the order of all `angles_deg`.
    pub sensors: Vec<String>,
    /// The rig's own angles.
    pub declared: Arrangement,
    /// Whether they keep the clearance.
    pub declared_keeps_clearance: bool,
    /// The best and alternatives to it, best first; none a mirror image or a rotation of another. Only what is better
    /// than the rig's own, unless that breaks the clearance.
    pub found: Vec<Arrangement>,
}

/// Angles of the sensors and what they give.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Arrangement {
    /// By sensor.
    pub angles_deg: Vec<f64>,
    /// With every sensor at its nominal angle.
    pub nominal: Score,
    /// The worst of the placements within the angle tolerance.
    pub within_tolerance: Score,
}

/// What is observable with a layout of measured points and how well, and what to add to it.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct PointReport {
    /// The pipeline's title.
    pub title: String,
    /// Its separator.
    pub separator: String,
    /// What the separator says.
    #[serde(flatten)]
    pub plan: PointPlan,
}

/// An addition in words.
pub(crate) fn words(addition: &Addition, rig: &Rig) -> String {
    match addition {
        Addition::Setup { part_deg, sensors_turned: false } => format!("a setup, part at {part_deg}°, sensors fixed"),
        Addition::Setup { part_deg, sensors_turned: true } => {
            format!("a setup, part at {part_deg}°, sensors turned by 180°")
        }
        Addition::Sensor { section, angle_deg } => {
            let section = rig.sections.get(*section).map_or("", String::as_str);
            format!("a sensor at {angle_deg}° in section {section}")
        }
    }
}

/// Noise gain of form by order, the worst over the sections.
pub(crate) fn form_gains(separability: &Separability) -> Vec<Gain> {
    let gain = |order: &Order| {
        let forms =
            separability.unknowns.iter().zip(&order.noise_gain).filter(|(unknown, _)| unknown.quantity == "form");
        let gain = forms.map(|(_, gain)| *gain).try_fold(0.0, |worst: f64, gain| Some(worst.max(gain?)));
        Gain { order: order.order, gain }
    };
    separability.orders.iter().map(gain).collect()
}

impl Report {
    /// Without suggestions yet.
    pub(crate) fn new(rig: &Rig, separability: Separability, foresight: Foresight) -> Self {
        let dof = |order: &Order| ResidualDof { order: order.order, dof: order.residual_dof };
        Self {
            rig: RigSize::from(rig),
            noise_gain: NoiseGain { form: form_gains(&separability) },
            residual_dof: separability.orders.iter().map(dof).collect(),
            separability,
            foresight,
            suggestions: Vec::new(),
            unresolved: Unresolved::default(),
            notes: Vec::new(),
            optimised: None,
            map: None,
        }
    }
}

impl Suggested {
    pub(crate) fn new(found: &Suggestion, change: Option<&Change>, rig: &Rig, before: plan::Score) -> Self {
        let setup = found.rig.setups.last().filter(|_| matches!(found.addition, Addition::Setup { .. }));
        let (add, part_deg, section, angle_deg) = match found.addition {
            Addition::Setup { part_deg, .. } => ("setup", Some(part_deg), None, None),
            Addition::Sensor { section, angle_deg } => {
                ("sensor", None, rig.sections.get(section).cloned(), Some(angle_deg))
            }
        };
        Self {
            add,
            text: words(&found.addition, rig),
            part_deg,
            sensors_deg: setup.map(|setup| degrees(setup.sensors_rad)),
            section,
            angle_deg,
            reveals: change.map(|change| change.reveals.clone()).unwrap_or_default(),
            distinguishes: change.map(|change| change.distinguishes.clone()).unwrap_or_default(),
            before: before.into(),
            after: found.after.into(),
        }
    }
}

impl Optimised {
    pub(crate) fn new(optimum: &Optimum, rig: &Rig, args: &PlanArgs) -> Self {
        Self {
            criterion: match args.criterion {
                Criterion::Worst => "worst",
                Criterion::Rms => "rms",
            },
            clearance_deg: args.clearance,
            angle_tolerance_deg: args.angle_tolerance,
            seed: args.seed,
            sensors: rig.sensors.iter().map(|sensor| sensor.id.clone()).collect(),
            declared: (&optimum.declared).into(),
            declared_keeps_clearance: optimum.declared_keeps_clearance,
            found: optimum.found.iter().map(Arrangement::from).collect(),
        }
    }
}

impl From<&plan::Arrangement> for Arrangement {
    fn from(arrangement: &plan::Arrangement) -> Self {
        Self {
            angles_deg: arrangement.angles_deg.clone(),
            nominal: arrangement.nominal.into(),
            within_tolerance: arrangement.within_tolerance.into(),
        }
    }
}

impl From<plan::Score> for Score {
    fn from(score: plan::Score) -> Self {
        // Noise gains are above 0: 0 is the worst of none.
        let some_observable = score.worst > 0.0;
        Self {
            lost_form_orders: score.lost,
            worst: some_observable.then_some(score.worst),
            worst_order: some_observable.then_some(score.worst_order),
            rms: some_observable.then_some(score.rms),
        }
    }
}

/// Degrees as they stood in the file, before they became radians.
pub(crate) fn degrees(angle_rad: f64) -> f64 {
    (angle_rad.to_degrees() * 1e9).round() / 1e9
}
