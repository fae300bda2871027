//! Terminal text.

pub(crate) mod answer;
pub(crate) mod batch;
pub(crate) mod check;
pub(crate) mod compare;
pub(crate) mod diagnosis;
pub(crate) mod diagnostic;
pub(crate) mod file;
pub(crate) mod foresight;
pub(crate) mod keys;
pub(crate) mod page;
pub(crate) mod plan;
pub(crate) mod plan_points;
pub(crate) mod summary;
pub(crate) mod table;
pub(crate) mod wrap;

use std::{
    borrow::Cow,
    fmt::Write as _,
    io::{self, ErrorKind, IsTerminal, Write},
};

pub(crate) use runout_core::numerics::number::{self, unit_text as unit};
use serde::Serialize;
pub(crate) use wrap::columns;

/// Whether a character may change what a terminal shows of others: control characters, and marks that turn the direction of text.
fn is_harmful(character: char) -> bool {
    breaks_line(character) && !matches!(character, '\n' | '\t')
}

/// Whether a character is a control character, a line break among them, or a mark that turns the direction of text.
fn breaks_line(character: char) -> bool {
    character.is_control()
        || matches!(character, '\u{2028}' | '\u{2029}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// A text of several lines as a terminal may show it: control characters as `\u{1b}`.
#[must_use]
pub(crate) fn printable(text: &str) -> Cow<'_, str> {
    escaped(text, is_harmful)
}

/// A line as a terminal may show it, whatever names of a file are in it: line breaks as `\n`.
#[must_use]
pub(crate) fn one_line(text: &str) -> Cow<'_, str> {
    escaped(text, breaks_line)
}

fn escaped(text: &str, which: fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(which) {
        return Cow::Borrowed(text);
    }
    let shown = text.chars().fold(String::new(), |mut shown, character| {
        if which(character) {
            shown.extend(character.escape_default());
        } else {
            shown.push(character);
        }
        shown
    });
    Cow::Owned(shown)
}

/// Writes to stdout. Whoever closed it early (`| head`) has seen enough: that is no failure.
///
/// # Errors
/// When stdout cannot be written to.
pub(crate) fn to_stdout(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(printable(text).as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        outcome => outcome,
    }
}

/// Writes to stderr, as far as there is one.
pub(crate) fn to_stderr(text: &str) {
    // Nowhere is left to say that stderr fails.
    let _ = io::stderr().lock().write_all(text.as_bytes());
}

/// Writes the one JSON document to stdout.
///
/// # Errors
/// When stdout cannot be written to.
pub(crate) fn document(value: &impl Serialize) -> io::Result<()> {
    let mut text = String::new();
    for character in serde_json::to_string_pretty(value)?.chars() {
        // Only texts have them; JSON knows no other spelling.
        match character {
            // A string takes whatever is written to it.
            harmful if is_harmful(harmful) => {
                let _ = write!(text, "\\u{:04x}", u32::from(harmful));
            }
            other => text.push(other),
        }
    }
    text.push('\n');
    to_stdout(&text)
}

/// Whether stderr is a terminal whose user wants colours.
#[must_use]
pub(crate) fn fancy_stderr() -> bool {
    let refused = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty())
        || std::env::var_os("TERM").is_some_and(|value| value == "dumb");
    !refused && io::stderr().is_terminal()
}

/// "1 turn", "2 turns".
#[must_use]
pub(crate) fn count(number: usize, thing: &str) -> String {
    if number == 1 { format!("1 {thing}") } else { format!("{number} {thing}s") }
}

#[cfg(test)]
mod tests {
    use super::{one_line, printable};

    #[test]
    fn a_name_from_a_file_is_no_line_of_its_own() {
        assert_eq!(one_line("a\nb\tc\u{1b}\u{2028}d"), "a\\nb\\tc\\u{1b}\\u{2028}d");
        assert_eq!(printable("a\nb\tc\u{1b}"), "a\nb\tc\\u{1b}");
        assert_eq!(one_line("süd 50 µm"), "süd 50 µm");
    }
}
