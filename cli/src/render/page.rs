//! Text that grows line by line, for a terminal and for a page of a report.

use std::{
    fmt::{Display, Write},
    path::{Path, PathBuf},
};

use runout_core::{
    answer::Answer,
    rig::Rig,
    stage::{Overview, Part, Section},
};

use super::{one_line, table::Table, wrap};

/// Places that a warning names on the page; all of them are in the files.
const FEW_PLACES: usize = 8;

/// Lines, sections and tables in the order added.
#[derive(Debug, Default)]
pub(crate) struct Page {
    blocks: Vec<Block>,
    /// What is shown only when it is asked for.
    details: Vec<Detail>,
}

/// Blocks that a terminal shows only when all is asked for.
#[derive(Debug)]
struct Detail {
    /// What it is, in the line that counts it.
    what: String,
    /// The blocks before which it stands.
    before: usize,
    blocks: Vec<Block>,
}

#[derive(Debug)]
enum Block {
    Line(String),
    Code(String),
    Heading(String),
    Bullet(String),
    Table(Table),
}

impl Block {
    fn write(&self, width: usize, text: &mut String) {
        let lines = match self {
            Self::Table(table) => return text.push_str(&table.text(width)),
            Self::Code(line) => vec![one_line(line).into_owned()],
            Self::Line(line) => wrap::lines(&one_line(line), width, 2),
            Self::Bullet(line) => wrap::lines(&one_line(&format!("  - {line}")), width, 2),
            Self::Heading(line) => [String::new()].into_iter().chain(wrap::lines(&one_line(line), width, 2)).collect(),
        };
        for line in lines {
            // A string takes whatever is written to it.
            let _ = writeln!(text, "{line}");
        }
    }
}

impl Page {
    /// Adds a line.
    pub(crate) fn line(&mut self, line: impl Display) {
        self.blocks.push(Block::Line(line.to_string()));
    }

    /// Adds a line that stays one, since it is copied.
    pub(crate) fn code(&mut self, line: impl Display) {
        self.blocks.push(Block::Code(line.to_string()));
    }

    /// Adds a heading behind an empty line.
    pub(crate) fn heading(&mut self, heading: impl Display) {
        self.blocks.push(Block::Heading(heading.to_string()));
    }

    /// Adds a table's rows.
    pub(crate) fn table(&mut self, table: &Table) {
        self.blocks.push(Block::Table(table.clone()));
    }

    /// Adds a table under a heading; nothing where it has no rows.
    pub(crate) fn headed_table(&mut self, heading: impl Display, table: &Table) {
        if !table.is_empty() {
            self.heading(heading);
            self.table(table);
        }
    }

