//! Columns of rows as names and numbers.

use arrow_array::{Array, Float64Array, RecordBatch, StringArray, UInt32Array, cast::AsArray, types::Float64Type};

/// Names of a row, those that are there.
pub(super) fn joined(columns: &[Names], row: usize) -> String {
    let names = columns.iter().map(|column| column.get(row)).filter(|name| !name.is_empty());
    names.collect::<Vec<_>>().join(" ")
}

/// A column of names.
pub(super) struct Names<'a>(Option<&'a StringArray>);

impl<'a> Names<'a> {
    pub(super) fn of(rows: &'a RecordBatch, column: &str) -> Self {
        Self(rows.column_by_name(column).and_then(|column| column.as_string_opt::<i32>()))
    }

    pub(super) fn get(&self, row: usize) -> &'a str {
        self.0.filter(|names| names.is_valid(row)).map_or("", |names| names.value(row))
    }
}

/// A column of numbers.
pub(super) enum Numbers<'a> {
    Measured(&'a Float64Array),
    Counted(&'a UInt32Array),
}

impl<'a> Numbers<'a> {
    pub(super) fn of(rows: &'a RecordBatch, column: &str) -> Option<Self> {
        let column = rows.column_by_name(column)?;
        let counted = || column.as_any().downcast_ref::<UInt32Array>().map(Self::Counted);
        column.as_primitive_opt::<Float64Type>().map(Self::Measured).or_else(counted)
    }

    pub(super) fn get(&self, row: usize) -> f64 {
        match self {
            Self::Measured(numbers) if numbers.is_valid(row) => numbers.value(row),
            Self::Counted(numbers) if numbers.is_valid(row) => f64::from(numbers.value(row)),
            _ => f64::NAN,
        }
    }
}
