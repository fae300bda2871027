//! Tables with units: what a result of any domain consists of, and what every exporter of tables writes.
//!
//! A [`TableSpec`] declares a table before the run: its columns with unit and meaning. Its rows come as Arrow record batches, some
//! at a time, so that memory does not grow with a result. Columns keep unit and meaning as the metadata `unit` and `about` of
//! their Arrow fields.
//!
//! ```
//! use runout_table::{ColumnSpec, TableSpec, numbers};
//!
//! let angle = ColumnSpec::number("angle_deg", "deg", "the part's angle").repeating();
//! let form = ColumnSpec::number("form_um", "um", "deviation from the nominal radius");
//! let table = TableSpec::new("form", "form of each section", vec![angle, form]);
//! let rows = table.rows(vec![numbers([0.0, 90.0]), numbers([1.2, -0.8])]).unwrap();
//! assert_eq!(rows.num_rows(), 2);
//! assert_eq!(rows.schema().field(1).metadata()["unit"], "um");
//! assert!(table.rows(vec![numbers([0.0])]).is_err(), "a column is missing");
//! ```

pub mod circles;
pub mod figure;
pub mod panels;

use std::{collections::HashMap, sync::Arc};

use arrow_array::{BooleanArray, UInt32Array, builder::StringBuilder};
use arrow_schema::{DataType, Field, Schema, SchemaRef};

use runout_error::{Error, Result};

pub use arrow_array::{Array, ArrayRef, Float64Array, RecordBatch, StringArray};
pub use figure::{Figure, Measure};

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Short texts that repeat: ids and names.
    Name,
    /// Texts of any length.
    Text,
    /// f64.
    Number,
    /// u32: orders, counts.
    Count,
    /// true and false.
    Flag,
}

/// A column of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct ColumnSpec {
    /// Its name, with the unit where it has one: `form_um`.
    pub name: String,
    /// What it holds.
    pub kind: Kind,
    /// Whether cells may be null.
    pub nullable: bool,
    /// Whether its numbers are measured, so that their last digits are noise and do not compress.
    pub measured: bool,
    /// Its unit; empty for what has none.
    pub unit: String,
    /// What it is.
    pub about: String,
}

impl ColumnSpec {
    fn new(kind: Kind, name: impl Into<String>, unit: impl Into<String>, about: impl Into<String>) -> Self {
        let (name, unit, about) = (name.into(), unit.into(), about.into());
        Self { name, kind, nullable: false, measured: kind == Kind::Number, unit, about }
    }

    /// Short texts that repeat.
    #[must_use]
    pub fn name(name: impl Into<String>, about: impl Into<String>) -> Self {
        Self::new(Kind::Name, name, "", about)
    }

    /// Texts of any length.
    #[must_use]
    pub fn text(name: impl Into<String>, about: impl Into<String>) -> Self {
        Self::new(Kind::Text, name, "", about)
    }

    /// Measured numbers.
    #[must_use]
    pub fn number(name: impl Into<String>, unit: impl Into<String>, about: impl Into<String>) -> Self {
        Self::new(Kind::Number, name, unit, about)
    }

    /// Whole numbers from 0.
    #[must_use]
    pub fn count(name: impl Into<String>, unit: impl Into<String>, about: impl Into<String>) -> Self {
        Self::new(Kind::Count, name, unit, about)
    }

    /// true and false.
    #[must_use]
    pub fn flag(name: impl Into<String>, about: impl Into<String>) -> Self {
        Self::new(Kind::Flag, name, "", about)
    }

    /// Allows cells that are null.
    #[must_use]
    pub fn or_null(self) -> Self {
        Self { nullable: true, ..self }
    }

    /// Marks the column as one of numbers that repeat from row to row or follow a rule, and compress.
    #[must_use]
    pub fn repeating(self) -> Self {
        Self { measured: false, ..self }
    }

    fn field(&self) -> Field {
        let kind = match self.kind {
            Kind::Name | Kind::Text => DataType::Utf8,
            Kind::Number => DataType::Float64,
            Kind::Count => DataType::UInt32,
            Kind::Flag => DataType::Boolean,
        };
        let about = [("unit", &self.unit), ("about", &self.about)];
        let about = about.map(|(key, value)| (key.to_owned(), value.clone()));
        Field::new(&self.name, kind, self.nullable).with_metadata(HashMap::from(about))
    }
}

/// A table as it is declared before a run.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct TableSpec {
    /// Its name, of a file or a group: `form`.
    pub name: String,
    /// What its rows are, and by which conventions.
    pub about: String,
    /// Its columns.
    pub columns: Vec<ColumnSpec>,
    /// Whether a result may lack it.
    pub optional: bool,
    /// What to draw of it.
    pub figures: Vec<Figure>,
}

