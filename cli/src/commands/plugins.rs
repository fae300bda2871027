//! `runout plugins`: the built-in plugins, and the keys of each.

use runout_core::{
    effects::EffectEntry,
    fault::known_names,
    pipeline::{Catalogue, Registry, plain_tables, put_right},
};
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::{conformance, print};
use crate::{
    args::PluginsArgs,
    failure::Failure,
    render::{columns, keys, table::Table},
};

const EFFECT: &str = "effect";
const TABLE: &str = "table";
/// The word that asks for a test of a program.
const TEST: &str = "test";

/// One plugin, or one of the tables that name none.
#[derive(Debug, Serialize)]
pub(crate) struct Entry {
    /// The table's key in TOML; "simulate" for scenarios, "effect" for what `[diagnose]` looks for, "table" for the tables
    /// that name no plugin.
    pub stage: &'static str,
    /// Kebab-case name in TOML; of a table, its key.
    pub name: &'static str,
    /// What it does.
    pub about: &'static str,
    /// JSON Schema of its keys; of an effect, of what may stand in `values` where it is known.
    pub schema: Value,
    /// Where its keys are written.
    #[serde(skip)]
    place: String,
}

/// Lists the plugins, all or those of one stage, or the keys of those with one name; or tests a program.
///
/// # Errors
/// When the name is unknown, or a check of a program fails.
pub(crate) fn execute(args: &PluginsArgs, json: bool, registry: &Registry) -> Result<(), Failure> {
    match (args.name.as_deref() == Some(TEST), &args.command[..]) {
        (true, [_, ..]) => return conformance::execute(&args.command, args.rig.as_deref(), json),
        (true, []) => {
            let help = "runout plugins test -- python3 my_separator.py".to_owned();
            return Err(Failure::Name { message: "`test` needs the command of a program behind `--`".into(), help });
        }
        (false, [word, ..]) => {
            let help = "only `runout plugins test -- COMMAND` takes a command".to_owned();
            return Err(Failure::Name { message: format!("unexpected `{word}`"), help });
        }
        (false, []) => {}
    }
    let entries = entries(registry);
    match &args.name {
        None => print(&entries.iter().collect::<Vec<_>>(), json, |entries| list(entries)),
        Some(name) => match named(&entries, name) {
            found if found.is_empty() => match entries.iter().filter(|entry| entry.stage == name).collect::<Vec<_>>() {
                stage if stage.is_empty() => Err(unknown(&entries, name, &[])),
                stage => print(&stage, json, |stage| list(stage)),
            },
            found => {
                print(&found, json, |found| found.iter().map(|entry| describe(entry)).collect::<Vec<_>>().join("\n"))
            }
        },
    }
}

/// Every plugin, by stage, every effect, and the tables that name no plugin.
#[must_use]
pub(crate) fn entries(registry: &Registry) -> Vec<Entry> {
    let mut entries = Vec::new();
    add(&mut entries, "load", &registry.loaders);
    add(&mut entries, "preprocess", &registry.preprocessors);
    add(&mut entries, "separate", &registry.separators);
    add(&mut entries, "evaluator", &registry.evaluators);
    add(&mut entries, "export", &registry.exporters);
    add(&mut entries, "simulate", &registry.simulators);
    add(&mut entries, "check", &registry.checks);
    add(&mut entries, EFFECT, &registry.own_effects);
    entries.extend(registry.effects.iter().map(|effect| Entry {
        stage: EFFECT,
        name: effect.name,
        about: effect.about,
        schema: values(effect),
        place: if put_right::IDS.contains(&effect.name) {
            "[diagnose] effects; the recording is put right".into()
        } else {
            "[diagnose] effects, values in known".into()
        },
    }));
    entries.extend(plain_tables().into_iter().map(|table| Entry {
        stage: TABLE,
        name: table.key,
        about: table.about,
        schema: table.schema.to_value(),
        place: if table.repeats { format!("[[{}]]", table.key) } else { format!("[{}]", table.key) },
    }));
    entries
}

fn add<S>(entries: &mut Vec<Entry>, stage: &'static str, catalogue: &Catalogue<S>) {
    entries.extend(catalogue.iter().map(|plugin| Entry {
        stage,
        name: plugin.name,
        about: plugin.about,
        schema: plugin.schema().to_value(),
        place: match stage {
            "simulate" => "a scenario".into(),
            "preprocess" | "evaluator" | "export" | "check" | EFFECT => format!("[[{stage}]]"),
            stage => format!("[{stage}]"),
        },
    }));
}

/// Schema of an effect's parameters.
fn values(effect: &EffectEntry) -> Value {
    let properties: Map<String, Value> = effect
        .parameters
        .iter()
        .map(|parameter| {
            let unit = if parameter.unit == "1" { String::new() } else { format!(" {}", parameter.unit) };
            let description = format!("Usually within ±{}{unit}.", parameter.tolerance);
            (parameter.name.clone(), json!({ "type": "number", "description": description }))
        })
        .collect();
    json!({ "type": "object", "additionalProperties": false, "properties": properties })
}

/// Those that are meant by a name alone, or by `stage/name`.
#[must_use]
pub(crate) fn named<'a>(entries: &'a [Entry], name: &str) -> Vec<&'a Entry> {
    let meant = |entry: &&Entry| match name.split_once('/') {
        Some((stage, name)) => entry.stage == stage && entry.name == name,
        None => entry.name == name,
    };
    entries.iter().filter(meant).collect()
}

/// The failure that says which names there are.
#[must_use]
pub(crate) fn unknown(entries: &[Entry], name: &str, others: &[&str]) -> Failure {
    let mut known: Vec<&str> = entries.iter().map(|entry| entry.name).chain(others.iter().copied()).collect();
    known.sort_unstable();
    known.dedup();
    Failure::Name { message: format!("unknown name `{name}`"), help: known_names(name, known) }
}

fn list(entries: &[&Entry]) -> String {
    let mut table = Table::new(3, ["stage", "plugin", "does"]);
    for entry in entries {
        table.row([entry.stage, entry.name, entry.about]);
    }
    format!("{}\n  The keys of one: runout plugins NAME\n", table.text(columns()))
}

fn describe(entry: &Entry) -> String {
    format!("{} ({}): {}\n\n{}", entry.name, entry.place, entry.about, keys::text(&entry.schema))
}
