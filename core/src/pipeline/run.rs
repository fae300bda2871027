//! The run: load → preprocess → separate → evaluate → export, station by station, threads across stations.

use std::{
    num::NonZeroUsize,
    path::PathBuf,
    sync::{
        Condvar, Mutex, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::config::{Pipeline, Route};
use crate::{
    Complex64, Error, Result,
    evaluate::{Value, roundness, texture},
    inspection::Inspection,
    measurement::{Recording, StationKey, StationTruth},
    numerics::fourier::Fourier,
    points::Points,
    profile::{Profile, Rejection, TurnLength},
    provenance::{Input, Provenance, VERSION},
    rig::Rig,
    separation::{Assessment, Quantity, Separation},
    stage::{Averager, Conditioner, Export, PointSeparator, Source, Station, StationSeparator},
    surface::{Meeting, Surface, SurfaceBuilder},
};

/// What exporters know when they begin.
#[derive(Debug, Clone)]
pub struct RunInfo {
    /// The pipeline's title.
    pub title: String,
    /// Sensors and setups, where there are any.
    pub rig: Option<Rig>,
    /// What the separator can tell with the rig.
    pub assessment: Option<Assessment>,
}

/// One station, done.
#[derive(Debug, Clone, PartialEq)]
pub struct StationResult {
    /// Its name.
    pub station: String,
    /// Carriage position, in mm.
    pub z_mm: f64,
    /// Equal angles on which form and motion are given.
    pub angles: usize,
    /// Form and motion.
    pub separation: Separation,
    /// The averages that it came from; empty for measured points.
    pub profiles: Vec<Profile>,
    /// The standards' values, section by section.
    pub values: Vec<Vec<Value>>,
    /// What the recording says is true.
    pub truth: Option<StationTruth>,
}

impl StationResult {
    /// One unknown on [`angles`](Self::angles) equal angles from 0: form over the part's, motion over the spindle's.
    /// Orders that the layout cannot tell are left out.
    #[must_use]
    pub fn over_angle(&self, unknown: usize) -> Vec<f64> {
        let motion = !self.separation.unknowns[unknown].is_form();
        let turned = |value: Complex64| if motion { value.conj() } else { value };
        Fourier::new(self.angles).synthesise(self.separation.coefficients(unknown).map(turned)).to_vec()
    }
}

/// What a run found, for people and programs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Summary {
    /// The pipeline's title.
    pub title: String,
    /// Enough to repeat the run.
    pub provenance: Provenance,
    /// Orders that the layout cannot separate.
    pub lost_orders: LostOrders,
    /// One entry a station.
    pub stations: Vec<StationSummary>,
    /// The surface, where one was built.
    pub surface: Option<SurfaceSummary>,
    /// Files written.
    pub outputs: Vec<PathBuf>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Orders that cannot be separated.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct LostOrders {
    /// At which a section's form cannot be told.
    pub form: Vec<usize>,
    /// At which a motion cannot be told.
    pub motion: Vec<usize>,
}

impl From<&Assessment> for LostOrders {
    fn from(assessment: &Assessment) -> Self {
        Self { form: assessment.lost_form_orders(), motion: assessment.lost_motion_orders() }
    }
}

/// One station of a [`Summary`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StationSummary {
    /// Its name.
    pub station: String,
    /// Carriage position, in mm.
    pub z_mm: f64,
    /// What became of the turns, one entry a setup.
    pub captures: Vec<CaptureSummary>,
    /// Form, section by section.
    pub sections: Vec<SectionSummary>,
    /// Root mean square that the fit leaves of the readings, in µm; absent where nothing is redundant.
    pub residual_rms_um: Option<f64>,
    /// What the scatter over the turns lets expect of it, in µm.
    pub expected_residual_rms_um: Option<f64>,
    /// Weighted residual per degree of freedom.
    pub chi2_per_dof: Option<f64>,
    /// True error of the motions, where the recording carries the truth.
    pub truth: Option<MotionTruth>,
    /// What the user should know of this station.
    pub warnings: Vec<String>,
}

/// What became of one capture's turns.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CaptureSummary {
    /// Id of the setup.
    pub setup: String,
    /// Whole turns between the first and the last mark.
    pub turns_recorded: usize,
    /// Turns in the average.
    pub turns_used: usize,
    /// "3 turns: start-up".
    pub trimmed: Vec<String>,
    /// Turns left out of the average, each with its reason.
    pub rejected: Vec<RejectedTurnSummary>,
    /// Mean speed of the turns used.
    pub speed_rpm: Option<f64>,
    /// Filters that the signal went through.
    pub filters: Vec<String>,
}

