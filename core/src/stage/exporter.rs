//! Exporting: from results to files.

use std::path::PathBuf;

use crate::{
    Result,
    atomic_file::PendingFile,
    pipeline::run::{RunInfo, StationResult, Summary},
    straightness::Straightness,
    surface::Surface,
    table::Table,
};

/// Writes results to files.
pub trait Exporter: Send + Sync {
    /// The files that it will write, so that two exporters do not write the same one.
    fn outputs(&self) -> Vec<PathBuf>;

    /// Whether it needs the surface at the end.
    fn needs_surface(&self) -> bool {
        false
    }

    /// How it writes straightness; `None` where it has no place for it, so that `check` can refuse it.
    fn straightness(&self) -> Option<&dyn StraightnessExporter> {
        None
    }

    /// How it writes a model's table; `None` where it has no place for it, so that `check` can refuse it.
    fn tables(&self) -> Option<&dyn TableExporter> {
        None
    }

    /// Begins an export. Files appear under their names only when it is finished.
    ///
    /// # Errors
    /// When the place cannot be written to.
    fn begin(&self, run: &RunInfo) -> Result<Box<dyn Export>>;
}

/// Writes the straightness of part and slide, all at once.
pub trait StraightnessExporter {
    /// Completes the files. The run gives them their names when every exporter's are complete.
    ///
    /// # Errors
    /// When they cannot be written.
    fn write(&self, result: &Straightness, summary: &Summary) -> Result<Vec<PendingFile>>;
}

/// Writes a table of numbers, all at once.
pub trait TableExporter {
    /// The file that a table of this name goes to.
    fn table_output(&self, name: &str) -> PathBuf;

    /// Completes the files. The run gives them their names when every exporter's are complete.
    ///
    /// # Errors
    /// When they cannot be written.
    fn write_table(&self, table: &Table, summary: &Summary) -> Result<Vec<PendingFile>>;
}

/// An export under way: stations come in order, one at a time.
pub trait Export: Send {
    /// Takes one station's result.
    ///
    /// # Errors
    /// When it cannot be written.
    fn station(&mut self, result: &StationResult) -> Result<()>;

    /// Completes the files. The run gives them their names when every exporter's are complete.
    ///
    /// # Errors
    /// When they cannot be completed.
    fn finish(self: Box<Self>, summary: &Summary, surface: Option<&Surface>) -> Result<Vec<PendingFile>>;
}
