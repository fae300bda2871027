//! The closed loop on a pipeline: load → fit → find what the model lacks → export the final model.

mod corrected_rig;
mod moved;

use std::{num::NonZeroUsize, path::PathBuf, sync::Arc};

use corrected_rig::Change;

use super::{
    config::{Pipeline, Route, exports::spare_inputs},
    hidden_readings,
    observer::Observer,
    point_run::{self, PointResult},
    put_right,
    record_reader::{RecordReader, separate},
    result_writer::{Finished, ResultWriter},
    run::projections,
    true_error::true_error,
    warnings::{DeclaredStations, TurnsOfAll},
};
use crate::{
    atomic_file::PendingFile,
    effects::PointEffect,
    points::{Points, measured},
    stage::{PointModel, PointSeparator, Source, Station, StationModel, StationSeparator, diagnose_linear},
    summary::Summary,
};
use runout_closed_loop::{
    Effect, Setting, Settings,
    correction::Correction,
    diagnosis::{Diagnosis, Estimated, Step, Truth},
};
use runout_error::{Error, ErrorKind, Result};
use runout_evaluate::{EvaluatedStation, Group};
use runout_numerics::threads;
use runout_turning::station::StationResult;
use runout_turning::{profile::Profile, separation::Quantity};

/// Runs the closed loop and writes `diagnosis.json`, and the exports of the final model where it has a form. These do not
/// replace those of a run: they go below `diagnosed/`, or where `[diagnose] out` says.
///
/// # Errors
/// When the data or a file fails, or the separator has no model for the loop. Exports that had begun leave nothing behind.
pub fn diagnose(pipeline: &Pipeline, threads: Option<NonZeroUsize>, observer: &dyn Observer) -> Result<Diagnosis> {
    Ok(diagnosed(pipeline, threads, observer)?.diagnosis)
}

/// What the closed loop found, with the result of its final model.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Diagnosed {
    /// What was found.
    pub diagnosis: Diagnosis,
    /// The result of the final model.
    pub summary: Summary,
}

/// Runs the closed loop as [`diagnose`] does, and gives the result of its final model too.
///
/// # Errors
/// As [`diagnose`] has.
pub fn diagnosed(pipeline: &Pipeline, threads: Option<NonZeroUsize>, observer: &dyn Observer) -> Result<Diagnosed> {
    if threads == Some(NonZeroUsize::MIN) {
        return threads::alone(|| loop_on(pipeline, threads, observer));
    }
    loop_on(pipeline, threads, observer)
}

fn loop_on(pipeline: &Pipeline, threads: Option<NonZeroUsize>, observer: &dyn Observer) -> Result<Diagnosed> {
    let source = pipeline.loader.open(&pipeline.request())?;
    let no_model = |separator: &str| {
        Error::new("diagnose", &pipeline.title, format!("`{separator}` has no model of effects for the closed loop"))
            .of(ErrorKind::Configuration)
    };
    match (&source, &pipeline.route) {
        (Source::Points(points), Route::Points { separator, effects, .. }) => {
            let model = separator.model().ok_or_else(|| no_model(&pipeline.separator))?;
            diagnose_points(pipeline, points, (&**separator, model, effects), observer)
        }
        (Source::Turns(recording), Route::Turns { conditioners, averager, separator, model: Some(model) }) => {
            let rig = pipeline.rig.as_ref().ok_or_else(|| no_model(&pipeline.separator))?;
            let hold_out = Some(pipeline.diagnose.hold_out.unwrap_or(HOLD_OUT));
            let line = RecordReader {
                rig,
                recording: &**recording,
                conditioners,
                averager: &**averager,
                hold_out,
                projections: projections(pipeline, &**separator, rig),
                alone: false,
                puts_right: Some(&pipeline.diagnose.settings),
            };
            diagnose_turns(pipeline, &line, threads, (&**separator, &**model), observer)
        }
        _ => Err(no_model(&pipeline.separator)),
    }
}

/// What is not corrected for the effects.
const UNCORRECTED_SPREAD: &str = "synchronous error motion is corrected for the effects found; the spread of the turns in asynchronous \
    and total error motion is that of the readings as the rig declares them";

/// Share of the turns that is held out where the pipeline says nothing.
const HOLD_OUT: f64 = 0.2;

