//! Parquet: the exporter `parquet`, which writes the tables of a result.
//!
//! Its path is a folder that receives one file a table, named by it (`form.parquet`). Every column carries its `unit` and what it
//! is (`about`) as metadata, every file the configuration, the checksums of the inputs, the effects that the result is corrected
//! for and the warnings. A [`DataSet`] keeps the tables of many recordings side by side.

mod about;
mod comparison;
mod data_set;
mod file;
mod table;

use std::path::PathBuf;

use runout_core::{
    Error, ErrorKind, Result,
    atomic_file::PendingFile,
    fault::Fault,
    pipeline::{Context, Plugin, Registry, StageConfig},
    stage::{Completed, Export, Exporter, ResultInfo, Takes},
    table::{RecordBatch, TableSpec},
};
use schemars::JsonSchema;
use serde::Deserialize;

pub use comparison::{ComparisonTable, comparison_figures, comparison_rows, comparison_table};
pub use data_set::DataSet;
use data_set::Partition;
pub use file::ParquetFile;
use table::TableFile;

/// Adds the exporter `parquet`.
pub fn register(registry: &mut Registry) {
    registry.exporters.add(Plugin::of::<ParquetConfig>());
}

/// `[[export]] plugin = "parquet"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ParquetConfig {
    /// Folder for the tables, one file each: form.parquet, motion.parquet, harmonics.parquet, values.parquet; of measured points
    /// those of their separator. Made where it is missing.
    pub path: PathBuf,
}

impl StageConfig for ParquetConfig {
    type Stage = Box<dyn Exporter>;

    const NAME: &'static str = "parquet";
    const ABOUT: &'static str = "the tables of a result, one file each";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        if self.path.as_os_str().is_empty() {
            return Err(Fault::at("path", "expected the name of a folder"));
        }
        Ok(Box::new(Parquet { folder: context.path(&self.path), partition: None }))
    }
}

/// The exporter `parquet`.
#[derive(Debug, Clone)]
struct Parquet {
    folder: PathBuf,
    /// Where the result is one recording's in a data set, the recording.
    partition: Option<Partition>,
}

impl Parquet {
    fn file(&self, table: &TableSpec) -> PathBuf {
        match &self.partition {
            None => self.folder.join(format!("{}.parquet", table.name)),
            Some(partition) => partition.file(&self.folder, &table.name),
        }
    }
}

impl Exporter for Parquet {
    fn takes(&self) -> Takes {
        Takes::Tables
    }

    fn outputs(&self, tables: &[TableSpec]) -> Vec<PathBuf> {
        tables.iter().map(|table| self.file(table)).collect()
    }

    fn summary(&self, tables: &[TableSpec]) -> Option<PathBuf> {
        match &self.partition {
            None => self.outputs(tables).first().map(|path| path.with_file_name("summary.json")),
            Some(partition) => Some(partition.summary(&self.folder)),
        }
    }

    fn begin(&self, result: &ResultInfo) -> Result<Box<dyn Export>> {
        if self.folder.is_file() {
            let shown = self.folder.display().to_string();
            return Err(Error::new("write to", shown, "there is a file of that name")
                .of(ErrorKind::Io)
                .help("name a folder"));
        }
        let (always, optional): (Vec<_>, Vec<_>) = result.tables.iter().cloned().partition(|table| !table.optional);
        let begun = always.into_iter().map(|table| Ok((TableFile::create(self.file(&table), &table)?, table)));
        Ok(Box::new(TableFiles { place: self.clone(), begun: begun.collect::<Result<_>>()?, optional }))
    }
}

/// The tables being written.
struct TableFiles {
    place: Parquet,
    begun: Vec<(TableFile, TableSpec)>,
    /// Those of which no rows have come yet.
    optional: Vec<TableSpec>,
}

impl Export for TableFiles {
    fn rows(&mut self, table: &TableSpec, rows: &RecordBatch) -> Result<()> {
        if let Some((file, _)) = self.begun.iter_mut().find(|(_, known)| known.name == table.name) {
            return file.append(rows);
        }
        self.optional.retain(|other| other.name != table.name);
        let mut file = TableFile::create(self.place.file(table), table)?;
        file.append(rows)?;
        self.begun.push((file, table.clone()));
        Ok(())
    }

    fn finish(self: Box<Self>, result: &Completed) -> Result<Vec<PendingFile>> {
        let complete = match self.place.partition {
            None => close_all(self.begun, result)?,
            // The other threads have recordings of their own.
            Some(_) => (self.begun.into_iter())
                .map(|(file, table)| file.close(&about::entries(&table, result)))
                .collect::<Result<_>>()?,
        };
        // An earlier run's motion beside this run's form would be taken for this run's.
        for path in self.optional.iter().map(|table| self.place.file(table)).filter(|path| path.is_file()) {
            std::fs::remove_file(&path)
                .map_err(|error| Error::caused("remove the outdated", path.display().to_string(), error))?;
        }
        Ok(complete)
    }
}

/// Completes tables side by side: each has rows that were not packed yet, and nothing else is left to do meanwhile.
fn close_all(tables: Vec<(TableFile, TableSpec)>, result: &Completed) -> Result<Vec<PendingFile>> {
    let stopped =
        |_| Err(Error::new("write", "the tables", "a thread that wrote them stopped").of(ErrorKind::Interrupted));
    std::thread::scope(|scope| {
        let close =
            |(file, table): (TableFile, TableSpec)| scope.spawn(move || file.close(&about::entries(&table, result)));
        let closing: Vec<_> = tables.into_iter().map(close).collect();
        closing.into_iter().map(|table| table.join().unwrap_or_else(stopped)).collect()
    })
}
