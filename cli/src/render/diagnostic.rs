//! Configuration mistakes: the place in the text, what is wrong, what to do.

use std::{borrow::Cow, fmt};

use miette::{GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource, SourceCode};
use runout_core::fault::Diagnostic;

use textwrap::WordSplitter;

use super::{fancy_stderr, one_line};

/// Columns of a report that no terminal bounds.
const PLAIN_WIDTH: usize = 100;
/// Bytes of a line that is drawn, at most; lines around a mistake that are drawn with it, and characters where nothing is drawn.
const LONGEST_LINE: usize = 1000;
const AROUND: usize = 2;
const EXCERPT: usize = 60;

/// The report for stderr: in colour on a terminal, in ASCII elsewhere.
#[must_use]
pub(crate) fn report(diagnostic: &Diagnostic) -> String {
    if !can_be_drawn(diagnostic) {
        return plain(diagnostic);
    }
    let handler = if fancy_stderr() {
        GraphicalReportHandler::new_themed(GraphicalTheme::unicode())
    } else {
        let mut theme = GraphicalTheme::none();
        "error:".clone_into(&mut theme.characters.error);
        GraphicalReportHandler::new_themed(theme).with_links(false).with_width(PLAIN_WIDTH)
    };
    let shown = Shown {
        diagnostic,
        source: NamedSource::new(&diagnostic.source_name, diagnostic.source_text.clone()).with_language("toml"),
    };
    let mut text = String::new();
    if handler
        .with_word_splitter(WordSplitter::NoHyphenation)
        .with_break_words(false)
        .render_report(&mut text, &shown)
        .is_err()
    {
        text = plain(diagnostic);
    }
    text.trim_start_matches(' ').to_owned()
}

/// Whether the lines around the mistake are short enough to be drawn, and all of it harmless on a terminal.
fn can_be_drawn(diagnostic: &Diagnostic) -> bool {
    let Diagnostic { message, help, source_name, source_text, span } = diagnostic;
    let line = source_text.get(..span.start).map_or(0, |before| before.matches('\n').count());
    let lines = source_text.get(span.clone()).map_or(0, |inside| inside.matches('\n').count());
    let near = source_text.lines().skip(line.saturating_sub(AROUND)).take(2 * AROUND + 1 + lines);
    // Tabs indent lines of a file.
    let harmless = |text: &str| matches!(one_line(&text.replace('\t', " ")), Cow::Borrowed(_));
    near.into_iter().all(|line| line.len() <= LONGEST_LINE && harmless(line))
        && harmless(message)
        && harmless(source_name)
        && harmless(help.as_deref().unwrap_or_default())
}

/// The report without a drawing.
fn plain(diagnostic: &Diagnostic) -> String {
    let Diagnostic { message, help, source_name, source_text, span } = diagnostic;
    let (line, column) = diagnostic.line_and_column();
    let rest = source_text.get(span.start..).unwrap_or_default().lines().next().unwrap_or_default();
    let excerpt: String = rest.chars().take(EXCERPT).collect();
    let help = help.as_ref().map(|help| format!("  help: {}\n", one_line(help))).unwrap_or_default();
    let [message, source_name, excerpt] = [message, source_name, &excerpt].map(|text| one_line(text));
    format!("error: {message}\n  at {source_name}:{line}:{column}: {excerpt}\n{help}")
}

/// The core's diagnostic as miette knows it.
#[derive(Debug)]
struct Shown<'a> {
    diagnostic: &'a Diagnostic,
    source: NamedSource<String>,
}

impl fmt::Display for Shown<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.diagnostic.message)
    }
}

impl std::error::Error for Shown<'_> {}

impl miette::Diagnostic for Shown<'_> {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.diagnostic.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        Some(&self.source)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let Diagnostic { source_text, span, .. } = self.diagnostic;
        // A parser may stop within a character, at which nothing can be drawn.
        let start = source_text.floor_char_boundary(span.start);
        let end = source_text.ceil_char_boundary(span.end.max(start));
        Some(Box::new(std::iter::once(LabeledSpan::new(None, start, end - start))))
    }
}
