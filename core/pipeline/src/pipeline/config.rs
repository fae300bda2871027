//! A pipeline, from TOML to stages that can only be valid.

pub(super) mod candidate;
pub(crate) mod diagnose;
mod effects;
mod evaluate;
pub(super) mod exports;
mod route;
mod schema;

use runout_error::fault::{Fault, known_names};
use runout_evaluate::Evaluate;
use std::path::{Path, PathBuf};

use toml::de::DeValue;

pub use candidate::Candidate;
pub use route::Route;
pub use schema::{PlainTable, choice, pipeline_schema, plain_tables};

use super::{
    document::{self, ConfigError, Document, Sources, Table, checked, required, table, tables},
    registry::{Catalogue, Context, Registry},
    tables::FORM_HARMONICS,
};
use crate::{
    effects::EffectCatalogue,
    report_head::ReportHead,
    stage::{Check, Evaluator, Exporter, Loader, Request, SourceKind},
    summary::{Limit, Summary},
};
use diagnose::{Diagnose, DiagnoseConfig};
use exports::{DIAGNOSIS, Exporting, Exports, beside_the_first, summary_path, written};
use runout_table::TableSpec;
use runout_turning::{
    provenance::{Provenance, VERSION},
    rig::{Rig, RigConfig},
    separation::Assessment,
    surface::SurfaceConfig,
};

/// The key whose string value names a file of its own.
pub const INCLUDE_KEY: &str = "rig";

/// A checked pipeline.
#[non_exhaustive]
pub struct Pipeline {
    /// For results and meshes.
    pub title: String,
    /// What the head of a report says.
    pub head: ReportHead,
    /// Sensors and setups; always there on the [`Route::Turns`].
    pub rig: Option<Rig>,
    /// The rig as it is configured, as a file of its own.
    pub rig_text: Option<String>,
    /// Opens the measurement.
    pub loader: Box<dyn Loader>,
    /// From there to form and motion.
    pub route: Route,
    /// Name of the separator's plugin.
    pub separator: String,
    /// The separators of `[[compare]]`, which `run` leaves alone.
    pub compare: Vec<Candidate>,
    /// What the closed loop may consider.
    pub diagnose: Diagnose,
    /// How sections become a surface.
    pub surface: SurfaceConfig,
    /// Which of the standards' values are computed, and their limits.
    pub evaluate: Evaluate,
    /// What computes values besides, in the order configured.
    pub evaluators: Vec<Box<dyn Evaluator>>,
    /// What models may lack: the registered effects and the pipeline's own.
    pub effects: EffectCatalogue,
    /// In the order configured.
    pub exporters: Vec<Box<dyn Exporter>>,
    /// Exporters of the results of a diagnosis, in the order configured: below `diagnosed/`, or where `[diagnose] out` says.
    pub diagnosed: Vec<Box<dyn Exporter>>,
    /// What `check` asks besides.
    pub checks: Vec<Box<dyn Check>>,
    /// The tables of its result, also those that it may lack.
    pub tables: Vec<TableSpec>,
    /// What is observable by the separator with the rig.
    pub assessment: Option<Assessment>,
    /// Files that stages besides `[load]` name and read: inputs of the result too.
    pub named_files: Vec<PathBuf>,
    /// The configuration with includes and overrides in their places, for provenance: it runs again as it is.
    pub configuration: String,
    /// Whether its result is a part of a data set: a [batch](super::batch) holds the lock on the folder above its files, and its summary,
    /// which comes last, says that it is complete.
    pub(super) in_data_set: bool,
}

const KEYS: [&str; 15] = [
    "title",
    "report",
    "rig",
    "load",
    "preprocess",
    "separate",
    "compare",
    "surface",
    "evaluate",
    "evaluator",
    "limit",
    "effect",
    "diagnose",
    "export",
    "check",
];

impl Pipeline {
    /// Checks a configuration against the registry and builds every stage.
    ///
    /// # Errors
    /// The first mistake, with its place.
    pub fn from_sources(sources: &Sources, registry: &Registry) -> Result<Self, ConfigError> {
        let document = Document::parse(sources)?;
        Self::build(document.root(), sources, registry).map_err(|fault| document.diagnose(fault).into())
    }

    /// Reads and checks a file; paths in it are relative to its folder.
    ///
    /// # Errors
    /// When it cannot be read, and the first mistake, with its place.
    pub fn read(path: &Path, registry: &Registry) -> Result<Self, ConfigError> {
        Self::from_sources(&Sources::read(path, &[], INCLUDE_KEY)?, registry)
    }

