//! A result on its way to the exporters.

use std::path::PathBuf;

use super::{
    config::{
        Pipeline,
        exports::{summary_path, written},
    },
    evaluations::Evaluations,
    station_summary::summarise,
    tables::{StationTables, consistency_rows, correction_rows, named_value_rows},
    warnings::{Warnings, findings, of_checks, of_stations},
};
use crate::{
    atomic_file::{FolderLock, PendingFile, commit_all, commit_last_after_others},
    stage::{About, Completed, Export, Exporter, PointSeparator, ResultInfo, Takes},
    summary::{LostOrders, PartSummary, Summary, SurfaceSummary, Value},
};
use runout_closed_loop::{correction::Correction, diagnosis, diagnosis::Diagnosis};
use runout_consistency::Check;
use runout_error::{Error, Result};
use runout_evaluate::{self as values, Evaluate, Evaluated, EvaluatedStation, Group, height_grid::HeightGrid};
use runout_table::{TableRows, TableSpec};
use runout_turning::{
    measurement::StationKey,
    provenance::Input,
    rig::Rig,
    surface::{Surface, SurfaceBuilder},
};

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

/// Gives a result to the exporters piece by piece, and keeps what its summary needs.
#[allow(clippy::struct_excessive_bools, reason = "facts of a pipeline, each of which is asked for by itself")]
pub(super) struct ResultWriter {
    exports: Vec<Box<dyn Export>>,
    evaluations: Evaluations,
    /// Whether an exporter or an evaluator takes tables.
    tables_wanted: bool,
    specs: Vec<TableSpec>,
    pub(super) station_tables: StationTables,
    /// Whether the result has form.
    of_form: bool,
    /// Sections for a surface, or for values of all of them.
    sections: Option<SurfaceBuilder>,
    surface: SurfaceUse,
    angles: usize,
    evaluate: Evaluate,
    /// Whether the sections' centres and mean radii are known.
    placed: bool,
    interrupted: bool,
    /// Signs and references of a domain's own tables.
    convention: String,
    /// Heights on a plane.
    heights: Option<HeightGrid>,
    summary: Summary,
    warnings: Warnings,
    /// What the closed loop found.
    diagnosis: Option<Diagnosis>,
    /// What a run of the same pipeline warns of, where this is another result.
    of_run: Vec<String>,
    summary_path: Option<PathBuf>,
    /// Inputs besides what is loaded.
    named_files: Vec<PathBuf>,
    /// Whether the result is a part of a data set.
    in_data_set: bool,
    /// Given back last.
    lock: FolderLock,
}

impl ResultWriter {
    /// Begins the exports of these exporters; `stations` are those that will come, where they are known.
    pub(super) fn begin(pipeline: &Pipeline, exporters: &[Box<dyn Exporter>], stations: &[StationKey]) -> Result<Self> {
        let info = ResultInfo {
            title: pipeline.title.clone(),
            tables: pipeline.tables.clone(),
            // Names of chosen directions are as long as their angles are written.
            longest_name: longest_name(pipeline.rig.as_ref(), stations)
                .filter(|_| pipeline.evaluate.directions.is_empty()),
        };
        let outputs = written(exporters, &pipeline.tables);
        let files = outputs.iter().map(PathBuf::as_path);
        let lock = if pipeline.in_data_set { FolderLock::covering(files) } else { FolderLock::of(files) }?;
        let tested = pipeline.route.point_separator().is_some_and(PointSeparator::needs_surface);
        let takes = |takes: Takes| exporters.iter().any(|exporter| exporter.takes() == takes);
        let evaluate = pipeline.evaluate.clone();
        let needed = takes(Takes::Surface) || (evaluate.needs_surface() && !evaluate.all);
        let surface = match (needed, tested || evaluate.all || takes(Takes::TablesAndSurface)) {
            (true, _) => SurfaceUse::Needed,
            (false, true) => SurfaceUse::WhereThere,
            (false, false) => SurfaceUse::Unused,
        };
        let gathered = surface != SurfaceUse::Unused || evaluate.has(Group::Cylindricity);
        Ok(Self {
            exports: exporters.iter().map(|exporter| exporter.begin(&info)).collect::<Result<_>>()?,
            tables_wanted: takes(Takes::Tables) || takes(Takes::TablesAndSurface) || !pipeline.evaluators.is_empty(),
            evaluations: Evaluations::begin(&pipeline.evaluators, &info)?,
            specs: pipeline.tables.clone(),
            station_tables: StationTables::new(pipeline.assessment.as_ref(), pipeline.rig.as_ref())
                .of_stations(stations.len()),
            of_form: pipeline.route.gives_form(),
            sections: (gathered && pipeline.route.gives_form()).then(|| SurfaceBuilder::new(&pipeline.surface)),
            surface,
            angles: pipeline.surface.angles,
            evaluate,
            placed: pipeline.route.point_separator().is_some(),
            interrupted: false,
            convention: String::new(),
            heights: None,
            summary: begun(pipeline),
            warnings: noted(pipeline),
            diagnosis: None,
            of_run: Vec::new(),
            summary_path: summary_path(exporters, &pipeline.tables),
            named_files: pipeline.named_files.clone(),
            in_data_set: pipeline.in_data_set,
            lock,
        })
    }

