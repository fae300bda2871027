//! Mutated inputs, each given to the program as a process of its own: no panic, no abort, no hang, no memory without bound.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use crate::{
    process::{Outcome, root, run, say, target},
    random::Random,
    setup::cargo,
};

/// Longer is a hang.
const LONGEST: Duration = Duration::from_secs(5);
/// Memory that is allowed beyond four times the input.
const ALLOWANCE_KB: u64 = 100_000;
/// Longest text that is put in.
const LONGEST_TEXT: u64 = 40_000;
/// Bytes that are printed of what a program said before it panicked.
const LONGEST_SAID: usize = 1000;
/// Texts that configurations and tables do not expect.
const DICTIONARY: [&str; 22] = [
    "1e308",
    "-1e308",
    "nan",
    "inf",
    "-0.0",
    "9223372036854775808",
    "\0",
    "\u{1b}[2J",
    "\u{202e}",
    "[[",
    "]]",
    "{",
    "}",
    "\"\"\"",
    "=",
    ",",
    ";",
    "\t",
    "\r\n",
    "é",
    "0",
    "-1",
];
const KEYS: [&str; 8] = [
    "rig.sensors.0.angle_deg",
    "rig.part_radius_mm",
    "title",
    "preprocess.0.samples_per_rev",
    "load.pattern",
    "rig",
    "export.0.path",
    "separate.plugin",
];

/// What went wrong with how many inputs.
#[derive(Default)]
struct Count {
    inputs: u64,
    done: u64,
    panics: u64,
    aborts: u64,
    hangs: u64,
    large: u64,
    largest_kb: u64,
}

/// `[--inputs N] [--minutes M] [--seed S] [PROGRAM]`: as many inputs, or as much time, whichever ends first.
pub fn fuzz(words: &[&str]) -> Outcome {
    let (mut inputs, mut minutes, mut seed, mut program) = (u64::MAX, 2.0, 1_u64, None);
    let mut words = words.iter();
    while let Some(word) = words.next() {
        let mut number =
            || words.next().and_then(|value| value.parse::<f64>().ok()).ok_or(format!("{word} takes a number"));
        match *word {
            "--inputs" => (inputs, minutes) = (number()? as u64, f64::INFINITY),
            "--minutes" => minutes = number()?,
            "--seed" => seed = number()? as u64,
            path => program = Some(std::path::absolute(path).map_err(|error| format!("{path}: {error}"))?),
        }
    }
    let program = if let Some(program) = program {
        program
    } else {
        run(&mut cargo(&["build", "--release", "--package", "runout"])?)?;
        target().join("release/runout")
    };
    let until = (minutes.is_finite()).then(|| Instant::now() + Duration::from_secs_f64(60.0 * minutes));
    let count = drive(&program, inputs, until, seed)?;
    let Count { inputs, done, panics, aborts, hangs, large, largest_kb } = count;
    say(&format!(
        "{inputs} inputs from seed {seed}, {done} of them taken as they are: {panics} panics, {aborts} aborts, {hangs} hangs above {} s, {large} \
         above 4 times their size and 100 MB (most: {} MB)",
        LONGEST.as_secs(),
        largest_kb / 1000
    ));
    if panics + aborts + hangs + large > 0 {
        return Err(format!("the inputs are in {}", folder(seed).join(FAILURES).display()));
    }
    Ok(())
}

const FAILURES: &str = "failures";

/// Each seed has a folder of its own: several may run at a time.
fn folder(seed: u64) -> PathBuf {
    target().join(format!("fuzz/seed-{seed}"))
}