/// A turn that was left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RejectedTurnSummary {
    /// Counted from 0 at the capture's first mark.
    pub turn: usize,
    /// Sample at which it begins.
    pub start_sample: u64,
    /// Why.
    pub reason: String,
}

/// One section's form.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SectionSummary {
    /// Its id in the rig.
    pub section: String,
    /// Its place, in mm.
    pub z_mm: f64,
    /// Root mean square of the form, in µm.
    pub form_rms_um: f64,
    /// Standard uncertainty of the form at any one angle, from the scatter over the turns, in µm.
    pub form_std_um: Option<f64>,
    /// The standards' values.
    pub values: Vec<Value>,
    /// True error of the form (root mean square over orders from 2 that could be told), where the truth is known.
    pub truth_form_rms_error_um: Option<f64>,
}

/// True errors of the motion: root mean square over orders from 2 that could be told.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MotionTruth {
    /// Of x, in µm.
    pub x_rms_error_um: Option<f64>,
    /// Of y, in µm.
    pub y_rms_error_um: Option<f64>,
    /// Of the tilt about x, in µrad.
    pub tilt_x_rms_error_urad: Option<f64>,
    /// Of the tilt about y, in µrad.
    pub tilt_y_rms_error_urad: Option<f64>,
}

/// The surface of a [`Summary`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SurfaceSummary {
    /// Angles around the part.
    pub angles: usize,
    /// Rings along z.
    pub rings: usize,
    /// First and last ring, in mm.
    pub z_mm: [f64; 2],
    /// How it was filled between the sections.
    pub interpolation: String,
    /// Where sections of different sensors meet, and how well they agree.
    pub meetings: Vec<Meeting>,
}

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
            let surface = gathering.build_surface(separator.nominal_radius_mm())?;
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

/// Adds the standards' values to a separation.
fn complete(
    station: String,
    z_mm: f64,
    angles: usize,
    separation: Separation,
    profiles: Vec<Profile>,
    truth: Option<StationTruth>,
) -> StationResult {
    let mut result = StationResult { station, z_mm, angles, separation, profiles, values: Vec::new(), truth };
    let sections = 0..result.separation.sections.len();
    result.values = sections.map(|section| section_values(&result, section)).collect();
    result
}

fn section_values(result: &StationResult, section: usize) -> Vec<Value> {
    let Some(unknown) = result.separation.position(Quantity::Form(section)) else { return Vec::new() };
    // Level and centring are no form deviation, also where the method knows them.
    let harmonics = result.separation.coefficients(unknown);
    let from_two = harmonics.enumerate().map(|(order, value)| if order < 2 { Complex64::ZERO } else { value });
    let mut fourier = Fourier::new(result.angles);
    let form_um = fourier.synthesise(from_two);
    let highest = result.separation.max_order();
    let lost: Vec<usize> = result.separation.lost_orders(unknown).into_iter().filter(|order| *order >= 2).collect();
    let value = |symbol: &str, value, source: &str, reference: &str| Value {
        symbol: symbol.into(),
        unit: "um".into(),
        value,
        source: source.into(),
        band_upr: [2, highest],
        lost_orders: lost.clone(),
        filter: "none".into(),
        reference: reference.into(),
    };
    vec![
        value("RONt", roundness::ront_lsci_um(form_um), "ISO 12181-1:2011, 3.6.1", "LSCI"),
        value("Ra", texture::ra_um(form_um), "Qiao, Xu, Zhao 2024: unfiltered circumferential profile", "mean line"),
    ]
}

