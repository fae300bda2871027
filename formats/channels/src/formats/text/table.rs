//! Where in a text the table of numbers is, and what its columns are.

use runout_core::{Error, ErrorKind, Result, clock::ClockScan};

use super::{
    LONGEST_LINE,
    cells::{Dialect, cells, instant_s, is_passed_over, number, without_end},
};
use crate::{
    bytes::{Bytes, text},
    channel::{Channel, Kind},
    hints::{is_rate, is_step, is_time},
    unit::{self, Known},
};

/// Lines that are examined for the beginning of the table.
const HEAD: usize = 400;
/// Rows in which the table shows what its columns hold.
const SHOWN: usize = 30;
/// Columns of a table.
const MOST_COLUMNS: usize = 4096;

/// A table of numbers.
pub(super) struct Table {
    /// Where its first row is, in bytes, and the number of the line before it.
    pub(super) begin: u64,
    pub(super) line: u64,
    pub(super) rows: u64,
    pub(super) dialect: Dialect,
    /// The columns that are channels; what a channel is in is filled in by the file.
    pub(super) channels: Vec<(usize, Channel)>,
    /// Columns of instants, and the first of each in s.
    pub(super) origins: Vec<(usize, f64)>,
    pub(super) remarks: Vec<String>,
}

/// A line at the beginning of a file.
pub(super) struct Line {
    pub(super) text: Vec<u8>,
    /// Where it begins.
    pub(super) place: u64,
}

/// Reads lines from here on.
pub(super) fn head(bytes: &mut Bytes, most: usize) -> Result<Vec<Line>> {
    let mut lines = Vec::new();
    while lines.len() < most {
        let place = bytes.place();
        let Some(text) = bytes.line(LONGEST_LINE)? else { break };
        lines.push(Line { text, place });
    }
    Ok(lines)
}

impl Table {
    /// Looks for the table of a file.
    pub(super) fn found(bytes: &mut Bytes) -> Result<Self> {
        bytes.seek(0)?;
        let lines = head(bytes, HEAD)?;
        let Some((dialect, first, end, width)) = beginning(&lines) else {
            return Err(bytes.damaged("expected rows of numbers with a delimiter, found none").help(
                "columns are delimited by comma, semicolon, tab or blanks; numbers with decimal commas need another delimiter than the comma",
            ));
        };
        let header = Header::above(&lines[..first], dialect, width)?;
        let preamble = Preamble::of(&lines[..first], dialect);
        let mut table =
            Self::of(bytes, &lines[first..end], first as u64, dialect, &header, |_, line| is_passed_over(line))?;
        for (_, channel) in &mut table.channels {
            channel.rate_hz = channel.rate_hz.or(header.rate_hz).or(preamble.rate_hz);
            channel.start_s = channel.start_s.or(header.start_s);
        }
        Ok(table)
    }

    /// The table whose first rows are `shown`; its rows end where `is_passed_over` does not hold and the cells are no numbers.
    pub(super) fn of(
        bytes: &mut Bytes,
        shown: &[Line],
        line: u64,
        dialect: Dialect,
        header: &Header,
        is_passed_over: impl Fn(&mut Bytes, &[u8]) -> bool,
    ) -> Result<Self> {
        let begin = shown.first().map_or(bytes.place(), |line| line.place);
        let mut table =
            Self { begin, line, rows: 0, dialect, channels: Vec::new(), origins: Vec::new(), remarks: Vec::new() };
        let rows: Vec<Vec<&[u8]>> = shown
            .iter()
            .map(|line| cells(&line.text, dialect.delimiter))
            .filter(|cells| !without_end(cells).is_empty())
            .take(SHOWN)
            .collect();
        let width =
            header.names.len().max(rows.iter().map(|row| without_end(row).len()).max().unwrap_or(0)).min(MOST_COLUMNS);
        for column in 0..width {
            let held = || rows.iter().filter_map(|row| row.get(column)).filter(|cell| !cell.is_empty());
            let (all, is_any) = (|is: &dyn Fn(&[u8]) -> bool| held().all(|cell| is(cell)), held().next().is_some());
            let kind = match () {
                () if !is_any => continue,
                () if all(&|cell| number(cell, dialect.decimal).is_some()) => Kind::Decimal,
                () if all(&|cell| instant_s(cell).is_some()) => {
                    table.origins.push((column, held().next().and_then(|cell| instant_s(cell)).unwrap_or(0.0)));
                    Kind::Time
                }
                () => Kind::Text,
            };
            let (name, unit) = header.column(column);
            let mut channel = Channel::new("", name, kind, 0);
            channel.unit = if kind == Kind::Time { Some("s".into()) } else { unit };
            table.channels.push((column, channel));
        }
        bytes.seek(begin)?;
        table.count(bytes, is_passed_over)?;
        Ok(table)
    }

