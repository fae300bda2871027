//! `runout check`: everything that can be said before a run.

use runout_core::{
    Error, ErrorKind, mains,
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
    render::{self, count},
    reports::check::{Data, OfPoints, Report, RigSize, Separability, Stage, TakenColumn},
};

/// Checks a pipeline and says what it can do.
///
/// # Errors
/// When the configuration is wrong, and when the data are there and do not fit it, after the report.
pub(crate) fn execute(args: &PipelineArgs, json: bool, registry: &Registry) -> Result<(), Failure> {
    let (sources, pipeline) = pipeline(args, registry)?;
    let (report, refused) = report(&sources, &pipeline)?;
    print(&report, json, render::check::text)?;
    refused.map_or(Ok(()), |error| Err(error.into()))
}

/// What can be said of a pipeline, and why data that are there cannot be used.
///
/// # Errors
/// When a check of it fails.
pub(crate) fn report(sources: &Sources, pipeline: &Pipeline) -> Result<(Report, Option<Error>), Failure> {
    let mut notes = pipeline.assessment.as_ref().map(|assessment| assessment.notes.clone()).unwrap_or_default();
    notes.extend(pipeline.rig.as_ref().map(Rig::remarks).unwrap_or_default());
    let source = pipeline.loader.open(&pipeline.request());
    match &source {
        Ok(Source::Points(points)) => notes.extend(points.remarks.iter().cloned()),
        Ok(Source::Turns(recording)) => {
            let setups = pipeline.rig.as_ref().map_or(0, |rig| rig.setups.len());
            notes.extend(mains::whole_orders(&captures_sampled(&**recording, setups)));
        }
        Err(_) => {}
    }
    let amount = source.as_ref().map_err(Error::clone).and_then(|source| amount(source, pipeline.rig.as_ref()));
    let (data, refused) = match amount {
        Ok(about) => (Data::Usable { about }, None),
        Err(error) if error.kind() == ErrorKind::MissingFile => (Data::Missing { about: error.to_string() }, None),
        Err(error) => (Data::Unusable { about: error.to_string() }, Some(error)),
    };
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
        Route::Turns { separator, .. } => separator.foresee(&pipeline.effects).transpose()?,
        Route::Points { .. } => None,
    };
    let report = Report {
        title: pipeline.title.clone(),
        data,
        stages: stages(sources)?,
        rig: pipeline.rig.as_ref().map(RigSize::from),
        separability: pipeline.assessment.as_ref().map(|found| Separability::new(found, pipeline.rig.as_ref())),
        of_points: separator.and_then(PointSeparator::lost_orders).map(|lost_orders| OfPoints { lost_orders }),
        foresight,
        columns: pipeline.request().columns.iter().map(TakenColumn::from).collect(),
        evaluables: pipeline.route.evaluables().into_iter().map(EvaluableKind::name).collect(),
        tables: pipeline.tables.iter().map(|table| table.name.clone()).collect(),
        notes,
    };
    Ok((report, refused))
}

/// How much the data hold: points, or stations with the turns of the first one in every setup.
fn amount(source: &Source, rig: Option<&Rig>) -> Result<String, Error> {
    let recording = match source {
        Source::Points(points) => {
            let rows = points.columns.first().map_or(0, |column| column.values.len());
            return Ok(format!("{} with {} columns", count(rows, "point"), points.columns.len() + points.labels.len()));
        }
        Source::Turns(recording) => recording,
    };
    let setups = rig.map_or(&[][..], |rig| &rig.setups);
    let mut turns = Vec::new();
    for (index, setup) in setups.iter().enumerate() {
        let stream = recording.open(0, index)?;
        let capture = stream.capture();
        let Some(whole @ 1..) = capture.marks.len().checked_sub(1) else {
            let found = format!("expected marks of at least one turn, found {}", count(capture.marks.len(), "mark"));
            return Err(Error::new("check", capture.object.clone(), found)
                .of(ErrorKind::InsufficientData)
                .help("the turns are found by the mark or the angle of the loader: see its keys by `runout plugins`"));
        };
        turns.push(format!("{whole} in {}", setup.id));
    }
    let stations = count(recording.stations().len(), "station");
    Ok(format!("{stations}, turns of the first one: {}", turns.join(", ")))
}

fn stages(sources: &Sources) -> Result<Vec<Stage>, Failure> {
    let document = Document::parse(sources)?;
    let root = document.root().get_ref();
    let mut stages = Vec::new();
    for stage in ["load", "preprocess", "separate", "evaluator", "export", "effect", "check"] {
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
