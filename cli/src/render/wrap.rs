//! Lines and cells that fit a terminal.

use textwrap::{Options, WordSeparator, WordSplitter, core::display_width};

/// Columns of text at most: longer lines are hard to read, and a wide table has more columns than anyone compares.
const WIDEST: usize = 100;
/// Columns at least, of a terminal that is narrower.
const NARROWEST: usize = 60;

/// Columns for text on stdout: those of the terminal, else those that the variable `COLUMNS` says, within limits.
#[must_use]
pub(crate) fn columns() -> usize {
    let terminal = || Some(usize::from(terminal_size::terminal_size_of(std::io::stdout())?.0.0));
    let said = || std::env::var("COLUMNS").ok()?.parse().ok();
    terminal().or_else(said).map_or(WIDEST, within)
}

/// Columns for text on a terminal of so many.
pub(crate) fn within(terminal: usize) -> usize {
    terminal.clamp(NARROWEST, WIDEST)
}

/// Lines of a text that are not wider, but for a word that is: names and paths are not broken. Further lines are indented as its first
/// line is, and by `hanging` more.
pub(crate) fn lines(text: &str, width: usize, hanging: usize) -> Vec<String> {
    let body = text.trim_start_matches(' ');
    let indent = " ".repeat(text.len() - body.len());
    let further = format!("{indent}{}", " ".repeat(hanging));
    let options = Options::new(width).word_splitter(WordSplitter::NoHyphenation);
    wrapped(body, options.initial_indent(&indent).subsequent_indent(&further))
}

/// Lines of a cell. Names are broken at their hyphens: a column has less room than a line.
pub(crate) fn cell(text: &str, width: usize) -> Vec<String> {
    wrapped(text, Options::new(width).word_splitter(WordSplitter::HyphenSplitter))
}

/// The width of the widest word, or part of one before a hyphen: a column is not narrower.
pub(crate) fn widest_word(text: &str) -> usize {
    let part = |word: &str| {
        let ends: Vec<usize> = WordSplitter::HyphenSplitter.split_points(word);
        let starts = std::iter::once(0).chain(ends.iter().copied());
        starts.zip(ends.iter().copied().chain([word.len()])).map(|(from, to)| display_width(&word[from..to])).max()
    };
    text.split(' ').filter_map(part).max().unwrap_or(0)
}

fn wrapped(text: &str, options: Options) -> Vec<String> {
    let options = options.word_separator(WordSeparator::AsciiSpace).break_words(false);
    textwrap::wrap(text, options).into_iter().map(|line| line.trim_end().to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::{lines, widest_word};

    #[test]
    fn further_lines_stand_under_the_first_and_words_stay_whole() {
        assert_eq!(lines("  - a long-hyphenated line", 14, 2), ["  - a", "    long-hyphenated", "    line"]);
        assert_eq!(widest_word("a radial-rotating b -3.5"), 8);
    }
}
