//! One row of a file: the readings of an instant.

use runout_core::{Result, rig::Rig};

use crate::{
    header::Header,
    lines::{Line, cell_at, split},
    number::{self, Reading},
};

/// What a column is read for.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Role {
    Sensor {
        channel: usize,
        sign: f64,
    },
    /// The mark, or the encoder's angle.
    Phase,
    Time,
    Skip,
}

impl Role {
    /// Of each column.
    pub(crate) fn of_columns(header: &Header, rig: &Rig) -> Vec<Self> {
        let mut roles = vec![Self::Skip; header.names.len()];
        for (channel, (column, sensor)) in header.sensors.iter().zip(&rig.sensors).enumerate() {
            roles[*column] = Self::Sensor { channel, sign: sensor.sign };
        }
        roles[header.phase.column()] = Self::Phase;
        if let Some(column) = header.time {
            roles[column] = Self::Time;
        }
        roles
    }
}

/// How a row is read.
pub(crate) struct Row<'a> {
    pub(crate) header: &'a Header,
    pub(crate) roles: &'a [Role],
    /// `.` or `,`.
    pub(crate) decimal: u8,
}

/// What a row holds besides readings.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instant {
    /// The mark, 0 or 1 or its trace, or the encoder's angle in degrees.
    pub(crate) phase: f64,
    /// NaN without such a column.
    pub(crate) time_s: f64,
}

impl Row<'_> {
    /// A row of plain numbers, as most are, that begins where `bytes` do and ends somewhere in them: fills the channels, and
    /// gives its length with the line's end. `None` where each cell has to be read by itself.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "what is not inlined leaves wide registers")]
    pub(crate) fn plain(&self, reading: impl Reading, bytes: &[u8], channels: &mut [f64]) -> Option<(Instant, usize)> {
        let delimiter = self.header.delimiter;
        let mut found = Instant { phase: f64::NAN, time_s: f64::NAN };
        let mut end = 0;
        for (column, role) in self.roles.iter().enumerate() {
            if column > 0 {
                if bytes.get(end) != Some(&delimiter) {
                    return None;
                }
                end += 1;
            }
            let rest = bytes.get(end..)?;
            if let Role::Skip = role {
                if rest.first() == Some(&b'"') {
                    return None;
                }
                end += memchr::memchr3(delimiter, b'\n', b'\r', rest)?;
                continue;
            }
            let (value, length) = number::leading(reading, rest, self.decimal)?;
            end += length;
            match role {
                Role::Sensor { channel, sign } => channels[*channel] = value * sign,
                Role::Phase => found.phase = value,
                Role::Time => found.time_s = value,
                Role::Skip => {}
            }
        }
        match bytes.get(end..)? {
            [b'\n', ..] => Some((found, end + 1)),
            [b'\r', b'\n', ..] => Some((found, end + 2)),
            _ => None,
        }
    }

    /// Any row: with quotes, exponents, missing readings, or mistakes.
    pub(crate) fn cell_by_cell(&self, line: Line, channels: &mut [f64]) -> Result<Instant> {
        let delimiter = self.header.delimiter;
        let mut found = Instant { phase: f64::NAN, time_s: f64::NAN };
        let mut rest = Some(line.bytes);
        for (column, role) in self.roles.iter().enumerate() {
            let Some(bytes) = rest else { return Err(ragged(self.header, line.number, column)) };
            if let Role::Skip = role {
                rest = split(bytes, delimiter).1;
                continue;
            }
            let (cell, after) = split(bytes, delimiter);
            rest = after;
            let readable = |value: &f64| matches!(role, Role::Sensor { .. }) || value.is_finite();
            let value = number::parse_number(cell, self.decimal)
                .filter(readable)
                .ok_or_else(|| self.header.no_number(line.number, column, cell, self.decimal))?;
            match role {
                Role::Sensor { channel, sign } => channels[*channel] = value * sign,
                Role::Phase => found.phase = value,
                Role::Time => found.time_s = value,
                Role::Skip => {}
            }
        }
        match rest {
            // Some programs end each row with a delimiter.
            Some(bytes) if !bytes.trim_ascii().is_empty() => {
                let more = memchr::memchr_iter(delimiter, bytes).count() + 1;
                Err(ragged(self.header, line.number, self.roles.len() + more))
            }
            _ => Ok(found),
        }
    }

    /// Phase and time alone.
    pub(crate) fn instant(&self, line: Line) -> Result<Instant> {
        let mut found = Instant { phase: f64::NAN, time_s: f64::NAN };
        let mut wanted: Vec<usize> = std::iter::once(self.header.phase.column()).chain(self.header.time).collect();
        wanted.sort_unstable();
        let mut rest = (0, Some(line.bytes));
        for column in wanted {
            let (cell, after) = cell_at(rest, self.header.delimiter, column)
                .map_err(|found| ragged(self.header, line.number, found))?;
            rest = (column + 1, after);
            let value = number::parse_number(cell, self.decimal)
                .filter(|value| value.is_finite())
                .ok_or_else(|| self.header.no_number(line.number, column, cell, self.decimal))?;
            match self.roles[column] {
                Role::Time => found.time_s = value,
                _ => found.phase = value,
            }
        }
        Ok(found)
    }
}

/// A row of too few or too many cells.
fn ragged(header: &Header, line: u64, found: usize) -> runout_core::Error {
    let expected = header.names.len();
    let help = if header.delimiter == b',' && found > expected {
        "where the comma is the delimiter, numbers have a decimal point and no commas between thousands: delimit columns of numbers with \
         decimal commas by semicolon or tab"
    } else {
        "each row has one cell for each name of the header; a cell without a reading is empty"
    };
    header.line_error(line, format!("expected {expected} cells as in the header, found {found}")).help(help)
}
