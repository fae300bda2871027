//! The evaluators of a pipeline at work: they get tables as exporters do, and give values before limits decide.

use crate::{
    stage::{Evaluation, Evaluator, OwnValues, ResultInfo},
    summary::Summary,
};
use runout_error::Result;
use runout_table::{RecordBatch, TableRows, TableSpec};

/// Evaluations under way, in the order configured.
pub(super) struct Evaluations(Vec<Box<dyn Evaluation>>);

impl Evaluations {
    pub(super) fn begin(evaluators: &[Box<dyn Evaluator>], result: &ResultInfo) -> Result<Self> {
        evaluators.iter().map(|evaluator| evaluator.begin(result)).collect::<Result<_>>().map(Self)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Takes rows of a table.
    pub(super) fn rows(&mut self, table: &TableSpec, rows: &RecordBatch) -> Result<()> {
        self.0.iter_mut().try_for_each(|evaluation| evaluation.rows(table, rows))
    }

    /// Takes the values so far, and gives those of all evaluators.
    pub(super) fn finish(&mut self, specs: &[TableSpec], values: &[TableRows], summary: &Summary) -> Result<OwnValues> {
        for TableRows { table, rows } in values {
            if let Some(spec) = specs.iter().find(|spec| spec.name == *table) {
                self.rows(spec, rows)?;
            }
        }
        let mut all = OwnValues::default();
        for evaluation in self.0.drain(..) {
            let found = evaluation.finish(summary)?;
            all.values.extend(found.values);
            all.remarks.extend(found.remarks);
        }
        Ok(all)
    }
}
