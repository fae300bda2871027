//! The sheets of a table.

use arrow_array::{
    Array, RecordBatch,
    cast::AsArray,
    types::{Float64Type, UInt32Type},
};
use runout_core::table::{Kind, TableSpec};
use rust_xlsxwriter::{Format, Workbook, Worksheet, XlsxError};

/// Rows of a sheet, at most, with the header.
const MOST_ROWS: u32 = 1_048_576;
/// Characters of a sheet's name, at most.
const LONGEST_NAME: usize = 31;

/// A table's sheets: one, and another one wherever it is full. Rows are in a temporary file, not in memory.
pub(crate) struct Sheets {
    full: Vec<Worksheet>,
    current: Worksheet,
    /// The row after the last one.
    next: u32,
    most_rows: u32,
}

impl Sheets {
    pub(crate) fn begin(workbook: &mut Workbook, table: &TableSpec) -> Result<Self, XlsxError> {
        let current = sheet(workbook, table, 0)?;
        Ok(Self { full: Vec::new(), current, next: 1, most_rows: MOST_ROWS })
    }

    /// Adds rows. What is lost (NaN) or not known (null) is an empty cell.
    pub(crate) fn add(
        &mut self,
        workbook: &mut Workbook,
        table: &TableSpec,
        rows: &RecordBatch,
    ) -> Result<(), XlsxError> {
        for row in 0..rows.num_rows() {
            if self.next == self.most_rows {
                let following = sheet(workbook, table, self.full.len() + 1)?;
                self.full.push(std::mem::replace(&mut self.current, following));
                self.next = 1;
            }
            for (column, (spec, cells)) in table.columns.iter().zip(rows.columns()).enumerate() {
                if !cells.is_null(row) {
                    self.cell(column as u16, spec.kind, cells, row)?;
                }
            }
            self.next += 1;
        }
        Ok(())
    }

    fn cell(&mut self, column: u16, kind: Kind, cells: &dyn Array, row: usize) -> Result<(), XlsxError> {
        let (sheet, at) = (&mut self.current, self.next);
        match kind {
            Kind::Name | Kind::Text => {
                sheet.write_string(at, column, fitting(cells.as_string::<i32>().value(row)))?;
            }
            Kind::Number => {
                let number = cells.as_primitive::<Float64Type>().value(row);
                if number.is_finite() {
                    sheet.write_number(at, column, number)?;
                }
            }
            Kind::Count => {
                sheet.write_number(at, column, cells.as_primitive::<UInt32Type>().value(row))?;
            }
            Kind::Flag => {
                sheet.write_boolean(at, column, cells.as_boolean().value(row))?;
            }
        }
        Ok(())
    }

    pub(crate) fn finish(self, workbook: &mut Workbook) {
        self.full.into_iter().chain([self.current]).for_each(|sheet| workbook.push_worksheet(sheet));
    }
}

/// A sheet of a table that has so many before it.
fn sheet(workbook: &mut Workbook, table: &TableSpec, before: usize) -> Result<Worksheet, XlsxError> {
    let mut sheet = workbook.new_worksheet_with_constant_memory()?;
    let behind = if before == 0 { String::new() } else { format!(" {}", before + 1) };
    let name: String = table.name.chars().take(LONGEST_NAME - behind.len()).collect();
    sheet.set_name(name + &behind)?;
    let width = |kind: Kind| if matches!(kind, Kind::Text) { 40.0 } else { 14.0 };
    header(&mut sheet, table.columns.iter().map(|column| (column.name.as_str(), width(column.kind))), 0)?;
    Ok(sheet)
}

/// Names of the columns and their widths in characters, which stay in sight; with a filter of so many rows, where there are some.
pub(crate) fn header<'a>(
    sheet: &mut Worksheet,
    columns: impl Iterator<Item = (&'a str, f64)>,
    rows: u32,
) -> Result<(), XlsxError> {
    let bold = Format::new().set_bold();
    let mut last = 0;
    for (column, (name, width)) in columns.enumerate() {
        last = column as u16;
        sheet.set_column_width(last, width)?;
        sheet.write_string_with_format(0, last, name, &bold)?;
    }
    sheet.set_freeze_panes(1, 0)?;
    if rows > 0 {
        sheet.autofilter(0, 0, rows, last)?;
    }
    Ok(())
}

/// As much of a text as a cell holds.
pub(crate) fn fitting(text: &str) -> String {
    const MOST: usize = 32_767;
    text.chars().take(MOST).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use calamine::{Data, DataType, Reader, Xlsx};
    use runout_core::table::{ColumnSpec, flags, numbers_or_null};

    use super::*;

    #[test]
    fn a_full_sheet_is_followed_by_another_one() {
        let columns =
            vec![ColumnSpec::number("height_um", "um", "height").or_null(), ColumnSpec::flag("observable", "")];
        let table = TableSpec::new("a table with a name that is longer than sheets", "", columns);
        let mut workbook = Workbook::new();
        let mut sheets = Sheets { most_rows: 4, ..Sheets::begin(&mut workbook, &table).unwrap() };
        let rows = [Some(1.0), None, Some(f64::NAN), Some(-2.5), Some(1e-9)];
        let batch = table.rows(vec![numbers_or_null(rows), flags([true, false, true, false, true])]).unwrap();
        sheets.add(&mut workbook, &table, &batch).unwrap();
        sheets.finish(&mut workbook);
        let bytes = workbook.save_to_buffer().unwrap();
        let mut read = Xlsx::new(std::io::Cursor::new(bytes)).unwrap();
        let names = read.sheet_names();
        assert!(names.len() == 2 && names.iter().all(|name| name.len() <= LONGEST_NAME), "{names:?}");
        let mut numbers = Vec::new();
        for name in names {
            let range = read.worksheet_range(&name).unwrap();
            assert_eq!(range.get((0, 1)), Some(&Data::String("observable".into())));
            numbers.extend((1..range.height()).map(|row| range.get((row, 0)).and_then(DataType::get_float)));
        }
        assert_eq!(numbers, [Some(1.0), None, None, Some(-2.5), Some(1e-9)]);
    }
}