impl TableSpec {
    /// A table that every result has.
    #[must_use]
    pub fn new(name: impl Into<String>, about: impl Into<String>, columns: Vec<ColumnSpec>) -> Self {
        Self { name: name.into(), about: about.into(), columns, optional: false, figures: Vec::new() }
    }

    /// Marks the table as one that a result may lack.
    #[must_use]
    pub fn optional(self) -> Self {
        Self { optional: true, ..self }
    }

    /// Adds a figure.
    #[must_use]
    pub fn figure(mut self, figure: Figure) -> Self {
        self.figures.push(figure);
        self
    }

    /// The column of this name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&ColumnSpec> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// Its columns as Arrow's schema, with `unit` and `about` as metadata of each field.
    #[must_use]
    pub fn schema(&self) -> SchemaRef {
        Arc::new(Schema::new(self.columns.iter().map(ColumnSpec::field).collect::<Vec<_>>()))
    }

    /// Rows of the table, column by column in the order declared.
    ///
    /// # Errors
    /// When columns are missing, of another type, or of different lengths.
    pub fn rows(&self, columns: Vec<ArrayRef>) -> Result<RecordBatch> {
        RecordBatch::try_new(self.schema(), columns)
            .map_err(|error| Error::caused("make", format!("rows of the table {}", self.name), error))
    }
}

/// Rows of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct TableRows {
    /// Name of the table.
    pub table: String,
    /// The rows.
    pub rows: RecordBatch,
}

/// A column of numbers; NaN where there is none.
pub fn numbers(values: impl IntoIterator<Item = f64>) -> ArrayRef {
    Arc::new(Float64Array::from_iter_values(values))
}

/// A column of numbers, null where there is none.
pub fn numbers_or_null(values: impl IntoIterator<Item = Option<f64>>) -> ArrayRef {
    Arc::new(values.into_iter().collect::<Float64Array>())
}

/// A column of nulls.
#[must_use]
pub fn no_numbers(rows: usize) -> ArrayRef {
    Arc::new(Float64Array::new_null(rows))
}

/// A column of whole numbers; what is too large is the largest.
pub fn counts(values: impl IntoIterator<Item = usize>) -> ArrayRef {
    Arc::new(UInt32Array::from_iter_values(values.into_iter().map(whole)))
}

/// A column of whole numbers, null where there is none.
pub fn counts_or_null(values: impl IntoIterator<Item = Option<usize>>) -> ArrayRef {
    Arc::new(values.into_iter().map(|value| value.map(whole)).collect::<UInt32Array>())
}

/// A column of texts.
pub fn texts<T: AsRef<str>>(values: impl IntoIterator<Item = T>) -> ArrayRef {
    Arc::new(StringArray::from_iter_values(values))
}

/// A column of texts, each on so many rows in a row.
pub fn stretches<T: AsRef<str>>(texts: impl IntoIterator<Item = (T, usize)>) -> ArrayRef {
    let mut column = StringBuilder::new();
    for (text, rows) in texts {
        column.append_value_n(text, rows);
    }
    Arc::new(column.finish())
}

/// A column of texts, null where there is none.
pub fn texts_or_null<T: AsRef<str>>(values: impl IntoIterator<Item = Option<T>>) -> ArrayRef {
    Arc::new(values.into_iter().collect::<StringArray>())
}

/// A column of true and false.
pub fn flags(values: impl IntoIterator<Item = bool>) -> ArrayRef {
    Arc::new(values.into_iter().map(Some).collect::<BooleanArray>())
}

fn whole(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn stretches_are_texts_that_repeat() {
        let column = stretches([("a", 2), ("", 1), ("never", 0), ("bb", 3)]);
        assert_eq!(&column, &texts(["a", "a", "", "bb", "bb", "bb"]));
        assert_eq!(column.null_count(), 0);
    }

    #[test]
    fn columns_say_what_they_hold() {
        let table = TableSpec::new(
            "form",
            "form of each section",
            vec![ColumnSpec::name("section", "id of the section"), ColumnSpec::number("form_um", "um", "deviation")],
        );
        let rows = table.rows(vec![texts(["a", "b"]), numbers([1.0, f64::NAN])]).unwrap();
        assert_eq!(rows.num_rows(), 2);
        assert_eq!(rows.schema().field(1).metadata()["unit"], "um");
        assert_eq!(rows.schema().field(0).metadata()["about"], "id of the section");
        let message = table.rows(vec![texts(["a"]), numbers([1.0, 2.0])]).unwrap_err().to_string();
        assert!(message.contains("table form"), "{message}");
    }
}