    /// Takes a station's form and motion.
    pub(super) fn take(&mut self, station: &EvaluatedStation, rig: Option<&Rig>) -> Result<()> {
        let result = &station.result;
        self.interrupted |= result.separation.sections.iter().any(|section| !section.gaps.is_empty());
        let tables = self.station_tables.rows_of(station, self.tables_wanted)?;
        self.write(&tables)?;
        if let Some(sections) = &mut self.sections {
            sections.add(result);
        }
        rig.iter().for_each(|_| self.summary.lost_orders.add_those_of(&result.separation));
        self.summary.stations.push(summarise(station, rig));
        let checks = &result.separation.residual.checks;
        self.summary.consistency.extend(checks.iter().map(|check| check.clone().within(&result.station)));
        Ok(())
    }

    /// Takes rows of tables.
    pub(super) fn write(&mut self, tables: &[TableRows]) -> Result<()> {
        for TableRows { table, rows } in tables {
            let spec = self.specs.iter().find(|spec| spec.name == *table).ok_or_else(|| {
                Error::new("export", format!("the table {table}"), "the separator did not declare it")
            })?;
            for export in &mut self.exports {
                export.rows(spec, rows)?;
            }
            self.evaluations.rows(spec, rows)?;
        }
        Ok(())
    }

    /// Takes the values of the evaluators, and gives what they remark.
    fn evaluate(&mut self) -> Result<Vec<String>> {
        let known = if self.evaluations.is_empty() { Vec::new() } else { self.value_rows()? };
        let found = self.evaluations.finish(&self.specs, &known, &self.summary)?;
        self.summary.values.extend(found.values);
        Ok(found.remarks)
    }

    /// Rows of the tables of values.
    fn value_rows(&self) -> Result<Vec<TableRows>> {
        let own = &self.summary.values;
        if !self.of_form {
            return Ok(vec![named_value_rows(own, false)?]);
        }
        let named = (!own.is_empty()).then(|| named_value_rows(own, true)).transpose()?;
        Ok(std::iter::once(self.station_tables.value_rows(&self.summary)?).chain(named).collect())
    }

    /// Takes a domain's own values, those of the standards of what it offers beside form, and the convention of its tables.
    pub(super) fn take_values(&mut self, values: Vec<Value>, evaluated: Evaluated, convention: String) {
        self.summary.values = evaluated.values.into_iter().chain(values).collect();
        self.note(evaluated.remarks);
        self.convention = convention;
    }

    /// Takes the tests of the points on themselves.
    pub(super) fn take_checks(&mut self, checks: Vec<Check>) {
        self.summary.consistency.extend(checks);
    }

