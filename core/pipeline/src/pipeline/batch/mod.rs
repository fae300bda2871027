//! A batch: one pipeline, many recordings. Each recording is a run of its own, whose result is kept by a [`ResultStore`]; one that is up
//! to date is skipped, one that fails does not stop the others.

mod exports;
mod names;
mod overview;
mod recording;
mod report;
mod speed;
mod trend;

use std::{
    collections::{BTreeSet, HashSet},
    fs,
    num::NonZeroUsize,
    path::Path,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
};

pub use recording::{Recording, by_name, recordings};
pub use report::{BatchReport, Failed, LimitCount, Warned};
pub use speed::SpeedSeries;
pub use trend::{RECORDING, Series, Signals, recording_column};

use super::{
    config::Pipeline,
    document::{ConfigError, Document, Sources},
    observer::Observer,
    read_ahead::write_behind,
    registry::Registry,
    result_writer::CompleteFiles,
    run::run_alone_to_files,
    tables,
};
use crate::{
    atomic_file::{self, FolderLock, PendingFile, commit_all, resolved},
    stage::{About, Completed, Exporter, ResultInfo, Source},
    summary::Summary,
};
use recording::{of_recording, without_recording};
use report::RecordingSummary;
use runout_error::{Error, ErrorKind, Result};
use runout_table::{RecordBatch, TableSpec};
use runout_turning::provenance::{Input, VERSION};
use speed::Speeds;
use trend::Trend;

/// The report's file in the folder of the data set.
const REPORT: &str = "batch.json";

/// Keeps the results of recordings side by side, as a data set.
pub trait ResultStore: Sync {
    /// Writes the result of a recording; its summary, which comes last, says that the result is complete.
    fn exporter(&self, recording: &str) -> Box<dyn Exporter>;

    /// Removes all that is kept of a recording, the summary first.
    ///
    /// # Errors
    /// When a file cannot be removed.
    fn remove(&self, recording: &str) -> Result<()>;

    /// The recordings of which anything is kept.
    ///
    /// # Errors
    /// When the folder cannot be read.
    fn recordings(&self) -> Result<Vec<String>>;

    /// The rows of a table of these recordings as one table, behind a column with the recording's name.
    ///
    /// # Errors
    /// When a file cannot be read or written.
    fn gather(&self, table: &TableSpec, recordings: &[String]) -> Result<Box<dyn Gathered>>;

    /// Writes tables of the whole batch.
    fn exporter_of_all(&self) -> Box<dyn Exporter>;

    /// Where the batch is and where its report goes.
    fn folder(&self) -> &Path;
}

/// One table of all recordings, complete but for its name.
pub trait Gathered {
    /// Gives all rows, some at a time, in the order of the recordings.
    ///
    /// # Errors
    /// When they cannot be read, and those of `take`.
    fn each(&self, take: &mut dyn FnMut(&RecordBatch) -> Result<()>) -> Result<()>;

    /// The file.
    fn finish(self: Box<Self>) -> PendingFile;
}

/// A pipeline for many recordings.
pub struct Batch<'a> {
    sources: &'a Sources,
    registry: &'a Registry,
    store: &'a dyn ResultStore,
    /// The pipeline as it is for any recording.
    pipeline: Pipeline,
    /// Its configuration without what is a recording's own.
    key: Option<toml::Table>,
    /// What takes the tables of the batch.
    exporters: Vec<Box<dyn Exporter>>,
}

/// What became of a recording.
enum RecordingOutcome {
    Done(RecordingSummary),
    Skipped(RecordingSummary),
    Failed(Error),
}

/// A recording whose computation is over.
enum Computed {
    UpToDate(RecordingSummary),
    /// Its files wait for their names.
    Files(Box<CompleteFiles>),
}

impl Computed {
    fn publish(self, recording: &str) -> Result<RecordingOutcome> {
        match self {
            Self::UpToDate(found) => Ok(RecordingOutcome::Skipped(found)),
            Self::Files(files) => Ok(RecordingOutcome::Done(RecordingSummary::of(recording, &files.publish()?))),
        }
    }
}

impl<'a> Batch<'a> {
    /// Checks a pipeline for these recordings.
    ///
    /// # Errors
    /// The first mistake of the configuration, with its place.
    pub fn new(
        sources: &'a Sources,
        registry: &'a Registry,
        store: &'a dyn ResultStore,
        recordings: &[Recording],
    ) -> std::result::Result<Self, ConfigError> {
        let first = recordings.first().map(|first| of_recording(sources, &first.path)).transpose()?;
        let pipeline = Pipeline::from_sources(first.as_ref().unwrap_or(sources), registry)?;
        let key = without_recording(&pipeline.configuration);
        let document = Document::parse(sources)?;
        let exporters = exports::of_batch(
            document.root(),
            sources,
            registry,
            pipeline.rig.as_ref(),
            store,
            &[trend::table(), speed::table()],
        )
        .map_err(|fault| document.diagnose(fault))?;
        Ok(Self { sources, registry, store, pipeline, key, exporters })
    }

