//! A pipeline, from TOML to stages that can only be valid.

use std::path::{Path, PathBuf};

use schemars::{JsonSchema, Schema};
use serde_json::{Value, json};
use toml::{Spanned, de::DeValue};

use super::{
    compare::{self, Candidate},
    diagnose::config::{Diagnose, DiagnoseConfig},
    document::{self, ConfigError, Document, Sources, Table},
    error::{Fault, known_names},
    evaluate::{Evaluate, EvaluateConfig, Limit},
    registry::{Catalogue, Context, Plugin, Registry},
};
use crate::{
    atomic_file::resolved,
    model::Effect,
    rig::{Rig, RigConfig},
    separation::Assessment,
    stage::{
        Averager, Conditioner, Exporter, Loader, PointModel, PointSeparator, Preprocessor, Separator, SourceKind,
        StationModel, StationSeparator, TraceSeparator,
    },
    surface::SurfaceConfig,
};

/// The key whose string value names a file of its own.
pub const INCLUDE_KEY: &str = "rig";

/// A checked pipeline.
pub struct Pipeline {
    /// For results and meshes.
    pub title: String,
    /// Sensors and setups; always there on the [`Route::Turns`].
    pub rig: Option<Rig>,
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
        /// Points to form.
        separator: Box<dyn PointSeparator>,
    },
    /// Measured points with a model for the closed loop, and no form.
    Model {
        /// Points to terms.
        model: Box<dyn PointModel>,
    },
    /// Measured traces along an axis, all at once.
    Traces {
        /// Traces to straightness.
        separator: Box<dyn TraceSeparator>,
    },
}

impl Route {
    /// What its model may lack.
    fn effects(&self) -> Vec<Effect> {
        match self {
            Self::Turns { model, .. } => model.as_ref().map_or_else(Vec::new, |model| model.effects().to_vec()),
            Self::Points { separator } => separator.model().map_or_else(Vec::new, PointModel::effects),
            Self::Model { model } => model.effects(),
            Self::Traces { .. } => Vec::new(),
        }
    }
}

const KEYS: [&str; 11] =
    ["title", "rig", "load", "preprocess", "separate", "compare", "surface", "evaluate", "limit", "diagnose", "export"];

impl Pipeline {
    /// Checks a configuration against the registry and builds every stage.
    ///
    /// # Errors
    /// The first mistake, with its place.
    pub fn from_sources(sources: &Sources, registry: &Registry) -> Result<Self, ConfigError> {
        let document = Document::parse(sources)?;
        Self::build(document.root(), sources, registry).map_err(|fault| document.diagnose(fault).into())
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
            Some(value) => value
                .get_ref()
                .as_str()
                .ok_or_else(|| Fault::span(value.span(), "expected the title in quotes"))?
                .to_owned(),
        };
        let rig = table(root, "rig")?.map(|table| checked::<RigConfig, _>(&table, RigConfig::check)).transpose()?;
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
                (points(registry.separators.build(&separate_table, &context)?, &separate_table, root)?, None)
            }
        };
        let diagnose = table(root, "diagnose")?
            .map(|table| {
                checked::<DiagnoseConfig, _>(&table, |config| {
                    config.check(sources.folder(), loader.kind(), &route.effects())
                })
            })
            .transpose()?
            .unwrap_or_default();
        let compare = tables(root, "compare")?
            .iter()
            .map(|table| compare::candidate(table, registry, &context))
            .collect::<Result<_, _>>()?;
        let evaluate = evaluate(root, &route, rig.as_ref())?;
        let exporters = exporters(root, sources, registry, &context, &route, diagnose.path.as_deref())?;
        Ok(Self {
            title,
            rig,
            loader,
            route,
            separator: compare::plugin_name(&separate_table),
            compare,
            diagnose,
            surface,
            evaluate,
            exporters,
            assessment,
            configuration: document::resolved_text(root, sources)?,
        })
    }
}

impl Pipeline {
    /// Every file that a run writes.
    #[must_use]
    pub fn outputs(&self) -> Vec<PathBuf> {
        let exported = self.exporters.iter().flat_map(|exporter| exporter.outputs());
        exported.chain(self.summary_path()).collect()
    }

    /// Where the summary goes: beside the first export.
    #[must_use]
    pub fn summary_path(&self) -> Option<PathBuf> {
        self.beside_the_first(SUMMARY)
    }

    /// Where the diagnosis goes: where `[diagnose]` says, or beside the first export.
    #[must_use]
    pub fn diagnosis_path(&self) -> Option<PathBuf> {
        self.diagnose.path.clone().or_else(|| self.beside_the_first(DIAGNOSIS))
    }

    fn beside_the_first(&self, name: &str) -> Option<PathBuf> {
        self.exporters.iter().find_map(|exporter| exporter.outputs().first().map(|path| beside(path, name)))
    }
}

const SUMMARY: &str = "summary.json";
const SUMMARY_USE: &str = "where the run's summary goes";
const DIAGNOSIS: &str = "diagnosis.json";
const DIAGNOSIS_USE: &str = "where the diagnosis goes";

fn beside(output: &Path, name: &str) -> PathBuf {
    output.with_file_name(name)
}