    /// Checks a configuration that is there as TOML; paths in it are relative to `folder`.
    ///
    /// # Errors
    /// The first mistake, with its place.
    pub fn from_toml(text: &str, folder: impl Into<PathBuf>, registry: &Registry) -> Result<Self, ConfigError> {
        Self::from_sources(&Sources::from_text("pipeline", text, folder.into(), &[], INCLUDE_KEY)?, registry)
    }

    fn build(root: &Table, sources: &Sources, registry: &Registry) -> Result<Self, Fault> {
        for key in root.get_ref().keys() {
            if !KEYS.contains(&key.get_ref().as_ref()) {
                let fault = Fault::span(key.span(), format!("unknown key `{}`", key.get_ref()));
                return Err(fault.help(known_names(key.get_ref(), KEYS)));
            }
        }
        let title = title(root)?;
        let head = table(root, "report")?
            .map(|table| checked::<ReportHead, _>(&table, |head| head.check(sources.folder())))
            .transpose()?
            .unwrap_or_default();
        let rig_table = table(root, "rig")?;
        let rig = rig_table.as_ref().map(|table| checked::<RigConfig, _>(table, RigConfig::check)).transpose()?;
        let rig_text = rig_table.as_ref().map(document::table_text).transpose()?;
        let context = Context { folder: sources.folder(), rig: rig.as_ref() };
        let surface = table(root, "surface")?
            .map(|table| checked::<SurfaceConfig, _>(&table, SurfaceConfig::check))
            .transpose()?
            .unwrap_or_default();

        let load_table = required(root, "load")?;
        let loader = registry.loaders.build(&load_table, &context)?;
        let separate_table = required(root, "separate")?;
        let mut preprocessors = Vec::new();
        for table in tables(root, "preprocess")? {
            preprocessors.push((registry.preprocessors.build(&table, &context)?, table));
        }
        let effects = effects::effects(root, registry, &context, loader.kind())?;
        let (route, assessment) = match loader.kind() {
            SourceKind::Turns => {
                if rig.is_none() {
                    return Err(Fault::here("missing key `rig`").help("describe sensors and setups in [rig]"));
                }
                let separator = registry.separators.build(&separate_table, &context)?;
                route::turns(preprocessors, separator, &separate_table, root, &effects)?
            }
            SourceKind::Points => {
                if let Some((_, table)) = preprocessors.first() {
                    let fault = Fault::here("measured points take no preprocessor").help("leave [[preprocess]] out");
                    return Err(document::resolve(fault, table));
                }
                if let Some(table) = &rig_table {
                    let fault = Fault::span(table.span(), "measured points take no [rig]");
                    return Err(fault.help("leave it out; [separate] describes how points were measured"));
                }
                let separator = registry.separators.build(&separate_table, &context)?;
                (route::points(separator, &separate_table, root, &effects)?, None)
            }
        };
        let diagnose = table(root, "diagnose")?
            .map(|table| {
                checked::<DiagnoseConfig, _>(&table, |config| {
                    config.check(sources.folder(), loader.kind(), &route.effects(), route.data_name_targets())
                })
            })
            .transpose()?
            .unwrap_or_default();
        let mut compare = Vec::new();
        for table in tables(root, "compare")? {
            let shared = loader.kind() == SourceKind::Points;
            let whole = if shared { candidate::with_shared_keys(&table, &separate_table, registry) } else { table };
            compare.push(candidate::candidate(&whole, registry, &context)?);
        }
        let checks = built(root, "check", &registry.checks, &context)?;
        let evaluators = built(root, "evaluator", &registry.evaluators, &context)?;
        let evaluate = evaluate::evaluate(root, &route, rig.as_ref(), assessment.as_ref(), &evaluators)?;
        let of_result = route.tables(assessment.as_ref(), rig.as_ref(), !evaluators.is_empty());
        let of_result = with_limits(of_result, evaluate.limits());
        let exporting = Exporting {
            registry,
            context: &context,
            gives_surface: route.gives_surface(),
            has_model: route.has_model(),
            tables: &of_result,
            diagnose: &diagnose,
        };
        let Exports { exporters, diagnosed } = exporting.exports(&tables(root, "export")?, sources)?;
        Ok(Self {
            title,
            head,
            rig,
            rig_text,
            loader,
            route,
            separator: candidate::plugin_name(&separate_table),
            compare,
            diagnose,
            surface,
            evaluate,
            evaluators,
            effects,
            exporters,
            diagnosed,
            checks,
            tables: of_result,
            assessment,
            named_files: named_files(root, sources.folder()),
            configuration: document::resolved_text(root, sources)?,
            in_data_set: false,
        })
    }
}

