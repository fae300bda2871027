//! The chores themselves.

use std::{fs, path::Path, process::Command, time::SystemTime};

use crate::{
    foreign, house,
    process::{Outcome, answer, root, run, say, target},
    setup::{self, cargo},
};

/// Format, lints, tests, and the demo with the program that the tests were built with.
pub fn test(foreign_readers: bool) -> Outcome {
    house::check_quietly()?;
    setup::components()?;
    run(&mut cargo(&["fmt", "--all", "--check"])?)?;
    run(&mut cargo(&["clippy", "--workspace", "--all-targets", "--quiet", "--", "--deny", "warnings"])?)?;
    let nextest = answer("cargo-nextest", &["--version"]).is_some();
    let runner: &[&str] = if nextest {
        &["nextest", "run", "--workspace", "--no-fail-fast"]
    } else {
        &["test", "--workspace", "--all-targets", "--no-fail-fast"]
    };
    let mut tests = cargo(runner)?;
    // Foreign readers that one test starts inherit the open files of the others, and HDF5's locks on them with it.
    tests.env("HDF5_USE_FILE_LOCKING", "FALSE");
    if foreign_readers {
        foreign::equip(&mut tests)?;
    }
    run(&mut tests)?;
    run(&mut cargo(&["test", "--workspace", "--doc", "--quiet"])?)?;
    run_example(&target().join("debug/runout"))
}

/// Writes schemas/ anew.
pub fn schemas() -> Outcome {
    run(&mut cargo(&["run", "--quiet", "--package", "runout", "--", "schema", "--out", "schemas"])?)
}

/// Makes the first example's campaign once, and runs its pipeline.
pub fn demo() -> Outcome {
    run(&mut cargo(&["build", "--release", "--package", "runout"])?)?;
    let program = target().join("release/runout");
    run_example(&program)?;
    let shown = program.strip_prefix(root()).unwrap_or(&program).display();
    say(&format!("\nThe program is {shown}; meshes open in MeshLab and Blender, tables in Python."));
    Ok(())
}

fn run_example(program: &Path) -> Outcome {
    let example = Path::new("examples/01-four-sensor");
    let scenario = example.join("scenario.toml");
    let campaign = example.join("shaft.h5");
    if newer(&campaign, &scenario) {
        say(&format!("the campaign is there: {}", campaign.display()));
    } else {
        run(Command::new(program).arg("simulate").arg(&scenario).arg("--out").arg(&campaign))?;
    }
    run(Command::new(program).arg("run").arg(example.join("pipeline.toml")))
}

/// Prints the figures that the READMEs show.
pub fn studies(arguments: &[&str]) -> Outcome {
    let mut words = vec!["run", "--release", "--quiet", "--package", "runout-studies", "--"];
    words.extend(arguments);
    run(&mut cargo(&words)?)
}

/// Whether `made` is there and not older than what it is made from.
fn newer(made: &Path, from: &Path) -> bool {
    let changed = |path: &Path| -> Option<SystemTime> { fs::metadata(root().join(path)).ok()?.modified().ok() };
    matches!((changed(made), changed(from)), (Some(made), Some(from)) if made >= from)
}
