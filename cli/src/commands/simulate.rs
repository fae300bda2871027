//! `runout simulate`: a campaign with declared truth and effects.

use std::path::PathBuf;

use runout_core::{
    Error,
    atomic_file::resolved,
    fault::Fault,
    measurement::Recording,
    pipeline::{
        Context, INCLUDE_KEY, Registry,
        document::{Document, Sources, Table},
    },
    rig::Rig,
    stage::{Simulation, Simulator},
};
use runout_hdf5::{SampleFormat, Scale, WriteOptions, write_height_map, write_measurement};
use serde::Serialize;

use super::print;
use crate::{
    args::SimulateArgs,
    failure::Failure,
    progress::Progress,
    render::{count, one_line},
};

/// What was made. What is hidden in it stays hidden.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    title: String,
    output: PathBuf,
    bytes: u64,
    effects: usize,
    #[serde(flatten)]
    made: Made,
}

/// The size of what was made.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Made {
    Turns { setups: usize, stations: usize, sensors: usize, samples_per_capture: u64, turns_per_capture: usize },
    Points { points: usize, columns: Vec<String> },
    Heights { points: usize, rows: usize, columns: usize, holes: usize },
}

/// Computes a campaign and writes it.
///
/// # Errors
/// When the scenario is wrong, cannot be computed, or the file cannot be written.
pub(crate) fn execute(args: &SimulateArgs, json: bool, registry: &Registry) -> Result<(), Failure> {
    print(&report(args, registry, &Progress::new("captures"))?, json, text)
}

/// Computes a campaign, writes it, and gives its size.
///
/// # Errors
/// When the scenario is wrong, cannot be computed, or the file cannot be written.
pub(crate) fn report(args: &SimulateArgs, registry: &Registry, progress: &Progress) -> Result<Report, Failure> {
    let sources = Sources::read(&args.scenario, &args.overrides.set, INCLUDE_KEY)?;
    let document = Document::parse(&sources)?;
    let scenario = Scenario::build(document.root(), &sources, args.out.clone(), registry)
        .map_err(|fault| document.diagnose(fault))?;
    Ok(write(&scenario, progress)?)
}

/// A checked scenario.
struct Scenario {
    title: String,
    output: PathBuf,
    samples: SampleFormat,
    effects: usize,
    simulator: Box<dyn Simulator>,
}

impl Scenario {
    fn build(root: &Table, sources: &Sources, out: Option<PathBuf>, registry: &Registry) -> Result<Self, Fault> {
        let title = string(root, "title")?.unwrap_or_else(|| "Untitled".into());
        let context = Context { folder: sources.folder(), rig: None };
        let output = match (out, string(root, "output")?) {
            (Some(out), _) => out,
            (None, Some(output)) => context.path(output.as_ref()),
            (None, None) => {
                let fault = Fault::here("missing key `output`");
                return Err(fault.help("name the file to write, here or by --out"));
            }
        };
        if sources.files().any(|file| resolved(file) == resolved(&output)) {
            return Err(Fault::at("output", format!("{} is the scenario itself", output.display())));
        }
        let mut own = root.clone();
        own.get_mut().remove("title");
        own.get_mut().remove("output");
        let simulator = registry.simulators.build(&own, &context)?;
        let effects =
            root.get_ref().get("effect").and_then(|value| value.get_ref().as_array()).map_or(0, |all| all.len());
        Ok(Self { title, output, samples: samples(root), effects, simulator })
    }
}

fn string(root: &Table, key: &str) -> Result<Option<String>, Fault> {
    let Some(value) = root.get_ref().get(key) else { return Ok(None) };
    let text = value.get_ref().as_str().ok_or_else(|| Fault::at(key, format!("expected `{key}` in quotes")))?;
    Ok(Some(text.to_owned()))
}

/// How the file is to hold the samples: the simulator has checked the word.
fn samples(root: &Table) -> SampleFormat {
    let recording = root.get_ref().get("recording");
    match recording.and_then(|table| table.get_ref().get("format")).and_then(|value| value.get_ref().as_str()) {
        Some("f32") => SampleFormat::F32,
        Some("i16") => SampleFormat::I16(Scale::ConverterLimits),
        Some("i32") => SampleFormat::I32(Scale::ConverterLimits),
        _ => SampleFormat::F64,
    }
}

fn write(scenario: &Scenario, progress: &Progress) -> Result<Report, Error> {
    let made = match scenario.simulator.simulate()? {
        Simulation::Turns { rig, recording } => write_turns(scenario, rig, &*recording, progress)?,
        Simulation::Points { table, rows } => {
            let about = [("title", scenario.title.as_str()), ("scenario", scenario.simulator.scenario())];
            runout_points::write(&scenario.output, &table, &rows, &about)?;
            let columns = table.columns.iter().map(|column| column.name.clone()).collect();
            Made::Points { points: rows.num_rows(), columns }
        }
        Simulation::Heights(grid) => {
            write_height_map(&grid, &scenario.output, &scenario.title, Some(scenario.simulator.scenario()))?;
            let (points, rows, columns) = (grid.height_nm.len(), grid.rows(), grid.columns);
            Made::Heights { points, rows, columns, holes: grid.holes() }
        }
    };
    let output = scenario.output.clone();
    let bytes =
        std::fs::metadata(&output).map_err(|error| Error::caused("read", output.display().to_string(), error))?;
    Ok(Report { title: scenario.title.clone(), output, bytes: bytes.len(), effects: scenario.effects, made })
}

fn write_turns(scenario: &Scenario, rig: &Rig, recording: &dyn Recording, progress: &Progress) -> Result<Made, Error> {
    let stations = recording.stations().len();
    let first = recording.open(0, 0)?.capture().clone();
    let options = WriteOptions {
        samples: scenario.samples,
        title: &scenario.title,
        scenario: Some(scenario.simulator.scenario()),
        ..WriteOptions::default()
    };
    progress.expect(stations * rig.setups.len());
    write_measurement(recording, rig, &scenario.output, &options, &mut |name| progress.advance(name))?;
    Ok(Made::Turns {
        setups: rig.setups.len(),
        stations,
        sensors: rig.sensors.len(),
        samples_per_capture: first.samples,
        turns_per_capture: first.marks.len().saturating_sub(1),
    })
}

fn text(report: &Report) -> String {
    let size = match &report.made {
        Made::Turns { setups, stations, sensors, samples_per_capture, turns_per_capture } => format!(
            "{}, {}, {}, {} of {samples_per_capture} samples each",
            count(*setups, "setup"),
            count(*stations, "station"),
            count(*sensors, "sensor"),
            count(*turns_per_capture, "turn"),
        ),
        Made::Points { points, columns } => {
            format!("{} with the columns {}", count(*points, "point"), columns.join(", "))
        }
        Made::Heights { points, rows, columns, holes } => {
            let holes = if *holes > 0 { format!(", {holes} of them without a height") } else { String::new() };
            format!("{} on {rows} rows and {columns} columns{holes}", count(*points, "point"))
        }
    };
    let effects = match (report.effects, &report.made) {
        (0, _) => String::new(),
        (effects, Made::Turns { .. } | Made::Heights { .. }) => {
            format!("  {} in it, kept with the truth in the file\n", count(effects, "effect"))
        }
        (effects, Made::Points { .. }) => format!("  {} in it\n", count(effects, "effect")),
    };
    let written = format!("{} ({:.1} MB)", report.output.display(), report.bytes as f64 / 1e6);
    format!("{}\n  {size}\n{effects}  written: {written}\n", one_line(&report.title))
}
