//! A pipeline, from TOML to stages that can only be valid.
//!
//! Long because every stage is built here, with what one has to know of another.

use std::path::{Path, PathBuf};

use toml::{Spanned, de::DeValue};

pub use super::schema::{PlainTable, choice, pipeline_schema, plain_tables};
use super::{
    compare::{self, Candidate},
    diagnose::config::{Diagnose, DiagnoseConfig},
    document::{self, ConfigError, Document, Sources, Table},
    error::{Fault, known_names},
    evaluate::{Evaluate, EvaluateConfig, Limit},
    exports::{DIAGNOSIS, Exporting, Exports, beside_the_first, summary_path, written},
    registry::{Context, Registry},
    tables::{self, StationTables},
};
use crate::{
    points::PointColumn,
    stage::{
        Averager, Check, Conditioner, Exporter, Loader, PointModel, PointSeparator, Preprocessor, Request, Separator,
        SourceKind, StationModel, StationSeparator,
    },
};
use runout_closed_loop::Effect;
use runout_table::TableSpec;
use runout_turning::{
    rig::{Rig, RigConfig},
    separation::{Assessment, NOTHING_SEPARATED},
    surface::SurfaceConfig,
};

/// The key whose string value names a file of its own.
pub const INCLUDE_KEY: &str = "rig";

/// A checked pipeline.
#[non_exhaustive]
pub struct Pipeline {
    /// For results and meshes.
    pub title: String,
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
    /// In the order configured.
    pub exporters: Vec<Box<dyn Exporter>>,
    /// The same for the results of a diagnosis: below `diagnosed/`, or where `[diagnose] out` says.
    pub diagnosed: Vec<Box<dyn Exporter>>,
    /// What `check` asks besides.
    pub checks: Vec<Box<dyn Check>>,
    /// The tables of its result, also those that it may lack.
    pub tables: Vec<TableSpec>,
    /// What the separator can tell with the rig.
    pub assessment: Option<Assessment>,
    /// The configuration with includes and overrides in their places, for provenance: it runs again as it is.
    pub configuration: String,
}

/// The ways from a measurement to form.
pub enum Route {
    /// Recorded turns, station by station.
    Turns {
        /// Samples to samples.
        conditioners: Vec<Box<dyn Conditioner>>,
        /// Samples to a profile.
        averager: Box<dyn Averager>,
        /// Profiles to form and motion.
        separator: Box<dyn StationSeparator>,
        /// The separator's model for the closed loop, where it has one.
        model: Option<Box<dyn StationModel>>,
    },
    /// Measured points, all at once.
    Points {
        /// Points to tables, values and form.
        separator: Box<dyn PointSeparator>,
        /// The columns that it takes.
        columns: Vec<PointColumn>,
    },
}

impl Route {
    /// The separator of measured points.
    #[must_use]
    pub fn point_separator(&self) -> Option<&dyn PointSeparator> {
        match self {
            Self::Turns { .. } => None,
            Self::Points { separator, .. } => Some(&**separator),
        }
    }

    /// Whether its result has form.
    #[must_use]
    pub fn gives_form(&self) -> bool {
        self.point_separator().is_none_or(PointSeparator::gives_form)
    }

    /// Whether its result has a surface: form, or heights on a plane.
    fn gives_surface(&self) -> bool {
        self.gives_form() || self.point_separator().is_some_and(PointSeparator::gives_heights)
    }

    /// Whether there is a model for the closed loop.
    fn has_model(&self) -> bool {
        match self {
            Self::Turns { model, .. } => model.is_some(),
            Self::Points { separator, .. } => separator.model().is_some(),
        }
    }

    /// What its model may lack.
    fn effects(&self) -> Vec<Effect> {
        match self {
            Self::Turns { model, .. } => model.as_ref().map_or_else(Vec::new, |model| model.effects().to_vec()),
            Self::Points { separator, .. } => separator.model().map_or_else(Vec::new, PointModel::effects),
        }
    }

    /// Whether only the data name the targets of its effects.
    fn data_name_targets(&self) -> bool {
        let model = self.point_separator().and_then(PointSeparator::model);
        model.is_some_and(PointModel::points_name_targets)
    }

