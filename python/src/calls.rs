//! What the package calls.

use std::{ffi::OsString, num::NonZeroUsize, path::PathBuf};

use pyo3::prelude::*;
use runout_cli::{Failure, builtin, documents};
use runout_core::{
    pipeline::{
        INCLUDE_KEY, Pipeline, Plugin, Registry,
        compare::{Comparing, ComparingPoints, Comparison},
        diagnose::diagnose as find_effects,
        document::{Document, Sources},
        run::{Observer, run as separate, run_alone as separate_alone},
    },
    stage::Exporter,
};
use serde::Serialize;

use crate::{
    arrays::{ArrayLoader, Arrays, Station},
    collect::Collector,
    interruptible::Interruptible,
    own::{self, Own},
    table::{Surface, Table},
    work::{Stop, watched},
};

/// The pipeline of a call: a file or a text, what to change in it, the recording where it is in memory, and plugins in Python.
#[derive(FromPyObject)]
pub(crate) struct Job {
    path: Option<PathBuf>,
    text: String,
    folder: PathBuf,
    set: Vec<String>,
    stations: Option<Vec<Station>>,
    plugins: Vec<Own>,
}

impl Job {
    /// What is registered for the call.
    fn registry(&mut self, stop: &Stop) -> Result<Registry, Failure> {
        let mut registry = builtin::registry();
        registry.loaders.add(Plugin::of::<Arrays>());
        own::register(&mut registry, std::mem::take(&mut self.plugins), stop)?;
        Ok(registry)
    }

    fn build(self, registry: &Registry, stop: Stop) -> Result<(Sources, Pipeline), Failure> {
        let sources = match &self.path {
            Some(path) => Sources::read(path, &self.set, INCLUDE_KEY)?,
            None => Sources::from_text("pipeline", &self.text, self.folder, &self.set, INCLUDE_KEY)?,
        };
        let mut pipeline = Pipeline::from_sources(&sources, registry)?;
        if let Some(stations) = self.stations {
            pipeline.loader = Box::new(ArrayLoader { stations });
        }
        pipeline.loader = Box::new(Interruptible { loader: pipeline.loader, stop });
        Ok((sources, pipeline))
    }
}

fn json(result: &impl Serialize) -> Result<String, Failure> {
    serde_json::to_string(result).map_err(|error| Failure::Output(error.into()))
}

/// What a run or a diagnosis gives: its document, its tables and its surface.
type Answer = (String, Vec<Table>, Option<Surface>);

/// Runs a pipeline.
#[pyfunction]
#[pyo3(signature = (job, threads = None, progress = None, surface = false))]
pub(crate) fn run(
    py: Python<'_>,
    job: Job,
    threads: Option<NonZeroUsize>,
    progress: Option<&Bound<'_, PyAny>>,
    surface: bool,
) -> PyResult<Answer> {
    answer(py, job, progress, surface, move |mut pipeline, collector, watch| {
        pipeline.exporters.push(collector);
        json(&match threads {
            // A processor is then left for another process.
            Some(NonZeroUsize::MIN) => separate_alone(&pipeline, watch)?,
            _ => separate(&pipeline, threads, watch)?,
        })
    })
}

/// Runs the closed loop on a pipeline.
#[pyfunction]
#[pyo3(signature = (job, threads = None, progress = None, surface = false))]
pub(crate) fn diagnose(
    py: Python<'_>,
    job: Job,
    threads: Option<NonZeroUsize>,
    progress: Option<&Bound<'_, PyAny>>,
    surface: bool,
) -> PyResult<Answer> {
    answer(py, job, progress, surface, move |mut pipeline, collector, watch| {
        pipeline.diagnosed.push(collector);
        json(&find_effects(&pipeline, threads, watch)?)
    })
}

/// Does work on a pipeline with an exporter that keeps its result, and gives that with the work's document.
fn answer(
    py: Python<'_>,
    mut job: Job,
    progress: Option<&Bound<'_, PyAny>>,
    surface: bool,
    work: impl FnOnce(Pipeline, Box<dyn Exporter>, &dyn Observer) -> Result<String, Failure> + Send + 'static,
) -> PyResult<Answer> {
    let collector = Collector { with_surface: surface, ..Collector::default() };
    let exporter: Box<dyn Exporter> = Box::new(collector.clone());
    let stop = collector.stop.clone();
    let document = watched(py, progress, &collector.stop, move |watch| {
        let registry = job.registry(&stop)?;
        let (_, pipeline) = job.build(&registry, stop)?;
        work(pipeline, exporter, watch)
    })?;
    let kept = collector.take();
    let tables = kept.tables.into_iter().map(|(spec, batches)| Table::new(spec, batches)).collect();
    Ok((document, tables, kept.surface.map(|surface| Surface::new(py, surface)).transpose()?))
}

/// Compares separators on the same data.
#[pyfunction]
#[pyo3(signature = (job, methods, threads = None, progress = None))]
pub(crate) fn compare(
    py: Python<'_>,
    mut job: Job,
    methods: Vec<String>,
    threads: Option<NonZeroUsize>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<String> {
    let stop = Stop::default();
    let of_job = stop.clone();
    watched(py, progress, &stop, move |watch| {
        let registry = job.registry(&of_job)?;
        documents::separators_known(&methods, &registry)?;
        let (sources, pipeline) = job.build(&registry, of_job)?;
        json(&comparison(&sources, pipeline, &methods, &registry, threads, watch)?)
    })
}

fn comparison(
    sources: &Sources,
    mut pipeline: Pipeline,
    methods: &[String],
    registry: &Registry,
    threads: Option<NonZeroUsize>,
    observer: &dyn Observer,
) -> Result<Comparison, Failure> {
    let misplaced = |fault| match Document::parse(sources) {
        Ok(document) => Failure::from(document.diagnose(fault)),
        Err(diagnostic) => diagnostic.into(),
    };
    if pipeline.route.point_separator().is_some() {
        let comparing = ComparingPoints::new(&pipeline, methods, registry, sources).map_err(misplaced)?;
        return Ok(comparing.run(Vec::new())?);
    }
    let comparing = Comparing::new(&mut pipeline, methods, registry, sources.folder()).map_err(misplaced)?;
    let mut stations = Vec::new();
    let take = |station| {
        stations.push(station);
        Ok(())
    };
    let mut comparison = comparing.run(threads, observer, Vec::new(), take)?;
    comparison.stations = stations;
    Ok(comparison)
}

/// Says what a pipeline can do.
#[pyfunction]
pub(crate) fn check(py: Python<'_>, mut job: Job) -> PyResult<String> {
    let stop = Stop::default();
    let of_job = stop.clone();
    watched(py, None, &stop, move |_| {
        let registry = job.registry(&of_job)?;
        let (sources, pipeline) = job.build(&registry, of_job)?;
        json(&documents::check(&sources, &pipeline)?)
    })
}

/// The document that a command of the program prints with `--json`.
#[pyfunction]
pub(crate) fn document(py: Python<'_>, words: Vec<OsString>) -> PyResult<String> {
    watched(py, None, &Stop::default(), move |_| json(&documents::of_command(words, &builtin::registry())?))
}

/// The program: prints, and gives its exit status.
#[pyfunction]
pub(crate) fn main(py: Python<'_>, words: Vec<OsString>) -> u8 {
    py.detach(|| runout_cli::status_of(words, &builtin::registry()))
}
