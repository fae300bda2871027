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
    traces,
};
pub use super::{
    result::{RunInfo, StationResult},
    summary::{
        CaptureSummary, LostOrders, MotionTruth, RejectedTurnSummary, SectionSummary, StationSummary,
        StraightnessSummary, StraightnessValues, Summary, SurfaceSummary,
    },
};
use crate::{
    Error, Result,
    atomic_file::{PendingFile, commit_all, resolved},
    inspection::Inspection,
    measurement::{Recording, StationKey},
    points::Points,
    profile::Profile,
    provenance::{Input, Provenance, VERSION},
    rig::Rig,
    separation::Separation,
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
    let inputs = match &source {
        Source::Turns(recording) => recording.inputs(),
        Source::Points(points) => vec![points.input.clone()],
    };
    spare_inputs(pipeline, &inputs)?;
    if let (Source::Points(points), Route::Traces { separator }) = (&source, &pipeline.route) {
        return traces::run(pipeline, points, &**separator);
    }
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

/// χ² per degree of freedom above which a run warns: chance and coarse covariances stay well below it.
const MISFIT_CHI2: f64 = 4.0;

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
        Ok(Self {
            exports: exports?,
            surface: wanted.then(|| SurfaceBuilder::new(&pipeline.surface)),
            summary_path: pipeline.summary_path(),
            summary: begun(pipeline),
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
        self.summary.warnings.extend(misfit(&self.summary.stations));
        let mut complete = Vec::new();
        for export in self.exports {
            complete.extend(export.finish(&self.summary, surface)?);
        }
        conclude(self.summary, complete, self.summary_path)
    }
}

/// A summary of nothing yet.
pub(super) fn begun(pipeline: &Pipeline) -> Summary {
    Summary {
        title: pipeline.title.clone(),
        provenance: Provenance {
            program: format!("runout {VERSION}"),
            configuration: pipeline.configuration.clone(),
            inputs: Vec::new(),
        },
        lost_orders: pipeline.assessment.as_ref().map(LostOrders::from).unwrap_or_default(),
        stations: Vec::new(),
        surface: None,
        straightness: None,
        outputs: Vec::new(),
        warnings: pipeline.assessment.as_ref().map(|found| found.notes.clone()).unwrap_or_default(),
    }
}

/// Writes the summary and gives all files their names.
pub(super) fn conclude(
    mut summary: Summary,
    mut complete: Vec<PendingFile>,
    summary_path: Option<PathBuf>,
) -> Result<Summary> {
    let named = complete.iter().map(|file| file.destination().to_path_buf());
    summary.outputs = named.chain(summary_path.clone()).collect();
    if let Some(path) = summary_path {
        let file = PendingFile::new(path)?;
        let text = serde_json::to_vec_pretty(&summary).map_err(|error| file.failure(error))?;
        std::fs::write(file.path(), text).map_err(|error| file.failure(error))?;
        complete.push(file);
    }
    commit_all(complete)?;
    Ok(summary)
}

/// Refuses to write over what the run reads.
fn spare_inputs(pipeline: &Pipeline, inputs: &[PathBuf]) -> Result<()> {
    let read: Vec<PathBuf> = inputs.iter().map(|input| resolved(input)).collect();
    for output in pipeline.outputs() {
        if read.contains(&resolved(&output)) {
            let problem = "it is what the run reads";
            return Err(Error::new("write", output.display().to_string(), problem).help("export to another path"));
        }
    }
    Ok(())
}

/// What a rig that is not as declared looks like: a residual far above what the turns' scatter lets expect.
fn misfit(stations: &[StationSummary]) -> Option<String> {
    let beyond = stations.iter().filter(|station| station.chi2_per_dof.is_some_and(|chi2| chi2 > MISFIT_CHI2));
    let count = beyond.clone().count();
    let worst =
        beyond.max_by(|a, b| a.chi2_per_dof.unwrap_or_default().total_cmp(&b.chi2_per_dof.unwrap_or_default()))?;
    let left = worst.residual_rms_um.unwrap_or(f64::NAN);
    let expected = worst.expected_residual_rms_um.unwrap_or(f64::NAN);
    Some(format!(
        "at {count} of {} stations the readings contradict each other: the fit leaves up to {left:.4} µm rms ({}), where \
         the turns' scatter lets expect {expected:.4}; something is not as the rig declares it, and the stated \
         uncertainties, which come from that scatter alone, do not cover it",
        stations.len(),
        worst.station,
    ))
}

/// Refuses what is not a number where the layout could tell one.
fn finite(station: &str, separation: &Separation) -> Result<()> {
    let width = separation.unknowns.len().max(1);
    let told = separation.estimate.iter().zip(&separation.observable);
    match told.enumerate().find(|(_, (value, told))| **told && !value.is_finite()) {
        None => Ok(()),
        Some((index, _)) => {
            let quantity = separation.unknowns[index % width].id();
            let problem = format!("{quantity} of order {} comes out as no number", index / width);
            Err(Error::new("separate", format!("station {station}"), problem)
                .help("look for absurd readings, and check the rig's radius and positions"))
        }
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
        finite(&key.name, &separation)?;
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