fn summarise(result: &StationResult, rig: Option<&Rig>) -> StationSummary {
    let separation = &result.separation;
    let known = |value: f64| value.is_finite().then_some(value);
    let sections = separation.sections.iter().enumerate().map(|(section, at)| {
        let unknown = separation.position(Quantity::Form(section));
        let rms = unknown.map_or(f64::NAN, |unknown| {
            (0.5 * separation.coefficients(unknown).skip(2).map(|value| value.norm_sqr()).sum::<f64>()).sqrt()
        });
        SectionSummary {
            section: at.id.clone(),
            z_mm: at.z_mm,
            form_rms_um: rms,
            form_std_um: unknown.and_then(|unknown| known(separation.angle_std(unknown))),
            values: result.values.get(section).cloned().unwrap_or_default(),
            truth_form_rms_error_um: true_error(result, Quantity::Form(section)),
        }
    });
    let sections: Vec<_> = sections.collect();
    let has_motion = result.truth.as_ref().is_some_and(|truth| truth.motion.is_some());
    StationSummary {
        station: result.station.clone(),
        z_mm: result.z_mm,
        captures: result.profiles.iter().map(|profile| capture_summary(profile, rig)).collect(),
        sections,
        residual_rms_um: known(separation.residual.rms_um),
        expected_residual_rms_um: known(separation.residual.expected_rms_um),
        chi2_per_dof: known(separation.residual.chi2_per_dof),
        truth: has_motion.then(|| MotionTruth {
            x_rms_error_um: true_error(result, Quantity::X),
            y_rms_error_um: true_error(result, Quantity::Y),
            tilt_x_rms_error_urad: true_error(result, Quantity::TiltX),
            tilt_y_rms_error_urad: true_error(result, Quantity::TiltY),
        }),
        warnings: separation
            .warnings
            .iter()
            .chain(result.profiles.iter().flat_map(|profile| &profile.warnings))
            .cloned()
            .collect(),
    }
}

fn capture_summary(profile: &Profile, rig: Option<&Rig>) -> CaptureSummary {
    let setup = rig.and_then(|rig| rig.setups.get(profile.setup)).map_or_else(String::new, |setup| setup.id.clone());
    let sensor = |index: usize| {
        rig.and_then(|rig| rig.sensors.get(index)).map_or_else(|| format!("sensor {index}"), |sensor| sensor.id.clone())
    };
    let length =
        |turn: &TurnLength| format!("{:.1} samples long, the median turn has {:.1}", turn.samples, turn.median_samples);
    let reason = |rejection: &Rejection| match rejection {
        Rejection::MissingMark(turn) => format!("a mark is missing: {}", length(turn)),
        Rejection::DoubledMark(turn) => format!("a mark was counted twice: {}", length(turn)),
        Rejection::Speed(turn) => format!("off speed: {}", length(turn)),
        Rejection::Defect { sensor: index, kind } => format!("{}: {kind}", sensor(*index)),
        Rejection::Outlier { sensor: index, distance_um } => {
            format!("{}: {distance_um:.3} µm rms from the other turns", sensor(*index))
        }
        Rejection::Incomplete => "not wholly covered by samples".into(),
        Rejection::Angle => "the encoder's angle does not grow steadily by one turn".into(),
    };
    CaptureSummary {
        setup,
        turns_recorded: profile.turns.recorded,
        turns_used: profile.turns.used,
        trimmed: profile.turns.trimmed.iter().map(|trim| format!("{} turns: {}", trim.turns, trim.reason)).collect(),
        rejected: profile
            .turns
            .rejected
            .iter()
            .map(|turn| RejectedTurnSummary {
                turn: turn.turn,
                start_sample: turn.start_sample,
                reason: reason(&turn.reason),
            })
            .collect(),
        speed_rpm: profile.speed_rpm,
        filters: profile.responses.iter().map(|response| response.description.clone()).collect(),
    }
}

/// Root mean square of estimate minus truth over the orders from 2 that could be told.
fn true_error(result: &StationResult, quantity: Quantity) -> Option<f64> {
    let truth = result.truth.as_ref()?;
    let curve = match quantity {
        Quantity::Form(section) => truth.form_um.get(section)?,
        motion => {
            let axis =
                [Quantity::X, Quantity::Y, Quantity::TiltX, Quantity::TiltY].iter().position(|axis| *axis == motion)?;
            &truth.motion.as_ref()?[axis]
        }
    };
    let unknown = result.separation.position(quantity)?;
    if curve.len() < 2 {
        return None;
    }
    let mut fourier = Fourier::new(curve.len());
    let mut harmonics = vec![Complex64::ZERO; fourier.max_order() + 1];
    fourier.analyse(curve.iter().copied(), &mut harmonics);
    let width = result.separation.unknowns.len();
    let told = result.separation.observable.iter().skip(unknown).step_by(width);
    let squares =
        result.separation.coefficients(unknown).zip(told).enumerate().skip(2).filter(|(_, (_, told))| **told).map(
            |(order, (value, _))| {
                let truth = harmonics.get(order).copied().unwrap_or_default();
                let truth = if quantity.is_form() { truth } else { truth.conj() };
                (value - truth).norm_sqr()
            },
        );
    Some((0.5 * squares.sum::<f64>()).sqrt())
}
