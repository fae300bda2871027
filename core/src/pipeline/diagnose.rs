//! The closed loop on a pipeline: load → fit → find what the model lacks → export the final model.

pub mod config;

use super::{
    config::{Pipeline, Route},
    result::RunInfo,
    run::{Gathering, Observer, spare_inputs, take_sections},
};
use crate::{
    Error, Result,
    atomic_file::{PendingFile, commit_all},
    model::{Model, closed_loop, diagnosis::Diagnosis},
    points::Points,
    provenance::Input,
    stage::{Conclusion, PointModel, Source},
};

/// Runs the closed loop and writes `diagnosis.json`, and the exports of the final model where it has a form.
///
/// # Errors
/// When the data or a file fails, or the separator has no model for the loop. Exports that had begun leave nothing behind.
pub fn diagnose(pipeline: &Pipeline, observer: &dyn Observer) -> Result<Diagnosis> {
    let source = pipeline.loader.open(pipeline.rig.as_ref())?;
    let no_model = |separator: &str| {
        Error::new("diagnose", &pipeline.title, format!("`{separator}` has no model of effects for the closed loop"))
    };
    match (&source, &pipeline.route) {
        (Source::Points(points), Route::Points { separator }) => {
            let model = separator.model().ok_or_else(|| no_model(&pipeline.separator))?;
            diagnose_points(pipeline, points, model, observer)
        }
        (Source::Points(points), Route::Model { model }) => diagnose_points(pipeline, points, &**model, observer),
        // Recorded turns.
        _ => Err(no_model(&pipeline.separator)),
    }
}

/// More than any model of points has effects that earn their place.
const MOST_ADDED: usize = 40;

fn diagnose_points(
    pipeline: &Pipeline,
    points: &Points,
    model: &dyn PointModel,
    observer: &dyn Observer,
) -> Result<Diagnosis> {
    let outputs: Vec<_> = pipeline.outputs().into_iter().chain(pipeline.diagnosis_path()).collect();
    spare_inputs(&outputs, std::slice::from_ref(&points.input))?;
    let terms = model.terms(points)?;
    let settings = pipeline.diagnose.settings(terms.effects())?;
    let terms = terms.with_known(&settings.known);
    let settings = closed_loop::Settings { max_added: MOST_ADDED, ..settings };
    let closed = closed_loop::diagnose(&terms, &settings)?;
    let Conclusion { shape, remarks } = model.conclude(points, &closed.after)?;
    let mut diagnosis = closed.diagnosis;
    diagnosis.warnings.extend(remarks);
    let written = pipeline.diagnosis_path().map(|path| pending(path, &diagnosis)).transpose()?;
    let Some(shape) = shape else {
        commit_all(written.into_iter().collect())?;
        return Ok(diagnosis);
    };
    let info = RunInfo { title: pipeline.title.clone(), rig: None, assessment: None };
    let mut gathering = Gathering::begin(pipeline, &info)?;
    take_sections(shape.sections, pipeline.surface.angles, observer, &mut gathering)?;
    let surface = gathering.build_surface(shape.radius_mm)?;
    gathering.conclude(vec![Input::of(&points.input)?], diagnosis.warnings.clone(), surface.as_ref(), written)?;
    Ok(diagnosis)
}

/// `diagnosis.json`, written and waiting for its name.
fn pending(path: std::path::PathBuf, diagnosis: &Diagnosis) -> Result<PendingFile> {
    let file = PendingFile::new(path)?;
    let text = serde_json::to_vec_pretty(diagnosis).map_err(|error| file.failure(error))?;
    std::fs::write(file.path(), text).map_err(|error| file.failure(error))?;
    Ok(file)
}
