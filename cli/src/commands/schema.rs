//! `runout schema`: JSON Schemas, from the types that read and write the files.

use std::path::Path;

use runout_core::{
    Error, atomic_file,
    closed_loop::diagnosis::Diagnosis,
    pipeline::{Registry, batch::BatchReport, choice, compare::Comparison, pipeline_schema},
    rig::RigConfig,
    summary::Summary,
};
use schemars::{JsonSchema, generate::SchemaSettings};
use serde_json::{Map, Value, json};

use super::plugins;
use crate::{
    args::SchemaArgs,
    failure::Failure,
    render,
    reports::{check, plan},
};

/// Prints schemas, or writes them to a folder.
///
/// # Errors
/// When the name is unknown or a file cannot be written.
pub(crate) fn execute(args: &SchemaArgs, json: bool, registry: &Registry) -> Result<(), Failure> {
    if let Some(folder) = &args.out {
        let written = write(registry, folder)?;
        return super::print(&json!({ "outputs": written }), json, |_| format!("written: {}\n", written.join(", ")));
    }
    let files = files(registry);
    let schema = match &args.name {
        None => Value::Object(files.into_iter().map(|(name, schema)| (name.to_owned(), schema)).collect()),
        Some(name) => match files.iter().find(|(file, _)| file == name) {
            Some((_, schema)) => schema.clone(),
            None => of_plugin(registry, name, &files.iter().map(|(file, _)| *file).collect::<Vec<_>>())?,
        },
    };
    Ok(render::document(&schema)?)
}

/// The schema of every kind of file.
fn files(registry: &Registry) -> Vec<(&'static str, Value)> {
    vec![
        ("pipeline", pipeline_schema(registry)),
        ("scenario", scenario(registry)),
        ("rig", of::<RigConfig>("runout rig", SchemaSettings::default())),
        ("summary", of::<Summary>("runout summary", SchemaSettings::default().for_serialize())),
        ("diagnosis", of::<Diagnosis>("runout diagnosis", SchemaSettings::default().for_serialize())),
        ("compare", of::<Comparison>("runout compare", SchemaSettings::default().for_serialize())),
        ("batch", of::<BatchReport>("runout batch", SchemaSettings::default().for_serialize())),
        ("check", of::<check::Report>("runout check", SchemaSettings::default().for_serialize())),
        ("plan", of::<plan::Report>("runout plan", SchemaSettings::default().for_serialize())),
        (
            "plan-points",
            of::<plan::PointReport>("runout plan, measured points", SchemaSettings::default().for_serialize()),
        ),
    ]
}

fn write(registry: &Registry, folder: &Path) -> Result<Vec<String>, Failure> {
    let mut written = Vec::new();
    for (name, schema) in files(registry) {
        let path = folder.join(format!("{name}.schema.json"));
        let mut text = serde_json::to_string_pretty(&schema)
            .map_err(|error| Error::caused("write", path.display().to_string(), error))?;
        text.push('\n');
        written.push(atomic_file::write(&path, text.as_bytes())?.display().to_string());
    }
    Ok(written)
}

fn of_plugin(registry: &Registry, name: &str, files: &[&str]) -> Result<Value, Failure> {
    let entries = plugins::entries(registry);
    match plugins::named(&entries, name)[..] {
        [] => Err(plugins::unknown(&entries, name, files)),
        [one] => Ok(one.schema.clone()),
        ref several => {
            let full: Vec<String> = several.iter().map(|entry| format!("`{}/{}`", entry.stage, entry.name)).collect();
            let message = format!("several stages have a plugin `{name}`");
            Err(Failure::Name { message, help: format!("say which: {}", full.join(", ")) })
        }
    }
}

fn of<T: JsonSchema>(title: &str, settings: SchemaSettings) -> Value {
    let mut schema = settings.into_generator().into_root_schema_for::<T>();
    schema.insert("title".to_owned(), title.into());
    schema.to_value()
}

/// A scenario is a simulator's table with a title and an output; its rig may be a file of its own.
fn scenario(registry: &Registry) -> Value {
    let mut schema = choice(&registry.simulators);
    let variants = schema.get_mut("oneOf").and_then(Value::as_array_mut);
    for properties in variants.into_iter().flatten().filter_map(|variant| variant.get_mut("properties")) {
        if let Some(properties) = properties.as_object_mut() {
            include(properties);
        }
    }
    if let Some(root) = schema.as_object_mut() {
        root.insert("$schema".into(), "https://json-schema.org/draft/2020-12/schema".into());
        root.insert("title".into(), "runout scenario".into());
    }
    schema
}

fn include(properties: &mut Map<String, Value>) {
    properties.insert("title".into(), json!({ "type": "string", "description": "For the measurement." }));
    let output = "The measurement file to write, relative to the scenario.";
    properties.insert("output".into(), json!({ "type": "string", "description": output }));
    if let Some(rig) = properties.get_mut("rig") {
        let inline = rig.take();
        *rig = json!({
            "description": "Sensors and setups, or the path of a file that has them.",
            "anyOf": [{ "type": "string" }, inline],
        });
    }
}
