//! The peers' work, by runout and by the peers themselves: `benchmarks`.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use crate::{
    process::{Outcome, answer, root, run, say, target, tools},
    setup::{self, cargo},
};

/// Modules that the peers of a campaign, of its stages and of reference circles import, and the packages that bring them.
const CAMPAIGN: [[&str; 2]; 3] = [["numpy"; 2], ["scipy"; 2], ["h5py"; 2]];
const STAGES: [[&str; 2]; 5] = [["numpy"; 2], ["scipy"; 2], ["h5py"; 2], ["polars"; 2], ["pyarrow"; 2]];
const ROUNDNESS: [[&str; 2]; 6] = [
    ["numpy"; 2],
    ["scipy"; 2],
    ["circle_fit", "circle-fit"],
    ["miniball"; 2],
    ["cv2", "opencv-python-headless"],
    ["shapely"; 2],
];
const KRIGING: [[&str; 2]; 4] = [["numpy"; 2], ["scipy"; 2], ["sklearn", "scikit-learn"], ["pykrige"; 2]];
/// The formats' reference libraries.
const FORMATS: [&str; 5] =
    ["npTDMS==1.13.0", "pyuff==2.5.8", "scipy==1.17.1", "soundfile==0.14.0", "surfalize==0.19.2"];
/// Samples a turn and turns of a section, as in the record that the peers are measured with.
const SAMPLES_PER_REV: usize = 2560;
const TURNS: usize = 120;

/// What is asked for.
struct Options {
    scratch: PathBuf,
    stations: usize,
    rounds: usize,
    i16: bool,
    /// Other versions of runout, timed in the same turns.
    beside: Vec<PathBuf>,
}

