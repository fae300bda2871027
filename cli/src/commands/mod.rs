//! What each command does.

pub mod check;
pub mod compare;
pub mod diagnose;
pub mod inspect;
pub mod plan;
pub mod plugins;
pub mod run;
pub mod schema;
pub mod simulate;

use runout_core::pipeline::{Pipeline, config::INCLUDE_KEY, document::Sources};
use serde::Serialize;

use crate::{
    args::{Command, PipelineArgs},
    builtin,
    failure::Failure,
    render,
};

/// Does what the command line asks for.
///
/// # Errors
/// When it cannot be done.
pub fn execute(command: Command, json: bool) -> Result<(), Failure> {
    match command {
        Command::Run(args) => run::execute(&args, json),
        Command::Check(args) => check::execute(&args, json),
        Command::Diagnose(args) => diagnose::execute(&args, json),
        Command::Compare(args) => compare::execute(&args, json),
        Command::Simulate(args) => simulate::execute(&args, json),
        Command::Plan(args) => plan::execute(&args, json),
        Command::Plugins(args) => plugins::execute(&args, json),
        Command::Schema(args) => schema::execute(&args, json),
        Command::Inspect(args) => inspect::execute(&args, json),
    }
}

/// The texts of a pipeline and what they make.
fn pipeline(args: &PipelineArgs) -> Result<(Sources, Pipeline), Failure> {
    let sources = Sources::read(&args.pipeline, &args.overrides.set, INCLUDE_KEY)?;
    let pipeline = Pipeline::from_sources(&sources, &builtin::registry())?;
    Ok((sources, pipeline))
}

/// Prints a result: as one JSON document, or as text.
fn print<T: Serialize>(result: &T, json: bool, text: impl FnOnce(&T) -> String) -> Result<(), Failure> {
    let outcome = if json { render::document(result) } else { render::to_stdout(&text(result)) };
    Ok(outcome?)
}
