//! `runout diagnose`.

use runout_core::pipeline::{Registry, diagnose};

use super::{pipeline, print};
use crate::{args::DiagnoseArgs, failure::Failure, progress::Progress, render};

/// Runs the closed loop on a pipeline and says what the declared model lacks.
///
/// # Errors
/// When the configuration is wrong, or the data or a file fails. Whatever the verdict, a diagnosis is no failure.
pub fn execute(args: &DiagnoseArgs, json: bool, registry: &Registry) -> Result<(), Failure> {
    let (_, pipeline) = pipeline(&args.pipeline, registry)?;
    let progress = Progress::new("stations");
    let diagnosis = diagnose::diagnose(&pipeline, args.threads, &progress)?;
    drop(progress);
    print(&diagnosis, json, render::diagnosis::text)
}