impl Options {
    fn read(words: &[&str]) -> Outcome<Self> {
        let mut options =
            Self { scratch: target().join("bench"), stations: 40, rounds: 5, i16: false, beside: Vec::new() };
        let mut words = words.iter();
        while let Some(word) = words.next() {
            let mut number = || {
                let value = words.next().and_then(|value| value.parse().ok()).filter(|value| *value > 0);
                value.ok_or_else(|| format!("{word} needs a number of at least 1"))
            };
            match *word {
                "--stations" => options.stations = number()?,
                "--rounds" => options.rounds = number()?,
                "--i16" => options.i16 = true,
                "--beside" => {
                    let file = words.next().ok_or("--beside needs a program")?;
                    let path = std::path::absolute(file).map_err(|error| format!("{file}: {error}"))?;
                    options.beside.push(path);
                }
                option if option.starts_with('-') => {
                    return Err(format!(
                        "unknown option `{option}`; known: --stations K, --rounds N, --i16, --beside PROGRAM"
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

/// Writes the record once, times both programs on it in turns and prints a table.
pub(crate) fn campaign(words: &[&str]) -> Outcome {
    time_campaign(&Options::read(words)?).map(|_| ())
}

/// Times both programs with both kinds of samples; the table goes where `benchmarks/README.md` shows it.
pub(crate) fn all_peers(words: &[&str]) -> Outcome {
    let options = Options { i16: true, ..Options::read(words)? };
    if !time_campaign(&options)? {
        return Ok(());
    }
    let tables: Vec<Table> = KINDS.iter().map(|kind| Table::read(&options.scratch, kind)).collect::<Outcome<_>>()?;
    let Some(first) = tables.first() else { return Ok(()) };
    let columns = first.head.matches('|').count().saturating_sub(1);
    let rule = format!("|{}", " --- |".repeat(columns));
    let mut lines: Vec<&str> = Vec::new();
    for table in &tables {
        if !lines.contains(&table.said.as_str()) {
            lines.extend([table.said.as_str(), ""]);
        }
    }
    lines.extend([first.head.as_str(), &rule]);
    lines.extend(tables.iter().flat_map(|table| &table.rows).map(String::as_str));
    show("bench-peers", &lines.join("\n"))
}

/// Puts a table where `benchmarks/README.md` shows it, between two comments of this name.
fn show(name: &str, table: &str) -> Outcome {
    let path = root().join("benchmarks/README.md");
    let failure = |error: std::io::Error| format!("{}: {error}", path.display());
    let text = std::fs::read_to_string(&path).map_err(failure)?;
    let (begin, end) = (format!("<!-- {name} -->"), format!("<!-- /{name} -->"));
    let (Some((before, _)), Some((_, after))) = (text.split_once(&begin), text.split_once(&end)) else {
        return Err(format!("{} has no place {begin} … {end}", path.display()));
    };
    std::fs::write(&path, format!("{before}{begin}\n{}\n{end}{after}", table.trim_end())).map_err(failure)?;
    say(&format!("wrote the table `{name}` of {}", path.display()));
    Ok(())
}

/// Times each stage and the peers' in turns; the table goes where `benchmarks/README.md` shows it.
pub(crate) fn stages(words: &[&str]) -> Outcome {
    let options = Options::read(words)?;
    let Some(peers) = peers(&["record.py", "pipeline.py"]) else { return Ok(()) };
    let python = python(&STAGES)?;
    write_record(&options, &peers, &python)?;
    run(&mut cargo(&["build", "--release", "--package", "runout", "--example", "stages"])?)?;
    let mut compare = Command::new(python);
    compare.arg("-B").arg("benchmarks/stages/compare.py").arg(target().join("release/examples/stages"));
    run(compare.arg(&peers).arg(&options.scratch).arg(options.rounds.to_string()).arg(options.stations.to_string()))?;
    let path = options.scratch.join("table-stages.md");
    show("bench-stages", &std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?)
}

/// Kinds of samples.
const KINDS: [&str; 2] = ["f64", "i16"];

/// What `compare.py` found.
struct Table {
    said: String,
    head: String,
    rows: Vec<String>,
}

impl Table {
    fn read(scratch: &Path, kind: &str) -> Outcome<Self> {
        let path = scratch.join(format!("table-{kind}.md"));
        let text = std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        let mut lines = text.lines().map(str::to_owned);
        match (lines.next(), lines.next()) {
            (Some(said), Some(head)) => Ok(Self { said, head, rows: lines.collect() }),
            _ => Err(format!("{} holds no table", path.display())),
        }
    }
}

/// False where there are no peers.
fn time_campaign(options: &Options) -> Outcome<bool> {
    let Some(peers) = peers(&["record.py", "pipeline.py"]) else { return Ok(false) };
    let python = python(&CAMPAIGN)?;
    let script = |name: &str| {
        let mut command = Command::new(&python);
        command.arg("-B").arg(Path::new("benchmarks/campaign").join(name));
        command
    };
    write_record(options, &peers, &python)?;
    run(&mut cargo(&["build", "--release", "--package", "runout"])?)?;
    for name in KINDS.into_iter().take(if options.i16 { 2 } else { 1 }) {
        let mut compare = script("compare.py");
        compare.arg(target().join("release/runout")).arg(&peers).arg(&options.scratch);
        compare.arg(options.rounds.to_string()).arg(name).arg(options.stations.to_string());
        run(compare.args(&options.beside))?;
    }
    Ok(true)
}

/// The record that both programs read, where it is not yet.
fn write_record(options: &Options, peers: &Path, python: &Path) -> Outcome {
    let mut write = Command::new(python);
    write.args(["-B", "benchmarks/campaign/write_record.py"]).arg(peers).arg(&options.scratch);
    write.args([SAMPLES_PER_REV, TURNS, options.stations].map(|number| number.to_string()));
    run(write.args(options.i16.then_some("--i16")))
}

/// Times the reference circles of runout and of the peers on the same points.
pub(crate) fn roundness() -> Outcome {
    run(&mut cargo(&["build", "--release", "--package", "runout-core", "--example", "reference_circles"])?)?;
    let Some(peers) = peers(&["roundness_bench.py", "roundness.py"]) else { return Ok(()) };
    let mut compare = Command::new(python(&ROUNDNESS)?);
    compare.arg("-B").arg("benchmarks/roundness/compare.py");
    run(compare.arg(target().join("release/examples/reference_circles")).arg(&peers).arg(target().join("bench")))
}

/// Times predictions of 100 000 places from 1000 of runout, scikit-learn and pykrige, one thread; `words` may hold other numbers.
pub(crate) fn kriging(words: &[&str]) -> Outcome {
    run(&mut cargo(&["build", "--release", "--package", "runout-spatial-error", "--example", "spatial_error_bench"])?)?;
    let Some(peers) = peers(&["kriging_bench.py", "common.py"]) else { return Ok(()) };
    let mut compare = Command::new(python(&KRIGING)?);
    compare.arg("-B").arg("benchmarks/kriging/compare.py");
    compare.arg(target().join("release/examples/spatial_error_bench")).arg(&peers).arg(target().join("bench"));
    run(compare.args(words))
}

/// Times reading files beside the formats' reference libraries, one thread; the number of rounds may be given.
pub(crate) fn formats(words: &[&str]) -> Outcome {
    let folder = tools().join("formats-venv");
    setup::python_environment(&folder)?;
    if answer(folder.join("bin/python"), &["-c", "import nptdms, pyuff, scipy, soundfile, surfalize"]).is_none() {
        run(Command::new(folder.join("bin/pip")).arg("install").arg("--quiet").args(FORMATS))?;
    }
    for (package, example) in [("runout-channels", "channel_seconds"), ("runout-maps", "map_seconds")] {
        run(&mut cargo(&["build", "--release", "--package", package, "--example", example])?)?;
    }
    let mut compare = Command::new(folder.join("bin/python"));
    compare.env("OMP_NUM_THREADS", "1").env("OPENBLAS_NUM_THREADS", "1").arg("-B").arg("benchmarks/formats/compare.py");
    compare.args(["channel_seconds", "map_seconds"].map(|example| target().join("release/examples").join(example)));
    run(compare.arg(target().join("bench/formats")).args(words))
}

/// The folder of the peers, if it holds these files; says why not.
fn peers(files: &[&str]) -> Option<PathBuf> {
    let peers = std::env::var_os("RUNOUT_PEERS").map_or_else(|| root().join("../shared/peers"), PathBuf::from);
    if files.iter().all(|file| peers.join(file).is_file()) {
        return Some(peers);
    }
    let (folder, files) = (peers.display(), files.join(", "));
    say(&format!("skipped: there are no peers in {folder} ({files}); RUNOUT_PEERS can name their folder"));
    None
}

/// A Python with what the peers need, installed below target/ where it is not yet.
fn python(needed: &[[&str; 2]]) -> Outcome<PathBuf> {
    let folder = tools().join("peers-venv");
    setup::python_environment(&folder)?;
    let interpreter = folder.join("bin/python");
    let [modules, packages] = [0, 1].map(|part| needed.iter().map(|names| names[part]).collect::<Vec<&str>>());
    if answer(&interpreter, &["-c", &format!("import {}", modules.join(", "))]).is_none() {
        run(Command::new(folder.join("bin/pip")).args(["install", "--quiet"]).args(packages))?;
    }
    Ok(interpreter)
}