/// The route of measured points.
fn points(separator: Separator, separate_table: &Table, root: &Table) -> Result<Route, Fault> {
    match separator {
        Separator::Points(separator) => Ok(Route::Points { separator }),
        Separator::Model(model) => Ok(Route::Model { model }),
        Separator::Traces(separator) => match table(root, "surface")? {
            Some(table) => Err(Fault::span(table.span(), "straightness along one line makes no surface")),
            None => Ok(Route::Traces { separator }),
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
    if let (Route::Traces { .. } | Route::Model { .. }, Some(table)) = (route, configured.as_ref().or(limits.first())) {
        return Err(Fault::span(table.span(), "there is no form here whose values could be chosen or limited"));
    }
    let configured = configured.map(|table| checked::<EvaluateConfig, _>(&table, EvaluateConfig::check)).transpose()?;
    let mut evaluate = configured.unwrap_or_default();
    for table in limits {
        let limit = checked::<Limit, _>(&table, |limit| limit.check(&evaluate, rig))?;
        evaluate.add_limit(limit);
    }
    Ok(evaluate)
}

/// The exporters, none of which writes over what is read or what another file is for.
fn exporters(
    root: &Table,
    sources: &Sources,
    registry: &Registry,
    context: &Context,
    route: &Route,
    diagnosis_path: Option<&Path>,
) -> Result<Vec<Box<dyn Exporter>>, Fault> {
    let mut exporters: Vec<Box<dyn Exporter>> = Vec::new();
    let mut outputs: Vec<_> = sources.files().map(|file| (resolved(file), "read as configuration")).collect();
    outputs.extend(diagnosis_path.map(|path| (resolved(path), DIAGNOSIS_USE)));
    for table in tables(root, "export")? {
        let exporter = registry.exporters.build(&table, context)?;
        match route {
            Route::Traces { .. } if exporter.straightness().is_none() => {
                let fault = Fault::at("plugin", "this exporter takes form; [separate] gives straightness along a line");
                return Err(document::resolve(fault.help("take one that writes tables"), &table));
            }
            Route::Model { .. } => {
                let fault = Fault::at("plugin", "this exporter takes form; [separate] is a model for `diagnose` only");
                return Err(document::resolve(fault.help("name a file by `path` in [diagnose]"), &table));
            }
            _ => {}
        }
        for output in exporter.outputs() {
            let place = resolved(&output);
            if let Some((_, use_of_it)) = outputs.iter().find(|(other, _)| *other == place) {
                let message = format!("{} is already {use_of_it}", output.display());
                return Err(document::resolve(Fault::at("path", message), &table));
            }
            if outputs.iter().all(|(_, use_of_it)| *use_of_it != SUMMARY_USE) {
                outputs.push((resolved(&beside(&output, SUMMARY)), SUMMARY_USE));
                if diagnosis_path.is_none() {
                    outputs.push((resolved(&beside(&output, DIAGNOSIS)), DIAGNOSIS_USE));
                }
            }
            outputs.push((place, "written by an exporter"));
        }
        exporters.push(exporter);
    }
    Ok(exporters)
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
            let assessment =
                separator.assess(averager.max_order()).map_err(|fault| document::resolve(fault, separate_table))?;
            let model = separator.model(&registry.effects);
            Ok((Route::Turns { conditioners, averager, separator, model }, Some(assessment)))
        }
        Separator::Points(_) | Separator::Model(_) | Separator::Traces(_) => {
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

fn required<'a>(root: &Table<'a>, key: &str) -> Result<Table<'a>, Fault> {
    table(root, key)?.ok_or_else(|| {
        document::resolve(Fault::here(format!("missing key `{key}`")).help(format!("add a table [{key}]")), root)
    })
}

fn tables<'a>(root: &Table<'a>, key: &str) -> Result<Vec<Table<'a>>, Fault> {
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

/// JSON Schema of a pipeline file with these plugins.
#[must_use]
pub fn pipeline_schema(registry: &Registry) -> Value {
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "runout pipeline",
        "type": "object",
        "additionalProperties": false,
        "required": ["load", "separate"],
        "properties": {
            "title": { "type": "string", "description": "For results and meshes." },
            "rig": {
                "description": "Sensors and setups, or the path of a file that holds them.",
                "anyOf": [{ "type": "string" }, inline::<RigConfig>()],
            },
            "load": choice(&registry.loaders),
            "preprocess": { "type": "array", "items": choice(&registry.preprocessors) },
            "separate": choice(&registry.separators),
            "compare": { "type": "array", "items": choice(&registry.separators) },
            "surface": inline::<SurfaceConfig>(),
            "evaluate": inline::<EvaluateConfig>(),
            "limit": { "type": "array", "items": inline::<Limit>() },
            "diagnose": inline::<DiagnoseConfig>(),
            "export": { "type": "array", "items": choice(&registry.exporters) },
        },
    })
}

/// Schema of a stage's table: one of the plugins, told apart by `plugin`.
#[must_use]
pub fn choice<S>(catalogue: &Catalogue<S>) -> Value {
    let one = |plugin: &Plugin<S>| {
        let mut schema = plugin.schema().to_value();
        if let Some(object) = schema.as_object_mut() {
            object.remove("$schema");
            object.insert("title".into(), plugin.name.into());
            object.insert("description".into(), plugin.about.into());
            let properties = object.entry("properties").or_insert_with(|| json!({}));
            if let Some(properties) = properties.as_object_mut() {
                properties.insert("plugin".into(), json!({ "const": plugin.name }));
            }
            let required = object.entry("required").or_insert_with(|| json!([]));
            if let Some(required) = required.as_array_mut() {
                required.insert(0, "plugin".into());
            }
        }
        schema
    };
    json!({ "oneOf": catalogue.iter().map(one).collect::<Vec<_>>() })
}

pub(super) fn inline<T: JsonSchema>() -> Schema {
    let settings = schemars::generate::SchemaSettings::default().with(|settings| {
        settings.inline_subschemas = true;
        settings.meta_schema = None;
    });
    settings.into_generator().into_root_schema_for::<T>()
}
