//! Terminal text.

pub mod check;
pub mod compare;
pub mod diagnosis;
pub mod diagnostic;
pub mod file;
pub mod foresight;
pub mod keys;
pub mod number;
pub mod page;
pub mod plan;
pub mod plan_points;
pub mod summary;
pub mod table;

use std::io::{self, ErrorKind, IsTerminal, Write};

use serde::Serialize;

/// Writes to stdout. Whoever closed it early (`| head`) has seen enough: that is no failure.
///
/// # Errors
/// When stdout cannot be written to.
pub fn to_stdout(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        outcome => outcome,
    }
}

/// Writes to stderr, as far as there is one.
pub fn to_stderr(text: &str) {
    // Nowhere is left to say that stderr fails.
    let _ = io::stderr().lock().write_all(text.as_bytes());
}

/// Writes the one JSON document to stdout.
///
/// # Errors
/// When stdout cannot be written to.
pub fn document(value: &impl Serialize) -> io::Result<()> {
    let mut text = serde_json::to_string_pretty(value)?;
    text.push('\n');
    to_stdout(&text)
}

/// Whether stderr is a terminal whose user wants colours.
#[must_use]
pub fn fancy_stderr() -> bool {
    let refused = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty())
        || std::env::var_os("TERM").is_some_and(|value| value == "dumb");
    !refused && io::stderr().is_terminal()
}

/// "1 turn", "2 turns".
#[must_use]
pub fn count(number: usize, thing: &str) -> String {
    if number == 1 { format!("1 {thing}") } else { format!("{number} {thing}s") }
}
