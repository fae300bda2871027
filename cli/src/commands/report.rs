//! `runout report`.

use std::path::{Path, PathBuf};

use runout_core::{
    Result,
    atomic_file::{self, resolved},
    stage::{Completed, Exporter, ResultInfo},
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
pub fn execute(args: &ReportArgs, json: bool) -> std::result::Result<(), Failure> {
    let report = args.out.clone().unwrap_or_else(|| args.result.with_extension("html"));
    if resolved(&report) == resolved(&args.result) {
        let message = format!("{} is the result itself", report.display());
        return Err(Failure::Name { message, help: "name another file with --out".into() });
    }
    write(&args.result, &report)?;
    print(&Written { report }, json, |written| format!("{}\n", written.report.display()))
}

fn write(result: &Path, report: &Path) -> Result<()> {
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
    };
    atomic_file::commit_all(export.finish(&completed)?).map(|_written| ())
}
