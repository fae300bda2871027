//! How `runout batch` scales with the number of jobs: `cargo xtask bench-batch`.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::atomic::{AtomicUsize, Ordering},
    thread,
};

use crate::{
    measured::{Spent, measured},
    process::{Outcome, root, run, say, target},
    setup::cargo,
};

/// What is asked for.
struct Options {
    scratch: PathBuf,
    recordings: usize,
    rounds: usize,
    jobs: Vec<usize>,
    program: Option<PathBuf>,
}

impl Options {
    fn read(words: &[&str]) -> Outcome<Self> {
        let scratch = target().join("bench/batch");
        let mut options = Self { scratch, recordings: 1000, rounds: 1, jobs: vec![1, 2], program: None };
        let mut words = words.iter();
        while let Some(word) = words.next() {
            let mut value = || words.next().ok_or_else(|| format!("{word} needs a value"));
            let number = |text: &str| {
                let number = text.parse().ok().filter(|number| *number > 0);
                number.ok_or_else(|| format!("{word} needs numbers of at least 1, found `{text}`"))
            };
            match *word {
                "--recordings" => options.recordings = number(value()?)?,
                "--rounds" => options.rounds = number(value()?)?,
                "--jobs" => options.jobs = value()?.split(',').map(number).collect::<Outcome<_>>()?,
                "--program" => options.program = Some(root().join(value()?)),
                option if option.starts_with('-') => {
                    return Err(format!(
                        "unknown option `{option}`; known: --recordings N, --rounds N, --jobs A,B, --program FILE"
                    ));
                }
                folder => {
                    options.scratch = std::path::absolute(folder).map_err(|error| format!("{folder}: {error}"))?;
                }
            }
        }
        Ok(options)
    }
}

/// Simulates recordings of 2 MB once, runs the batch with each number of jobs in turns and prints a table.
pub(crate) fn batch(words: &[&str]) -> Outcome {
    let options = Options::read(words)?;
    let program = if let Some(program) = &options.program {
        program.clone()
    } else {
        run(&mut cargo(&["build", "--release", "--package", "runout"])?)?;
        target().join("release/runout")
    };
    let recordings = simulate(&options, &program)?;
    let mut times = vec![Vec::new(); options.jobs.len()];
    let mut busy = vec![Vec::new(); options.jobs.len()];
    let mut peaks = vec![0; options.jobs.len()];
    // Each batch has a folder of its own, and all go at the end: some file systems slow down after a removal of many files.
    let outs = options.scratch.join("out");
    remove(&outs)?;
    for round in 0..options.rounds {
        for (at, jobs) in options.jobs.iter().enumerate() {
            let out = outs.join(format!("{round}-{jobs}"));
            let spent = timed(&program, &recordings, &out, *jobs)?;
            times[at].push(spent.seconds);
            busy[at].push(spent.processor_seconds);
            peaks[at] = spent.peak_kb.max(peaks[at]);
        }
    }
    remove(&outs)?;
    let median = |times: &mut Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    let medians: Vec<f64> = times.iter_mut().map(median).collect();
    let processors = thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    say(&format!(
        "{} recordings, {processors} processors, median of {}\n\n| jobs | time, s | processor time, s | recordings a second | times the first | peak memory, MiB |\n\
         | --- | --- | --- | --- | --- | --- |",
        options.recordings, options.rounds
    ));
    for (at, (jobs, seconds)) in options.jobs.iter().zip(&medians).enumerate() {
        let (rate, gain, busy) = (options.recordings as f64 / seconds, medians[0] / seconds, median(&mut busy[at]));
        let [busy, peak] = [(busy > 0.0, format!("{busy:.2}")), (peaks[at] > 0, (peaks[at] / 1024).to_string())]
            .map(|(is_known, text)| if is_known { text } else { "-".to_owned() });
        say(&format!("| {jobs} | {seconds:.2} | {busy} | {rate:.1} | {gain:.2} | {peak} |"));
    }
    Ok(())
}

/// The recordings, those that are not there yet made by as many programs as there are processors.
fn simulate(options: &Options, program: &Path) -> Outcome<Vec<PathBuf>> {
    let folder = options.scratch.join("recordings");
    fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let all: Vec<PathBuf> = (1..=options.recordings).map(|number| folder.join(format!("part-{number}.h5"))).collect();
    let next = AtomicUsize::new(0);
    let work = || -> Outcome {
        while let Some(path) = all.get(next.fetch_add(1, Ordering::Relaxed)) {
            if path.is_file() {
                continue;
            }
            let seed = path.file_stem().and_then(|stem| stem.to_str()).and_then(|stem| stem.strip_prefix("part-"));
            let mut simulate = Command::new(program);
            simulate.arg("simulate").arg(root().join("benchmarks/batch/scenario.toml")).arg("--out").arg(path);
            simulate.args(["--set", &format!("seed={}", seed.unwrap_or("1"))]).stdout(Stdio::null());
            let status = simulate.status().map_err(|error| format!("cannot start {}: {error}", program.display()))?;
            if !status.success() {
                return Err(format!("cannot simulate {} ({status})", path.display()));
            }
        }
        Ok(())
    };
    let workers = thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    thread::scope(|scope| {
        let workers: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|worker| worker.join().unwrap_or_else(|_| Err("a thread stopped".into())))
    })?;
    Ok(all)
}

fn remove(folder: &Path) -> Outcome {
    if folder.exists() {
        fs::remove_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    Ok(())
}

/// One batch into a new folder, from start to end.
fn timed(program: &Path, recordings: &[PathBuf], out: &Path, jobs: usize) -> Outcome<Spent> {
    let mut batch = Command::new(program);
    batch.arg("batch").arg(root().join("benchmarks/batch/pipeline.toml")).args(recordings);
    batch.arg("--out").arg(out).args(["--jobs", &jobs.to_string()]).stdout(Stdio::null());
    let spent = measured(&mut batch)?;
    say(&format!("{jobs} jobs: {:.2} s", spent.seconds));
    Ok(spent)
}
