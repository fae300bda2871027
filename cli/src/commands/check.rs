//! `runout check`: everything that can be said without the data.

use runout_core::{
    azimuth::Azimuth,
    mains,
    model::{diagnosis, foresight::Foresight},
    pipeline::{
        Pipeline, Registry,
        config::Route,
        document::{Document, Sources},
        effects::EffectCatalogue,
        run::LostOrders,
    },
    points::PointColumn,
    rig::{Rig, Rotation},
    separation::{Assessment, OrderAssessment, Quantity},
    stage::{Planned, PointSeparator, Source, check},
};
use schemars::JsonSchema;
use serde::Serialize;
use toml::{Spanned, de::DeValue};

use super::{pipeline, print};
use crate::{args::PipelineArgs, failure::Failure, render};

/// What can be said without the data.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Report {
    /// The pipeline's title.
    pub title: String,
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
    /// The tables of the result, also those that it may lack.
    pub tables: Vec<String>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// What can be said of measured points.
#[derive(Debug, Serialize, JsonSchema)]
pub struct OfPoints {
    /// Orders that cannot be separated, by what they are of.
    pub lost_orders: diagnosis::LostOrders,
}

/// A column of measured points.
#[derive(Debug, Serialize, JsonSchema)]
pub struct TakenColumn {
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
pub struct Stage {
    /// The table's key: "load", "preprocess", "separate", "export", "check".
    pub stage: &'static str,
    /// The plugin's name.
    pub plugin: String,
}

/// A rig in numbers.
#[derive(Debug, Serialize, JsonSchema)]
pub struct RigSize {
    /// Displacement sensors.
    pub sensors: usize,
    /// Circles of the part that they look at.
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
pub struct Separability {
    /// What is solved for, per order.
    pub unknowns: Vec<Unknown>,
    /// Orders that cannot be separated.
    pub lost_orders: LostOrders,
    /// One entry an order, ascending.
    pub orders: Vec<Order>,
}

/// Something that is solved for.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Unknown {
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
pub struct Order {
    /// Undulations per revolution.
    pub order: usize,
    /// Rank of the layout's matrix.
    pub rank: usize,
    /// Readings (complex) that are left over for a residual.
    pub residual_dof: usize,
    /// Whether each of `unknowns` can be told.
    pub observable: Vec<bool>,
    /// Standard deviation of each of `unknowns`, in its unit, for 1 µm in every reading; null where it cannot be told.
    pub noise_gain: Vec<Option<f64>>,
    /// Why something cannot be told.
    pub lost_because: Option<String>,
}

impl Unknown {
    /// "form a", "tilt_x".
    #[must_use]
    pub fn name(&self) -> String {
        match (&self.section, self.along_deg) {
            (Some(section), _) => format!("{} {section}", self.quantity),
            (None, Some(along_deg)) => format!("{} {along_deg}°", self.quantity),
            (None, None) => self.quantity.to_owned(),
        }
    }
}

/// Checks a pipeline and says what it can do.
///
/// # Errors
/// When the configuration is wrong.
pub fn execute(args: &PipelineArgs, json: bool, registry: &Registry) -> Result<(), Failure> {
    let (sources, pipeline) = pipeline(args, registry)?;
    let report = report(&sources, &pipeline, &registry.effects)?;
    print(&report, json, render::check::text)
}

/// What can be said of a pipeline.
///
/// # Errors
/// When a check of it fails.
pub fn report(sources: &Sources, pipeline: &Pipeline, effects: &EffectCatalogue) -> Result<Report, Failure> {
    let mut notes = pipeline.assessment.as_ref().map(|assessment| assessment.notes.clone()).unwrap_or_default();
    notes.extend(pipeline.rig.as_ref().map(Rig::remarks).unwrap_or_default());
    let source = pipeline.loader.open(&pipeline.request());
    match &source {
        Ok(Source::Points(points)) => notes.extend(points.remarks.iter().cloned()),
        Ok(Source::Turns(recording)) => {
            let setups = pipeline.rig.as_ref().map_or(0, |rig| rig.setups.len());
            notes.extend(mains::whole_orders(&check::speeds_and_turns(&**recording, setups)));
        }
        Err(error) => notes.push(format!("the data are not there yet, or cannot be used: {error}")),
    }
    if !pipeline.checks.is_empty() {
        let speeds_rpm = match &source {
            Ok(Source::Turns(recording)) => {
                check::speeds_of(&**recording, pipeline.rig.as_ref().map_or(0, |rig| rig.setups.len()))
            }
            _ => Vec::new(),
        };
        for check in &pipeline.checks {
            notes.extend(check.notes(&Planned { speeds_rpm: &speeds_rpm })?);
        }
    }
    notes.extend(pipeline.route.point_separator().map(PointSeparator::notes).unwrap_or_default());
    if pipeline.exporters.is_empty() {
        notes.push("there is no [[export]]: a run would only print its summary".into());
    }
    let separator = pipeline.route.point_separator();
    let foresight = match &pipeline.route {
        Route::Turns { separator, .. } => separator.foresee(effects).transpose()?,
        Route::Points { .. } => None,
    };
    Ok(Report {
        title: pipeline.title.clone(),
        stages: stages(sources)?,
        rig: pipeline.rig.as_ref().map(RigSize::from),
        separability: pipeline.assessment.as_ref().map(|found| Separability::new(found, pipeline.rig.as_ref())),
        of_points: separator.and_then(PointSeparator::lost_orders).map(|lost_orders| OfPoints { lost_orders }),
        foresight,
        columns: pipeline.request().columns.iter().map(TakenColumn::from).collect(),
        tables: pipeline.tables.iter().map(|table| table.name.clone()).collect(),
        notes,
    })
}

fn stages(sources: &Sources) -> Result<Vec<Stage>, Failure> {
    let document = Document::parse(sources)?;
    let root = document.root().get_ref();
    let mut stages = Vec::new();
    for stage in ["load", "preprocess", "separate", "export", "check"] {
        let name = |table: &DeValue| Some(table.get("plugin")?.get_ref().as_str()?.to_owned());
        let names: Vec<String> = match root.get(stage).map(Spanned::get_ref) {
            Some(DeValue::Array(tables)) => tables.iter().filter_map(|table| name(table.get_ref())).collect(),
            Some(table) => name(table).into_iter().collect(),
            None => Vec::new(),
        };
        stages.extend(names.into_iter().map(|plugin| Stage { stage, plugin }));
    }
    Ok(stages)
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
    pub(super) fn new(assessment: &Assessment, rig: Option<&Rig>) -> Self {
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