fn drive(program: &Path, inputs: u64, until: Option<Instant>, seed: u64) -> Outcome<Count> {
    let (place, failures) = (folder(seed).join("work"), folder(seed).join(FAILURES));
    let words = |error: std::io::Error| format!("{}: {error}", place.display());
    let _ = fs::remove_dir_all(folder(seed));
    fs::create_dir_all(&place).map_err(words)?;
    fs::create_dir_all(&failures).map_err(words)?;
    let example = root().join("examples/08-text-recording");
    let text = fs::read_to_string(example.join("pipeline.toml")).map_err(words)?;
    let hdf5 = text.replace("plugin = \"csv\"", "plugin = \"hdf5\"\npath = \"shaft.h5\"");
    let dropped = ["pattern", "stations", "sample_rate_hz", "speed_rpm"];
    let hdf5 = hdf5.lines().filter(|line| dropped.iter().all(|key| !line.starts_with(key)));
    let hdf5 = hdf5.collect::<Vec<_>>().join("\n");
    // Its names go into the recording, by which the inputs of a seed are to be the same everywhere.
    fs::copy(example.join("scenario.toml"), place.join("scenario.toml")).map_err(words)?;
    let mut simulate = Command::new(program);
    simulate.args(["simulate", "scenario.toml", "--out", "seed.h5"]).current_dir(&place);
    let made = simulate.stdout(Stdio::null()).stderr(Stdio::null()).status().map_err(words)?;
    if !made.success() {
        return Err("the recording that is to be damaged cannot be made".into());
    }
    let seeds = [
        text.clone().into_bytes(),
        fs::read(example.join("shaft.csv")).map_err(words)?,
        fs::read(place.join("seed.h5")).map_err(words)?,
    ];
    let mut random = Random::new(seed);
    let mut count = Count::default();
    while count.inputs < inputs && until.is_none_or(|until| Instant::now() < until) {
        let kind = random.below(4) as usize;
        let (file, command): (&str, &[&str]) = match (kind, random.below(3)) {
            (0, 0) => ("pipeline.toml", &["run", "pipeline.toml", "--json"]),
            (0, _) => ("pipeline.toml", &["check", "pipeline.toml"]),
            (1, _) => ("shaft.csv", &["run", "pipeline.toml"]),
            (2, 0) => ("shaft.h5", &["inspect", "shaft.h5"]),
            (2, _) => ("shaft.h5", &["run", "hdf5.toml", "--json"]),
            _ => ("", &["check", "pipeline.toml", "--json", "--set"]),
        };
        let write = |name: &str, bytes: &[u8]| fs::write(place.join(name), bytes).map_err(words);
        write("pipeline.toml", &seeds[0])?;
        write("hdf5.toml", hdf5.as_bytes())?;
        write("shaft.csv", &seeds[1])?;
        let mut arguments: Vec<String> = command.iter().map(|word| (*word).to_owned()).collect();
        let input = if kind == 3 {
            let assignment = format!(
                "{}={}",
                KEYS[random.below(KEYS.len() as u64) as usize],
                random.text(&DICTIONARY, LONGEST_TEXT)
            );
            let assignment =
                String::from_utf8_lossy(&random.mutated(assignment.as_bytes(), &DICTIONARY)).replace('\0', "");
            arguments.push(assignment.clone());
            assignment.into_bytes()
        } else {
            let input = random.mutated(&seeds[kind], &DICTIONARY);
            write(file, &input)?;
            input
        };
        count.inputs += 1;
        let mut started = Command::new(program);
        let said = place.join("said");
        let errors = fs::File::create(&said).map_err(words)?;
        started.args(&arguments).current_dir(&place).stdin(Stdio::null()).stdout(Stdio::null()).stderr(errors);
        let ended = watch(started.spawn().map_err(words)?).map_err(words)?;
        let most_kb = ALLOWANCE_KB + 4 * input.len() as u64 / 1000;
        count.largest_kb = count.largest_kb.max(ended.memory_kb);
        let large = ended.memory_kb > most_kb;
        let (counted, name) = match ended.how {
            How::Killed => (&mut count.hangs, "hang"),
            How::Status(101) => (&mut count.panics, "panic"),
            How::Signal => (&mut count.aborts, "abort"),
            How::Status(_) if large => (&mut count.large, "memory"),
            How::Status(0) => (&mut count.done, ""),
            How::Status(_) => continue,
        };
        *counted += 1;
        if !name.is_empty() {
            let kept = failures.join(format!("{name}-{}", count.inputs));
            fs::write(&kept, &input).map_err(words)?;
            let said = fs::read(&said).map_err(words)?;
            let said = String::from_utf8_lossy(&said[..said.len().min(LONGEST_SAID)]).escape_debug().to_string();
            say(&format!(
                "{name}: input {}, runout {} ({})\n  {said}",
                count.inputs,
                command.join(" "),
                kept.display()
            ));
        }
    }
    Ok(count)
}

/// How a process ended.
struct Ended {
    how: How,
    /// Largest memory that was seen, on Linux.
    memory_kb: u64,
}

/// By itself or not.
enum How {
    /// With an exit status.
    Status(i32),
    /// By a signal.
    Signal,
    /// It had to be killed.
    Killed,
}

fn watch(mut child: Child) -> std::io::Result<Ended> {
    let begun = Instant::now();
    let mut memory_kb = 0;
    loop {
        let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().split(' ').next()?.parse().ok());
        memory_kb = memory_kb.max(peak.unwrap_or(0));
        if let Some(status) = child.try_wait()? {
            let how = status.code().map_or(How::Signal, How::Status);
            return Ok(Ended { how, memory_kb });
        }
        if begun.elapsed() > LONGEST {
            child.kill()?;
            child.wait()?;
            return Ok(Ended { how: How::Killed, memory_kb });
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}
