//! What each command does.

pub(crate) mod batch;
pub(crate) mod check;
pub(crate) mod compare;
pub(crate) mod completions;
mod conformance;
pub(crate) mod convert;
pub(crate) mod diagnose;
pub(crate) mod example;
pub(crate) mod inspect;
pub(crate) mod new;
pub(crate) mod plan;
pub(crate) mod plugins;
pub(crate) mod report;
pub(crate) mod run;
pub(crate) mod schema;
pub(crate) mod simulate;

use std::path::Path;

use runout_core::pipeline::{INCLUDE_KEY, Pipeline, Registry, document::Sources};
use serde::Serialize;

use crate::{
    args::{Command, LimitArgs, PipelineArgs, WarningArgs},
    failure::Failure,
    render,
};

/// Does what the command line asks for.
///
/// # Errors
/// When it cannot be done.
pub(crate) fn execute(command: Command, json: bool, registry: &Registry) -> Result<(), Failure> {
    match command {
        Command::Run(args) => run::execute(&args, json, registry),
        Command::Check(args) => check::execute(&args, json, registry),
        Command::Diagnose(args) => diagnose::execute(&args, json, registry),
        Command::Compare(args) => compare::execute(&args, json, registry),
        Command::Batch(args) => batch::execute(&args, json, registry),
        Command::Simulate(args) => simulate::execute(&args, json, registry),
        Command::Plan(args) => plan::execute(&args, json, registry),
        Command::Plugins(args) => plugins::execute(&args, json, registry),
        Command::Schema(args) => schema::execute(&args, json, registry),
        Command::Inspect(args) => inspect::execute(&args, json),
        Command::New(args) => new::execute(&args, json, registry),
        Command::Example(args) => example::execute(&args, json),
        Command::Convert(args) => convert::execute(&args, json),
        Command::Report(args) => report::execute(&args, json),
        Command::Completions(args) => completions::execute(&args, json),
    }
}

/// The texts of a pipeline and what they make.
fn pipeline(args: &PipelineArgs, registry: &Registry) -> Result<(Sources, Pipeline), Failure> {
    let sources = Sources::read(&args.pipeline, &args.overrides.set, INCLUDE_KEY)?;
    let pipeline = Pipeline::from_sources(&sources, registry)?;
    Ok((sources, pipeline))
}

/// Fails where limits are not proven to be kept, by their names, if that was asked for.
fn fail_on_limits(open: impl Iterator<Item = String>, args: LimitArgs) -> Result<(), Failure> {
    let open: Vec<String> = open.collect();
    if args.fail_on_limit && !open.is_empty() { Err(Failure::Limit(open)) } else { Ok(()) }
}

/// What is wrong where limits are to decide and there is none.
fn no_limit() -> Failure {
    let message = "--fail-on-limit, and the pipeline has no limit".into();
    Failure::Name { message, help: "add a table [[limit]], or leave --fail-on-limit out".into() }
}

/// Fails where there are warnings, if that was asked for.
fn fail_on(warnings: usize, args: WarningArgs) -> Result<(), Failure> {
    if args.fail_on_warning && warnings > 0 { Err(Failure::Warnings(warnings)) } else { Ok(()) }
}

/// Prints a result: as one JSON document, or as text.
fn print<T: Serialize>(result: &T, json: bool, text: impl FnOnce(&T) -> String) -> Result<(), Failure> {
    let outcome = if json { render::document(result) } else { render::to_stdout(&text(result)) };
    Ok(outcome?)
}

/// A file that a command would write over.
fn there_already(file: &Path, help: &str) -> Failure {
    Failure::Name { message: format!("`{}` is there already", file.display()), help: help.into() }
}
