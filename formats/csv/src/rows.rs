//! The rows of a file, one after the other.

use std::path::Path;

use runout_core::{Error, Result, rig::Rig};

use crate::{
    header::Header,
    lines::{Line, Lines, cells},
    number::Eights,
    row::{Instant, Role, Row},
};

/// A file below its header.
pub(crate) struct Rows {
    pub(crate) header: Header,
    lines: Lines,
    roles: Vec<Role>,
    processor: Processor,
    /// `.` or `,`, once a row told.
    decimal: Option<u8>,
    /// The first of the blank lines that the file seems to end with.
    blank: Option<u64>,
}

impl Rows {
    /// Opens a file and reads its header.
    pub(crate) fn open(path: &Path, rig: &Rig) -> Result<Self> {
        let (header, lines) = Header::open(path, rig)?;
        let roles = Role::of_columns(&header, rig);
        // Where the comma delimits, it cannot be in a number.
        let decimal = (header.delimiter == b',').then_some(b'.');
        Ok(Self { header, lines, roles, processor: Processor::here(), decimal, blank: None })
    }

    /// Fills the channels from the next row; `None` at the end.
    pub(crate) fn next(&mut self, channels: &mut [f64]) -> Result<Option<Instant>> {
        if let (None, Some(decimal)) = (self.blank, self.decimal) {
            let row = Row { header: &self.header, roles: &self.roles, decimal };
            if let Some((instant, length)) = self.processor.plain(&row, self.lines.ahead(), channels) {
                self.lines.pass(length);
                return Ok(Some(instant));
            }
        }
        self.next_line(|row, line| row.cell_by_cell(line, channels))
    }

    /// Phase and time of the next row, its readings passed over; `None` at the end.
    #[allow(clippy::redundant_closure_for_method_calls, reason = "the method alone is one of a single lifetime")]
    pub(crate) fn next_instant(&mut self) -> Result<Option<Instant>> {
        self.next_line(|row, line| row.instant(line))
    }

    /// Reads the next line that is not blank; only blank lines may follow one that is.
    fn next_line(&mut self, read: impl FnOnce(&Row, Line) -> Result<Instant>) -> Result<Option<Instant>> {
        while let Some(line) = self.lines.next()? {
            if line.is_blank() {
                self.blank.get_or_insert(line.number);
                continue;
            }
            if let Some(number) = self.blank {
                return Err(self.header.line_error(number, "expected a row, found a blank line between rows"));
            }
            self.decimal = self.decimal.or_else(|| decimal_of(&self.roles, line.bytes, self.header.delimiter));
            let row = Row { header: &self.header, roles: &self.roles, decimal: self.decimal.unwrap_or(b'.') };
            return read(&row, line).map(Some);
        }
        Ok(None)
    }

    /// An error in a column of the row that was read last.
    pub(crate) fn error(&self, column: usize, problem: impl ToString) -> Error {
        self.header.error(self.lines.number(), column, problem)
    }
}

/// What this processor can do.
#[derive(Clone, Copy)]
struct Processor {
    /// With AVX2.
    #[cfg(target_arch = "x86_64")]
    wide: Option<pulp::x86::V3>,
}

impl Processor {
    fn here() -> Self {
        Self {
            #[cfg(target_arch = "x86_64")]
            wide: pulp::x86::V3::try_new(),
        }
    }

    /// See [`Row::plain`].
    #[inline]
    fn plain(self, row: &Row, bytes: &[u8], channels: &mut [f64]) -> Option<(Instant, usize)> {
        #[cfg(target_arch = "x86_64")]
        if let Some(wide) = self.wide {
            return wide.vectorize(Plain { wide, row, bytes, channels });
        }
        row.plain(Eights, bytes, channels)
    }
}

/// A row that is read in wide registers. (A closure would not be inlined.)
#[cfg(target_arch = "x86_64")]
struct Plain<'a> {
    wide: pulp::x86::V3,
    row: &'a Row<'a>,
    bytes: &'a [u8],
    channels: &'a mut [f64],
}

#[cfg(target_arch = "x86_64")]
impl pulp::NullaryFnOnce for Plain<'_> {
    type Output = Option<(Instant, usize)>;

    #[inline(always)]
    #[allow(clippy::inline_always, reason = "what is not inlined leaves wide registers")]
    fn call(self) -> Self::Output {
        self.row.plain(self.wide, self.bytes, self.channels)
    }
}

/// The decimal mark of a line's numbers, where one has it; other columns may hold dates and sentences.
fn decimal_of(roles: &[Role], line: &[u8], delimiter: u8) -> Option<u8> {
    let mut numbers =
        cells(line, delimiter).zip(roles).filter(|(_, role)| !matches!(role, Role::Skip)).map(|(cell, _)| cell);
    let mark = |cell: &[u8]| memchr::memchr2(b',', b'.', cell).map(|place| cell[place]);
    numbers.find_map(mark)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_decimal_mark_is_that_of_the_numbers() {
        let roles = [Role::Skip, Role::Phase, Role::Sensor { channel: 0, sign: 1.0 }, Role::Skip];
        for (line, mark) in [
            ("01.02.2024 12:00:00;0;5,58606;3.5", Some(b',')),
            ("12:00:00,123;0;5.58606;a, b", Some(b'.')),
            ("12:00:00,123;0;5;\"a; b.\"", None),
            ("\"1.5;2\";0;-0,25;", Some(b',')),
        ] {
            assert_eq!(decimal_of(&roles, line.as_bytes(), b';'), mark, "{line}");
        }
    }
}
