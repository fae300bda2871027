//! The run: load → preprocess → separate → evaluate → export, station by station, threads across stations.

use std::{
    num::NonZeroUsize,
    path::PathBuf,
    sync::{
        Condvar, Mutex, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
};

use super::{
    config::{Pipeline, Route},
    result::complete,
    summary::summarise,
};
pub use super::{
    result::{RunInfo, StationResult},
    summary::{
        CaptureSummary, LostOrders, MotionTruth, RejectedTurnSummary, SectionSummary, StationSummary, Summary,
        SurfaceSummary,
    },
};
use crate::{
    Error, Result,
    inspection::Inspection,
    measurement::{Recording, StationKey},
    points::Points,
    profile::Profile,
    provenance::{Input, Provenance, VERSION},
    rig::Rig,
    stage::{Averager, Conditioner, Export, PointSeparator, Source, Station, StationSeparator},
    surface::{Surface, SurfaceBuilder},
};

/// Watches a run, for a progress bar.
pub trait Observer: Sync {
    /// The run begins.
    fn begin(&self, _stations: usize) {}
    /// A station is done.
    fn station(&self, _name: &str) {}
}

/// Watches nothing.
pub struct Silent;

impl Observer for Silent {}

/// Runs a pipeline.
///
/// # Errors
/// When the data or a file fails. Exports that had begun leave nothing behind.
pub fn run(pipeline: &Pipeline, threads: Option<NonZeroUsize>, observer: &dyn Observer) -> Result<Summary> {
    let source = pipeline.loader.open(pipeline.rig.as_ref())?;
    let info =
        RunInfo { title: pipeline.title.clone(), rig: pipeline.rig.clone(), assessment: pipeline.assessment.clone() };
    let mut gathering = Gathering::begin(pipeline, &info)?;
    let (inputs, surface, remarks) = match (&source, &pipeline.route) {
        (Source::Turns(recording), Route::Turns { conditioners, averager, separator }) => {
            let rig = pipeline
                .rig
                .as_ref()
                .ok_or_else(|| Error::new("run", &pipeline.title, "recorded turns need a [rig]"))?;
            let line =
                Line { rig, recording: &**recording, conditioners, averager: &**averager, separator: &**separator };
            let inputs = line.run(threads, observer, &mut gathering)?;
            (inputs, gathering.build_surface(rig.part_radius_mm)?, recording.remarks())
        }
        (Source::Points(points), Route::Points { separator }) => {
            fit_points(points, &**separator, pipeline.surface.angles, observer, &mut gathering)?;
            let surface = gathering.build_surface(separator.reference_radius_mm(points)?)?;
            let remarks = separator.remarks(points, surface.as_ref())?;
            (vec![Input::of(&points.input)?], surface, remarks)
        }
        _ => return Err(Error::new("run", &pipeline.title, "the loader gave what it did not declare")),
    };
    gathering.summary.provenance.inputs = inputs;
    gathering.summary.warnings.extend(remarks);
    gathering.finish(surface.as_ref())
}

/// Results on their way to the exporters.
struct Gathering {
    exports: Vec<Box<dyn Export>>,
    surface: Option<SurfaceBuilder>,
    summary: Summary,
    summary_path: Option<PathBuf>,
}

impl Gathering {
    fn begin(pipeline: &Pipeline, info: &RunInfo) -> Result<Self> {
        let exports: Result<Vec<_>> = pipeline.exporters.iter().map(|exporter| exporter.begin(info)).collect();
        let tested = matches!(&pipeline.route, Route::Points { separator } if separator.needs_surface());
        let wanted = tested || pipeline.exporters.iter().any(|exporter| exporter.needs_surface());
        let first = pipeline.exporters.first().and_then(|exporter| exporter.outputs().into_iter().next());
        Ok(Self {
            exports: exports?,
            surface: wanted.then(|| SurfaceBuilder::new(&pipeline.surface)),
            summary_path: first.map(|path| path.with_file_name("summary.json")),
            summary: Summary {
                title: pipeline.title.clone(),
                provenance: Provenance {
                    program: format!("runout {VERSION}"),
                    configuration: pipeline.configuration.clone(),
                    inputs: Vec::new(),
                },
                lost_orders: pipeline.assessment.as_ref().map(LostOrders::from).unwrap_or_default(),
                stations: Vec::new(),
                surface: None,
                outputs: Vec::new(),
                warnings: pipeline.assessment.as_ref().map(|found| found.notes.clone()).unwrap_or_default(),
            },
        })
    }

    fn take(&mut self, result: &StationResult, rig: Option<&Rig>) -> Result<()> {
        for export in &mut self.exports {
            export.station(result)?;
        }
        if let Some(surface) = &mut self.surface {
            surface.add(result);
        }
        self.summary.stations.push(summarise(result, rig));
        Ok(())
    }

    fn build_surface(&mut self, radius_mm: f64) -> Result<Option<Surface>> {
        let surface = self.surface.take().map(|builder| builder.build(radius_mm)).transpose()?;
        self.summary.surface = surface.as_ref().map(|surface| SurfaceSummary {
            angles: surface.angles,
            rings: surface.z_mm.len(),
            z_mm: [surface.z_mm.first().copied().unwrap_or(f64::NAN), surface.z_mm.last().copied().unwrap_or(f64::NAN)],
            interpolation: surface.interpolation.to_owned(),
            meetings: surface.meetings.clone(),
        });
        Ok(surface)
    }

    fn finish(mut self, surface: Option<&Surface>) -> Result<Summary> {
        for export in self.exports {
            let outputs = export.finish(&self.summary, surface)?;
            self.summary.outputs.extend(outputs);
        }
        if let Some(path) = self.summary_path {
            self.summary.outputs.push(path.clone());
            let text = serde_json::to_vec_pretty(&self.summary)
                .map_err(|error| Error::new("write", path.display().to_string(), error))?;
            crate::atomic_file::write(path, &text)?;
        }
        Ok(self.summary)
    }
}

/// Recorded turns on their way to form and motion.
struct Line<'a> {
    rig: &'a Rig,
    recording: &'a dyn Recording,
    conditioners: &'a [Box<dyn Conditioner>],
    averager: &'a dyn Averager,
    separator: &'a dyn StationSeparator,
}

