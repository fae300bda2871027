//! `runout check`: everything that can be said without the data.

use runout_core::{
    effects::EffectCatalogue,
    mains,
    pipeline::{
        Pipeline, Registry, Route,
        document::{Document, Sources},
    },
    rig::Rig,
    stage::{EvaluableKind, Planned, PointSeparator, Source, captures_sampled, speeds_of},
};
use toml::{Spanned, de::DeValue};

use super::{pipeline, print};
use crate::{
    args::PipelineArgs,
    failure::Failure,
    render,
    reports::check::{OfPoints, Report, RigSize, Separability, Stage, TakenColumn},
};

/// Checks a pipeline and says what it can do.
///
/// # Errors
/// When the configuration is wrong.
pub(crate) fn execute(args: &PipelineArgs, json: bool, registry: &Registry) -> Result<(), Failure> {
    let (sources, pipeline) = pipeline(args, registry)?;
    let report = report(&sources, &pipeline, &registry.effects)?;
    print(&report, json, render::check::text)
}

/// What can be said of a pipeline.
///
/// # Errors
/// When a check of it fails.
pub(crate) fn report(sources: &Sources, pipeline: &Pipeline, effects: &EffectCatalogue) -> Result<Report, Failure> {
    let mut notes = pipeline.assessment.as_ref().map(|assessment| assessment.notes.clone()).unwrap_or_default();
    notes.extend(pipeline.rig.as_ref().map(Rig::remarks).unwrap_or_default());
    let source = pipeline.loader.open(&pipeline.request());
    match &source {
        Ok(Source::Points(points)) => notes.extend(points.remarks.iter().cloned()),
        Ok(Source::Turns(recording)) => {
            let setups = pipeline.rig.as_ref().map_or(0, |rig| rig.setups.len());
            notes.extend(mains::whole_orders(&captures_sampled(&**recording, setups)));
        }
        Err(error) => notes.push(format!("the data are not there yet, or cannot be used: {error}")),
    }
    if !pipeline.checks.is_empty() {
        let speeds_rpm = match &source {
            Ok(Source::Turns(recording)) => {
                speeds_of(&**recording, pipeline.rig.as_ref().map_or(0, |rig| rig.setups.len()))
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
        evaluables: pipeline.route.evaluables().into_iter().map(EvaluableKind::name).collect(),
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
