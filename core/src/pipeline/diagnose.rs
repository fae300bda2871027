//! The closed loop on a pipeline: load → fit → find what the model lacks → export the final model.

pub mod config;

use std::num::NonZeroUsize;

use super::{
    config::{Pipeline, Route},
    evaluate::Evaluate,
    line::Line,
    result::{Evaluation, RunInfo, complete, true_error},
    run::{Gathering, Observer, spare_inputs, take_sections},
};
use crate::{
    Error, Result,
    atomic_file::{PendingFile, commit_all},
    model::{
        closed_loop,
        diagnosis::{Diagnosis, Step, Truth},
    },
    points::Points,
    provenance::Input,
    separation::Quantity,
    stage::{Conclusion, PointModel, Source, Station, StationModel},
};

/// Runs the closed loop and writes `diagnosis.json`, and the exports of the final model where it has a form.
///
/// # Errors
/// When the data or a file fails, or the separator has no model for the loop. Exports that had begun leave nothing behind.
pub fn diagnose(pipeline: &Pipeline, threads: Option<NonZeroUsize>, observer: &dyn Observer) -> Result<Diagnosis> {
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
        (Source::Turns(recording), Route::Turns { conditioners, averager, model: Some(model), .. }) => {
            let rig = pipeline.rig.as_ref().ok_or_else(|| no_model(&pipeline.separator))?;
            let hold_out = Some(pipeline.diagnose.hold_out.unwrap_or(HOLD_OUT));
            let line = Line {
                rig,
                recording: &**recording,
                conditioners,
                averager: &**averager,
                hold_out,
                projections: Vec::new(),
            };
            diagnose_turns(pipeline, &line, threads, &**model, observer)
        }
        _ => Err(no_model(&pipeline.separator)),
    }
}

/// Share of the turns that is held out where the pipeline says nothing.
const HOLD_OUT: f64 = 0.2;

fn diagnose_turns(
    pipeline: &Pipeline,
    line: &Line,
    threads: Option<NonZeroUsize>,
    model: &dyn StationModel,
    observer: &dyn Observer,
) -> Result<Diagnosis> {
    let recording = line.recording;
    let outputs: Vec<_> = pipeline.outputs().into_iter().chain(pipeline.diagnosis_path()).collect();
    spare_inputs(&outputs, &recording.inputs())?;
    let mut stations: Vec<Station> = Vec::new();
    let inputs = line.run(
        threads,
        observer,
        |_, station| Ok(station),
        |station| {
            stations.push(station);
            Ok(())
        },
    )?;
    let found = model.diagnose(&stations, &pipeline.diagnose.settings)?;
    let mut diagnosis = found.diagnosis;
    let info = RunInfo::of(pipeline, recording.stations());
    let mut gathering = Gathering::begin(pipeline, &info)?;
    let mut errors = [Vec::new(), Vec::new()];
    let nothing = Evaluate::nothing();
    for (index, (station, (before, after))) in
        stations.into_iter().zip(found.before.into_iter().zip(found.after)).enumerate()
    {
        let angles = station.profiles.first().map_or(0, |profile| profile.samples_per_rev);
        let truth = recording.truth(index)?;
        let complete = |separation, profiles, evaluate| {
            let evaluation = Evaluation { evaluate, radius_mm: line.rig.part_radius_mm, rig: Some(line.rig) };
            complete(station.name.clone(), station.z_mm, angles, separation, profiles, truth.clone(), evaluation)
        };
        let declared = complete(before, Vec::new(), &nothing);
        let result = complete(after, station.profiles, &pipeline.evaluate);
        for (errors, result) in errors.iter_mut().zip([&declared, &result]) {
            let forms = (0..result.separation.sections.len()).map(Quantity::Form);
            errors.extend(forms.filter_map(|form| true_error(result, form)));
        }
        gathering.take(&result, pipeline.rig.as_ref())?;
    }
    let rms = |errors: &Vec<f64>| {
        let squares: f64 = errors.iter().map(|error| error * error).sum();
        (!errors.is_empty()).then(|| (squares / errors.len() as f64).sqrt())
    };
    if !errors[0].is_empty() {
        diagnosis.truth = Some(Truth { form_rms_error_um: Step { before: rms(&errors[0]), after: rms(&errors[1]) } });
    }
    let written = pipeline.diagnosis_path().map(|path| pending(path, &diagnosis)).transpose()?;
    let surface = gathering.build_surface(line.rig.part_radius_mm)?;
    let mut remarks = recording.remarks();
    remarks.extend(diagnosis.warnings.iter().cloned());
    gathering.conclude(inputs, remarks, surface.as_ref(), written)?;
    Ok(diagnosis)
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
    let settings = closed_loop::Settings { max_added: MOST_ADDED, ..pipeline.diagnose.settings.clone() };
    let terms = terms.with_known(&settings.known);
    let closed = closed_loop::diagnose(&terms, &settings)?;
    let Conclusion { shape, remarks } = model.conclude(points, &closed.after)?;
    let mut diagnosis = closed.diagnosis;
    diagnosis.warnings.extend(remarks);
    let written = pipeline.diagnosis_path().map(|path| pending(path, &diagnosis)).transpose()?;
    let Some(shape) = shape else {
        commit_all(written.into_iter().collect())?;
        return Ok(diagnosis);
    };
    let info = RunInfo { title: pipeline.title.clone(), ..RunInfo::default() };
    let mut gathering = Gathering::begin(pipeline, &info)?;
    take_sections(shape.sections, pipeline, shape.radius_mm, observer, &mut gathering)?;
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
