//! The rows of a file, one after the other.

use std::path::Path;

use runout_core::{Error, Result, rig::Rig};

use crate::{
    header::Header,
    lines::{Line, Lines},
    row::{Instant, Role, Row},
};

/// In no text.
const UNKNOWN: u8 = 0;

/// A file below its header.
pub(crate) struct Rows {
    pub(crate) header: Header,
    lines: Lines,
    roles: Vec<Role>,
    /// `.` or `,`, once a row told.
    decimal: u8,
    /// The first of the blank lines that the file seems to end with.
    blank: Option<u64>,
}

impl Rows {
    /// Opens a file and reads its header.
    pub(crate) fn open(path: &Path, rig: &Rig) -> Result<Self> {
        let (header, lines) = Header::open(path, rig)?;
        let roles = Role::of_columns(&header, rig);
        // Where the comma delimits, it cannot be in a number.
        let decimal = if header.delimiter == b',' { b'.' } else { UNKNOWN };
        Ok(Self { header, lines, roles, decimal, blank: None })
    }

    /// Fills the channels from the next row; `None` at the end.
    pub(crate) fn next(&mut self, channels: &mut [f64]) -> Result<Option<Instant>> {
        if self.blank.is_none() {
            let row = Row { header: &self.header, roles: &self.roles, decimal: self.decimal };
            if let Some((instant, length)) = row.plain(self.lines.ahead(), channels) {
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
            if self.decimal == UNKNOWN {
                self.decimal = memchr::memchr2(b',', b'.', line.bytes).map_or(UNKNOWN, |place| line.bytes[place]);
            }
            let row = Row { header: &self.header, roles: &self.roles, decimal: self.decimal };
            return read(&row, line).map(Some);
        }
        Ok(None)
    }

    /// An error in a column of the row that was read last.
    pub(crate) fn error(&self, column: usize, problem: impl ToString) -> Error {
        self.header.error(self.lines.number(), column, problem)
    }
}
