//! JSON Schema of a pipeline file.

use schemars::Schema;
use serde_json::{Value, json};

use super::diagnose::DiagnoseConfig;
use crate::{
    pipeline::{
        document::inline,
        registry::{Catalogue, Plugin, Registry},
    },
    report_head::ReportHead,
    summary::Limit,
};
use runout_evaluate::EvaluateConfig;
use runout_turning::{rig::RigConfig, surface::SurfaceConfig};

/// A table of a pipeline that names no plugin.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct PlainTable {
    /// Its key in TOML.
    pub key: &'static str,
    /// One line for lists.
    pub about: &'static str,
    /// Whether there may be several.
    pub repeats: bool,
    /// JSON Schema of its keys.
    pub schema: Schema,
}

/// The tables of a pipeline that name no plugin.
#[must_use]
pub fn plain_tables() -> [PlainTable; 6] {
    let one = |key, about, schema| PlainTable { key, about, repeats: false, schema };
    [
        one("rig", "sensors, setups and part; or the path of a file with these keys", inline::<RigConfig>()),
        one("surface", "how sections become a surface", inline::<SurfaceConfig>()),
        one("evaluate", "which of the standards' values are computed, and how", inline::<EvaluateConfig>()),
        PlainTable { repeats: true, ..one("limit", "a limit of one value", inline::<Limit>()) },
        one("diagnose", "what the closed loop may consider", inline::<DiagnoseConfig>()),
        one(
            "report",
            "machine, operator, instrument, customer and logo, for the head of reports",
            inline::<ReportHead>(),
        ),
    ]
}

/// JSON Schema of a pipeline file with these plugins.
#[must_use]
pub fn pipeline_schema(registry: &Registry) -> Value {
    let [rig, surface, evaluate, limit, diagnose, report] = plain_tables().map(|table| table.schema);
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "runout pipeline",
        "type": "object",
        "additionalProperties": false,
        "required": ["load", "separate"],
        "properties": {
            "title": { "type": "string", "description": "For results and meshes." },
            "report": report,
            "rig": {
                "description": "Sensors and setups, or the path of a file that has them.",
                "anyOf": [{ "type": "string" }, rig],
            },
            "load": choice(&registry.loaders),
            "preprocess": { "type": "array", "items": choice(&registry.preprocessors) },
            "separate": choice(&registry.separators),
            "compare": { "type": "array", "items": choice(&registry.separators) },
            "surface": surface,
            "evaluate": evaluate,
            "evaluator": { "type": "array", "items": choice(&registry.evaluators) },
            "limit": { "type": "array", "items": limit },
            "effect": { "type": "array", "items": choice(&registry.own_effects) },
            "diagnose": diagnose,
            "export": { "type": "array", "items": choice(&registry.exporters) },
            "check": { "type": "array", "items": choice(&registry.checks) },
        },
    })
}

/// Schema of a stage's table: one of the plugins, distinguished by `plugin`.
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
