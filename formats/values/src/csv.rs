//! The exporter `csv`.

use std::path::PathBuf;

use runout_core::{
    fault::Fault,
    pipeline::{Context, StageConfig},
    stage::Exporter,
    summary::Summary,
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    COLUMNS, Cell,
    file::{SummaryFile, check_ending},
    row,
};

/// `[[export]] plugin = "csv"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CsvConfig {
    /// The file to write, ending in `.csv`: one row a value and limit.
    pub path: PathBuf,
    /// Decimal commas, and semicolons between cells, as spreadsheets of many countries expect.
    #[serde(default)]
    pub decimal_comma: bool,
}

impl StageConfig for CsvConfig {
    type Stage = Box<dyn Exporter>;

    const NAME: &'static str = "csv";
    const ABOUT: &'static str = "values with their uncertainties, limits and decisions as CSV, one row each";

    fn check(self, context: &Context) -> Result<Self::Stage, Fault> {
        check_ending(&self.path, &["csv"])?;
        Ok(Box::new(SummaryFile { path: context.path(&self.path), config: self, contents }))
    }
}

fn contents(summary: &Summary, config: &CsvConfig) -> Vec<u8> {
    let delimiter = if config.decimal_comma { b';' } else { b',' };
    let mut writer = csv::WriterBuilder::new().delimiter(delimiter).from_writer(Vec::new());
    let text = |cell: &Cell| match cell {
        Cell::Text(text) => (*text).to_owned(),
        Cell::Number(number) if config.decimal_comma => number.to_string().replace('.', ","),
        Cell::Number(number) => number.to_string(),
        Cell::Empty => String::new(),
    };
    // Memory takes every record.
    let _ = writer.write_record(COLUMNS.map(|(name, _)| name));
    for value in summary.reported_values() {
        let _ = writer.write_record(row(&value).iter().map(text));
    }
    writer.into_inner().unwrap_or_default()
}
