//! Measured points that belong to no turn: a coordinate measuring machine's circles, an R-test's ball positions.

use std::{ops::Range, path::PathBuf};

use crate::{Error, Result};

/// Points in named columns, grouped into traces.
#[derive(Debug, Clone, PartialEq)]
pub struct Points {
    /// The file behind them.
    pub input: PathBuf,
    /// Columns of equal length; the unit is part of the name (`angle_deg`).
    pub columns: Vec<Column>,
    /// Consecutive points that were measured in one go.
    pub traces: Vec<Trace>,
}

/// One named column.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name with unit.
    pub name: String,
    /// One value a point.
    pub values: Vec<f64>,
}

/// A run of points measured in one go.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Its name in the file.
    pub id: String,
    /// What it runs along ("circle", "generatrix"), or the setup that it was measured in ("initial").
    pub kind: String,
    /// Its points.
    pub points: Range<usize>,
}

impl Points {
    /// A column by name.
    ///
    /// # Errors
    /// When there is none of that name.
    pub fn column(&self, name: &str) -> Result<&[f64]> {
        self.columns.iter().find(|column| column.name == name).map(|column| column.values.as_slice()).ok_or_else(|| {
            let known: Vec<&str> = self.columns.iter().map(|column| column.name.as_str()).collect();
            Error::new("find the column", name, format!("{} has {}", self.input.display(), known.join(", ")))
        })
    }
}