    /// The surface, where someone takes it; and the values of all sections together.
    pub(super) fn build_surface(&mut self, radius_mm: f64) -> Result<Option<Surface>> {
        let Some(builder) = self.sections.take() else { return Ok(None) };
        let evaluate = &self.evaluate;
        if evaluate.has(Group::Cylindricity) || evaluate.needs_surface() {
            self.summary.part = values::part_summary(builder.sections(), self.angles, evaluate, radius_mm, self.placed);
        }
        match self.surface {
            SurfaceUse::Unused => return Ok(None),
            SurfaceUse::WhereThere if builder.is_flat() => return Ok(None),
            SurfaceUse::WhereThere | SurfaceUse::Needed => {}
        }
        let (surface, uncertain) = builder.build(radius_mm)?;
        if evaluate.needs_surface() {
            let part = self.summary.part.get_or_insert_with(PartSummary::default);
            values::add_generatrices(part, &uncertain, radius_mm, self.placed, evaluate);
            values::add_areal(part, &surface, &uncertain, if self.placed { 0 } else { 2 }, evaluate)?;
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

    /// Takes what the closed loop found, and what a run of the same pipeline warns of.
    pub(super) fn diagnosed(&mut self, diagnosis: Diagnosis, of_run: Vec<String>) {
        self.diagnosis = Some(diagnosis);
        self.of_run = of_run;
    }

    /// Takes heights on a plane.
    pub(super) fn take_heights(&mut self, heights: Option<HeightGrid>) {
        self.heights = heights;
    }

    /// Takes what the user should know and that is as it should be.
    pub(super) fn note(&mut self, notes: Vec<String>) {
        self.warnings.note(notes);
    }

    /// Takes the orders that points do not separate.
    pub(super) fn lost_orders(&mut self, lost: Option<diagnosis::LostOrders>) {
        if let Some(lost) = lost {
            self.summary.lost_orders = lost.into();
        }
    }

    /// Warnings and notes of the summary, and of the diagnosis where there is one: the same.
    fn gather_warnings(&mut self, remarks: impl Iterator<Item = String>) {
        let mut warnings = std::mem::take(&mut self.warnings);
        warnings.note(self.station_tables.remark());
        warnings.warn(self.diagnosis.iter_mut().flat_map(|diagnosis| std::mem::take(&mut diagnosis.warnings)));
        warnings.warn(of_checks(&self.summary.consistency, self.summary.stations.is_empty()));
        warnings.warn(remarks);
        warnings.warn(of_stations(&self.summary.stations, &self.summary.consistency, self.interrupted));
        warnings.of_run(std::mem::take(&mut self.of_run));
        let [all, notes] = warnings.into_parts();
        if let Some(diagnosis) = &mut self.diagnosis {
            (diagnosis.warnings, diagnosis.notes) = (all.clone(), notes.clone());
        }
        (self.summary.warnings, self.summary.notes) = (all, notes);
    }

    /// Completes the exports.
    pub(super) fn finish(
        mut self,
        inputs: Vec<Input>,
        remarks: Vec<String>,
        surface: Option<&Surface>,
    ) -> Result<Finished> {
        self.summary.provenance.inputs = inputs;
        for file in &self.named_files {
            self.summary.provenance.inputs.push(Input::of(file)?);
        }
        self.summary.refute_part();
        let of_evaluators = self.evaluate()?;
        let (limits, unmatched) = values::decide(self.evaluate.limits(), &self.summary.all_values())?;
        self.summary.limits = limits;
        self.gather_warnings(remarks.into_iter().chain(of_evaluators).chain(unmatched));
        let last: Vec<TableRows> =
            self.value_rows()?.into_iter().chain(correction_rows(&self.summary.effects)?).collect();
        self.write(&last)?;
        self.write(consistency_rows(&self.summary.consistency)?.as_slice())?;
        let about = if self.of_form {
            self.station_tables.about(&self.summary)
        } else {
            About { convention: std::mem::take(&mut self.convention), ..About::default() }
        };
        let heights = self.heights.as_ref();
        let completed = Completed {
            summary: &self.summary,
            about: &about,
            surface,
            heights,
            diagnosis: self.diagnosis.as_ref(),
            overview: None,
        };
        let mut complete = Vec::new();
        for export in self.exports {
            complete.extend(export.finish(&completed)?);
        }
        let Self { summary, diagnosis, summary_path, in_data_set, lock, .. } = self;
        Ok(Finished { summary, diagnosis, complete, summary_path, in_data_set, lock })
    }
}

/// Bytes of the longest name that a result can hold; without stations they are not known before.
fn longest_name(rig: Option<&Rig>, stations: &[StationKey]) -> Option<usize> {
    let rig = rig.filter(|_| !stations.is_empty())?;
    let setups = rig.setups.iter().map(|setup| &setup.id);
    let sensors = rig.sensors.iter().map(|sensor| &sensor.id);
    let names = rig.sections.iter().chain(setups).chain(sensors).chain(stations.iter().map(|station| &station.name));
    names.map(String::len).max()
}

/// Exports that are complete and wait for their names.
pub(super) struct Finished {
    summary: Summary,
    diagnosis: Option<Diagnosis>,
    complete: Vec<PendingFile>,
    summary_path: Option<PathBuf>,
    in_data_set: bool,
    /// Given back last.
    lock: FolderLock,
}

impl Finished {
    /// The files that will have their names, the summary's among them.
    pub(super) fn outputs(&self) -> Vec<PathBuf> {
        let complete = self.complete.iter().map(PendingFile::destination);
        complete.chain(self.summary_path.as_deref()).map(Into::into).collect()
    }

    /// What it warns of, where nothing of it is wanted but that.
    pub(super) fn into_findings(self) -> Vec<String> {
        findings(self.summary)
    }

    /// What the closed loop found, with all warnings.
    pub(super) fn diagnosis(&mut self) -> Option<Diagnosis> {
        self.diagnosis.take()
    }

    /// Adds a file.
    pub(super) fn add(&mut self, file: PendingFile) {
        self.complete.push(file);
    }

    /// Writes the summary and gives all files their names, one more among them where there is one.
    pub(super) fn commit(self, besides: Option<PendingFile>) -> Result<Summary> {
        self.complete(besides)?.publish()
    }

    /// Writes the summary, the last of the files.
    pub(super) fn complete(mut self, besides: Option<PendingFile>) -> Result<CompleteFiles> {
        self.complete.extend(besides);
        self.summary.outputs = self.outputs();
        let Self { summary, complete: mut files, summary_path, in_data_set, lock, .. } = self;
        if let Some(path) = summary_path {
            let file = PendingFile::new(path)?;
            let text = serde_json::to_vec_pretty(&summary).map_err(|error| file.caused(error))?;
            file.write(&text)?;
            files.push(file);
        }
        Ok(CompleteFiles { summary, files, in_data_set, lock })
    }
}

/// All files of a result, complete under temporary names.
pub(super) struct CompleteFiles {
    summary: Summary,
    files: Vec<PendingFile>,
    in_data_set: bool,
    /// Given back last.
    lock: FolderLock,
}

impl CompleteFiles {
    /// Gives all files their names. This waits for the disk.
    pub(super) fn publish(self) -> Result<Summary> {
        let Self { summary, files, in_data_set, lock } = self;
        // The summary is the last file: it says that the part is complete.
        if in_data_set { commit_last_after_others(files) } else { commit_all(files) }?;
        drop(lock);
        Ok(summary)
    }
}

/// A summary of nothing yet.
fn begun(pipeline: &Pipeline) -> Summary {
    Summary { lost_orders: pipeline.assessment.as_ref().map(LostOrders::from).unwrap_or_default(), ..pipeline.headed() }
}

/// What is known without the data: what the layout and the method cannot observe.
fn noted(pipeline: &Pipeline) -> Warnings {
    let mut warnings = Warnings::default();
    warnings.note(pipeline.assessment.iter().flat_map(|found| found.notes.clone()));
    warnings.note(pipeline.route.point_separator().map(PointSeparator::notes).unwrap_or_default());
    warnings
}
