//! What can go wrong, how it is shown, and the exit status that it gives.

use std::{borrow::Cow, io};

use runout_core::{Error, ErrorKind, fault::Diagnostic, pipeline::document::ConfigError};
use serde::Serialize;
use serde_json::{Value, json};

use crate::render::{self, diagnostic};

/// The kind of a mistake in the command line, in the JSON document.
const COMMAND_LINE: &str = "command-line";

/// The exit status of a mistake in the program.
const PROGRAM: u8 = 101;
const REPORT: &str =
    "this is a mistake in the program: report it with the command and its files; no result was published";

/// Why a command did not do its work.
#[derive(Debug)]
pub enum Failure {
    /// The command line is wrong: clap's words.
    CommandLine(Box<clap::Error>),
    /// A name or a value on the command line cannot be.
    Name {
        /// Which, and of what.
        message: String,
        /// The known ones, or what to do.
        help: String,
    },
    /// The configuration is wrong, or cannot be read.
    Configuration(ConfigError),
    /// The data or the work failed.
    Work(Error),
    /// Limits that are not proven to be kept, after a result that has been shown.
    Limit(Vec<String>),
    /// So many warnings, after a result that has been shown with them.
    Warnings(usize),
    /// So many of several things failed (recordings of a batch, checks of a program), after a report that names them.
    Several {
        /// How many.
        failed: usize,
        /// What each is: "recording".
        thing: &'static str,
    },
    /// Standard output cannot be written to.
    Output(io::Error),
    /// The program itself failed: a mistake in it.
    Program(String),
}

impl From<clap::Error> for Failure {
    fn from(error: clap::Error) -> Self {
        Self::CommandLine(Box::new(error))
    }
}

impl From<ConfigError> for Failure {
    fn from(error: ConfigError) -> Self {
        Self::Configuration(error)
    }
}

impl From<Diagnostic> for Failure {
    fn from(diagnostic: Diagnostic) -> Self {
        Self::Configuration(diagnostic.into())
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Work(error)
    }
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::Output(error)
    }
}

impl Failure {
    /// Shows it on stderr, with `json` also as a document on stdout, and gives its exit status.
    pub(crate) fn report(&self, json: bool) -> u8 {
        render::to_stderr(&self.text());
        // The result itself is the one document then.
        if json && !matches!(self, Self::Limit(_) | Self::Warnings(_) | Self::Several { .. }) {
            // When stdout cannot be written to either, the exit status is the only report.
            let _ = render::document(&json!({ "error": self.document() }));
        }
        match self {
            Self::CommandLine(_) | Self::Name { .. } | Self::Configuration(_) => 2,
            Self::Work(_) | Self::Limit(_) | Self::Warnings(_) | Self::Several { .. } | Self::Output(_) => 1,
            Self::Program(_) => PROGRAM,
        }
    }

    fn text(&self) -> String {
        match self {
            Self::CommandLine(error) => {
                let text = error.render().to_string();
                match render::printable(&text) {
                    Cow::Borrowed(_) if render::fancy_stderr() => error.render().ansi().to_string(),
                    harmless => harmless.into_owned(),
                }
            }
            Self::Name { message, help } => plain(message, Some(help)),
            Self::Configuration(ConfigError::Text(diagnostic)) => diagnostic::report(diagnostic),
            Self::Configuration(ConfigError::File(error)) | Self::Work(error) => {
                let message = error.to_string();
                // Most messages hold the text of their source already.
                let causes = error.causes().into_iter().filter(|cause| !message.contains(cause.as_str()));
                let causes = causes.map(|cause| format!("  cause: {}\n", render::one_line(&cause)));
                headed(&message, &causes.collect::<String>(), error.advice())
            }
            Self::Limit(open) => plain(&format!("not proven to be kept: {}", open.join("; ")), None),
            Self::Warnings(count) => {
                plain(&format!("{}, and --fail-on-warning", render::count(*count, "warning")), None)
            }
            Self::Several { failed, thing } => plain(&format!("{} failed", render::count(*failed, thing)), None),
            Self::Output(error) => plain(&format!("cannot write to stdout: {error}"), None),
            Self::Program(message) => plain(&format!("the program failed: {message}"), Some(REPORT)),
        }
    }

    /// What went wrong, as the document that `--json` prints: `kind`, `message`, `help`, and the place or the causes.
    #[must_use]
    pub fn document(&self) -> Value {
        match self {
            Self::CommandLine(error) => {
                let text = error.render().to_string();
                let first: Vec<&str> = text.lines().take_while(|line| !line.is_empty()).map(str::trim).collect();
                let tip = text.lines().find_map(|line| line.trim().strip_prefix("tip: "));
                json!({ "kind": COMMAND_LINE, "message": first.join(" ").trim_start_matches("error: "), "help": tip })
            }
            Self::Name { message, help } => json!({ "kind": COMMAND_LINE, "message": message, "help": help }),
            Self::Configuration(ConfigError::Text(diagnostic)) => {
                let (line, column) = diagnostic.line_and_column();
                json!({
                    "kind": ErrorKind::Configuration.name(),
                    "message": diagnostic.message,
                    "help": diagnostic.help,
                    "file": diagnostic.source_name,
                    "line": line,
                    "column": column,
                })
            }
            Self::Configuration(ConfigError::File(error)) | Self::Work(error) => {
                json!({
                    "kind": error.kind().name(),
                    "message": error.to_string(),
                    "help": error.advice(),
                    "causes": error.causes(),
                })
            }
            Self::Limit(open) => json!({ "kind": "limit", "message": "not proven to be kept", "limits": open }),
            Self::Warnings(count) => json!({ "kind": "warnings", "message": "there are warnings", "warnings": count }),
            Self::Several { failed, thing } => {
                let things = format!("{thing}s");
                json!({ "kind": things, "message": format!("{things} failed"), things: failed })
            }
            Self::Output(error) => json!({ "kind": ErrorKind::Io.name(), "message": error.to_string() }),
            Self::Program(message) => json!({ "kind": "program", "message": message, "help": REPORT }),
        }
    }
}

/// A result as a document.
pub(crate) fn to_value(result: &impl Serialize) -> Result<Value, Failure> {
    serde_json::to_value(result).map_err(|error| Failure::Output(error.into()))
}

fn plain(message: &str, help: Option<&str>) -> String {
    headed(message, "", help)
}

/// A message, further lines, and what to do.
fn headed(message: &str, further: &str, help: Option<&str>) -> String {
    let help = help.map(|help| format!("  help: {}\n", render::one_line(help))).unwrap_or_default();
    format!("error: {}\n{further}{help}", render::one_line(message))
}
