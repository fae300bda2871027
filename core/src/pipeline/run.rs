//! The run: load → preprocess → separate → evaluate → export, station by station, threads across stations.

use std::{num::NonZeroUsize, path::PathBuf};

use super::{
    config::{Pipeline, Route, summary_path},
    evaluate::{Evaluate, Group, add_areal, add_generatrices, decide, part_summary, steepest_um_per_deg},
    line::{Line, separate},
    outdated,
    overlap::write_behind,
    result::{Evaluation, complete},
    steadiness::{Steadiness, inflated},
    summary::summarise,
    traces,
};
pub use super::{
    evaluate::{Decision, Limit, LimitSummary, LimitValue, PartSummary, PlacedValue},
    result::{RunInfo, StationResult},
    summary::{
        CaptureSummary, LostOrders, MotionTruth, RejectedTurnSummary, SectionSummary, StationSummary,
        StraightnessSummary, StraightnessValues, Summary, SurfaceSummary,
    },
};
use crate::{
    Error, Result,
    atomic_file::{PendingFile, commit_all, resolved},
    evaluate::{
        Value,
        error_motion::{Centre, ErrorMotion},
    },
    model::diagnosis::Correction,
    provenance::{Input, Provenance, VERSION},
    rig::Rig,
    separation::Separation,
    stage::{Export, Exporter, Source, Station},
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
    let (inputs, stations) = match &source {
        Source::Turns(recording) => (recording.inputs(), recording.stations()),
        Source::Points(points) => (vec![points.input.clone()], &[][..]),
    };
    let info = RunInfo::of(pipeline, stations);
    spare_inputs(&pipeline.outputs(), &inputs)?;
    if let (Source::Points(points), Route::Traces { separator }) = (&source, &pipeline.route) {
        return traces::run(pipeline, points, &**separator);
    }
    if matches!(pipeline.route, Route::Model { .. }) {
        let problem = format!("`{}` is a model for the closed loop and separates no form", pipeline.separator);
        return Err(
            Error::new("run", &pipeline.title, problem).help("runout diagnose finds what the declared model lacks")
        );
    }
    let mut gathering = Gathering::begin(pipeline, &pipeline.exporters, &info)?;
    let (inputs, surface, remarks) = match (&source, &pipeline.route) {
        (Source::Turns(recording), Route::Turns { conditioners, averager, separator, .. }) => {
            let rig = pipeline
                .rig
                .as_ref()
                .ok_or_else(|| Error::new("run", &pipeline.title, "recorded turns need a [rig]"))?;
            let wanted = pipeline.evaluate.has(Group::ErrorMotion);
            let directions = &pipeline.evaluate.directions;
            let projection =
                |setup| separator.projection(setup).filter(|_| wanted).map(|found| found.with_lines(directions));
            let line = Line {
                rig,
                recording: &**recording,
                conditioners,
                averager: &**averager,
                hold_out: None,
                projections: (0..rig.setups.len()).map(projection).collect(),
            };
            let evaluation = Evaluation { evaluate: &pipeline.evaluate, radius_mm: rig.part_radius_mm, rig: Some(rig) };
            let work = |index, station: Station| {
                let separation = separate(&**separator, &station, rig.part_radius_mm)?;
                let angles = station.profiles.first().map_or(0, |profile| profile.samples_per_rev);
                let truth = recording.truth(index)?;
                let profiles = station.profiles;
                let result = complete(station.name, station.z_mm, angles, separation, profiles, truth, evaluation);
                let motion_values = error_motion_values(&result, &pipeline.evaluate.centres, rig.part_radius_mm);
                Ok(StationResult { motion_values, ..result })
            };
            let mut steadiness = Steadiness::default();
            let inputs = write_behind(
                |result: StationResult| {
                    steadiness.take(&result.station, &result.profiles, rig);
                    gathering.take(&result, Some(rig))
                },
                |take| line.run(threads, observer, work, take),
            )?;
            let remarks = recording.remarks().into_iter().chain(steadiness.warning(rig)).collect();
            (inputs, gathering.build_surface(rig.part_radius_mm)?, remarks)
        }
        (Source::Points(points), Route::Points { separator }) => {
            let radius_mm = separator.reference_radius_mm(points)?;
            take_sections(separator.separate(points)?, pipeline, radius_mm, observer, &mut gathering)?;
            let surface = gathering.build_surface(radius_mm)?;
            let remarks = separator.remarks(points, surface.as_ref())?;
            (vec![Input::of(&points.input)?], surface, remarks)
        }
        _ => return Err(Error::new("run", &pipeline.title, "the loader gave what it did not declare")),
    };
    let summary = gathering.finish(inputs, remarks, surface.as_ref())?.commit(None)?;
    outdated::remove(pipeline)?;
    Ok(summary)
}