impl Line<'_> {
    /// Works on all stations, and on the inputs' checksums meanwhile.
    ///
    /// Each worker takes the next station and then waits for its turn to hand the result on: results come in order,
    /// and no more of them exist at a time than there are workers.
    fn run(
        &self,
        threads: Option<NonZeroUsize>,
        observer: &dyn Observer,
        gathering: &mut Gathering,
    ) -> Result<Vec<Input>> {
        let stations = self.recording.stations();
        observer.begin(stations.len());
        let available = || std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
        let workers = threads.map_or_else(available, NonZeroUsize::get).clamp(1, stations.len().max(1));
        let next = AtomicUsize::new(0);
        let failed = AtomicBool::new(false);
        let turnstile = Mutex::new((0_usize, Ok(()), gathering));
        let turned = Condvar::new();
        let work = || {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(station) = stations.get(index) else { return };
                let result = if failed.load(Ordering::Relaxed) { None } else { Some(self.station(index, station)) };
                let guard = turnstile.lock().unwrap_or_else(PoisonError::into_inner);
                let mut guard =
                    turned.wait_while(guard, |(turn, _, _)| *turn != index).unwrap_or_else(PoisonError::into_inner);
                let (turn, outcome, gathering) = &mut *guard;
                *turn += 1;
                if let (Some(result), Ok(())) = (result, &outcome) {
                    *outcome = result.and_then(|result| gathering.take(&result, Some(self.rig)));
                    if outcome.is_err() {
                        failed.store(true, Ordering::Relaxed);
                    } else {
                        observer.station(&station.name);
                    }
                }
                drop(guard);
                turned.notify_all();
            }
        };
        let inputs = std::thread::scope(|scope| {
            let checksums =
                scope.spawn(|| self.recording.inputs().iter().map(|path| Input::of(path)).collect::<Result<Vec<_>>>());
            for _ in 1..workers {
                scope.spawn(work);
            }
            work();
            checksums.join()
        });
        let (_, outcome, _) = turnstile.into_inner().unwrap_or_else(PoisonError::into_inner);
        outcome?;
        inputs.unwrap_or_else(|_| Err(Error::new("checksum", "the inputs", "the thread that read them stopped")))
    }

    fn station(&self, index: usize, key: &StationKey) -> Result<StationResult> {
        let profiles: Result<Vec<Profile>> =
            (0..self.rig.setups.len()).map(|setup| self.profile(index, setup)).collect();
        let station = Station { name: key.name.clone(), z_mm: key.z_mm, profiles: profiles? };
        let separation = self.separator.separate(&station)?;
        let angles = station.profiles.first().map_or(0, |profile| profile.samples_per_rev);
        let truth = self.recording.truth(index)?;
        Ok(complete(key.name.clone(), key.z_mm, angles, separation, station.profiles, truth))
    }

    fn profile(&self, station: usize, setup: usize) -> Result<Profile> {
        let mut stream: Box<dyn crate::measurement::SampleStream + '_> =
            Box::new(Inspection::new(self.recording.open(station, setup)?));
        for conditioner in self.conditioners {
            stream = conditioner.attach(stream)?;
        }
        self.averager.average(stream)
    }
}

fn fit_points(
    points: &Points,
    separator: &dyn PointSeparator,
    angles: usize,
    observer: &dyn Observer,
    gathering: &mut Gathering,
) -> Result<()> {
    let separations = separator.separate(points)?;
    observer.begin(separations.len());
    for separation in separations {
        let (name, z_mm) =
            separation.sections.first().map_or((String::new(), f64::NAN), |section| (section.id.clone(), section.z_mm));
        let result = complete(name, z_mm, angles, separation, Vec::new(), None);
        gathering.take(&result, None)?;
        observer.station(&result.station);
    }
    Ok(())
}
