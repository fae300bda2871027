//! Exporting: from results to files.

use std::path::PathBuf;

use super::Overview;
use crate::{atomic_file::PendingFile, summary::Summary};
use runout_closed_loop::diagnosis::Diagnosis;
use runout_error::Result;
use runout_evaluate::height_grid::HeightGrid;
use runout_table::{RecordBatch, TableSpec};
use runout_turning::surface::Surface;

/// Writes results to files. It knows no domain: a result is tables, and a surface where there is form along an axis.
pub trait Exporter: Send + Sync {
    /// What it writes.
    fn takes(&self) -> Takes;

    /// A table without which it has nothing to write, and what to do so that the result has it.
    fn needs(&self) -> Option<(&'static str, &'static str)> {
        None
    }

    /// The files that it writes of a result with these tables, so that two exporters do not write the same one. The first is
    /// always there, and `diagnosis.json` goes beside it where this is the first exporter.
    fn outputs(&self, tables: &[TableSpec]) -> Vec<PathBuf>;

    /// Where the run's summary goes if this is the first exporter: beside the first of its files.
    fn summary(&self, tables: &[TableSpec]) -> Option<PathBuf> {
        self.outputs(tables).first().map(|path| path.with_file_name("summary.json"))
    }

    /// Begins an export. Files appear under their names only when it is finished.
    ///
    /// # Errors
    /// When the place cannot be written to.
    fn begin(&self, result: &ResultInfo) -> Result<Box<dyn Export>>;
}

/// What an exporter writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Takes {
    /// Tables.
    Tables,
    /// The surface: form over angle and z, or heights on a plane.
    Surface,
    /// Tables, and the surface where there is one.
    TablesAndSurface,
}

/// What exporters know when they begin.
#[derive(Debug, Clone, Default)]
pub struct ResultInfo {
    /// The pipeline's title.
    pub title: String,
    /// The tables that will come; of those that are optional, not all.
    pub tables: Vec<TableSpec>,
    /// Bytes of the longest name in them, where it is known before.
    pub longest_name: Option<usize>,
}

/// An export under way.
pub trait Export: Send {
    /// Takes rows of one of the tables announced in [`ResultInfo`].
    ///
    /// # Errors
    /// When they cannot be written.
    fn rows(&mut self, table: &TableSpec, rows: &RecordBatch) -> Result<()>;

    /// Completes the files. The run gives them their names when every exporter's are complete.
    ///
    /// # Errors
    /// When they cannot be completed.
    fn finish(self: Box<Self>, result: &Completed) -> Result<Vec<PendingFile>>;
}

/// A result that is complete, but for the names of its files.
#[derive(Debug, Clone, Copy)]
pub struct Completed<'a> {
    /// What was found.
    pub summary: &'a Summary,
    /// What its numbers are.
    pub about: &'a About,
    /// Form over angle and z, where an exporter or a value needs it.
    pub surface: Option<&'a Surface>,
    /// Heights on a plane, where the result has them.
    pub heights: Option<&'a HeightGrid>,
    /// What the closed loop found, where the result is that of its final model.
    pub diagnosis: Option<&'a Diagnosis>,
    /// What is to be read where this is no single result.
    pub overview: Option<&'a Overview>,
}

/// What a result's numbers are, for files that explain themselves.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct About {
    /// Signs and references.
    pub convention: String,
    /// What else, by name; lists are JSON.
    pub notes: Vec<(String, String)>,
    /// Lowest and highest order of the forms, where there are any.
    pub form_band_upr: Option<[usize; 2]>,
}