    /// Runs the pipeline on each recording that is not up to date, so many at a time, and writes what all of them say together.
    ///
    /// # Errors
    /// When another batch writes to the folder, or the tables of the batch cannot be written. A recording that fails is none: the report
    /// names it.
    pub fn run(&self, recordings: &[Recording], jobs: NonZeroUsize, observer: &dyn Observer) -> Result<BatchReport> {
        let _lock = FolderLock::of([self.store.folder().join(REPORT).as_path()])?;
        // Nobody else changes it: the folder is locked.
        let kept: BTreeSet<String> = self.store.recordings()?.into_iter().collect();
        let outcomes = self.work(recordings, &kept, jobs, observer);
        let mut report = BatchReport::begun(&self.pipeline, self.store.folder());
        let (mut complete, mut speeds, mut given) = (Vec::new(), Vec::new(), HashSet::new());
        for (recording, outcome) in recordings.iter().zip(outcomes) {
            given.insert(recording.name.as_str());
            let found = match outcome {
                RecordingOutcome::Done(found) => {
                    report.done += 1;
                    found
                }
                RecordingOutcome::Skipped(found) => {
                    report.skipped += 1;
                    found
                }
                RecordingOutcome::Failed(error) => {
                    report.failed.push(Failed::of(recording, &error));
                    continue;
                }
            };
            speeds.extend(found.speed());
            report.count(&recording.name, found);
            complete.push(recording.name.clone());
        }
        for name in kept.into_iter().filter(|name| !given.contains(name.as_str())) {
            match self.summary(&name).filter(|summary| self.is_of_configuration(summary)) {
                Some(summary) => {
                    let found = RecordingSummary::of(&name, &summary);
                    speeds.extend(found.speed());
                    report.count(&name, found);
                    report.earlier += 1;
                    complete.push(name);
                }
                None => report.other_configuration.push(name),
            }
        }
        complete.sort_by(|a, b| by_name(a, b));
        report.other_configuration.sort_by(|a, b| by_name(a, b));
        // Of recordings at one speed, or none that has one, no value against speed is missing.
        let known = speeds.len();
        let speeds = Speeds::of(speeds);
        if known == 0 || (known > 1 && speeds.is_none()) {
            report.without_speed.clear();
        }
        self.conclude(&complete, speeds, report)
    }

    fn work(
        &self,
        recordings: &[Recording],
        kept: &BTreeSet<String>,
        jobs: NonZeroUsize,
        observer: &dyn Observer,
    ) -> Vec<RecordingOutcome> {
        let next = AtomicUsize::new(0);
        let outcomes: Mutex<Vec<Option<RecordingOutcome>>> = Mutex::new(recordings.iter().map(|_| None).collect());
        observer.begin(recordings.len());
        let claimed = || {
            let index = next.fetch_add(1, Ordering::Relaxed);
            Some((index, recordings.get(index)?))
        };
        let publish = |(index, computed): (usize, Result<Computed>)| {
            let name = &recordings[index].name;
            let outcome = computed.and_then(|computed| computed.publish(name)).unwrap_or_else(RecordingOutcome::Failed);
            outcomes.lock().unwrap_or_else(PoisonError::into_inner)[index] = Some(outcome);
            observer.station(name);
            Ok(())
        };
        let work = || {
            // While the files of a recording are synced, which takes no processor, the next one is computed.
            let outcome = write_behind(publish, |hand_on| {
                while let Some((index, recording)) = claimed() {
                    hand_on((index, self.one(recording, kept.contains(&recording.name))))?;
                }
                Ok(())
            });
            // Where the thread that publishes has stopped, recordings have no outcome, which is said below.
            drop(outcome);
        };
        std::thread::scope(|scope| {
            let others = jobs.get().min(recordings.len()).saturating_sub(1);
            (0..others).for_each(|_| drop(scope.spawn(work)));
            work();
        });
        let outcomes = outcomes.into_inner().unwrap_or_else(PoisonError::into_inner);
        let stopped = || Error::new("run", "the recording", "its thread stopped").of(ErrorKind::Interrupted);
        outcomes.into_iter().map(|outcome| outcome.unwrap_or_else(|| RecordingOutcome::Failed(stopped()))).collect()
    }

    /// Computes the result of a recording, of which something is kept or nothing.
    fn one(&self, recording: &Recording, is_kept: bool) -> Result<Computed> {
        let named = |error: ConfigError| match error {
            ConfigError::File(error) => error,
            ConfigError::Text(mistake) => {
                Error::new("run", &recording.name, &mistake.message).of(ErrorKind::Configuration)
            }
        };
        let sources = of_recording(self.sources, &recording.path).map_err(named)?;
        let mut pipeline = Pipeline::from_sources(&sources, self.registry).map_err(named)?;
        if is_kept
            && let Some(summary) = self.summary(&recording.name)
            && self.is_of_configuration(&summary)
            // What cannot be read now is not up to date; the run says why.
            && is_of_inputs(&summary, &pipeline).unwrap_or(false)
        {
            return Ok(Computed::UpToDate(RecordingSummary::of(&recording.name, &summary)));
        }
        if is_kept {
            self.store.remove(&recording.name)?;
        }
        pipeline.in_data_set = true;
        pipeline.exporters = vec![self.store.exporter(&recording.name)];
        pipeline.diagnosed.clear();
        let files = run_alone_to_files(&pipeline).map_err(|error| recording.explained(error))?;
        Ok(Computed::Files(Box::new(files)))
    }