fn diagnose_turns(
    pipeline: &Pipeline,
    line: &RecordReader,
    threads: Option<NonZeroUsize>,
    (separator, model): (&dyn StationSeparator, &dyn StationModel),
    observer: &dyn Observer,
) -> Result<Diagnosed> {
    let recording = line.recording;
    spare_inputs(&pipeline.diagnosed_outputs(), &recording.inputs())?;
    let mut stations: Vec<Station> = Vec::new();
    let inputs = line.run(
        threads,
        observer,
        |_, station| Ok(station),
        |station| {
            if stations.is_empty() {
                check_memory(pipeline, model, &station, recording.stations().len())?;
            }
            stations.push(station);
            Ok(())
        },
    )?;
    let settings = &pipeline.diagnose.settings;
    let mut put_right = put_right::put_right(&mut stations, settings, line.rig, separator)?;
    let mut found = hidden_readings::diagnose(&mut stations, settings, line.rig, (separator, model))?;
    let as_named: Vec<_> = (0..stations.len()).map(|station| put_right.declared(station)).collect();
    put_right.say(&mut found);
    let mut diagnosis = found.diagnosis;
    diagnosis.withhold_refuted();
    diagnosis.moved.clear();
    let mut writer = ResultWriter::begin(pipeline, &pipeline.diagnosed, recording.stations())?;
    writer.station_tables.with_residuals();
    let known = known(model.effects(), &settings.known, |effect| model.changes(effect, &settings.known));
    let changes = changes(known, &diagnosis);
    writer.corrected_for(corrections(&changes));
    let rig = pipeline.diagnose.write_rig.clone();
    diagnosis.warnings.extend(rig.as_ref().and_then(|path| corrected_rig::left_out(&changes, path)));
    let mut errors = [Vec::new(), Vec::new()];
    // As the rig is declared, and with the effects found.
    let (mut as_declared, mut turns) = (DeclaredStations::default(), TurnsOfAll::default());
    let (radius_mm, several) = (line.rig.part_radius_mm, stations.len() > 1);
    let looked_at = pipeline.evaluate.first_ront();
    // Before is what a run gives, which leaves known effects and names of stations alone.
    if settings.known.is_empty() {
        let separated = threads::spread(&stations, 2, |station| separate(separator, station, line.rig));
        found.before = separated.into_iter().collect::<Result<_>>()?;
    }
    let solved = found.before.into_iter().zip(found.after).zip(as_named);
    for (index, (station, ((before, after), as_named))) in stations.into_iter().zip(solved).enumerate() {
        let before = as_named.unwrap_or(before);
        let angles = station.profiles.first().map_or(0, |profile| profile.samples_per_rev);
        let truth = recording.truth(index)?;
        let complete = |separation, profiles, evaluate| {
            let (name, truth) = (station.name.clone(), truth.clone());
            let result = StationResult { station: name, z_mm: station.z_mm, angles, separation, profiles, truth };
            EvaluatedStation::of(result, evaluate, radius_mm, Some(line.rig), recording.stations().len())
        };
        let (declared, found) = threads::both(
            || complete(before, Vec::new(), &looked_at),
            || complete(after, station.profiles.clone(), &pipeline.evaluate),
        );
        diagnosis.moved.extend(moved::moved(&declared, &found, &looked_at, radius_mm, several));
        for (errors, EvaluatedStation { result, .. }) in errors.iter_mut().zip([&declared, &found]) {
            let forms = (0..result.separation.sections.len()).map(Quantity::Form);
            errors.extend(forms.filter_map(|form| true_error(result, form)));
        }
        as_declared.take(&declared, line.rig);
        turns.take(&found.result, line.rig);
        writer.take(&found, pipeline.rig.as_ref())?;
    }
    let rms = |errors: &Vec<f64>| {
        let squares: f64 = errors.iter().map(|error| error * error).sum();
        (!errors.is_empty()).then(|| (squares / errors.len() as f64).sqrt())
    };
    if !errors[0].is_empty() {
        diagnosis.truth = Some(Truth { form_rms_error_um: Step { before: rms(&errors[0]), after: rms(&errors[1]) } });
    }
    let surface = writer.build_surface(radius_mm)?;
    writer.note(turns.notes());
    let remarks = recording.remarks().into_iter().chain(turns.warnings(line.rig)).collect();
    if pipeline.evaluate.has(Group::ErrorMotion) && !diagnosis.added.is_empty() {
        writer.note(vec![UNCORRECTED_SPREAD.into()]);
    }
    writer.diagnosed(diagnosis, as_declared.warnings(line.rig));
    let mut finished = writer.finish(inputs, remarks, surface.as_ref())?;
    if let Some(path) = rig {
        finished.add(corrected_rig::pending(path, pipeline, &changes)?);
    }
    commit(finished, pipeline.diagnosis_path())
}

