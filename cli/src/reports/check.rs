//! What `runout check` says.

use runout_core::{
    azimuth::Azimuth,
    closed_loop::{diagnosis, foresight::Foresight},
    points::PointColumn,
    rig::{Rig, Rotation},
    separation::{Assessment, OrderAssessment, Quantity},
    summary::LostOrders,
};
use schemars::JsonSchema;
use serde::Serialize;

/// What can be said without the data.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Report {
    /// The pipeline's title.
    pub title: String,
    /// Whether the data are there and can be used.
    pub data: Data,
    /// The plugins in the order in which data meet them.
    pub stages: Vec<Stage>,
    /// The rig in numbers, where there is one.
    pub rig: Option<RigSize>,
    /// What the rig can and cannot separate; absent for measured points.
    #[serde(flatten)]
    pub separability: Option<Separability>,
    /// Orders that measured points would not separate; absent where their domain has none.
    #[serde(flatten)]
    pub of_points: Option<OfPoints>,
    /// Effects that the closed loop would show, be blind to or confound; absent where there is no model of effects.
    #[serde(flatten)]
    pub foresight: Option<Foresight>,
    /// The columns that the separator takes of measured points.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub columns: Vec<TakenColumn>,
    /// What the separator offers that the standards' values are computed from: "closed-profiles", "axis-motion", "turn-spread",
    /// "open-profile", "height-map".
    pub evaluables: Vec<&'static str>,
    /// The tables of the result, also those that it may lack.
    pub tables: Vec<String>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// The data that the pipeline names: names of sensors, setups and columns are compared with it, and marks are counted.
#[derive(Debug, Serialize, JsonSchema)]
#[serde(tag = "state", rename_all = "kebab-case")]
pub(crate) enum Data {
    /// They are there and hold what is wanted.
    Usable {
        /// How much there is.
        about: String,
    },
    /// There is no such file yet.
    Missing {
        /// Which.
        about: String,
    },
    /// They are there and cannot be used: the command ends with an error.
    Unusable {
        /// Why not.
        about: String,
    },
}

/// What can be said of measured points.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct OfPoints {
    /// Orders that cannot be separated, by what they are of.
    pub lost_orders: diagnosis::LostOrders,
}

/// A column of measured points.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct TakenColumn {
    /// Its name.
    pub name: &'static str,
    /// Its unit; empty for what has none.
    pub unit: &'static str,
    /// What it is.
    pub about: &'static str,
    /// Whether points may lack it.
    pub optional: bool,
}

/// A plugin in its place.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Stage {
    /// The table's key: "load", "preprocess", "separate", "evaluator", "export", "effect", "check".
    pub stage: &'static str,
    /// The plugin's name.
    pub plugin: String,
}

/// A rig in numbers.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct RigSize {
    /// Displacement sensors.
    pub sensors: usize,
    /// Circles of the part that they measure.
    pub sections: usize,
    /// Setups.
    pub setups: usize,
    /// Nominal radius of the part, in mm.
    pub part_radius_mm: f64,
    /// "ccw" or "cw", seen against +z.
    pub rotation: Rotation,
}

/// What a rig can and cannot separate.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Separability {
    /// What is solved for, per order.
    pub unknowns: Vec<Unknown>,
    /// Orders that cannot be separated.
    pub lost_orders: LostOrders,
    /// One entry an order, ascending.
    pub orders: Vec<Order>,
}

/// Something that is solved for.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Unknown {
    /// "form", "x", "y", "tilt_x", "tilt_y", "along", "tilt_along".
    pub quantity: &'static str,
    /// The section whose form it is; absent for motion.
    pub section: Option<String>,
    /// The line of "along" and "tilt_along": its angle from x towards y, in degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub along_deg: Option<f64>,
    /// "um" or "urad".
    pub unit: &'static str,
}

/// One order.
#[derive(Debug, Serialize, JsonSchema)]
#[allow(clippy::struct_field_names, reason = "the number of an order is what the standards call its order")]
pub(crate) struct Order {
    /// Undulations per revolution.
    pub order: usize,
    /// Rank of the layout's matrix.
    pub rank: usize,
    /// Readings (complex) that are left over for a residual.
    pub residual_dof: usize,
    /// Whether each of `unknowns` is observable.
    pub observable: Vec<bool>,
    /// Standard deviation of each of `unknowns`, in its unit, for 1 µm in every reading; null where it is not observable.
    pub noise_gain: Vec<Option<f64>>,
    /// Why something is not observable.
    pub lost_because: Option<String>,
}

impl Unknown {
    /// "form a", "tilt_x".
    #[must_use]
    pub(crate) fn name(&self) -> String {
        match (&self.section, self.along_deg) {
            (Some(section), _) => format!("{} {section}", self.quantity),
            (None, Some(along_deg)) => format!("{} {along_deg}°", self.quantity),
            (None, None) => self.quantity.to_owned(),
        }
    }
}

impl From<&PointColumn> for TakenColumn {
    fn from(column: &PointColumn) -> Self {
        let PointColumn { name, unit, about, optional, .. } = *column;
        Self { name, unit, about, optional }
    }
}

impl From<&Rig> for RigSize {
    fn from(rig: &Rig) -> Self {
        Self {
            sensors: rig.sensors.len(),
            sections: rig.sections.len(),
            setups: rig.setups.len(),
            part_radius_mm: rig.part_radius_mm,
            rotation: rig.rotation,
        }
    }
}

impl Separability {
    /// Of a rig whose layout was assessed.
    pub(crate) fn new(assessment: &Assessment, rig: Option<&Rig>) -> Self {
        let unknown = |quantity: &Quantity| Unknown {
            quantity: quantity.id(),
            section: quantity.section().and_then(|section| rig?.sections.get(section).cloned()),
            along_deg: quantity.azimuth().map(Azimuth::degrees),
            unit: quantity.unit(),
        };
        Self {
            unknowns: assessment.unknowns.iter().map(unknown).collect(),
            lost_orders: assessment.into(),
            orders: assessment.orders.iter().map(Order::from).collect(),
        }
    }
}

impl From<&OrderAssessment> for Order {
    fn from(order: &OrderAssessment) -> Self {
        Self {
            order: order.order,
            rank: order.rank,
            residual_dof: order.residual_dof,
            observable: order.observable.clone(),
            noise_gain: order.noise_gain.iter().map(|gain| gain.is_finite().then_some(*gain)).collect(),
            lost_because: order.lost_because.clone(),
        }
    }
}
