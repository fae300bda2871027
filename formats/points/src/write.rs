//! Points as a file: CSV or Parquet, by the extension.

use std::{fs::File, path::Path};

use arrow_array::{
    Array, ArrayRef,
    cast::AsArray,
    types::{Float64Type, UInt32Type},
};
use parquet::{arrow::ArrowWriter, file::metadata::KeyValue};
use runout_core::{
    Result,
    atomic_file::PendingFile,
    table::{RecordBatch, TableSpec},
};

/// Writes points, and where they came from into the file's metadata where it has any.
///
/// # Errors
/// When the file cannot be written.
pub fn write(path: &Path, table: &TableSpec, rows: &RecordBatch, about: &[(&str, &str)]) -> Result<()> {
    let pending = PendingFile::new(path)?;
    let file = pending.create()?;
    if path.extension().is_some_and(|extension| extension == "parquet") {
        parquet(file, table, rows, about).map_err(|error| pending.caused(error))?;
    } else {
        csv(file, rows).map_err(|error| pending.caused(error))?;
    }
    pending.commit().map(|_| ())
}

fn parquet(file: File, table: &TableSpec, rows: &RecordBatch, about: &[(&str, &str)]) -> parquet::errors::Result<()> {
    let mut writer = ArrowWriter::try_new(file, table.schema(), None)?;
    writer.write(rows)?;
    for (key, value) in about {
        writer.append_key_value_metadata(KeyValue::new(format!("runout.{key}"), (*value).to_owned()));
    }
    writer.close().map(|_| ())
}

fn csv(file: File, rows: &RecordBatch) -> csv::Result<()> {
    let mut writer = csv::Writer::from_writer(file);
    writer.write_record(rows.schema().fields().iter().map(|field| field.name()))?;
    for row in 0..rows.num_rows() {
        writer.write_record(rows.columns().iter().map(|column| cell(column, row)))?;
    }
    writer.flush()?;
    Ok(())
}

/// A cell as text, which reads back to the same number; empty where it is null.
fn cell(column: &ArrayRef, row: usize) -> String {
    if column.is_null(row) {
        return String::new();
    }
    if let Some(numbers) = column.as_primitive_opt::<Float64Type>() {
        numbers.value(row).to_string()
    } else if let Some(counts) = column.as_primitive_opt::<UInt32Type>() {
        counts.value(row).to_string()
    } else if let Some(texts) = column.as_string_opt::<i32>() {
        texts.value(row).to_owned()
    } else {
        column.as_boolean_opt().map_or_else(String::new, |flags| u8::from(flags.value(row)).to_string())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use runout_core::{
        points::{PointColumn, PointKind},
        table::{ColumnSpec, numbers, texts},
    };

    use super::*;

    #[test]
    fn what_is_written_reads_back() {
        let columns = [
            PointColumn::needed("ball", PointKind::Label, "", ""),
            PointColumn::needed("dx_mm", PointKind::Number, "mm", ""),
        ];
        let table = TableSpec::new(
            "points",
            "",
            vec![ColumnSpec::name("ball", "name"), ColumnSpec::number("dx_mm", "mm", "deviation")],
        );
        let rows = table.rows(vec![texts(["P1", "P, 2"]), numbers([0.1 + 0.2, -1e-9])]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        for name in ["points.csv", "points.parquet"] {
            let path = folder.path().join(name);
            write(&path, &table, &rows, &[("scenario", "seed = 1")]).unwrap();
            let read = crate::read(&path, &columns).unwrap();
            assert_eq!(read.column("dx_mm").unwrap(), [0.1 + 0.2, -1e-9], "{name}");
            assert_eq!(read.labels("ball").unwrap(), ["P1", "P, 2"]);
        }
    }
}
