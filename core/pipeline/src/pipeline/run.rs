//! The run: load → preprocess → separate → evaluate → export, station by station, threads across stations.

use std::num::NonZeroUsize;

use super::{
    config::{Pipeline, Route, exports::spare_inputs},
    outdated, point_run,
    read_ahead::write_behind,
    record_reader::{RecordReader, separate},
    result_writer::{CompleteFiles, Finished, ResultWriter},
    warnings::TurnsOfAll,
};
pub use super::{
    observer::{Observer, Silent},
    tables::StationTables,
};
use crate::stage::{Averager, Conditioner, Source, Station, StationSeparator};
use crate::summary::Summary;
use runout_error::{Error, ErrorKind, Result};
use runout_evaluate::{EvaluatedStation, Group};
use runout_numerics::threads;
use runout_turning::station::StationResult;
use runout_turning::{measurement::Recording, rig::Rig, spread::Projection};

impl Pipeline {
    /// Runs it on all threads: [`run`] without a progress bar.
    ///
    /// # Errors
    /// When the data or a file fails. Exports that had begun leave nothing behind.
    pub fn run(&self) -> Result<Summary> {
        run(self, None, &Silent)
    }
}

/// Runs a pipeline.
///
/// # Errors
/// When the data or a file fails. Exports that had begun leave nothing behind.
pub fn run(pipeline: &Pipeline, threads: Option<NonZeroUsize>, observer: &dyn Observer) -> Result<Summary> {
    run_with(pipeline, threads, false, observer)
}

/// Runs a pipeline on one thread, which also reads and writes: other threads or processes have recordings of their own.
///
/// # Errors
/// Those of [`run`].
pub fn run_alone(pipeline: &Pipeline, observer: &dyn Observer) -> Result<Summary> {
    threads::alone(|| run_with(pipeline, Some(NonZeroUsize::MIN), true, observer))
}

/// Runs a pipeline on one thread up to files that are complete and wait for their names.
///
/// # Errors
/// Those of [`run`].
pub(super) fn run_alone_to_files(pipeline: &Pipeline) -> Result<CompleteFiles> {
    threads::alone(|| finished(pipeline, Some(NonZeroUsize::MIN), true, &Silent)?.complete(None))
}

fn run_with(
    pipeline: &Pipeline,
    threads: Option<NonZeroUsize>,
    alone: bool,
    observer: &dyn Observer,
) -> Result<Summary> {
    let summary = finished(pipeline, threads, alone, observer)?.commit(None)?;
    outdated::remove(pipeline)?;
    Ok(summary)
}

fn finished(
    pipeline: &Pipeline,
    threads: Option<NonZeroUsize>,
    alone: bool,
    observer: &dyn Observer,
) -> Result<Finished> {
    let source = pipeline.loader.open(&pipeline.request())?;
    match (&source, &pipeline.route) {
        (Source::Turns(recording), Route::Turns { conditioners, averager, separator, .. }) => {
            run_turns(pipeline, &**recording, (conditioners, &**averager, &**separator), (threads, alone), observer)
        }
        (Source::Points(points), Route::Points { separator, .. }) => {
            point_run::run(pipeline, points, &**separator, observer)
        }
        _ => Err(Error::new("run", &pipeline.title, "the loader gave what it did not declare")),
    }
}

fn run_turns(
    pipeline: &Pipeline,
    recording: &dyn Recording,
    (conditioners, averager, separator): (&[Box<dyn Conditioner>], &dyn Averager, &dyn StationSeparator),
    (threads, alone): (Option<NonZeroUsize>, bool),
    observer: &dyn Observer,
) -> Result<Finished> {
    spare_inputs(&pipeline.outputs(), &recording.inputs())?;
    let rig = pipeline.rig.as_ref().ok_or_else(|| {
        Error::new("run", &pipeline.title, "recorded turns need a [rig]").of(ErrorKind::Configuration)
    })?;
    let mut writer = ResultWriter::begin(pipeline, &pipeline.exporters, recording.stations())?;
    let line = RecordReader {
        rig,
        recording,
        conditioners,
        averager,
        hold_out: None,
        projections: projections(pipeline, separator, rig),
        puts_right: None,
        alone,
    };
    let (radius_mm, stations) = (rig.part_radius_mm, recording.stations().len());
    let work = |index, station: Station| {
        let separation = separate(separator, &station, rig)?;
        separator.messages().iter().for_each(|text| observer.message(text));
        let angles = station.profiles.first().map_or(0, |profile| profile.samples_per_rev);
        let truth = recording.truth(index)?;
        let Station { name: station, z_mm, profiles, .. } = station;
        let result = StationResult { station, z_mm, angles, separation, profiles, truth };
        Ok(EvaluatedStation::of(result, &pipeline.evaluate, radius_mm, Some(rig), stations))
    };
    let mut turns = TurnsOfAll::default();
    let mut take = |station: EvaluatedStation| {
        turns.take(&station.result, rig);
        writer.take(&station, Some(rig))
    };
    let inputs = if alone {
        line.run(threads, observer, work, &mut take)?
    } else {
        write_behind(take, |take| line.run(threads, observer, work, take))?
    };
    writer.note(turns.notes());
    let remarks = recording.remarks().into_iter().chain(turns.warnings(rig)).collect();
    let surface = writer.build_surface(rig.part_radius_mm)?;
    writer.finish(inputs, remarks, surface.as_ref())
}

/// How motion follows from the readings of each setup, where error motion values are wanted.
pub(super) fn projections(pipeline: &Pipeline, separator: &dyn StationSeparator, rig: &Rig) -> Vec<Option<Projection>> {
    let wanted = pipeline.evaluate.has(Group::ErrorMotion);
    let directions = &pipeline.evaluate.directions;
    let faces = &pipeline.evaluate.faces;
    let projection = |setup| {
        let found = separator.projection(setup).filter(|_| wanted)?;
        Some(found.with_lines(directions).with_faces(faces))
    };
    (0..rig.setups.len()).map(projection).collect()
}