    /// The summary of a complete result; nothing where there is none that can be read.
    fn summary(&self, recording: &str) -> Option<Summary> {
        let path = self.store.exporter(recording).summary(&self.pipeline.tables)?;
        serde_json::from_slice(&fs::read(path).ok()?).ok()
    }

    fn is_of_configuration(&self, summary: &Summary) -> bool {
        summary.provenance.program == program()
            && self.key.is_some()
            && without_recording(&summary.provenance.configuration) == self.key
    }

    /// Writes the values of all recordings and their trend, and the report.
    fn conclude(
        &self,
        complete: &[String],
        mut speeds: Option<Speeds>,
        mut report: BatchReport,
    ) -> Result<BatchReport> {
        let mut gathered = Vec::new();
        for table in self.pipeline.tables.iter().filter(|table| tables::holds_values(&table.name)) {
            gathered.push(self.store.gather(table, complete)?);
        }
        let mut trend = Trend::new(self.pipeline.evaluate.limits());
        for pass in [Trend::estimate, Trend::judge] {
            trend.rewind();
            for table in &gathered {
                trend.begin_table();
                table.each(&mut |rows| {
                    pass(&mut trend, rows);
                    Ok(())
                })?;
            }
        }
        trend.rewind();
        let (spec, against_speed) = (trend::table(), speed::table());
        let speed_spec = speeds.as_ref().map(|_| against_speed.clone());
        let specs = std::iter::once(spec.clone()).chain(speed_spec).collect();
        let info = ResultInfo { title: self.pipeline.title.clone(), tables: specs, longest_name: None };
        let mut exports = self.exporters.iter().map(|exporter| exporter.begin(&info)).collect::<Result<Vec<_>>>()?;
        for table in &gathered {
            trend.begin_table();
            table.each(&mut |rows| {
                let at_speed = speeds.as_mut().map(|speeds| speeds.rows(rows)).transpose()?;
                let rows = trend.rows(rows)?;
                exports.iter_mut().try_for_each(|export| {
                    at_speed.iter().try_for_each(|rows| export.rows(&against_speed, rows))?;
                    export.rows(&spec, &rows)
                })
            })?;
        }
        if let Some(mut speeds) = speeds {
            let shifts = speeds.shifts(self.pipeline.rig.as_ref())?;
            exports.iter_mut().try_for_each(|export| export.rows(&against_speed, &shifts))?;
            report.against_speed = speeds.into_series();
        }
        report.trend = trend.into_series();
        let summary = self.pipeline.headed();
        let overview = overview::of(&report);
        let completed = Completed {
            summary: &summary,
            about: &About::default(),
            surface: None,
            heights: None,
            diagnosis: None,
            overview: Some(&overview),
        };
        let mut files: Vec<PendingFile> = gathered.into_iter().map(Gathered::finish).collect();
        for export in exports {
            files.extend(export.finish(&completed)?);
        }
        report.outputs = files.iter().map(|file| file.destination().to_owned()).collect();
        // The data set's own folder is locked already.
        let own = resolved(self.store.folder());
        let elsewhere = |file: &&Path| file.parent().is_none_or(|folder| resolved(folder) != own);
        let _lock = FolderLock::of(files.iter().map(PendingFile::destination).filter(elsewhere))?;
        commit_all(files)?;
        let path = self.store.folder().join(REPORT);
        report.outputs.push(path.clone());
        let text = serde_json::to_vec_pretty(&report)
            .map_err(|error| Error::caused("write", path.display().to_string(), error))?;
        atomic_file::write(path, &text)?;
        Ok(report)
    }
}

fn program() -> String {
    format!("runout {VERSION}")
}

/// Whether a result is of the files that the pipeline reads now, by their checksums.
fn is_of_inputs(summary: &Summary, pipeline: &Pipeline) -> Result<bool> {
    let inputs = match pipeline.loader.open(&pipeline.request())? {
        Source::Turns(recording) => recording.inputs(),
        Source::Points(points) => points.inputs(),
    };
    let known = &summary.provenance.inputs;
    if inputs.len() + pipeline.named_files.len() != known.len() {
        return Ok(false);
    }
    for (path, known) in inputs.iter().chain(&pipeline.named_files).zip(known) {
        let now = Input::of(path)?;
        if (now.bytes, &now.blake3) != (known.bytes, &known.blake3) {
            return Ok(false);
        }
    }
    Ok(true)
}
