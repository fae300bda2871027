//! `runout plugins test -- COMMAND`: whether a program keeps what every separator must.

use std::path::Path;

use runout_core::pipeline::document::Sources;
use runout_external::{Check, CheckResult, Conformance};
use serde::Serialize;
use serde_json::Map;

use super::{plan, print};
use crate::{failure::Failure, render};

/// Longest time for one answer, in s.
const TIMEOUT_S: f64 = 60.0;

/// One check, as it is printed.
#[derive(Debug, Serialize)]
struct Line {
    /// What must hold.
    check: &'static str,
    /// "holds", "not-tested" or "fails".
    found: &'static str,
    /// Why it fails or is not tested.
    because: Option<String>,
}

/// Tests a program, one line a check.
///
/// # Errors
/// When the rig or the command cannot be, and when a check fails, after all of them are shown.
pub(super) fn execute(command: &[String], rig: Option<&Path>, json: bool) -> Result<(), Failure> {
    let refused = |fault: runout_core::fault::Fault| Failure::Name {
        message: fault.message,
        help: fault.help.unwrap_or_else(|| "runout plugins test -- python3 my_separator.py".into()),
    };
    let rig = match rig {
        Some(path) => plan::rig(&Sources::read(path, &[], "")?)?,
        None => Conformance::three_sensors().map_err(refused)?,
    };
    let conformance = Conformance { command: command.to_vec(), config: Map::new(), rig, timeout_s: TIMEOUT_S };
    let checks = conformance.run(Path::new(".")).map_err(refused)?;
    let lines: Vec<Line> = checks.into_iter().map(line).collect();
    print(&lines, json, |lines| lines.iter().map(text).collect())?;
    match lines.iter().filter(|line| line.found == "fails").count() {
        0 => Ok(()),
        failed => Err(Failure::Several { failed, thing: "check" }),
    }
}

fn line(Check { name, found }: Check) -> Line {
    let (found, because) = match found {
        CheckResult::Holds => ("holds", None),
        CheckResult::NotTested(because) => ("not-tested", Some(because)),
        CheckResult::Fails(because) => ("fails", Some(because)),
    };
    Line { check: name, found, because }
}

fn text(line: &Line) -> String {
    let because = line.because.as_ref().map(|because| format!(": {}", render::one_line(because))).unwrap_or_default();
    format!("{:11} {}{because}\n", line.found, line.check)
}
