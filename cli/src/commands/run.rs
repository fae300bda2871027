//! `runout run`.

use runout_core::{
    pipeline::{Registry, run},
    summary::Decision,
};

use super::{fail_on, pipeline, print};
use crate::{args::RunArgs, failure::Failure, progress::Progress, render};

/// Runs a pipeline and says what came out.
///
/// # Errors
/// When the configuration is wrong, or the data or a file fails; where it was asked for, also when a limit is not proven to
/// be kept or a warning was given.
pub(crate) fn execute(args: &RunArgs, json: bool, registry: &Registry) -> Result<(), Failure> {
    let (_, pipeline) = pipeline(&args.pipeline, registry)?;
    if args.fail_on_limit && pipeline.evaluate.limits().is_empty() {
        let message = "--fail-on-limit, and the pipeline has no limit".into();
        return Err(Failure::Name { message, help: "add a table [[limit]], or leave --fail-on-limit out".into() });
    }
    let progress = Progress::new("stations");
    let summary = run::run(&pipeline, args.threads, &progress)?;
    drop(progress);
    print(&summary, json, |summary| render::summary::text(summary, render::columns(), args.verbose))?;
    let open: Vec<String> = (summary.limits.iter())
        .filter(|limit| args.fail_on_limit && limit.decision != Decision::Conforms)
        .map(|limit| limit.limit.name())
        .collect();
    if !open.is_empty() {
        return Err(Failure::Limit(open));
    }
    fail_on(summary.findings().count(), args.warnings)
}
