//! What commands find, as the documents that they print with `--json`: for programs that show it themselves.

use std::ffi::OsString;

use clap::Parser;
use runout_core::pipeline::{Pipeline, Registry, document::Sources};
use serde_json::Value;

use crate::{
    args::{Command, CommandLine},
    commands::{check as checking, compare, inspect, plan, simulate},
    failure::{Failure, to_value},
    progress::Progress,
};

/// What can be said of a pipeline without its data.
///
/// # Errors
/// When a check of the pipeline fails.
pub fn check(sources: &Sources, pipeline: &Pipeline) -> Result<Value, Failure> {
    to_value(&checking::report(sources, pipeline)?.0)
}

/// The document of `plan`, `simulate` or `inspect`, by the words of its command line without the program's name.
///
/// # Errors
/// When the words are wrong, name another command, or the work fails.
pub fn of_command(words: Vec<OsString>, registry: &Registry) -> Result<Value, Failure> {
    let line = CommandLine::try_parse_from(std::iter::once("runout".into()).chain(words))?;
    match line.command {
        Command::Plan(args) => plan::document(&args, registry, &Progress::hidden()),
        Command::Simulate(args) => to_value(&simulate::report(&args, registry, &Progress::hidden())?),
        Command::Inspect(args) => to_value(&inspect::report(&args.file)?),
        _ => Err(Failure::Name {
            message: "this command gives no document here".into(),
            help: "plan, simulate and inspect do".into(),
        }),
    }
}

/// Refuses names that no separator has.
///
/// # Errors
/// The first that none has.
pub fn separators_known(names: &[String], registry: &Registry) -> Result<(), Failure> {
    compare::known(names, registry)
}
