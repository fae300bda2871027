//! Time of one station of example 1, by the built-in least squares and by the same method as a program in Python:
//! `cargo run --release -p runout-external --example time_per_station [PYTHON]`.
//!
//! The campaign is that of `examples/01-four-sensor/scenario.toml`, in memory. Reading and averaging are common to both.

#![allow(clippy::print_stdout, reason = "a program that prints figures")]

use std::{error::Error, fs, path::Path, time::Instant};

use runout_core::{
    measurement::Recording,
    pipeline::{Pipeline, Registry, Route},
    stage::{Station, StationSeparator},
};
use runout_spindle::simulate::{SpindleConfig, simulator};

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let python = std::env::args().nth(1).unwrap_or_else(|| "python3".into());
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    let scenario: toml::Table = toml::from_str(&fs::read_to_string(examples.join("01-four-sensor/scenario.toml"))?)?;
    let keys = scenario.into_iter().filter(|(key, _)| !["title", "plugin", "output"].contains(&key.as_str()));
    let config: SpindleConfig = toml::Value::Table(keys.collect()).try_into()?;
    let simulator = simulator(&config)?;
    let recording = simulator.spindle_recording();
    let built_in = "plugin = \"harmonic-least-squares\"\nsecond_order = false\nweighting = \"none\"\n".to_owned();
    let script = examples.join("26-own-program/least_squares.py").display().to_string();
    let external = format!("plugin = \"external\"\ncommand = [{python:?}, {script:?}]\n");
    let pipelines = [pipeline(&examples, &built_in)?, pipeline(&examples, &external)?];
    let mut seconds = [Vec::new(), Vec::new(), Vec::new()];
    let mut worst = 0.0_f64;
    for index in 0..recording.stations().len() {
        let began = Instant::now();
        let station = averaged(&pipelines[0], &recording, index)?;
        seconds[0].push(began.elapsed().as_secs_f64());
        let mut found = Vec::new();
        for (pipeline, seconds) in pipelines.iter().zip(&mut seconds[1..]) {
            let began = Instant::now();
            found.push(separator(pipeline)?.separate(&station)?);
            seconds.push(began.elapsed().as_secs_f64());
        }
        let width = found[0].unknowns.len();
        for place in 2 * width..found[0].estimate.len() {
            let difference = (found[0].estimate[place] - found[1].estimate[place]).norm();
            // What is lost in both is no number in both.
            worst =
                if found[0].observable[place] || found[1].observable[place] { worst.max(difference) } else { worst };
        }
    }
    let started = seconds[2][0];
    let [averaging, built_in, external] = seconds.map(|all| median(&all[1..]));
    println!("largest difference from order 2 on: {worst:.1e} µm or µrad, {} stations", recording.stations().len());
    println!("reading and averaging            {:8.2} ms a station (median)", 1e3 * averaging);
    println!("built-in least squares           {:8.2} ms", 1e3 * built_in);
    println!(
        "the same as a program in Python  {:8.2} ms; the first with the start of Python {:.0} ms",
        1e3 * external,
        1e3 * started
    );
    let whole = [built_in, external].map(|separation| averaging + separation);
    println!("a whole station takes {:+.1} % with the program", 100.0 * (whole[1] / whole[0] - 1.0));
    Ok(())
}

/// Example 1 with another separator and without its exports; the loader is not asked.
fn pipeline(examples: &Path, separate: &str) -> Outcome<Pipeline> {
    let mut registry = Registry::default();
    runout_hdf5::register(&mut registry);
    runout_preprocess::register(&mut registry);
    runout_spindle::register(&mut registry);
    runout_external::register(&mut registry);
    let mut text: toml::Table = toml::from_str(&fs::read_to_string(examples.join("01-four-sensor/pipeline.toml"))?)?;
    text.remove("export");
    text.insert("separate".into(), toml::Value::Table(toml::from_str(separate)?));
    Ok(Pipeline::from_toml(&toml::to_string(&text)?, examples.join("01-four-sensor"), &registry)?)
}

fn separator(pipeline: &Pipeline) -> Outcome<&dyn StationSeparator> {
    match &pipeline.route {
        Route::Turns { separator, .. } => Ok(&**separator),
        Route::Points { .. } => Err("the pipeline is not one of recorded turns".into()),
    }
}

/// One station through the preprocessors.
fn averaged(pipeline: &Pipeline, recording: &dyn Recording, index: usize) -> Outcome<Station> {
    let Route::Turns { conditioners, averager, .. } = &pipeline.route else { return Err("not recorded turns".into()) };
    let mut profiles = Vec::new();
    for setup in 0..pipeline.rig.as_ref().map_or(0, |rig| rig.setups.len()) {
        let stream = recording.open(index, setup)?;
        let stream = conditioners.iter().try_fold(stream, |stream, conditioner| conditioner.attach(stream))?;
        profiles.push(averager.average(stream)?);
    }
    let key = &recording.stations()[index];
    Ok(Station { name: key.name.clone(), z_mm: key.z_mm, profiles })
}

fn median(all: &[f64]) -> f64 {
    let mut sorted = all.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}
