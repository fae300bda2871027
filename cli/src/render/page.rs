//! Text that grows line by line.

use std::fmt::{Display, Write};

use super::table::Table;

/// Lines, sections and tables in the order added.
#[derive(Debug, Default)]
pub struct Page {
    text: String,
}

impl Page {
    /// Adds a line.
    pub fn line(&mut self, line: impl Display) {
        // A string takes whatever is written to it.
        let _ = writeln!(self.text, "{line}");
    }

    /// Adds a heading behind an empty line.
    pub fn heading(&mut self, heading: impl Display) {
        self.line("");
        self.line(heading);
    }

    /// Adds a table's rows.
    pub fn table(&mut self, table: &Table) {
        self.text.push_str(&table.text());
    }

    /// Adds a table under a heading; nothing where it has no rows.
    pub fn headed_table(&mut self, heading: impl Display, table: &Table) {
        if !table.is_empty() {
            self.heading(heading);
            self.table(table);
        }
    }

    /// Adds lines under a heading, each behind a dash; nothing without lines. Equal lines become one that says how
    /// many they are.
    pub fn bullets(&mut self, heading: impl Display, lines: &[String]) {
        let mut seen: Vec<(&String, usize)> = Vec::new();
        for line in lines {
            match seen.iter_mut().find(|(known, _)| *known == line) {
                Some((_, times)) => *times += 1,
                None => seen.push((line, 1)),
            }
        }
        if seen.is_empty() {
            return;
        }
        self.heading(heading);
        for (line, times) in seen {
            if times == 1 {
                self.line(format_args!("  - {line}"));
            } else {
                self.line(format_args!("  - {line} ({times} times)"));
            }
        }
    }

    /// The text so far.
    #[must_use]
    pub fn into_text(self) -> String {
        self.text
    }
}

#[cfg(test)]
mod tests {
    use super::Page;

    #[test]
    fn equal_bullets_are_counted() {
        let mut page = Page::default();
        page.bullets("Warnings", &["a".into(), "b".into(), "a".into()]);
        page.bullets("Nothing", &[]);
        assert_eq!(page.into_text(), "\nWarnings\n  - a (2 times)\n  - b\n");
    }
}
