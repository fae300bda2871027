//! `runout completions`: scripts by which a shell completes commands and options.

use clap::CommandFactory;
use serde_json::json;

use crate::{
    args::{CommandLine, CompletionsArgs},
    failure::Failure,
};

/// Prints the script of one shell.
///
/// # Errors
/// When stdout cannot be written to.
pub(crate) fn execute(args: &CompletionsArgs, json: bool) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut CommandLine::command(), "runout", &mut script);
    let script = String::from_utf8_lossy(&script);
    super::print(&json!({ "shell": args.shell.to_string(), "script": script }), json, |_| script.to_string())
}
