//! Tables of numbers that a model gives, for exporters that write tables.

/// A table of numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    /// Its name: of a file, or of a group in one.
    pub name: String,
    /// What its numbers are, for files that explain themselves.
    pub about: String,
    /// Columns of equal length.
    pub columns: Vec<TableColumn>,
}

/// A column of a [`Table`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TableColumn {
    /// Its name, with the unit.
    pub name: String,
    /// Its unit; empty for a number without one.
    pub unit: String,
    /// What its numbers are.
    pub about: String,
    /// One number a row.
    pub values: Vec<f64>,
}
