//! The example: its readings are those of its scenario, and its pipeline runs.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::path::{Path, PathBuf};

use runout_core::{
    closed_loop::diagnosis::Verdict,
    pipeline::{Context, Pipeline, Registry, StageConfig, diagnose::diagnose, document::Sources, run::Silent},
    stage::Simulation,
};
use runout_spatial_error::simulate::Scenario;

fn example(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/17-spatial-error")).join(name)
}

fn registry() -> Registry {
    let mut registry = Registry::default();
    runout_points::register(&mut registry);
    runout_spatial_error::register(&mut registry);
    registry
}

/// `RUNOUT_WRITE=1` writes the file instead of comparing it.
#[test]
fn the_readings_are_those_of_the_scenario() {
    let text = std::fs::read_to_string(example("scenario.toml")).unwrap();
    let scenario: Scenario = toml::from_str(&text.replacen("plugin = \"spatial-error\"\n", "", 1)).unwrap();
    let simulator = scenario.check(&Context { folder: Path::new("."), rig: None }).unwrap();
    let Simulation::Points { table, rows } = simulator.simulate().unwrap() else { panic!("no points") };
    let folder = tempfile::tempdir().unwrap();
    let write = std::env::var_os("RUNOUT_WRITE").is_some();
    let path = if write { example("readings.csv") } else { folder.path().join("readings.csv") };
    runout_points::write(&path, &table, &rows, &[]).unwrap();
    assert_eq!(std::fs::read_to_string(path).unwrap(), std::fs::read_to_string(example("readings.csv")).unwrap());
}

#[test]
fn the_pipeline_finds_the_hidden_errors() {
    let text = std::fs::read_to_string(example("pipeline.toml")).unwrap();
    // The folder of the example stays as it is.
    let text = text.split("[diagnose]").next().unwrap();
    let sources = Sources::from_text("pipeline.toml", text, example(""), &[], "rig").unwrap();
    let pipeline = Pipeline::from_sources(&sources, &registry()).unwrap();
    let summary = runout_core::pipeline::run::run(&pipeline, None, &Silent).unwrap();
    for value in &summary.values {
        println!("{} {:?} {:.3?} ± {:.3?} {}", value.symbol, value.of, value.value, value.std(), value.unit);
    }
    for warning in &summary.warnings {
        println!("- {warning}");
    }
    let found = diagnose(&pipeline, None, &Silent).unwrap();
    println!("{:?}\n{:?}\n{:?}", found.verdict, found.before, found.after);
    for added in &found.added {
        println!("{added:?}");
    }
    assert_eq!(found.verdict, Verdict::Explained);
    let names: Vec<String> =
        found.added.iter().map(|added| format!("{} {}", added.effect, added.targets.join(" "))).collect();
    assert!(
        names.contains(&"scale X".into()) && names.contains(&"angular EBY".into()) && names.len() == 2,
        "{names:?}"
    );
}