    /// Counts rows, sees to it that their cells are numbers, and takes the rate from a column of times.
    fn count(&mut self, bytes: &mut Bytes, is_passed_over: impl Fn(&mut Bytes, &[u8]) -> bool) -> Result<()> {
        let of_kind = |kind: Kind| self.channels.iter().filter(move |(_, channel)| channel.kind == kind);
        let numbers: Vec<usize> = of_kind(Kind::Decimal).map(|(column, _)| *column).collect();
        let time = self.channels.iter().find(|(_, channel)| channel.kind == Kind::Time || is_time(channel));
        let mut clock = time.map(|(column, channel)| {
            let factor = match channel.unit.as_deref().and_then(unit::known) {
                Some(Known::Seconds(factor)) => factor,
                _ => 1.0,
            };
            (*column, channel.kind == Kind::Time, factor, ClockScan::default(), None)
        });
        let origins = self.origins.clone();
        let (mut line, mut wrong, mut even) = (self.line, None, true);
        while let Some(text) = bytes.line(LONGEST_LINE)? {
            line += 1;
            if is_passed_over(bytes, &text) {
                continue;
            }
            let cells = cells(&text, self.dialect.delimiter);
            let cell = |column: usize| cells.get(column).copied().unwrap_or_default();
            let is_number = |column: &&usize| number(cell(**column), self.dialect.decimal).is_none();
            if let Some(column) = numbers.iter().find(is_number) {
                // What is behind the last row need be no number; between rows it is damage.
                wrong.get_or_insert((line, *column, crate::bytes::text(cell(*column))));
                continue;
            }
            if let Some((line, column, cell)) = wrong {
                let problem = format!("line {line}, column {}: expected a number, found `{cell}`", column + 1);
                return Err(bytes.damaged(problem).of(ErrorKind::DamagedData));
            }
            if let Some((column, is_instant, factor, scan, first)) = &mut clock {
                let time = if *is_instant {
                    let origin = origins.iter().find(|(known, _)| known == column).map_or(0.0, |(_, at_s)| *at_s);
                    instant_s(cell(*column)).map(|at_s| at_s - origin)
                } else {
                    number(cell(*column), self.dialect.decimal).map(|time| time * *factor)
                };
                match time.filter(|time| time.is_finite()) {
                    Some(time) => {
                        first.get_or_insert(time);
                        even &= scan.push(time).is_ok();
                    }
                    None => even = false,
                }
            }
            self.rows += 1;
        }
        if let Some((from, ..)) = wrong {
            self.remarks.push(format!("its lines from {from} to {line} are no numbers: they are not used"));
        }
        if let Some((_, _, _, scan, first)) = clock.filter(|_| even)
            && let Ok(Some(rate_hz)) = scan.rate_hz()
        {
            for (_, channel) in &mut self.channels {
                (channel.rate_hz, channel.start_s) = (Some(rate_hz), first);
            }
        }
        Ok(())
    }
}

/// Lines with numbers in as many cells.
#[derive(Debug, Clone, Copy)]
struct Run {
    first: usize,
    /// Behind the last.
    end: usize,
    width: usize,
    length: usize,
}

impl Run {
    fn cells(&self) -> usize {
        self.width * self.length
    }
}

/// How the table is written, its first line and that behind those that were examined, and how many cells a row has: of all dialects that
/// which gives most cells.
fn beginning(lines: &[Line]) -> Option<(Dialect, usize, usize, usize)> {
    let stated = lines.first().and_then(|line| {
        let line = line.text.strip_prefix(&[0xEF, 0xBB, 0xBF]).unwrap_or(&line.text);
        line.trim_ascii().strip_prefix(b"sep=")?.first().copied()
    });
    let delimiters: Vec<u8> = stated.map_or_else(|| vec![b'\t', b';', b',', b' '], |stated| vec![stated]);
    let mut best: Option<(Dialect, Run)> = None;
    for delimiter in delimiters {
        for decimal in [b'.', b','] {
            let dialect = Dialect { delimiter, decimal };
            // A comma is both only where cells are quoted.
            let Some(run) = longest_run(lines, dialect) else { continue };
            if best.as_ref().is_none_or(|(_, other)| run.cells() > other.cells()) {
                best = Some((dialect, run));
            }
        }
    }
    best.map(|(dialect, run)| (dialect, run.first, run.end, run.width))
}

/// The longest run of lines with numbers in as many cells.
fn longest_run(lines: &[Line], dialect: Dialect) -> Option<Run> {
    let (mut best, mut run): (Option<Run>, Option<Run>) = (None, None);
    for (first, line) in lines.iter().enumerate() {
        if is_passed_over(&line.text) {
            continue;
        }
        let all = cells(&line.text, dialect.delimiter);
        let filled = without_end(&all);
        let is_held =
            |cell: &&&[u8]| !cell.is_empty() && (number(cell, dialect.decimal).is_some() || instant_s(cell).is_some());
        let held = filled.iter().filter(is_held).count();
        let is_row = held > 0 && 2 * held >= filled.iter().filter(|cell| !cell.is_empty()).count();
        run = match run {
            Some(run) if is_row && (filled.len()..=all.len()).contains(&run.width) => {
                Some(Run { end: first + 1, length: run.length + 1, ..run })
            }
            _ => is_row.then_some(Run { first, end: first + 1, width: filled.len(), length: 1 }),
        };
        if let Some(run) = run
            && best.is_none_or(|best| run.cells() > best.cells())
        {
            best = Some(run);
        }
    }
    best.filter(|run| run.width > 1 || run.length > 1)
}

