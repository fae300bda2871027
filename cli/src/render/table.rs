//! Tables of text.

use runout_core::stage::Part;

use super::one_line;

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

    /// The text, two blanks indented and two between columns; nothing without rows. Columns that are empty in every
    /// row are left out.
    #[must_use]
    pub(crate) fn text(&self) -> String {
        if self.is_empty() {
            return String::new();
        }
        let columns = self.used();
        let width = |column: usize| self.rows.iter().map(|row| cell(row, column).chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..=columns.last().copied().unwrap_or(0)).map(width).collect();
        let mut text = String::new();
        for row in &self.rows {
            let mut line = String::new();
            for &column in &columns {
                let (cell, width) = (cell(row, column), widths[column]);
                line.push_str("  ");
                let cell = if column < self.words { format!("{cell:<width$}") } else { format!("{cell:>width$}") };
                line.push_str(&cell);
            }
            text.push_str(line.trim_end());
            text.push('\n');
        }
        text
    }

    /// Columns that are not empty in every row.
    fn used(&self) -> Vec<usize> {
        let used = |column: &usize| self.rows.iter().skip(1).any(|row| !cell(row, *column).is_empty());
        (0..self.rows.first().map_or(0, Vec::len)).filter(used).collect()
    }

    /// The same for a report.
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
        assert_eq!(table.text(), "  section  rms µm\n  a          4.01\n  bearing   12.50\n");
        assert_eq!(Table::new(0, ["x"]).text(), "");
    }

    #[test]
    fn cells_from_files_are_cut_and_shown_harmless() {
        let mut table = Table::new(1, ["station", "z mm"]);
        table.row(["s".repeat(70_000), "\u{1b}[2J".into()]);
        let text = table.text();
        assert!(text.contains("ss…") && text.contains("\\u{1b}[2J") && !text.contains('\u{1b}'), "{text}");
    }
}
