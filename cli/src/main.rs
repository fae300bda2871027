//! `runout`: separates the form of a turning part from the error motion of its spindle.

mod args;
mod builtin;
mod commands;
mod failure;
mod progress;
mod render;

use std::process::ExitCode;

use clap::Parser;

use args::CommandLine;
use failure::Failure;

fn main() -> ExitCode {
    let (json, outcome) = match CommandLine::try_parse() {
        Ok(line) => (line.json, commands::execute(line.command, line.json)),
        Err(error) if error.use_stderr() => (std::env::args_os().any(|word| word == "--json"), Err(error.into())),
        // `--help` and `--version` come this way, and clap knows best how to print them.
        Err(error) => (false, error.print().map_err(Failure::Output)),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(json),
    }
}
