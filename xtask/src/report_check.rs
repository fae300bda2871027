//! Every example's report in Chromium, and what reports cost: size, time of the run, time until the page can be used.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    time::Instant,
};

use crate::{
    foreign,
    process::{Outcome, run, say, target, tools},
    results,
    setup::cargo,
};

const EXPORT: &str = "\n[[export]]\nplugin = \"report\"\npath = \"out/report.html\"\n";
const FIRST: &str = "01-four-sensor";
/// Runs with and without the report, in turns.
const ROUNDS: usize = 7;
/// Stations of the large report.
const MANY: usize = 400;

/// Runs all examples with a report each, examines every page, and prints a table of size and time.
pub(crate) fn check(words: &[&str]) -> Outcome {
    let program = match words {
        [] => {
            run(&mut cargo(&["build", "--release", "--package", "runout"])?)?;
            target().join("release/runout")
        }
        [program] => PathBuf::from(program),
        _ => return Err("usage: cargo xtask report-check [PROGRAM]".into()),
    };
    let program = program.canonicalize().map_err(|error| format!("cannot find {}: {error}", program.display()))?;
    let folder = target().join("report-check");
    if folder.exists() {
        fs::remove_dir_all(&folder).map_err(|error| format!("cannot remove {}: {error}", folder.display()))?;
    }
    results::run_examples(&folder, &program, &with_report, &mut |_| Ok(()))?;
    let first = folder.join("examples").join(FIRST);
    many_stations(&program, &first)?;
    let looked = look(&folder.join("examples"));
    let [with, without] = extra_time(&program, &first)?;
    say(&format!("example 1, median of {ROUNDS}: {with:.2} s with the report, {without:.2} s without"));
    looked
}

/// Adds a report to every pipeline that has none.
pub(crate) fn with_report(example: &Path) -> std::io::Result<()> {
    for entry in fs::read_dir(example)? {
        let path = entry?.path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let text = fs::read_to_string(&path)?;
        let is_pipeline = text.contains("[separate]") && !text.contains("plugin = \"report\"");
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if is_pipeline {
            fs::write(&path, text + &EXPORT.replace("report.html", &format!("{stem}-report.html")))?;
        }
    }
    Ok(())
}

/// The first example with many stations: as long a part and as many rings.
fn many_stations(program: &Path, example: &Path) -> Outcome {
    let step = format!("recording.stations.step_mm={}", 60.0 / MANY as f64);
    let count = format!("recording.stations.count={MANY}");
    let made = example.join("many.h5");
    let mut simulate = Command::new(program);
    simulate
        .arg("simulate")
        .arg(example.join("scenario.toml"))
        .arg("--out")
        .arg(&made)
        .args(["--set", &count, "--set", &step]);
    run(&mut simulate)?;
    let mut pipeline = Command::new(program);
    pipeline.arg("run").arg(example.join("pipeline.toml")).args(["--set", "load.path=many.h5"]);
    for (export, path) in
        [(0, "many"), (1, "many/report.html"), (2, "many/result.h5"), (3, "many/shaft.glb"), (4, "many/shaft.obj")]
    {
        pipeline.arg("--set").arg(format!("export.{export}.path={path}"));
    }
    run(&mut pipeline)
}

/// Opens every page below a folder in Chromium and prints a table of them.
fn look(folder: &Path) -> Outcome {
    let browser = foreign::browser().ok_or("Chromium is not installed")?;
    let modules =
        std::env::var_os("RUNOUT_NODE_MODULES").map_or_else(|| tools().join("node/node_modules"), PathBuf::from);
    let browser = std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default())
        .map(|folder| folder.join(browser))
        .find(|path| path.is_file())
        .ok_or("Chromium is not in the PATH")?;
    run(Command::new("node").arg("cli/tests/browser/table.mjs").arg(modules).arg(browser).arg(folder))
}

/// Seconds of a run with and without the report, in turns: medians.
fn extra_time(program: &Path, example: &Path) -> Outcome<[f64; 2]> {
    let with = example.join("pipeline.toml");
    let without = example.join("without.toml");
    let text = fs::read_to_string(&with).map_err(|error| format!("{}: {error}", with.display()))?;
    let report = "[[export]]\nplugin = \"report\"\npath = \"out/report.html\"\n";
    fs::write(&without, text.replace(report, "")).map_err(|error| format!("{}: {error}", without.display()))?;
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..ROUNDS {
        for (times, pipeline) in times.iter_mut().zip([&with, &without]) {
            let begun = Instant::now();
            let output = Command::new(program).arg("run").arg(pipeline).output();
            let output = output.map_err(|error| format!("cannot start {}: {error}", program.display()))?;
            if !output.status.success() {
                return Err(String::from_utf8_lossy(&output.stderr).into_owned());
            }
            times.push(begun.elapsed().as_secs_f64());
        }
    }
    Ok(times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    }))
}