    /// Adds lines under a heading, each behind a dash; nothing without lines. Equal lines become one that says how
    /// many they are.
    pub(crate) fn bullets(&mut self, heading: impl Display, lines: &[String]) {
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
            let times = if times == 1 { String::new() } else { format!(" ({times} times)") };
            self.blocks.push(Block::Bullet(format!("{line}{times}")));
        }
    }

    /// Adds the warnings that the answer does not hold, and as a detail the notes.
    pub(crate) fn findings(&mut self, answer: &Answer, warnings: &[String], notes: &[String]) {
        let is_new = |warning: &&String| !notes.contains(warning) && !answer.says(warning);
        let found: Vec<String> = warnings.iter().filter(is_new).cloned().collect();
        self.warnings("Warnings", &found);
        self.detail(super::count(notes.len(), "note"), |page| page.warnings("Notes", notes));
    }

    /// Adds the number of files written and their folders, and as a detail their names.
    pub(crate) fn written(&mut self, outputs: &[PathBuf]) {
        let mut folders: Vec<&Path> = Vec::new();
        for folder in outputs.iter().filter_map(|path| path.parent()) {
            if !folders.contains(&folder) {
                folders.push(folder);
            }
        }
        if !folders.is_empty() {
            let folders: Vec<String> = folders.into_iter().map(|folder| folder.display().to_string()).collect();
            self.heading(format_args!("Written: {} in {}", super::count(outputs.len(), "file"), folders.join(", ")));
        }
        let names: Vec<String> = outputs.iter().map(|path| path.display().to_string()).collect();
        self.detail("names of the files", |page| page.bullets("Written", &names));
    }

    /// Adds warnings and notes. Those that differ in the place before their first colon only become one, with the places.
    pub(crate) fn warnings(&mut self, heading: &str, texts: &[String]) {
        let mut groups: Vec<(&str, Vec<&str>)> = Vec::new();
        for text in texts {
            let (place, said) = text.split_once(": ").unwrap_or(("", text));
            match groups.iter_mut().find(|(known, _)| *known == said) {
                Some((_, places)) => places.push(place),
                None => groups.push((said, vec![place])),
            }
        }
        let lines = groups.into_iter().map(|(said, places)| {
            let more = places.len().saturating_sub(FEW_PLACES);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let shown = places[..places.len().min(FEW_PLACES)].join(", ");
            if shown.is_empty() { said.to_owned() } else { format!("{shown}{more}: {said}") }
        });
        self.bullets(heading, &lines.collect::<Vec<_>>());
    }

    /// Adds what a terminal shows only when all is asked for, and otherwise names by `what`; nothing where it adds nothing.
    pub(crate) fn detail(&mut self, what: impl Display, add: impl FnOnce(&mut Self)) {
        let mut inner = Self::default();
        add(&mut inner);
        if !inner.blocks.is_empty() {
            self.details.push(Detail { what: what.to_string(), before: self.blocks.len(), blocks: inner.blocks });
        }
    }

    /// The text for the terminal that there is.
    #[must_use]
    pub(crate) fn into_text(self) -> String {
        self.fitted(wrap::columns(), false)
    }

    /// The text for a terminal of so many columns; with all details, or with one line that counts them.
    #[must_use]
    pub(crate) fn fitted(self, width: usize, verbose: bool) -> String {
        let Self { blocks, details } = self;
        let mut text = String::new();
        if verbose {
            let mut details = details.into_iter().peekable();
            for (index, block) in blocks.into_iter().enumerate() {
                while let Some(detail) = details.next_if(|detail| detail.before <= index) {
                    detail.blocks.iter().for_each(|block| block.write(width, &mut text));
                }
                block.write(width, &mut text);
            }
            details.flat_map(|detail| detail.blocks).for_each(|block| block.write(width, &mut text));
        } else {
            blocks.iter().for_each(|block| block.write(width, &mut text));
            if !details.is_empty() {
                let what: Vec<String> = details.into_iter().map(|detail| detail.what).collect();
                Block::Heading(format!("--verbose adds: {}", what.join(", "))).write(width, &mut text);
            }
        }
        text
    }

    /// The page as title and overview of a report. The first line is its title, those before the first heading are its headline.
    #[must_use]
    pub(crate) fn into_overview(self, rig: Option<Rig>) -> (String, Overview) {
        let mut lead = Vec::new();
        let mut sections: Vec<Section> = Vec::new();
        for block in self.blocks {
            let Some(section) = sections.last_mut() else {
                match block {
                    Block::Line(line) => lead.push(line),
                    Block::Heading(heading) => sections.push(Section { heading, parts: Vec::new() }),
                    Block::Code(_) | Block::Bullet(_) | Block::Table(_) => {}
                }
                continue;
            };
            match (block, section.parts.last_mut()) {
                (Block::Heading(heading), _) => sections.push(Section { heading, parts: Vec::new() }),
                (Block::Line(line) | Block::Code(line), Some(Part::Lines(lines))) => lines.push(line.trim().to_owned()),
                (Block::Line(line) | Block::Code(line), _) => {
                    section.parts.push(Part::Lines(vec![line.trim().to_owned()]));
                }
                (Block::Bullet(line), Some(Part::List(lines))) => lines.push(line),
                (Block::Bullet(line), _) => section.parts.push(Part::List(vec![line])),
                (Block::Table(table), _) => section.parts.push(table.into_part()),
            }
        }
        let mut lead = lead.into_iter();
        let title = lead.next().unwrap_or_default();
        (title, Overview { headline: lead.collect::<Vec<_>>().join(" "), rig, sections })
    }
}

#[cfg(test)]
mod tests {
    use runout_core::stage::Part;

    use super::{super::table::Table, Page};

    #[test]
    fn equal_bullets_are_counted() {
        let mut page = Page::default();
        page.bullets("Warnings", &["a".into(), "b".into(), "a".into()]);
        page.bullets("Nothing", &[]);
        assert_eq!(page.fitted(100, false), "\nWarnings\n  - a (2 times)\n  - b\n");
    }

    #[test]
    fn one_warning_of_many_stations_is_shown_once() {
        let mut page = Page::default();
        let mut texts: Vec<String> = (0..11).map(|number| format!("s{number}: few turns: 3")).collect();
        texts.insert(1, "no truth".into());
        page.warnings("Warnings and notes", &texts);
        let shown = "s0, s1, s2, s3, s4, s5, s6, s7 and 3 more: few turns: 3";
        assert_eq!(page.fitted(100, false), format!("\nWarnings and notes\n  - {shown}\n  - no truth\n"));
    }

    #[test]
    fn a_name_with_a_line_break_stays_on_its_line() {
        let mut page = Page::default();
        page.line("station a\nb");
        page.bullets("Notes", &["a\nb: few turns".into()]);
        assert_eq!(page.fitted(100, false), "station a\\nb\n\nNotes\n  - a\\nb: few turns\n");
    }

    #[test]
    fn an_overview_has_the_text_in_sections() {
        let mut page = Page::default();
        page.line("Shaft");
        page.line("2 stations");
        let mut table = Table::new(1, ["a", "empty", "b"]);
        table.row(["x", "", "1"]);
        page.headed_table("Values", &table);
        page.line("  ± is the standard uncertainty");
        page.bullets("Notes", &["one".into()]);
        let (title, overview) = page.into_overview(None);
        assert_eq!((title.as_str(), overview.headline.as_str(), overview.sections.len()), ("Shaft", "2 stations", 2));
        let columns = vec!["a".to_owned(), "b".to_owned()];
        let rows = vec![vec!["x".to_owned(), "1".to_owned()]];
        let lines = Part::Lines(vec!["± is the standard uncertainty".into()]);
        assert_eq!(overview.sections[0].parts, [Part::Table { words: 1, header: columns, rows }, lines]);
        assert_eq!(overview.sections[1].parts, [Part::List(vec!["one".into()])]);
    }
}
