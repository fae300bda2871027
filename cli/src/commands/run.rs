//! `runout run`.

use runout_core::{
    pipeline::{Registry, run},
    summary::Decision,
};

use super::{fail_on, fail_on_limits, no_limit, pipeline, print};
use crate::{args::RunArgs, failure::Failure, progress::Progress, render};

/// Runs a pipeline and says what came out.
///
/// # Errors
/// When the configuration is wrong, or the data or a file fails; where it was asked for, also when a limit is not proven to
/// be kept or a warning was given.
pub(crate) fn execute(args: &RunArgs, json: bool, registry: &Registry) -> Result<(), Failure> {
    let (_, pipeline) = pipeline(&args.pipeline, registry)?;
    if args.limits.fail_on_limit && pipeline.evaluate.limits().is_empty() {
        return Err(no_limit());
    }
    let progress = Progress::new("stations");
    let summary = run::run(&pipeline, args.threads, &progress)?;
    drop(progress);
    print(&summary, json, |summary| render::summary::text(summary, render::columns(), args.verbose))?;
    let open = summary.limits.iter().filter(|limit| limit.decision != Decision::Conforms);
    fail_on_limits(open.map(|limit| limit.limit.name()), args.limits)?;
    fail_on(summary.findings().count(), args.warnings)
}
