//! An exporter of one file that is written of the finished summary.

use std::{
    ffi::OsStr,
    path::{Path, PathBuf},
};

use runout_core::{
    Result,
    atomic_file::PendingFile,
    fault::Fault,
    stage::{Completed, Export, Exporter, ResultInfo, Takes},
    summary::Summary,
    table::{RecordBatch, TableSpec},
};

/// A file's name has to end so, or the user takes it for another format.
pub(crate) fn check_ending(path: &Path, endings: &[&str]) -> std::result::Result<(), Fault> {
    let is_one = |extension: &str| endings.iter().any(|ending| extension.eq_ignore_ascii_case(ending));
    if path.extension().and_then(OsStr::to_str).is_some_and(is_one) {
        return Ok(());
    }
    let expected: Vec<String> = endings.iter().map(|ending| format!(".{ending}")).collect();
    let message = format!("expected a file name ending in {}, found `{}`", expected.join(" or "), path.display());
    Err(Fault::at("path", message))
}

/// Writes what a function makes of the summary.
pub(crate) struct SummaryFile<C> {
    pub path: PathBuf,
    pub config: C,
    pub contents: fn(&Summary, &C) -> Vec<u8>,
}

struct Pending<C> {
    place: PendingFile,
    config: C,
    contents: fn(&Summary, &C) -> Vec<u8>,
}

impl<C: Clone + Send + Sync + 'static> Exporter for SummaryFile<C> {
    fn takes(&self) -> Takes {
        Takes::Tables
    }

    fn outputs(&self, _tables: &[TableSpec]) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }

    fn begin(&self, _result: &ResultInfo) -> Result<Box<dyn Export>> {
        let place = PendingFile::new(&self.path)?;
        Ok(Box::new(Pending { place, config: self.config.clone(), contents: self.contents }))
    }
}

impl<C: Send> Export for Pending<C> {
    fn rows(&mut self, _table: &TableSpec, _rows: &RecordBatch) -> Result<()> {
        Ok(())
    }

    fn finish(self: Box<Self>, result: &Completed) -> Result<Vec<PendingFile>> {
        self.place.write(&(self.contents)(result.summary, &self.config))?;
        Ok(vec![self.place])
    }
}
