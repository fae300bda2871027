//! `runout run`.

use runout_core::pipeline::{Registry, run};

use super::{pipeline, print};
use crate::{args::RunArgs, failure::Failure, progress::Progress, render};

/// Runs a pipeline and says what came out.
///
/// # Errors
/// When the configuration is wrong, or the data or a file fails.
pub fn execute(args: &RunArgs, json: bool, registry: &Registry) -> Result<(), Failure> {
    let (_, pipeline) = pipeline(&args.pipeline, registry)?;
    let progress = Progress::new("stations");
    let summary = run::run(&pipeline, args.threads, &progress)?;
    drop(progress);
    print(&summary, json, render::summary::text)
}