    /// The tables of its result.
    fn tables(&self, assessment: Option<&Assessment>, rig: Option<&Rig>) -> Vec<TableSpec> {
        let mut tables = Vec::new();
        if self.gives_form() {
            tables.extend(StationTables::new(assessment, rig).specs());
        }
        tables.extend(self.point_separator().into_iter().flat_map(PointSeparator::tables));
        let own = tables::named_values(self.gives_form());
        match self {
            Self::Turns { .. } => {}
            Self::Points { .. } if self.gives_form() => tables.push(own.optional()),
            Self::Points { .. } => tables.push(own),
        }
        tables.push(tables::corrections());
        tables
    }
}

const KEYS: [&str; 12] = [
    "title",
    "rig",
    "load",
    "preprocess",
    "separate",
    "compare",
    "surface",
    "evaluate",
    "limit",
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
        let title = match root.get_ref().get("title") {
            None => "Untitled".to_owned(),
            Some(value) => match value.get_ref().as_str() {
                Some(title) if title.contains('\0') => {
                    return Err(Fault::span(value.span(), "the title must not hold NUL, which ends a text in HDF5"));
                }
                Some(title) => title.to_owned(),
                None => return Err(Fault::span(value.span(), "expected the title in quotes")),
            },
        };
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
        let (route, assessment) = match loader.kind() {
            SourceKind::Turns => {
                if rig.is_none() {
                    return Err(Fault::here("missing key `rig`").help("describe sensors and setups in [rig]"));
                }
                let separator = registry.separators.build(&separate_table, &context)?;
                turns(preprocessors, separator, &separate_table, root, registry)?
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
                (points(registry.separators.build(&separate_table, &context)?, &separate_table, root)?, None)
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
            let whole = if shared { compare::with_shared_keys(&table, &separate_table, registry) } else { table };
            compare.push(compare::candidate(&whole, registry, &context)?);
        }
        let checks = tables(root, "check")?
            .iter()
            .map(|table| registry.checks.build(table, &context))
            .collect::<Result<_, _>>()?;
        let evaluate = evaluate(root, &route, rig.as_ref())?;
        let of_result = route.tables(assessment.as_ref(), rig.as_ref());
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
            rig,
            rig_text,
            loader,
            route,
            separator: compare::plugin_name(&separate_table),
            compare,
            diagnose,
            surface,
            evaluate,
            exporters,
            diagnosed,
            checks,
            tables: of_result,
            assessment,
            configuration: document::resolved_text(root, sources)?,
        })
    }
}