/// The names and units of columns.
#[derive(Default)]
pub(super) struct Header {
    pub(super) names: Vec<String>,
    pub(super) units: Vec<String>,
    pub(super) rate_hz: Option<f64>,
    pub(super) start_s: Option<f64>,
}

impl Header {
    /// From the last lines above the first row.
    fn above(lines: &[Line], dialect: Dialect, width: usize) -> Result<Self> {
        let mut above = lines.iter().rev().filter(|line| !line.text.trim_ascii().is_empty());
        let split = |line: &Line| -> Vec<String> {
            let line = line.text.strip_prefix(b"#").unwrap_or(&line.text);
            cells(line, dialect.delimiter).into_iter().map(text).collect()
        };
        let mut header = Self::default();
        // Between blanks, a sentence would be names too.
        let fits = |cells: &Vec<String>| {
            if dialect.delimiter == b' ' { cells.len() == width } else { cells.len() >= width.min(2) }
        };
        let Some(last) = above.next().map(split).filter(fits) else { return Ok(header) };
        let is_unit = |cell: &String| {
            cell.is_empty()
                || unit::known(cell).is_some()
                || (cell.starts_with(['(', '[']) && cell.ends_with([')', ']']))
        };
        let units = last.iter().take(width).filter(|cell| is_unit(cell)).count();
        let is_units = 2 * units >= width.min(last.len()) && last.iter().any(|cell| !cell.is_empty());
        let names = if is_units { above.next().map(split) } else { None };
        (header.names, header.units) = match names {
            Some(names) if names.len() >= width.min(2) => (names, last),
            _ => (last, Vec::new()),
        };
        // Rigol has the time from sample to sample beside the units.
        for (name, unit) in header.names.iter().zip(&header.units) {
            match (name.to_lowercase().as_str(), unit.parse::<f64>()) {
                ("increment", Ok(step)) if step > 0.0 => header.rate_hz = Some(step.recip()),
                ("start", Ok(start)) => header.start_s = Some(start),
                _ => {}
            }
        }
        let named = header.names.iter().rposition(|name| !name.is_empty()).map_or(0, |last| last + 1);
        if dialect.delimiter == b',' && width == 2 * named && named > 1 && header.rate_hz.is_none() {
            let problem = format!(
                "its rows have {width} cells for {named} names: decimal commas are not distinguishable from delimiters"
            );
            return Err(Error::new("read", "the table", problem)
                .of(ErrorKind::DamagedData)
                .help("export it with semicolons or tabs between columns, or with decimal points"));
        }
        header.names.truncate(width);
        Ok(header)
    }

    /// Name and unit of a column.
    pub(super) fn column(&self, column: usize) -> (String, Option<String>) {
        let name = self.names.get(column).cloned().unwrap_or_default();
        let (name, of_name) = unit::split(&name);
        let stated = self.units.get(column).map(|unit| unit.trim_matches(['(', ')', '[', ']']).trim().to_owned());
        let unit = stated.filter(|unit| !unit.is_empty() && unit.parse::<f64>().is_err()).or(of_name);
        (if name.is_empty() { format!("column {}", column + 1) } else { name }, unit)
    }
}

/// What lines above the table say of all of it.
struct Preamble {
    rate_hz: Option<f64>,
}

impl Preamble {
    /// From lines like `Sample Interval,1e-06` or `# fs = 5120`.
    fn of(lines: &[Line], dialect: Dialect) -> Self {
        let mut rate_hz = None;
        for line in lines {
            let line = text(&line.text);
            let line = line.trim_start_matches('#').trim();
            let delimiter = char::from(dialect.delimiter);
            let pair = line.split_once(['=', ':']).or_else(|| line.split_once(delimiter).filter(|_| delimiter != ' '));
            let Some((name, value)) = pair.filter(|_| rate_hz.is_none()) else { continue };
            let name = unit::split(name.trim().trim_matches('"')).0.to_lowercase().replace([' ', '-'], "_");
            let value = value.trim().split([char::from(dialect.delimiter), ' ']).next().unwrap_or_default();
            let Some(value) =
                number(value.as_bytes(), dialect.decimal).filter(|value| *value > 0.0 && value.is_finite())
            else {
                continue;
            };
            if is_rate(&name) {
                rate_hz = Some(value);
            } else if is_step(&name) || name == "hresolution" {
                rate_hz = Some(value.recip());
            }
        }
        Self { rate_hz }
    }
}
