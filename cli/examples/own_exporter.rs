//! An exporter of one's own: a result's tables in Markdown. `cargo run -p runout --example own_exporter`.
//!
//! An exporter knows tables and no domain: this one writes the result of any separator.

#![allow(clippy::print_stdout, reason = "a program that prints its result")]

use std::{
    error::Error,
    fmt::Write,
    path::{Path, PathBuf},
};

use runout_core::{
    Result,
    atomic_file::PendingFile,
    fault::Fault,
    pipeline::{Context, Pipeline, Plugin, StageConfig},
    stage::{Completed, Export, Exporter, ResultInfo, Takes},
    table::{RecordBatch, TableSpec},
};
use schemars::JsonSchema;
use serde::Deserialize;

/// `plugin = "markdown"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Markdown {
    /// The file to write.
    path: PathBuf,
}

impl StageConfig for Markdown {
    type Stage = Box<dyn Exporter>;
    const NAME: &'static str = "markdown";
    const ABOUT: &'static str = "columns of all tables and all warnings, to read";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        Ok(Box::new(Self { path: context.path(&self.path) }))
    }
}

impl Exporter for Markdown {
    fn takes(&self) -> Takes {
        Takes::Tables
    }

    fn outputs(&self, _tables: &[TableSpec]) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }

    fn begin(&self, result: &ResultInfo) -> Result<Box<dyn Export>> {
        // The file appears under its name when all exporters are complete, or not at all.
        let file = PendingFile::new(&self.path)?;
        let rows = result.tables.iter().map(|table| (table.clone(), 0)).collect();
        Ok(Box::new(Page { file, title: result.title.clone(), rows }))
    }
}

struct Page {
    file: PendingFile,
    title: String,
    rows: Vec<(TableSpec, usize)>,
}

impl Export for Page {
    fn rows(&mut self, table: &TableSpec, rows: &RecordBatch) -> Result<()> {
        for (_, count) in self.rows.iter_mut().filter(|(known, _)| known.name == table.name) {
            *count += rows.num_rows();
        }
        Ok(())
    }

    fn finish(self: Box<Self>, result: &Completed) -> Result<Vec<PendingFile>> {
        let mut text = format!("# {}\n", self.title);
        for (table, rows) in self.rows.iter().filter(|(_, rows)| *rows > 0) {
            // A string takes whatever is written to it.
            let _ = write!(text, "\n## {} ({rows} rows)\n\n| column | unit | is |\n| --- | --- | --- |\n", table.name);
            for column in &table.columns {
                let _ = writeln!(text, "| {} | {} | {} |", column.name, column.unit, column.about);
            }
        }
        for warning in &result.summary.warnings {
            let _ = write!(text, "\nWarning: {warning}\n");
        }
        std::fs::write(self.file.path(), text).map_err(|error| self.file.caused(error))?;
        Ok(vec![self.file])
    }
}

/// Writes the straightness of example 4 to a page.
///
/// # Errors
/// When the traces cannot be read, or the page cannot be written.
pub(crate) fn page(traces: &Path, page: &Path) -> std::result::Result<(), Box<dyn Error>> {
    let mut registry = runout_cli::builtin::registry();
    registry.exporters.add(Plugin::of::<Markdown>());
    let (traces, page) = (traces.display(), page.display());
    let configuration = format!(
        r#"
        title = "Straightness of a cylinder and a slide"
        load = {{ plugin = "points", path = '{traces}' }}
        separate = {{ plugin = "axial-reversal" }}
        export = [{{ plugin = "markdown", path = '{page}' }}]
        "#
    );
    Pipeline::from_toml(&configuration, ".", &registry)?.run()?;
    Ok(())
}

#[allow(dead_code, reason = "a test calls `page`")]
fn main() -> std::result::Result<(), Box<dyn Error>> {
    let traces = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/04-straightness-reversal/traces.csv");
    let file = std::env::temp_dir().join("runout-page.md");
    page(Path::new(traces), &file)?;
    println!("{}", std::fs::read_to_string(file)?);
    Ok(())
}