/// Refuses to begin what needs more memory than the pipeline allows: as many stations like the first one.
fn check_memory(pipeline: &Pipeline, model: &dyn StationModel, first: &Station, stations: usize) -> Result<()> {
    let each = first.profiles.iter().map(Profile::bytes).sum::<u64>() + model.bytes(first);
    let (needed_gb, allowed_gb) = (1e-9 * each as f64 * stations as f64, pipeline.diagnose.memory_gb);
    if needed_gb <= allowed_gb {
        return Ok(());
    }
    let problem = format!(
        "the closed loop holds all {stations} stations at once, some {:.2} MB each and {needed_gb:.2} GB together; {allowed_gb} GB are \
         allowed",
        1e-6 * each as f64
    );
    let help = format!(
        "allow more (`--memory {:.0}`, or `memory_gb` in [diagnose]), or give fewer stations, or a smaller `samples_per_rev`",
        needed_gb.ceil()
    );
    Err(Error::new("diagnose", &pipeline.title, problem).of(ErrorKind::Configuration).help(help))
}

/// More than any model of points has effects that earn their place.
const MOST_ADDED: usize = 40;

fn diagnose_points(
    pipeline: &Pipeline,
    points: &Points,
    (separator, model, own): (&dyn PointSeparator, &dyn PointModel, &[Arc<dyn PointEffect>]),
    observer: &dyn Observer,
) -> Result<Diagnosed> {
    spare_inputs(&pipeline.diagnosed_outputs(), &points.inputs())?;
    measured::refuse_impossible(points)?;
    let mut effects = model.effects_of(points)?;
    effects.extend(own.iter().map(|own| own.effect()));
    let settings = if model.points_name_targets() {
        let settings = pipeline.diagnose.settings_for(&effects);
        settings.map_err(|fault| Error::caused("diagnose", &pipeline.title, fault))?
    } else {
        pipeline.diagnose.settings.clone()
    };
    let known = known(&effects, &settings.known, |_| Vec::new());
    let settings = Settings { max_added: MOST_ADDED, ..settings };
    let mut found = match model.linear().filter(|_| !own.is_empty()) {
        Some(model) => diagnose_linear(model, points, own, &settings)?,
        None => model.diagnose(points, &settings)?,
    };
    let checks = measured::checks(points, &separator.columns());
    found.diagnosis.refute(&checks);
    found.after = found.after.tested(checks);
    let effects = corrections(&changes(known, &found.diagnosis));
    let of_run = point_run::findings(pipeline, points, separator)?;
    let mut diagnosis = Diagnosis { lost_orders: found.after.lost_orders.clone(), ..found.diagnosis };
    diagnosis.withhold_refuted();
    let diagnosis = Some((diagnosis, of_run));
    let result = PointResult { outcome: found.after, remarks: None, effects, diagnosis };
    commit(result.write(pipeline, &pipeline.diagnosed, points, observer)?, pipeline.diagnosis_path())
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
fn commit(mut exports: Finished, path: Option<PathBuf>) -> Result<Diagnosed> {
    let missing = || Error::new("diagnose", "the pipeline", "the result has no diagnosis");
    let mut diagnosis = exports.diagnosis().ok_or_else(missing)?;
    diagnosis.outputs = exports.outputs();
    diagnosis.outputs.extend(path.clone());
    let written = path.map(|path| pending(path, &diagnosis)).transpose()?;
    let summary = exports.commit(written)?;
    Ok(Diagnosed { diagnosis, summary })
}

/// `diagnosis.json`, written and waiting for its name.
fn pending(path: PathBuf, diagnosis: &Diagnosis) -> Result<PendingFile> {
    let file = PendingFile::new(path)?;
    let text = serde_json::to_vec_pretty(diagnosis).map_err(|error| file.caused(error))?;
    file.write(&text)?;
    Ok(file)
}
