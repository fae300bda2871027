//! Time and memory of `runout diagnose` on large data: `cargo xtask bench-diagnose`.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use crate::{
    measured::measured,
    process::{Outcome, root, run, say, target},
    setup::cargo,
};

/// What is diagnosed: name in `benchmarks/diagnose`, what it is, and the file that its pipeline reads.
const DATA: [[&str; 3]; 2] =
    [["map", "height map of 1000 × 1000", "map.h5"], ["stations", "300 spindle stations", "stations.h5"]];
const ROUNDS: usize = 3;

/// Simulates the data once, diagnoses each three times and prints the median of the times and the largest memory.
pub(crate) fn diagnose(words: &[&str]) -> Outcome {
    let program = match words {
        [] => {
            run(&mut cargo(&["build", "--release", "--package", "runout"])?)?;
            target().join("release/runout")
        }
        [program] => std::path::absolute(program).map_err(|error| format!("{program}: {error}"))?,
        _ => return Err("expected no word, or the program that is measured".into()),
    };
    let scratch = target().join("bench/diagnose");
    fs::create_dir_all(&scratch).map_err(|error| format!("{}: {error}", scratch.display()))?;
    say("| data | file, MB | time, s | processor time, s | peak memory, MiB |\n| --- | --- | --- | --- | --- |");
    for [name, about, file] in DATA {
        let pipeline = prepared(&program, &scratch, name, file)?;
        let mut times = Vec::new();
        let (mut busy, mut peak_kb) = (f64::INFINITY, 0);
        for _ in 0..ROUNDS {
            let mut command = Command::new(&program);
            command.arg("diagnose").arg(&pipeline).stdout(Stdio::null()).stderr(Stdio::null());
            let spent = measured(&mut command)?;
            times.push(spent.seconds);
            busy = spent.processor_seconds.min(busy);
            peak_kb = spent.peak_kb.max(peak_kb);
        }
        times.sort_by(f64::total_cmp);
        let size = fs::metadata(scratch.join(file)).map_or(f64::NAN, |data| data.len() as f64 / 1e6);
        say(&format!("| {about} | {size:.0} | {:.2} | {busy:.2} | {} |", times[ROUNDS / 2], peak_kb / 1024));
    }
    Ok(())
}

/// The pipeline beside its data, which are simulated where they are not there.
fn prepared(program: &Path, scratch: &Path, name: &str, file: &str) -> Outcome<PathBuf> {
    let source = root().join("benchmarks/diagnose");
    let pipeline = scratch.join(format!("{name}.toml"));
    fs::copy(source.join(format!("{name}.toml")), &pipeline).map_err(|error| format!("{name}.toml: {error}"))?;
    let data = scratch.join(file);
    if !data.is_file() {
        let mut simulate = Command::new(program);
        simulate.arg("simulate").arg(source.join(format!("{name}-scenario.toml"))).arg("--out").arg(&data);
        run(simulate.stdout(Stdio::null()))?;
    }
    Ok(pipeline)
}
