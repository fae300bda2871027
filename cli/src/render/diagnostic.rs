//! Configuration mistakes: the place in the text, what is wrong, what to do.

use std::fmt;

use miette::{GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource, SourceCode};
use runout_core::pipeline::error::Diagnostic;

use textwrap::WordSplitter;

use super::fancy_stderr;

/// Columns of a report that no terminal bounds.
const PLAIN_WIDTH: usize = 100;

/// The report for stderr: in colour on a terminal, in ASCII elsewhere.
#[must_use]
pub fn report(diagnostic: &Diagnostic) -> String {
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
        // A report that cannot be drawn still has to be read.
        let (line, column) = diagnostic.line_and_column();
        text = format!("error: {}:{line}:{column}: {}\n", diagnostic.source_name, diagnostic.message);
    }
    text.trim_start_matches(' ').to_owned()
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
        let span = &self.diagnostic.span;
        Some(Box::new(std::iter::once(LabeledSpan::new(None, span.start, span.len()))))
    }
}
