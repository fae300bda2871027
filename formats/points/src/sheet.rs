//! XLSX: a sheet whose first row that is not empty holds the names of the columns.

use calamine::{Data, Reader, Xlsx};
use runout_core::{Error, Result, fault::known_names, input_file::InputFile};

use crate::{RawColumn, RawTable, failed};

/// Reads a sheet; the first one without a name.
pub(crate) fn read(input: &InputFile, sheet: Option<&str>) -> Result<RawTable> {
    let shown = input.path().display().to_string();
    let mut book = Xlsx::new(std::io::BufReader::new(input.open()?)).map_err(|error| failed(&shown, error))?;
    let names = book.sheet_names();
    let sheet = match sheet {
        Some(sheet) if names.iter().any(|name| name == sheet) => sheet.to_owned(),
        Some(sheet) => {
            let help = known_names(sheet, names.iter().map(String::as_str));
            return Err(Error::new("read", shown, format!("it has no sheet `{sheet}`")).help(help));
        }
        None => names.first().cloned().ok_or_else(|| Error::new("read", &shown, "it has no sheet"))?,
    };
    let range = book.worksheet_range(&sheet).map_err(|error| failed(&shown, error))?;
    let first_row = range.start().map_or(0, |(row, _)| u64::from(row));
    let mut rows = range.rows().zip(first_row + 1..).skip_while(|(row, _)| row.iter().all(|cell| *cell == Data::Empty));
    let (header, _) = rows.next().ok_or_else(|| Error::new("read", &shown, format!("the sheet `{sheet}` is empty")))?;
    let names: Vec<String> = header.iter().map(|cell| cell.to_string().trim().to_owned()).collect();
    let filled: Vec<(&[Data], u64)> = rows.filter(|(row, _)| row.iter().any(|cell| *cell != Data::Empty)).collect();
    let columns =
        (0..names.len()).map(|place| column(filled.iter().map(|(row, _)| row.get(place).unwrap_or(&Data::Empty))));
    let columns = columns.collect();
    Ok(RawTable {
        names,
        columns,
        rows: filled.len(),
        lines: filled.iter().map(|(_, line)| *line).collect(),
        decimal_comma: true,
    })
}

/// Numbers where all cells are numbers or empty, else texts.
fn column<'a>(cells: impl Iterator<Item = &'a Data> + Clone) -> RawColumn {
    let number = |cell: &Data| match cell {
        Data::Float(number) => Some(*number),
        #[allow(clippy::cast_precision_loss, reason = "whole numbers of a sheet are below 2^53")]
        Data::Int(number) => Some(*number as f64),
        Data::Empty => Some(f64::NAN),
        _ => None,
    };
    let numbers: Option<Vec<f64>> = cells.clone().map(number).collect();
    numbers.map_or_else(
        || RawColumn::Texts(cells.map(|cell| cell.to_string().trim().to_owned()).collect()),
        RawColumn::Numbers,
    )
}
