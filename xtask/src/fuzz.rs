//! Mutated inputs, given to the program one after another in one process: no panic, no abort, no hang, no memory without bound.

mod worker;

use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use crate::{
    process::{Outcome, root, run, say, target},
    random::Random,
    setup::cargo,
};

use worker::{Answer, Worker};

/// Longer is a hang, where it is that again: other programs may have had the processor.
const LONGEST: Duration = Duration::from_secs(5);
/// No answer comes after this time.
const PATIENCE: Duration = Duration::from_mins(1);
/// Memory that is allowed beyond four times the input.
const ALLOWANCE_KB: u64 = 100_000;
/// A process does so many inputs, and the next one the next.
const INPUTS_OF_A_PROCESS: u64 = 20_000;
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

/// `[--inputs N] [--minutes M] [--seed S] [--folder DIR] [WORKER]`: as many inputs, or as much time, whichever ends first. `WORKER` is a build of
/// the example `many_command_lines`; a folder in memory saves the time of syncing files.
pub(crate) fn fuzz(words: &[&str]) -> Outcome {
    let (mut inputs, mut minutes, mut seed, mut program) = (u64::MAX, 2.0, 1_u64, None);
    let mut parent = target().join("fuzz");
    let mut words = words.iter();
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} takes a value"));
        let number = |value: &&str| value.parse::<f64>().map_err(|_| format!("{word} takes a number"));
        match *word {
            "--inputs" => (inputs, minutes) = (number(value()?)? as u64, f64::INFINITY),
            "--minutes" => minutes = number(value()?)?,
            "--seed" => seed = number(value()?)? as u64,
            "--folder" => parent = PathBuf::from(value()?),
            path => program = Some(std::path::absolute(path).map_err(|error| format!("{path}: {error}"))?),
        }
    }
    let program = if let Some(program) = program {
        program
    } else {
        run(&mut cargo(&["build", "--release", "--package", "runout", "--example", "many_command_lines"])?)?;
        target().join("release/examples/many_command_lines")
    };
    // Each seed has a folder of its own: several may run at a time.
    let folder = parent.join(format!("seed-{seed}"));
    let until = (minutes.is_finite()).then(|| Instant::now() + Duration::from_secs_f64(60.0 * minutes));
    let count = drive(&program, &folder, inputs, until, seed)?;
    let Count { inputs, done, panics, aborts, hangs, large, largest_kb } = count;
    say(&format!(
        "{inputs} inputs from seed {seed}, {done} of them taken as they are: {panics} panics, {aborts} aborts, {hangs} hangs above {} s, {large} \
         above 4 times their size and 100 MB (most: {} MB)",
        LONGEST.as_secs(),
        largest_kb / 1000
    ));
    if panics + aborts + hangs + large > 0 {
        return Err(format!("the inputs are in {}", folder.join(FAILURES).display()));
    }
    Ok(())
}

const FAILURES: &str = "failures";

fn drive(program: &Path, folder: &Path, inputs: u64, until: Option<Instant>, seed: u64) -> Outcome<Count> {
    let (place, failures) = (folder.join("work"), folder.join(FAILURES));
    let words = |error: std::io::Error| format!("{}: {error}", place.display());
    let _ = fs::remove_dir_all(folder);
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
    let mut worker = Worker::start(program, &place).map_err(words)?;
    let made = worker.give(&["simulate", "scenario.toml", "--out", "seed.h5"], PATIENCE).map_err(words)?;
    if !matches!(made, Answer::Status { status: 0, .. }) {
        return Err("the recording that is to be damaged cannot be made".into());
    }
    let seeds = [
        text.clone().into_bytes(),
        fs::read(example.join("shaft.csv")).map_err(words)?,
        fs::read(place.join("seed.h5")).map_err(words)?,
    ];
    let write = |name: &str, bytes: &[u8]| fs::write(place.join(name), bytes).map_err(words);
    write("hdf5.toml", hdf5.as_bytes())?;
    for (name, bytes) in ["pipeline.toml", "shaft.csv", "shaft.h5"].iter().zip(&seeds) {
        write(name, bytes)?;
    }
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
        let mut arguments: Vec<&str> = command.to_vec();
        let assignment;
        let input = if kind == 3 {
            let text = random.text(&DICTIONARY, LONGEST_TEXT);
            let text = format!("{}={text}", KEYS[random.below(KEYS.len() as u64) as usize]);
            assignment = String::from_utf8_lossy(&random.mutated(text.as_bytes(), &DICTIONARY)).replace('\0', "");
            arguments.push(&assignment);
            assignment.clone().into_bytes()
        } else {
            let input = random.mutated(&seeds[kind], &DICTIONARY);
            write(file, &input)?;
            input
        };
        count.inputs += 1;
        let mut slow = 0;
        let answer = loop {
            let begun = Instant::now();
            let answer = worker.give(&arguments, PATIENCE).map_err(words)?;
            slow += u32::from(begun.elapsed() > LONGEST);
            match answer {
                Answer::Status { .. } if slow > 1 => break Answer::Late,
                Answer::Status { .. } if begun.elapsed() > LONGEST => {}
                _ => break answer,
            }
        };
        let said = worker.said().map_err(words)?;
        if kind < 3 {
            write(file, if file == "pipeline.toml" { &seeds[0] } else { &seeds[kind] })?;
        }
        if !matches!(answer, Answer::Status { .. }) || count.inputs.is_multiple_of(INPUTS_OF_A_PROCESS) {
            worker = Worker::start(program, &place).map_err(words)?;
        }
        let most_kb = ALLOWANCE_KB + 4 * input.len() as u64 / 1000;
        let (counted, name) = match answer {
            Answer::Late => (&mut count.hangs, "hang"),
            Answer::Ended => (&mut count.aborts, "abort"),
            Answer::Status { status, memory_kb } => {
                count.largest_kb = count.largest_kb.max(memory_kb);
                match status {
                    101 => (&mut count.panics, "panic"),
                    _ if memory_kb > most_kb => (&mut count.large, "memory"),
                    0 => (&mut count.done, ""),
                    _ => continue,
                }
            }
        };
        *counted += 1;
        if !name.is_empty() {
            let kept = failures.join(format!("{name}-{}", count.inputs));
            fs::write(&kept, &input).map_err(words)?;
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
