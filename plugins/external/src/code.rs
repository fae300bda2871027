//! Plugins whose stage is code of this process: the same requests, answers and checks as of a program.

use std::{path::PathBuf, sync::Arc};

use runout_core::{
    closed_loop::Parameter,
    fault::Fault,
    pipeline::{Context, Plugin, Registry},
};
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Map, Value};

use crate::{
    config::{self, Gives},
    point_effect::of_points,
    responder::Code,
    session::Session,
    values::Symbol,
};

/// What code does, with what a pipeline file says of a program in its place.
#[derive(Debug, Clone)]
pub enum CodeKind {
    /// It separates turns.
    Turns,
    /// It separates points with these columns.
    Points {
        /// Of numbers, at least one.
        columns: Vec<String>,
        /// Of texts.
        labels: Vec<String>,
        /// Values that limits may name; nothing else is given where there are some.
        symbols: Vec<Symbol>,
    },
    /// It is an effect of points with these parameters, at least one, and takes these columns.
    Effect {
        /// What it is described by.
        parameters: Vec<Parameter>,
        /// Of numbers, at least one.
        columns: Vec<String>,
        /// Of texts.
        labels: Vec<String>,
    },
    /// It changes averages.
    Preprocessor,
    /// It loads points or recorded turns.
    Loader(Gives),
    /// It computes these values, at least one.
    Evaluator(Vec<Symbol>),
    /// It writes files.
    Exporter,
}

/// Keys of a stage that is code.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Keys {
    /// What the code gets as `config`.
    #[serde(default)]
    config: Map<String, Value>,
}

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct LoaderKeys {
    /// The file that it reads, relative to the TOML. Its checksum belongs to the result.
    path: PathBuf,
    /// What the code gets as `config`.
    #[serde(default)]
    config: Map<String, Value>,
}

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ExporterKeys {
    /// Folder of the files, relative to the TOML. Made where it is missing.
    path: PathBuf,
    /// Names of the files that it writes, at least one.
    files: Vec<String>,
    /// What the code gets as `config`.
    #[serde(default)]
    config: Map<String, Value>,
}

/// Registers code under its name, which lasts as long as the process, as one line about it does.
///
/// # Errors
/// When an effect has no columns of numbers, or one twice.
pub fn register_code(
    registry: &mut Registry,
    (name, about): (&'static str, &'static str),
    kind: CodeKind,
    code: Arc<dyn Code>,
) -> Result<(), Fault> {
    match kind {
        CodeKind::Effect { parameters, columns, labels } => {
            let (session, config) = (Session::new(code), Value::Object(Map::new()));
            registry.effects.add(of_points(session, config, (name, about), parameters, [&columns, &labels])?);
        }
        CodeKind::Turns => registry.separators.add(Plugin::made(name, about, move |keys: Keys, context| {
            config::turns(Arc::clone(&code).into(), Value::Object(keys.config), context)
        })),
        CodeKind::Points { columns, labels, symbols } => {
            registry.separators.add(Plugin::made(name, about, move |keys: Keys, _: &Context| {
                let keys = Value::Object(keys.config);
                config::points(Arc::clone(&code).into(), keys, &columns, &labels, &symbols).map_err(of_object)
            }));
        }
        CodeKind::Preprocessor => {
            registry.preprocessors.add(Plugin::made(name, about, move |keys: Keys, context: &Context| {
                config::corrector(Arc::clone(&code).into(), Value::Object(keys.config), context)
            }));
        }
        CodeKind::Loader(gives) => {
            registry.loaders.add(Plugin::made(name, about, move |keys: LoaderKeys, context: &Context| {
                config::loader(Arc::clone(&code).into(), Value::Object(keys.config), &keys.path, gives, context)
            }));
        }
        CodeKind::Evaluator(symbols) => {
            registry.evaluators.add(Plugin::made(name, about, move |keys: Keys, _: &Context| {
                config::evaluator(Arc::clone(&code).into(), Value::Object(keys.config), &symbols).map_err(of_object)
            }));
        }
        CodeKind::Exporter => {
            registry.exporters.add(Plugin::made(name, about, move |keys: ExporterKeys, context: &Context| {
                let ExporterKeys { path, files, config: keys } = keys;
                config::exporter(Arc::clone(&code).into(), Value::Object(keys), &path, files, context)
            }));
        }
    }
    Ok(())
}

/// A fault of what the object says of itself: it has no key in the file.
fn of_object(fault: Fault) -> Fault {
    Fault::at("plugin", fault.message)
}
