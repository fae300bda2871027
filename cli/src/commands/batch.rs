//! `runout batch`: one pipeline on many recordings.

use std::{num::NonZeroUsize, thread::available_parallelism};

use runout_core::{
    atomic_file::resolved,
    pipeline::{
        INCLUDE_KEY, Registry,
        batch::{Batch, Recording, recordings},
        document::Sources,
    },
};
use runout_parquet::DataSet;

use super::{fail_on, fail_on_limits, no_limit, print};
use crate::{args::BatchArgs, failure::Failure, progress::Progress, render};

/// Runs a pipeline on every recording that is not up to date, and says how the values of all of them run.
///
/// # Errors
/// When the command line or the configuration is wrong, or the data set cannot be written; after the report, when a recording failed, and where it was
/// asked for, when a limit is not proven to be kept or a warning was given.
pub(crate) fn execute(args: &BatchArgs, json: bool, registry: &Registry) -> Result<(), Failure> {
    let sources = Sources::read(&args.pipeline.pipeline, &args.pipeline.overrides.set, INCLUDE_KEY)?;
    let recordings = recordings(&args.recordings, args.name_folders).map_err(|error| Failure::Name {
        message: error.to_string(),
        help: error.advice().unwrap_or("name files or folders").to_owned(),
    })?;
    are_apart(args, &recordings)?;
    let store = DataSet::new(args.out.clone())?;
    let batch = Batch::new(&sources, registry, &store, &recordings)?;
    let jobs = args.jobs.or_else(|| available_parallelism().ok()).unwrap_or(NonZeroUsize::MIN);
    let progress = Progress::new("recordings");
    let report = batch.run(&recordings, jobs, &progress)?;
    drop(progress);
    print(&report, json, render::batch::text)?;
    if !report.failed.is_empty() {
        return Err(Failure::Several { failed: report.failed.len(), thing: "recording" });
    }
    if args.limits.fail_on_limit && report.limits.is_empty() {
        return Err(no_limit());
    }
    let open = report.limits.iter().filter(|limit| limit.does_not_conform + limit.undecided > 0);
    fail_on_limits(open.map(|limit| limit.limit.name()), args.limits)?;
    // What is of another configuration is one warning.
    let outdated = usize::from(!report.other_configuration.is_empty());
    fail_on(report.warning_count + outdated, args.warnings)
}

/// Refuses recordings that lie in the data set: its own tables would be read as recordings.
fn are_apart(args: &BatchArgs, recordings: &[Recording]) -> Result<(), Failure> {
    let folder = resolved(&args.out);
    match recordings.iter().find(|recording| resolved(&recording.path).starts_with(&folder)) {
        None => Ok(()),
        Some(recording) => {
            let (path, out) = (recording.path.display(), args.out.display());
            let help = "name another folder with --out".to_owned();
            Err(Failure::Name { message: format!("the recording {path} lies in the data set {out}"), help })
        }
    }
}
