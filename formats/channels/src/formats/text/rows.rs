//! The rows of a table, read again from their beginning.

use runout_core::{Error, ErrorKind, Result};

use super::{
    LONGEST_LINE,
    cells::{Dialect, cells, instant_s, is_passed_over, number},
    table::Table,
};
use crate::{bytes::Bytes, source::Source};

/// Reads some columns of a table.
pub(super) struct RowSamples {
    bytes: Bytes,
    shown: String,
    dialect: Dialect,
    /// Column, and the instant that it is counted from where it holds instants.
    columns: Vec<(usize, Option<f64>)>,
    left: u64,
    line: u64,
}

impl RowSamples {
    pub(super) fn open(source: &Source, table: &Table, columns: &[usize]) -> Result<Self> {
        let mut bytes = Bytes::open(source)?;
        bytes.seek(table.begin)?;
        let origin =
            |column: &usize| (*column, table.origins.iter().find(|(known, _)| known == column).map(|(_, at_s)| *at_s));
        Ok(Self {
            bytes,
            shown: source.shown(),
            dialect: table.dialect,
            columns: columns.iter().map(origin).collect(),
            left: table.rows,
            line: table.line,
        })
    }

    /// Appends samples to those columns that the numbers name.
    pub(super) fn next(&mut self, most: usize, numbers: &[usize], columns: &mut [Vec<f64>]) -> Result<usize> {
        let mut taken = 0;
        while taken < most && self.left > 0 {
            let Some(line) = self.bytes.line(LONGEST_LINE)? else { break };
            self.line += 1;
            if is_passed_over(&line) {
                continue;
            }
            let cells = cells(&line, self.dialect.delimiter);
            for ((column, origin), number_of) in self.columns.iter().zip(numbers) {
                let cell = cells.get(*column).copied().unwrap_or_default();
                let value = match origin {
                    Some(origin) => instant_s(cell).map(|at_s| at_s - origin),
                    None => number(cell, self.dialect.decimal),
                };
                let Some(value) = value else {
                    let object = format!("{}, line {}, column {}", self.shown, self.line, column + 1);
                    let problem = format!("expected a number, found `{}`", crate::bytes::text(cell));
                    return Err(Error::new("read", object, problem).of(ErrorKind::DamagedData));
                };
                columns[*number_of].push(value);
            }
            taken += 1;
            self.left -= 1;
        }
        Ok(taken)
    }
}