impl Pipeline {
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

/// The route of measured points.
fn points(separator: Separator, separate_table: &Table, root: &Table) -> Result<Route, Fault> {
    match separator {
        Separator::Points(separator) => match table(root, "surface")? {
            Some(table) if !separator.gives_form() => {
                Err(Fault::span(table.span(), "this separator gives no form: it makes no surface"))
            }
            _ => Ok(Route::Points { columns: separator.columns(), separator }),
        },
        Separator::Stations(_) => {
            let fault = Fault::at("plugin", "this separator takes recorded turns; [load] gives points");
            Err(document::resolve(fault, separate_table))
        }
    }
}

/// What is evaluated of a form, and the limits of it.
fn evaluate(root: &Table, route: &Route, rig: Option<&Rig>) -> Result<Evaluate, Fault> {
    let configured = table(root, "evaluate")?;
    let limits = tables(root, "limit")?;
    if let (false, Some(table)) = (route.gives_form(), configured.as_ref().or(limits.first())) {
        return Err(Fault::span(table.span(), "there is no form here whose values could be chosen or limited"));
    }
    let measures = rig.filter(|_| matches!(route, Route::Turns { .. }));
    let check = |config: EvaluateConfig| {
        // Sections of measured points are those of their files.
        measures.map_or(Ok(()), |rig| config.check_datum(rig))?;
        config.check()
    };
    let configured = configured.map(|table| checked::<EvaluateConfig, _>(&table, check)).transpose()?;
    let mut evaluate = configured.unwrap_or_default();
    if let Some(rig) = measures {
        evaluate.add_faces(rig);
    }
    for table in limits {
        let limit = checked::<Limit, _>(&table, |limit| limit.check(&evaluate, rig))?;
        evaluate.add_limit(limit);
    }
    Ok(evaluate)
}

fn turns(
    preprocessors: Vec<(Preprocessor, Table)>,
    separator: Separator,
    separate_table: &Table,
    root: &Table,
    registry: &Registry,
) -> Result<(Route, Option<Assessment>), Fault> {
    let mut conditioners = Vec::new();
    let mut averager = None;
    for (preprocessor, table) in preprocessors {
        if averager.is_some() {
            let fault = Fault::at("plugin", "no preprocessor can follow the one that averages the turns");
            return Err(document::resolve(fault.help("move it above"), &table));
        }
        match preprocessor {
            Preprocessor::Conditioner(conditioner) => conditioners.push(conditioner),
            Preprocessor::Averager(found) => averager = Some(found),
        }
    }
    let averager = averager.ok_or_else(|| {
        let fault = Fault::at("preprocess", "the turns are never averaged");
        document::resolve(fault.help("end [[preprocess]] with plugin = \"synchronous-average\""), root)
    })?;
    match separator {
        Separator::Stations(separator) => {
            let mut assessment =
                separator.assess(averager.max_order()).map_err(|fault| document::resolve(fault, separate_table))?;
            if assessment.tells_no_form() {
                assessment.notes.insert(0, NOTHING_SEPARATED.into());
            }
            let model = separator.model(&registry.effects);
            Ok((Route::Turns { conditioners, averager, separator, model }, Some(assessment)))
        }
        Separator::Points(_) => {
            let fault = Fault::at("plugin", "this separator takes measured points; [load] gives recorded turns");
            Err(document::resolve(fault, separate_table))
        }
    }
}

/// Reads a table and checks it, with the places of the check's faults resolved.
///
/// # Errors
/// The first mistake.
pub fn checked<C: serde::de::DeserializeOwned, T>(
    table: &Table,
    check: impl FnOnce(C) -> Result<T, Fault>,
) -> Result<T, Fault> {
    check(document::read(table)?).map_err(|fault| document::resolve(fault, table))
}

/// A top-level table, where there is one.
///
/// # Errors
/// When the key holds something else.
pub fn table<'a>(root: &Table<'a>, key: &str) -> Result<Option<Table<'a>>, Fault> {
    match root.get_ref().get_key_value(key) {
        None => Ok(None),
        Some((name, value)) => match value.get_ref() {
            // The key is the better place to point at: the table's own span may be all its lines.
            DeValue::Table(table) => Ok(Some(Spanned::new(name.span(), table.clone()))),
            other => Err(Fault::span(value.span(), format!("expected a table `{key}`, found {}", other.type_str()))),
        },
    }
}

/// A top-level table that has to be there.
///
/// # Errors
/// When it is not.
pub(super) fn required<'a>(root: &Table<'a>, key: &str) -> Result<Table<'a>, Fault> {
    table(root, key)?.ok_or_else(|| {
        document::resolve(Fault::here(format!("missing key `{key}`")).help(format!("add a table [{key}]")), root)
    })
}

/// Top-level tables of one name, in their order; none where there is none.
///
/// # Errors
/// When the key holds something else.
pub(super) fn tables<'a>(root: &Table<'a>, key: &str) -> Result<Vec<Table<'a>>, Fault> {
    let Some(value) = root.get_ref().get(key) else { return Ok(Vec::new()) };
    let expected = |span, found: &str| Fault::span(span, format!("expected tables [[{key}]], found {found}"));
    match value.get_ref() {
        DeValue::Array(items) => items
            .iter()
            .map(|item| match item.get_ref() {
                DeValue::Table(table) => Ok(Spanned::new(item.span(), table.clone())),
                other => Err(expected(item.span(), other.type_str())),
            })
            .collect(),
        other => Err(expected(value.span(), other.type_str())),
    }
}
