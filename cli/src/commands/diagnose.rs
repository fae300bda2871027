//! `runout diagnose`.

use std::path::Path;

use runout_core::{
    atomic_file::resolved,
    pipeline::{Pipeline, Registry, diagnose, document::Sources},
};

use super::{fail_on, pipeline, print};
use crate::{args::DiagnoseArgs, failure::Failure, progress::Progress, render};

/// Runs the closed loop on a pipeline and says what the declared model lacks.
///
/// # Errors
/// When the configuration is wrong, or the data or a file fails; where it was asked for, also when a warning was given. Whatever the
/// verdict, a diagnosis is no failure.
pub(crate) fn execute(args: &DiagnoseArgs, json: bool, registry: &Registry) -> Result<(), Failure> {
    let (sources, mut pipeline) = pipeline(&args.pipeline, registry)?;
    if let Some(memory_gb) = args.memory {
        if !(memory_gb > 0.0 && memory_gb.is_finite()) {
            let message = format!("--memory {memory_gb}: expected a number of GB above 0");
            return Err(Failure::Name { message, help: "give as many as the machine has free".into() });
        }
        pipeline.diagnose.memory_gb = memory_gb;
    }
    if let Some(path) = &args.write {
        is_free(path, &sources, &pipeline)?;
        pipeline.diagnose.write_rig = Some(path.clone());
    }
    let progress = Progress::new("stations");
    let found = diagnose::diagnosed(&pipeline, args.threads, &progress)?;
    drop(progress);
    let diagnosis = &found.diagnosis;
    print(diagnosis, json, |diagnosis| {
        render::diagnosis::text(diagnosis, &found.summary, render::columns(), args.verbose)
    })?;
    fail_on(diagnosis.findings().count(), args.warnings)
}

/// Refuses a file for the corrected rig that is no TOML or is something else, and a pipeline without a rig.
fn is_free(path: &Path, sources: &Sources, pipeline: &Pipeline) -> Result<(), Failure> {
    let refuse = |message: String, help: &str| Err(Failure::Name { message, help: help.into() });
    let (shown, place) = (path.display(), resolved(path));
    if pipeline.rig.is_none() {
        return refuse("--write, and the pipeline has no [rig]".into(), "leave --write out");
    }
    if sources.files().any(|file| resolved(file) == place) {
        return refuse(format!("{shown} is read as configuration"), "write the corrected rig to another file");
    }
    if pipeline.diagnosed_outputs().iter().any(|output| resolved(output) == place) {
        return refuse(format!("{shown} is written by an exporter"), "write the corrected rig to another file");
    }
    // A name that was meant for another output is not to become a rig.
    if !path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml")) {
        return refuse(format!("the corrected rig is a TOML file, not {shown}"), "name it --write FILE.toml");
    }
    Ok(())
}