impl Pipeline {
    /// A summary of nothing yet: title, head and what ran.
    pub(super) fn headed(&self) -> Summary {
        let (program, configuration) = (format!("runout {VERSION}"), self.configuration.clone());
        let provenance = Provenance { program, configuration, ..Provenance::default() };
        Summary { title: self.title.clone(), head: self.head.clone(), provenance, ..Summary::default() }
    }

    /// What it wants of the files that are loaded.
    #[must_use]
    pub fn request(&self) -> Request<'_> {
        let columns = match &self.route {
            Route::Turns { .. } => &[][..],
            Route::Points { columns, .. } => columns,
        };
        Request { rig: self.rig.as_ref(), columns }
    }

    /// Every file that a run writes.
    #[must_use]
    pub fn outputs(&self) -> Vec<PathBuf> {
        written(&self.exporters, &self.tables)
    }

    /// Every file that a diagnosis writes.
    #[must_use]
    pub fn diagnosed_outputs(&self) -> Vec<PathBuf> {
        let more = self.diagnosis_path().into_iter().chain(self.diagnose.write_rig.clone());
        written(&self.diagnosed, &self.tables).into_iter().chain(more).collect()
    }

    /// Where the run's summary goes: beside the first export.
    #[must_use]
    pub fn summary_path(&self) -> Option<PathBuf> {
        summary_path(&self.exporters, &self.tables)
    }

    /// Where the diagnosis goes: where `[diagnose]` says, or beside the first export of the final model.
    #[must_use]
    pub fn diagnosis_path(&self) -> Option<PathBuf> {
        self.diagnose.path.clone().or_else(|| beside_the_first(&self.diagnosed, &self.tables, DIAGNOSIS))
    }

    /// Where a diagnosis may be that describes files which a run replaces: the configured one beside them, and the one that
    /// earlier versions wrote beside them.
    pub(super) fn outdated_diagnoses(&self) -> impl Iterator<Item = PathBuf> {
        let outputs = self.outputs();
        let beside = move |path: &PathBuf| outputs.iter().any(|output| output.parent() == path.parent());
        let configured = self.diagnose.path.clone().filter(beside);
        beside_the_first(&self.exporters, &self.tables, DIAGNOSIS).into_iter().chain(configured)
    }
}

/// The stages of a kind of which there may be several.
fn built<S>(root: &Table, key: &str, catalogue: &Catalogue<S>, context: &Context) -> Result<Vec<S>, Fault> {
    tables(root, key)?.iter().map(|table| catalogue.build(table, context)).collect()
}

/// Tables whose texts may name files that a run reads besides those of `[load]`.
const READERS: [&str; 5] = ["preprocess", "separate", "evaluate", "evaluator", "effect"];

/// The files that texts of a configuration name, each once.
fn named_files(root: &Table, folder: &Path) -> Vec<PathBuf> {
    fn add(value: &DeValue, folder: &Path, found: &mut Vec<PathBuf>) {
        match value {
            DeValue::String(text) if !text.is_empty() && !text.contains('\0') => {
                let path = folder.join(text.as_ref());
                if path.is_file() && !found.contains(&path) {
                    found.push(path);
                }
            }
            DeValue::Array(items) => items.iter().for_each(|item| add(item.get_ref(), folder, found)),
            DeValue::Table(table) => table.values().for_each(|value| add(value.get_ref(), folder, found)),
            _ => {}
        }
    }
    let mut found = Vec::new();
    for table in READERS.iter().filter_map(|key| root.get_ref().get(*key)) {
        add(table.get_ref(), folder, &mut found);
    }
    found
}

/// The tables of a result with the limits of its harmonics in their figure.
fn with_limits(mut tables: Vec<TableSpec>, limits: &[Limit]) -> Vec<TableSpec> {
    let figures = tables.iter_mut().flat_map(|table| &mut table.figures);
    for figure in figures.filter(|figure| figure.id == FORM_HARMONICS) {
        for limit in limits {
            let Some(orders) = limit.orders else { continue };
            let points = (orders.first..=orders.last).filter_map(|order| Some([order as f64, limit.upper_at(order)?]));
            let section = limit.section.as_ref().map(|section| format!(" of section {section}")).unwrap_or_default();
            figure.add_line(format!("limit{section}"), points.collect());
        }
    }
    tables
}

fn title(root: &Table) -> Result<String, Fault> {
    let Some(value) = root.get_ref().get("title") else { return Ok("Untitled".to_owned()) };
    match value.get_ref().as_str() {
        Some(title) if title.contains('\0') => {
            Err(Fault::span(value.span(), "the title must not contain NUL, which ends a text in HDF5"))
        }
        Some(title) => Ok(title.to_owned()),
        None => Err(Fault::span(value.span(), "expected the title in quotes")),
    }
}
