//! How `runout batch` scales with the number of jobs: `cargo xtask bench-batch`.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::atomic::{AtomicUsize, Ordering},
    thread,
    time::{Duration, Instant},
};

use crate::{
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

/// What one batch took. Where the system does not report the last two, they are 0.
struct Spent {
    seconds: f64,
    peak_kb: u64,
    /// User and system time of all threads.
    processor_seconds: f64,
}

/// One batch into a new folder, from start to end.
fn timed(program: &Path, recordings: &[PathBuf], out: &Path, jobs: usize) -> Outcome<Spent> {
    let mut batch = Command::new(program);
    batch.arg("batch").arg(root().join("benchmarks/batch/pipeline.toml")).args(recordings);
    batch.arg("--out").arg(out).args(["--jobs", &jobs.to_string()]).stdout(Stdio::null());
    let start = Instant::now();
    let mut running = batch.spawn().map_err(|error| format!("cannot start {}: {error}", program.display()))?;
    let [status_of, times_of] = ["status", "stat"].map(|file| format!("/proc/{}/{file}", running.id()));
    let (mut peak_kb, mut processor_seconds) = (0, 0.0);
    loop {
        let ended = running.try_wait().map_err(|error| format!("cannot wait for the batch: {error}"))?;
        if let Some(status) = ended {
            let seconds = start.elapsed().as_secs_f64();
            say(&format!("{jobs} jobs: {seconds:.2} s"));
            let spent = Spent { seconds, peak_kb, processor_seconds };
            return if status.success() { Ok(spent) } else { Err(format!("the batch failed ({status})")) };
        }
        peak_kb = fs::read_to_string(&status_of).ok().and_then(|text| peak(&text)).unwrap_or(peak_kb);
        let busy = fs::read_to_string(&times_of).ok().and_then(|text| processor_time(&text));
        processor_seconds = busy.unwrap_or(processor_seconds);
        thread::sleep(Duration::from_millis(10));
    }
}

/// The largest resident size so far.
fn peak(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse().ok()
}

/// User and system time of a process, in seconds: fields 14 and 15, which Linux counts in hundredths of a second.
fn processor_time(stat: &str) -> Option<f64> {
    // The program's name, in brackets, may hold blanks.
    let (_, fields) = stat.rsplit_once(')')?;
    let ticks: Vec<f64> = fields.split_whitespace().skip(11).take(2).filter_map(|ticks| ticks.parse().ok()).collect();
    (ticks.len() == 2).then(|| ticks.iter().sum::<f64>() / 100.0)
}

#[cfg(test)]
mod tests {
    use super::processor_time;

    #[test]
    fn user_and_system_time_are_read_behind_any_name() {
        let stat = "4242 (a ) b) R 1 4242 1 0 -1 4194560 500 0 0 0 321 54 0 0 20 0 3 0 100 1 1";
        assert_eq!(processor_time(stat), Some(3.75));
        assert_eq!(processor_time("4242 (a"), None);
    }
}
