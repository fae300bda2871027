//! The closed loop on a pipeline: load → fit → find what the model lacks → export the final model.

pub mod config;
mod corrected_rig;
mod moved;

use std::{num::NonZeroUsize, path::PathBuf};

use corrected_rig::Change;

use super::{
    config::{Pipeline, Route, summary_path},
    line::Line,
    result::{Evaluation, RunInfo, complete, true_error},
    run::{Finished, Gathering, Observer, begun, spare_inputs, take_sections},
    traces,
};
use crate::{
    Error, Result,
    atomic_file::{PendingFile, commit_all},
    model::{
        Effect, Setting, closed_loop,
        diagnosis::{Correction, Diagnosis, Estimated, Step, Truth},
    },
    points::Points,
    provenance::Input,
    separation::Quantity,
    stage::{Conclusion, PointModel, Source, Station, StationModel, StationSeparator, TraceModel},
    table::Table,
};

/// Runs the closed loop and writes `diagnosis.json`, and the exports of the final model where it has a form. These do not
/// replace those of a run: they go below `diagnosed/`, or where `[diagnose] out` says.
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
        (Source::Points(points), Route::Traces { separator }) => {
            let model = separator.model().ok_or_else(|| no_model(&pipeline.separator))?;
            diagnose_traces(pipeline, points, model)
        }
        (Source::Turns(recording), Route::Turns { conditioners, averager, separator, model: Some(model) }) => {
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
            diagnose_turns(pipeline, &line, threads, (&**separator, &**model), observer)
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
    (separator, model): (&dyn StationSeparator, &dyn StationModel),
    observer: &dyn Observer,
) -> Result<Diagnosis> {
    let recording = line.recording;
    spare_inputs(&pipeline.diagnosed_outputs(), &recording.inputs())?;
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
    let settings = &pipeline.diagnose.settings;
    let found = model.diagnose(&stations, settings)?;
    let mut diagnosis = found.diagnosis;
    diagnosis.moved.clear();
    let info = RunInfo::of(pipeline, recording.stations());
    let mut gathering = Gathering::begin(pipeline, &pipeline.diagnosed, &info)?;
    let known = known(model.effects(), &settings.known, |effect| model.changes(effect, &settings.known));
    let changes = changes(known, &diagnosis);
    gathering.corrected_for(corrections(&changes));
    let rig = pipeline.diagnose.write_rig.clone();
    diagnosis.warnings.extend(rig.as_ref().and_then(|path| corrected_rig::left_out(&changes, path)));
    let mut errors = [Vec::new(), Vec::new()];
    let (radius_mm, several) = (line.rig.part_radius_mm, stations.len() > 1);
    let looked_at = pipeline.evaluate.first_ront();
    for (index, (station, (before, after))) in
        stations.into_iter().zip(found.before.into_iter().zip(found.after)).enumerate()
    {
        // Before is what a run gives, which leaves known effects alone.
        let before = if settings.known.is_empty() { separator.separate(&station)? } else { before };
        let angles = station.profiles.first().map_or(0, |profile| profile.samples_per_rev);
        let truth = recording.truth(index)?;
        let complete = |separation, profiles, evaluate| {
            let evaluation = Evaluation { evaluate, radius_mm, rig: Some(line.rig) };
            complete(station.name.clone(), station.z_mm, angles, separation, profiles, truth.clone(), evaluation)
        };
        let declared = complete(before, Vec::new(), &looked_at);
        let result = complete(after, station.profiles, &pipeline.evaluate);
        diagnosis.moved.extend(moved::moved(&declared, &result, &looked_at, radius_mm, several));
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
    let surface = gathering.build_surface(radius_mm)?;
    let mut remarks = recording.remarks();
    remarks.extend(diagnosis.warnings.iter().cloned());
    let mut finished = gathering.finish(inputs, remarks, surface.as_ref())?;
    if let Some(path) = rig {
        finished.add(corrected_rig::pending(path, pipeline, &changes)?);
    }
    commit(Some(finished), pipeline.diagnosis_path(), diagnosis)
}

/// More than any model of points has effects that earn their place.
const MOST_ADDED: usize = 40;

fn diagnose_points(
    pipeline: &Pipeline,
    points: &Points,
    model: &dyn PointModel,
    observer: &dyn Observer,
) -> Result<Diagnosis> {
    let mut outputs = pipeline.diagnosed_outputs();
    if let Some(name) = model.table() {
        let tables = pipeline.diagnosed.iter().filter_map(|exporter| exporter.tables());
        outputs.extend(tables.map(|tables| tables.table_output(name)));
    }
    spare_inputs(&outputs, std::slice::from_ref(&points.input))?;
    let terms = model.terms(points)?;
    let settings = closed_loop::Settings { max_added: MOST_ADDED, ..pipeline.diagnose.settings.clone() };
    let terms = terms.with_known(&settings.known).considering(settings.effects.as_deref());
    let closed = closed_loop::diagnose(&terms, &settings)?;
    let Conclusion { shape, table, remarks } = model.conclude(points, &closed.after)?;
    let mut diagnosis = closed.diagnosis;
    diagnosis.warnings.extend(remarks);
    let Some(shape) = shape else {
        let known = known(&model.effects(), &settings.known, |_| Vec::new());
        let effects = corrections(&changes(known, &diagnosis));
        let exports = export_table(pipeline, points, table.as_ref(), &diagnosis, effects)?;
        return commit(exports, pipeline.diagnosis_path(), diagnosis);
    };
    let info = RunInfo { title: pipeline.title.clone(), ..RunInfo::default() };
    let mut gathering = Gathering::begin(pipeline, &pipeline.diagnosed, &info)?;
    let known = known(&model.effects(), &settings.known, |_| Vec::new());
    gathering.corrected_for(corrections(&changes(known, &diagnosis)));
    take_sections(shape.sections, pipeline, shape.radius_mm, observer, &mut gathering)?;
    let surface = gathering.build_surface(shape.radius_mm)?;
    let inputs = vec![Input::of(&points.input)?];
    let finished = gathering.finish(inputs, diagnosis.warnings.clone(), surface.as_ref())?;
    commit(Some(finished), pipeline.diagnosis_path(), diagnosis)
}

/// Effects that are declared as known, each with the lines that declare it in a rig.
fn known(effects: &[Effect], known: &[Setting], lines: impl Fn(usize) -> Vec<String>) -> Vec<Change> {
    let known = known.iter().filter_map(|setting| {
        let effect = effects.get(setting.effect)?;
        let parameters = effect.parameters.iter().zip(&setting.values).map(|(parameter, value)| Estimated {
            name: parameter.name.clone(),
            value: *value,
            std: None,
            unit: parameter.unit.clone(),
        });
        let effect = Correction {
            effect: effect.id.clone(),
            targets: effect.targets.clone(),
            confounded_with: Vec::new(),
            parameters: parameters.collect(),
            known: true,
        };
        Some(Change { effect, lines: lines(setting.effect) })
    });
    known.collect()
}

/// Everything that results are corrected for: known effects, then those that were added.
fn changes(mut known: Vec<Change>, diagnosis: &Diagnosis) -> Vec<Change> {
    known.extend(diagnosis.added.iter().map(|added| Change {
        effect: added.into(),
        lines: added.change.iter().flat_map(|change| change.lines()).map(str::to_owned).collect(),
    }));
    known
}

fn corrections(changes: &[Change]) -> Vec<Correction> {
    changes.iter().map(|change| change.effect.clone()).collect()
}

/// Gives the exports their names, and the diagnosis, which lists them, with them.
fn commit(exports: Option<Finished>, path: Option<PathBuf>, mut diagnosis: Diagnosis) -> Result<Diagnosis> {
    diagnosis.outputs = exports.as_ref().map_or_else(Vec::new, Finished::outputs);
    diagnosis.outputs.extend(path.clone());
    let written = path.map(|path| pending(path, &diagnosis)).transpose()?;
    match exports {
        Some(exports) => exports.commit(written).map(|_| ())?,
        None => commit_all(written.into_iter().collect()).map(|_| ())?,
    }
    Ok(diagnosis)
}

/// A model's table in every exporter that writes tables; nothing where there is no table or no exporter.
fn export_table(
    pipeline: &Pipeline,
    points: &Points,
    table: Option<&Table>,
    diagnosis: &Diagnosis,
    effects: Vec<Correction>,
) -> Result<Option<Finished>> {
    let exporters: Vec<_> = pipeline.diagnosed.iter().filter_map(|exporter| exporter.tables()).collect();
    let (Some(table), false) = (table, exporters.is_empty()) else { return Ok(None) };
    let mut summary = begun(pipeline);
    summary.provenance.inputs = vec![Input::of(&points.input)?];
    summary.warnings.extend(diagnosis.warnings.iter().cloned());
    summary.effects = effects;
    let mut complete: Vec<PendingFile> = Vec::new();
    for exporter in exporters {
        complete.extend(exporter.write_table(table, &summary)?);
    }
    Ok(Some(Finished::new(summary, complete, summary_path(&pipeline.diagnosed))))
}

fn diagnose_traces(pipeline: &Pipeline, points: &Points, model: &dyn TraceModel) -> Result<Diagnosis> {
    spare_inputs(&pipeline.diagnosed_outputs(), std::slice::from_ref(&points.input))?;
    let effects = model.effects_of(points)?;
    let settings = pipeline.diagnose.settings_for(&effects);
    let settings = settings.map_err(|fault| Error::new("diagnose", &pipeline.title, fault))?;
    let known = known(&effects, &settings.known, |_| Vec::new());
    let found = model.diagnose(points, &closed_loop::Settings { max_added: MOST_ADDED, ..settings })?;
    let corrected = corrections(&changes(known, &found.diagnosis));
    let remarks = found.diagnosis.warnings.clone();
    let finished = traces::finished(pipeline, &pipeline.diagnosed, points, found.after, remarks, corrected)?;
    commit(Some(finished), pipeline.diagnosis_path(), found.diagnosis)
}

/// `diagnosis.json`, written and waiting for its name.
fn pending(path: PathBuf, diagnosis: &Diagnosis) -> Result<PendingFile> {
    let file = PendingFile::new(path)?;
    let text = serde_json::to_vec_pretty(diagnosis).map_err(|error| file.failure(error))?;
    std::fs::write(file.path(), text).map_err(|error| file.failure(error))?;
    Ok(file)
}
