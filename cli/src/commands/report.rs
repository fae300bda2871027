//! `runout report`, and the reports of what is no single result.

use std::path::{Path, PathBuf};

use runout_core::{
    Result,
    atomic_file::{self, resolved},
    pipeline::document::Sources,
    provenance::Provenance,
    stage::{About, Completed, Export, Exporter, Overview, ResultInfo},
    summary::Summary,
    table::{RecordBatch, TableSpec},
};
use runout_hdf5::read_result;
use runout_report::Report;
use serde::Serialize;

use super::print;
use crate::{args::ReportArgs, failure::Failure};

/// What was written.
#[derive(Debug, Serialize)]
struct Written {
    report: PathBuf,
}

/// Writes the report of a result file.
///
/// # Errors
/// When the file is no result, or the report cannot be written.
pub(crate) fn execute(args: &ReportArgs, json: bool) -> std::result::Result<(), Failure> {
    if args.result.is_dir() || args.result.extension().is_some_and(|ending| ending == "json") {
        let message = format!("{} is no result file", args.result.display());
        let help = "name the file that `[[export]] plugin = \"hdf5\"` wrote; `plugin = \"report\"` writes the page of a run at once";
        return Err(Failure::Name { message, help: help.into() });
    }
    let report = args.out.clone().unwrap_or_else(|| args.result.with_extension("html"));
    if resolved(&report) == resolved(&args.result) {
        let message = format!("{} is the result itself", report.display());
        return Err(Failure::Name { message, help: "name another file with --out".into() });
    }
    write(&args.result, &report)?;
    print(&Written { report }, json, |written| format!("{}\n", written.report.display()))
}

fn write(result: &Path, report: &Path) -> Result<()> {
    atomic_file::complete_publication(result)?;
    let stored = read_result(result)?;
    let tables = stored.tables.iter().map(|(spec, _)| spec.clone()).collect();
    let info = ResultInfo { title: stored.title.clone(), tables, longest_name: None };
    let mut export = Report::new(report.to_owned()).begin(&info)?;
    for (spec, rows) in &stored.tables {
        export.rows(spec, rows)?;
    }
    let completed = Completed {
        summary: &stored.summary,
        about: &stored.about,
        surface: stored.surface.as_ref(),
        heights: None,
        diagnosis: stored.diagnosis.as_ref(),
        overview: None,
    };
    atomic_file::commit_all(export.finish(&completed)?).map(|_written| ())
}

/// The report of a comparison or a plan, whose tables are coming.
pub(super) struct OverviewReport {
    title: String,
    export: Box<dyn Export>,
}

impl OverviewReport {
    /// Begins the report that `--report` names, with tables whose figures it draws.
    ///
    /// # Errors
    /// When the file is one that is read, or its folder cannot be written to.
    pub(super) fn begin(
        path: &Path,
        title: String,
        sources: &Sources,
        tables: Vec<TableSpec>,
    ) -> std::result::Result<Self, Failure> {
        if sources.files().any(|file| resolved(file) == resolved(path)) {
            let message = format!("{} is read as configuration", path.display());
            return Err(Failure::Name { message, help: "name another file with --report".into() });
        }
        let info = ResultInfo { title: title.clone(), tables, longest_name: None };
        let export = Report::new(path.to_owned()).begin(&info)?;
        Ok(Self { title, export })
    }

    /// Takes rows of one of the tables.
    ///
    /// # Errors
    /// When they cannot be taken.
    pub(super) fn rows(&mut self, table: &TableSpec, rows: &RecordBatch) -> Result<()> {
        self.export.rows(table, rows)
    }

    /// Writes the file.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(super) fn finish(self, provenance: Provenance, overview: &Overview) -> Result<()> {
        let summary = Summary { title: self.title, provenance, ..Summary::default() };
        let about = About::default();
        let completed = Completed {
            summary: &summary,
            about: &about,
            surface: None,
            heights: None,
            diagnosis: None,
            overview: Some(overview),
        };
        atomic_file::commit_all(self.export.finish(&completed)?).map(|_written| ())
    }
}
