//! Evaluating: from the tables of a result to values of its own.

use super::ResultInfo;
use crate::summary::{Summary, Value};
use runout_error::Result;
use runout_table::{RecordBatch, TableSpec};

/// Computes values beside those of the standards. It knows no domain: a result is tables.
pub trait Evaluator: Send + Sync {
    /// Symbols of the values that it may give, with their units: those that `[[limit]]` may name. It gives no others.
    fn symbols(&self) -> Vec<(&'static str, &'static str)>;

    /// Begins an evaluation.
    ///
    /// # Errors
    /// When it cannot begin.
    fn begin(&self, result: &ResultInfo) -> Result<Box<dyn Evaluation>>;
}

/// An evaluation under way.
pub trait Evaluation: Send {
    /// Takes rows of one of the tables announced in [`ResultInfo`], as they are written, then of the standards' values.
    ///
    /// # Errors
    /// When they cannot be taken.
    fn rows(&mut self, table: &TableSpec, rows: &RecordBatch) -> Result<()>;

    /// The values, once all rows have come. `summary` is that of the run without what evaluators give and limits decide.
    ///
    /// # Errors
    /// When they cannot be computed.
    fn finish(self: Box<Self>, summary: &Summary) -> Result<OwnValues>;
}

/// What an evaluator found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OwnValues {
    /// The values.
    pub values: Vec<Value>,
    /// What the user should know.
    pub remarks: Vec<String>,
}