fn error_motion_values(result: &StationResult, centres: &[Centre], radius_mm: f64) -> Vec<Value> {
    let StationResult { station, z_mm, angles, separation, profiles, .. } = result;
    if profiles.iter().all(|profile| profile.spread.is_none()) {
        return Vec::new();
    }
    let forms = separation.unknowns.iter().enumerate().filter(|(_, quantity)| quantity.is_form());
    let steepest = forms.map(|(unknown, _)| steepest_um_per_deg(&result.over_angle(unknown))).fold(0.0, f64::max);
    let slope = steepest.to_degrees() / (1e3 * radius_mm);
    ErrorMotion { station, z_mm: *z_mm, angles: *angles, separation, profiles, slope }.values(centres)
}

/// χ² per degree of freedom above which a run warns: chance and coarse covariances stay well below it.
const MISFIT_CHI2: f64 = 4.0;

/// What a surface over all sections is for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum SurfaceUse {
    /// Nothing.
    Unused,
    /// Tested where there is one: sections at one height have none.
    WhereThere,
    /// An export or a value needs it.
    Needed,
}

/// Results on their way to the exporters.
pub(super) struct Gathering {
    exports: Vec<Box<dyn Export>>,
    /// Sections for a surface, or for values of all of them.
    sections: Option<SurfaceBuilder>,
    surface: SurfaceUse,
    angles: usize,
    evaluate: Evaluate,
    /// Whether the sections' centres and mean radii are known.
    placed: bool,
    /// Whether the part's surface is interrupted somewhere.
    interrupted: bool,
    summary: Summary,
    summary_path: Option<PathBuf>,
}

impl Gathering {
    /// Begins the exports of these exporters.
    pub(super) fn begin(pipeline: &Pipeline, exporters: &[Box<dyn Exporter>], info: &RunInfo) -> Result<Self> {
        let exports: Result<Vec<_>> = exporters.iter().map(|exporter| exporter.begin(info)).collect();
        let tested = matches!(&pipeline.route, Route::Points { separator } if separator.needs_surface());
        let evaluate = pipeline.evaluate.clone();
        let needed =
            exporters.iter().any(|exporter| exporter.needs_surface()) || (evaluate.needs_surface() && !evaluate.all);
        let surface = match (needed, tested || evaluate.all) {
            (true, _) => SurfaceUse::Needed,
            (false, true) => SurfaceUse::WhereThere,
            (false, false) => SurfaceUse::Unused,
        };
        let gathered = surface != SurfaceUse::Unused || evaluate.has(Group::Cylindricity);
        Ok(Self {
            exports: exports?,
            sections: gathered.then(|| SurfaceBuilder::new(&pipeline.surface)),
            surface,
            angles: pipeline.surface.angles,
            evaluate,
            placed: matches!(&pipeline.route, Route::Points { .. }),
            interrupted: false,
            summary_path: summary_path(exporters),
            summary: begun(pipeline),
        })
    }

    pub(super) fn take(&mut self, result: &StationResult, rig: Option<&Rig>) -> Result<()> {
        self.interrupted |= result.separation.sections.iter().any(|section| !section.gaps.is_empty());
        for export in &mut self.exports {
            export.station(result)?;
        }
        if let Some(sections) = &mut self.sections {
            sections.add(result);
        }
        self.summary.stations.push(summarise(result, rig));
        Ok(())
    }

    /// The surface, where someone takes it; and the values of all sections together.
    pub(super) fn build_surface(&mut self, radius_mm: f64) -> Result<Option<Surface>> {
        let Some(builder) = self.sections.take() else { return Ok(None) };
        let evaluate = &self.evaluate;
        if evaluate.has(Group::Cylindricity) || evaluate.needs_surface() {
            self.summary.part = part_summary(builder.sections(), self.angles, evaluate, radius_mm, self.placed);
        }
        match self.surface {
            SurfaceUse::Unused => return Ok(None),
            SurfaceUse::WhereThere if builder.is_flat() => return Ok(None),
            SurfaceUse::WhereThere | SurfaceUse::Needed => {}
        }
        let (surface, uncertain) = builder.build(radius_mm)?;
        if evaluate.needs_surface() {
            let part = self.summary.part.get_or_insert_with(PartSummary::default);
            add_generatrices(part, &uncertain, radius_mm, self.placed, evaluate);
            add_areal(part, &surface, &uncertain, if self.placed { 0 } else { 2 }, evaluate)?;
        }
        self.summary.surface = Some(SurfaceSummary {
            angles: surface.angles,
            rings: surface.z_mm.len(),
            z_mm: [surface.z_mm.first().copied().unwrap_or(f64::NAN), surface.z_mm.last().copied().unwrap_or(f64::NAN)],
            interpolation: surface.interpolation.to_owned(),
            meetings: surface.meetings.clone(),
        });
        Ok(Some(surface))
    }

    /// Says which effects the results are corrected for.
    pub(super) fn corrected_for(&mut self, effects: Vec<Correction>) {
        self.summary.effects = effects;
    }

