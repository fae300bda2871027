//! The report: the exporter `report`, which writes a result as one page to look at.
//!
//! The page opens without a network, in any browser: charts, data and program are in the file, and its content security policy
//! forbids every request. It draws the figures that a result's tables declare, and knows no domain.
//!
//! ```toml
//! [[export]]
//! plugin = "report"
//! path = "out/report.html"
//! ```

mod closed_loop;
mod consistency;
mod data;
mod facts;
mod first;
mod limits;
mod numbers;
mod origin;
mod overview;
mod page;
mod rig;
mod shapes;
mod values;

use std::path::PathBuf;

use runout_core::{
    Result,
    atomic_file::PendingFile,
    fault::Fault,
    pipeline::{Context, Plugin, Registry, StageConfig},
    stage::{Completed, Export, Exporter, ResultInfo, Takes},
    table::{RecordBatch, TableSpec, panels::Panels},
};
use schemars::JsonSchema;
use serde::Deserialize;

/// Adds the exporter `report`.
pub fn register(registry: &mut Registry) {
    registry.exporters.add(Plugin::of::<ReportConfig>());
}

/// `[[export]] plugin = "report"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReportConfig {
    /// The file to write, relative to the TOML: `out/report.html`.
    pub path: PathBuf,
}

impl StageConfig for ReportConfig {
    type Stage = Box<dyn Exporter>;

    const NAME: &'static str = "report";
    const ABOUT: &'static str = "one page with figures, values and limits, for a browser and for print";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        if self.path.file_name().is_none() {
            return Err(Fault::at("path", format!("expected the path of a file, found `{}`", self.path.display())));
        }
        Ok(Box::new(Report::new(context.path(&self.path))))
    }
}

/// The exporter `report`.
#[derive(Debug, Clone)]
pub struct Report {
    path: PathBuf,
}

impl Report {
    /// Writes to this file.
    #[must_use]
    pub fn new(path: PathBuf) -> Self {
        Self { path }
    }
}

impl Exporter for Report {
    fn takes(&self) -> Takes {
        Takes::TablesAndSurface
    }

    fn outputs(&self, _tables: &[TableSpec]) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }

    fn begin(&self, result: &ResultInfo) -> Result<Box<dyn Export>> {
        let pending = PendingFile::new(self.path.clone())?;
        let figures = result.tables.iter().flat_map(|table| table.figures.iter().map(move |figure| (table, figure)));
        let figures = figures.map(|(table, figure)| Panels::new(table, figure, usize::MAX)).collect::<Result<_>>()?;
        Ok(Box::new(Collected { title: result.title.clone(), pending, figures }))
    }
}

/// A report whose rows are coming.
struct Collected {
    title: String,
    pending: PendingFile,
    figures: Vec<Panels>,
}

impl Export for Collected {
    fn rows(&mut self, table: &TableSpec, rows: &RecordBatch) -> Result<()> {
        self.figures.iter_mut().for_each(|figure| figure.take(&table.name, rows));
        Ok(())
    }

    fn finish(self: Box<Self>, result: &Completed) -> Result<Vec<PendingFile>> {
        let Self { title, pending, figures } = *self;
        let page = page::page(&title, &figures, result).map_err(|error| pending.caused(error))?;
        std::fs::write(pending.path(), page.into_string()).map_err(|error| pending.failure(error))?;
        Ok(vec![pending])
    }
}

/// A name without what would break a line or hide.
fn one_line(name: &str) -> String {
    name.chars().map(|character| if character.is_control() { ' ' } else { character }).collect()
}

/// A unit as people write it.
fn symbol(unit: &str) -> String {
    match unit {
        "1" => String::new(),
        "deg" => "°".into(),
        _ => unit
            .replace("um", "µm")
            .replace("urad", "µrad")
            .replace("/deg", "/°")
            .replace("m2", "m²")
            .replace("m3", "m³"),
    }
}
