//! Tables of text.

use runout_core::stage::Part;

use super::{
    one_line,
    wrap::{self, widest_word},
};

/// Characters of a cell, at most: a name from a file may have any length.
const LONGEST: usize = 400;

/// A cell as a terminal may show it.
fn cut(cell: &str) -> String {
    let mut shown = one_line(cell).into_owned();
    if let Some((end, _)) = shown.char_indices().nth(LONGEST) {
        shown.truncate(end);
        shown.push('…');
    }
    shown
}

/// Which cells of a column make its width.
#[derive(Clone, Copy)]
enum Cells {
    /// All of them, on one line.
    All,
    /// Its numbers, and the words of its header.
    Wrapped,
    /// Single words of all of them.
    Words,
}

/// The width of columns side by side.
fn total(widths: &[usize]) -> usize {
    widths.iter().map(|width| width + 2).sum()
}

/// Columns that fit side by side, as places; from the second part on behind the first column.
fn parts(widths: &[usize], width: usize) -> Vec<Vec<usize>> {
    let mut parts: Vec<Vec<usize>> = vec![Vec::new()];
    for place in 0..widths.len() {
        let Some(part) = parts.last_mut() else { continue };
        let taken: usize = part.iter().map(|place| widths[*place] + 2).sum();
        if part.len() > 1 && taken + widths[place] + 2 > width {
            parts.push(vec![0, place]);
        } else {
            part.push(place);
        }
    }
    parts
}

/// Rows under a header; columns as wide as they need.
#[derive(Debug, Clone)]
pub(crate) struct Table {
    /// Columns of words, at the left; the rest are numbers and stand right-aligned.
    words: usize,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// The first `words` columns stand left-aligned.
    #[must_use]
    pub(crate) fn new<S: Into<String>>(words: usize, header: impl IntoIterator<Item = S>) -> Self {
        Self { words, rows: vec![header.into_iter().map(Into::into).collect()] }
    }

    /// Adds a row.
    pub(crate) fn row<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>) {
        self.rows.push(cells.into_iter().map(|cell| cut(&cell.into())).collect());
    }

    /// Whether it has no rows yet.
    #[must_use]
    pub(crate) fn is_empty(&self) -> bool {
        self.rows.len() < 2
    }

    /// Whether a cell has this character.
    #[must_use]
    pub(crate) fn contains(&self, character: char) -> bool {
        self.rows.iter().flatten().any(|cell| cell.contains(character))
    }

    /// The text, two blanks indented and two between columns; nothing without rows. Columns that are empty in every row are left out.
    /// Of a table that is wider than `width`, first the widest cells of words and the header are wrapped, then columns of numbers go
    /// below, behind the first column once more.
    #[must_use]
    pub(crate) fn text(&self, width: usize) -> String {
        if self.is_empty() {
            return String::new();
        }
        let columns = self.used();
        let mut widths: Vec<usize> = columns.iter().map(|column| self.widest(*column, Cells::All)).collect();
        self.narrow(&columns, &mut widths, width);
        let mut text = String::new();
        for part in parts(&widths, width) {
            for row in &self.rows {
                self.lines(row, part.iter().map(|place| (columns[*place], widths[*place])), &mut text);
            }
        }
        text
    }

    /// Makes columns narrower until they fit, those first that words leave most room: numbers keep their width.
    fn narrow(&self, columns: &[usize], widths: &mut [usize], width: usize) {
        let cells = |column| if column < self.words { Cells::Words } else { Cells::Wrapped };
        let least: Vec<usize> = columns.iter().map(|column| self.widest(*column, cells(*column))).collect();
        while total(widths) > width {
            let room = |place: &usize| widths[*place].saturating_sub(least[*place]);
            let Some(widest) = (0..columns.len()).filter(|place| room(place) > 0).max_by_key(room) else { return };
            widths[widest] -= 1;
        }
    }

    /// The widest of some cells of a column.
    fn widest(&self, column: usize, cells: Cells) -> usize {
        let width = |(index, row): (usize, &Vec<String>)| {
            let text = cell(row, column);
            match cells {
                Cells::Words => widest_word(text),
                Cells::Wrapped if index == 0 => widest_word(text),
                Cells::Wrapped | Cells::All => text.chars().count(),
            }
        };
        self.rows.iter().enumerate().map(width).max().unwrap_or(0)
    }

    /// Adds a row of some columns, on as many lines as its cells take.
    fn lines(&self, row: &[String], columns: impl Iterator<Item = (usize, usize)>, text: &mut String) {
        let cells: Vec<(bool, usize, Vec<String>)> =
            columns.map(|(column, width)| (column < self.words, width, wrap::cell(cell(row, column), width))).collect();
        let height = cells.iter().map(|(.., lines)| lines.len()).max().unwrap_or(0);
        for index in 0..height {
            let mut line = String::new();
            for (is_word, width, lines) in &cells {
                let cell = lines.get(index).map_or("", String::as_str);
                line.push_str("  ");
                let cell = if *is_word { format!("{cell:<width$}") } else { format!("{cell:>width$}") };
                line.push_str(&cell);
            }
            text.push_str(line.trim_end());
            text.push('\n');
        }
    }

    /// Columns that are not empty in every row.
    fn used(&self) -> Vec<usize> {
        let used = |column: &usize| self.rows.iter().skip(1).any(|row| !cell(row, *column).is_empty());
        (0..self.rows.first().map_or(0, Vec::len)).filter(used).collect()
    }

    /// The table as a part of a report, without columns that are empty in every row.
    #[must_use]
    pub(crate) fn into_part(self) -> Part {
        let columns = self.used();
        let words = columns.iter().filter(|column| **column < self.words).count();
        let mut rows =
            self.rows.iter().map(|row| columns.iter().map(|column| cell(row, *column).to_owned()).collect::<Vec<_>>());
        Part::Table { words, header: rows.next().unwrap_or_default(), rows: rows.collect() }
    }
}

fn cell(row: &[String], column: usize) -> &str {
    row.get(column).map_or("", String::as_str)
}

#[cfg(test)]
mod tests {
    use super::Table;

    #[test]
    fn words_stand_left_and_numbers_right() {
        let mut table = Table::new(1, ["section", "never", "rms µm"]);
        table.row(["a", "", "4.01"]);
        table.row(["bearing", "", "12.50"]);
        assert_eq!(table.text(100), "  section  rms µm\n  a          4.01\n  bearing   12.50\n");
        assert_eq!(Table::new(0, ["x"]).text(100), "");
    }

    #[test]
    fn cells_from_files_are_cut_and_shown_harmless() {
        let mut table = Table::new(1, ["station", "z mm"]);
        table.row(["s".repeat(70_000), "\u{1b}[2J".into()]);
        let text = table.text(100);
        assert!(text.contains("ss…") && text.contains("\\u{1b}[2J") && !text.contains('\u{1b}'), "{text}");
    }

    #[test]
    fn a_wide_table_wraps_its_words_and_then_goes_below() {
        let mut table = Table::new(1, ["what it is", "RONt LSCI µm", "RONq LSCI µm"]);
        table.row(["a sentence of several words", "1.2345 ± 0.0012", "0.2345"]);
        let wrapped = table.text(50);
        assert!(wrapped.lines().all(|line| line.chars().count() <= 50), "{wrapped}");
        assert_eq!(wrapped.matches("a sentence").count(), 1, "{wrapped}");
        let narrow = table.text(34);
        assert!(narrow.lines().all(|line| line.chars().count() <= 34), "{narrow}");
        assert_eq!(narrow.matches("several").count(), 2, "{narrow}");
    }
}