    /// Completes the exports.
    pub(super) fn finish(
        mut self,
        inputs: Vec<Input>,
        remarks: Vec<String>,
        surface: Option<&Surface>,
    ) -> Result<Finished> {
        self.summary.provenance.inputs = inputs;
        self.summary.warnings.extend(remarks);
        self.summary.warnings.extend(misfit(&self.summary.stations, self.interrupted));
        self.summary.warnings.extend(inflated(&self.summary.stations));
        let (limits, unmatched) = decide(self.evaluate.limits(), &self.summary.values());
        self.summary.limits = limits;
        self.summary.warnings.extend(unmatched);
        let mut complete = Vec::new();
        for export in self.exports {
            complete.extend(export.finish(&self.summary, surface)?);
        }
        Ok(Finished { summary: self.summary, complete, summary_path: self.summary_path })
    }
}

/// Exports that are complete and wait for their names.
pub(super) struct Finished {
    summary: Summary,
    complete: Vec<PendingFile>,
    summary_path: Option<PathBuf>,
}

impl Finished {
    pub(super) fn new(summary: Summary, complete: Vec<PendingFile>, summary_path: Option<PathBuf>) -> Self {
        Self { summary, complete, summary_path }
    }

    /// The files that will have their names, the summary's among them.
    pub(super) fn outputs(&self) -> Vec<PathBuf> {
        outputs(&self.complete, self.summary_path.as_ref())
    }

    /// Adds a file.
    pub(super) fn add(&mut self, file: PendingFile) {
        self.complete.push(file);
    }

    /// Gives all files their names, one more among them where there is one.
    pub(super) fn commit(mut self, besides: Option<PendingFile>) -> Result<Summary> {
        self.complete.extend(besides);
        conclude(self.summary, self.complete, self.summary_path)
    }
}

fn outputs(complete: &[PendingFile], summary_path: Option<&PathBuf>) -> Vec<PathBuf> {
    complete.iter().map(PendingFile::destination).chain(summary_path.map(PathBuf::as_path)).map(Into::into).collect()
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
        warnings: pipeline.assessment.as_ref().map(|found| found.notes.clone()).unwrap_or_default(),
        ..Summary::default()
    }
}

/// Writes the summary and gives all files their names.
pub(super) fn conclude(
    mut summary: Summary,
    mut complete: Vec<PendingFile>,
    summary_path: Option<PathBuf>,
) -> Result<Summary> {
    summary.outputs = outputs(&complete, summary_path.as_ref());
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
pub(super) fn spare_inputs(outputs: &[PathBuf], inputs: &[PathBuf]) -> Result<()> {
    let read: Vec<PathBuf> = inputs.iter().map(|input| resolved(input)).collect();
    for output in outputs {
        if read.contains(&resolved(output)) {
            let problem = "it is what the run reads";
            return Err(Error::new("write", output.display().to_string(), problem).help("export to another path"));
        }
    }
    Ok(())
}

/// What a rig that is not as declared looks like: a residual far above what the noise lets expect.
fn misfit(stations: &[StationSummary], interrupted: bool) -> Option<String> {
    let beyond = stations.iter().filter(|station| station.chi2_per_dof.is_some_and(|chi2| chi2 > MISFIT_CHI2));
    let count = beyond.clone().count();
    let worst =
        beyond.max_by(|a, b| a.chi2_per_dof.unwrap_or_default().total_cmp(&b.chi2_per_dof.unwrap_or_default()))?;
    let left = worst.residual_rms_um.unwrap_or(f64::NAN);
    let expected = worst.expected_residual_rms_um.unwrap_or(f64::NAN);
    let bridged =
        if interrupted { " (or readings go astray where its interruptions are bridged: make them wider)" } else { "" };
    Some(format!(
        "at {count} of {} stations the readings contradict each other: the fit leaves up to {left:.4} µm rms ({}), where \
         the noise measured over the turns lets expect {expected:.4}; something is not as the rig declares it{bridged}, and the stated \
         uncertainties, which come from that noise alone, do not cover it",
        stations.len(),
        worst.station,
    ))
}

/// Completes sections of measured points.
pub(super) fn take_sections(
    sections: Vec<Separation>,
    pipeline: &Pipeline,
    radius_mm: f64,
    observer: &dyn Observer,
    gathering: &mut Gathering,
) -> Result<()> {
    observer.begin(sections.len());
    let evaluation = Evaluation { evaluate: &pipeline.evaluate, radius_mm, rig: None };
    for separation in sections {
        // As many angles as the surface has, or a multiple of them that the highest order fits on.
        let angles = pipeline.surface.angles;
        let angles = angles * (2 * separation.max_order() + 1).div_ceil(angles);
        let (name, z_mm) =
            separation.sections.first().map_or((String::new(), f64::NAN), |section| (section.id.clone(), section.z_mm));
        let result = complete(name, z_mm, angles, separation, Vec::new(), None, evaluation);
        gathering.take(&result, None)?;
        observer.station(&result.station);
    }
    Ok(())
}
