//! The example: its touches are those of its scenario, and its pipeline runs.

#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::format_collect, reason = "tests")]

use std::path::PathBuf;

use runout_core::{
    closed_loop::diagnosis::Verdict,
    pipeline::{Pipeline, Registry, diagnose::diagnose, document::Sources, run::Silent},
    stage::Simulation,
};

fn example(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/15-touch-probe")).join(name)
}

fn registry() -> Registry {
    let mut registry = Registry::default();
    runout_points::register(&mut registry);
    runout_touch_probe::register(&mut registry);
    registry
}

/// `RUNOUT_WRITE=1` writes the file instead of comparing it.
#[test]
fn the_touches_are_those_of_the_scenario() {
    use runout_core::pipeline::{Context, StageConfig};
    use runout_touch_probe::simulate::TouchProbeScenario;
    let text = std::fs::read_to_string(example("scenario.toml")).unwrap();
    let text: String =
        text.lines().filter(|line| !line.starts_with("plugin")).map(|line| format!("{line}\n")).collect();
    let scenario: TouchProbeScenario = toml::from_str(&text).unwrap();
    let simulator = scenario.check(&Context { folder: std::path::Path::new("."), rig: None }).unwrap();
    let Simulation::Points { table, rows } = simulator.simulate().unwrap() else { panic!("no points") };
    let folder = tempfile::tempdir().unwrap();
    let write = std::env::var_os("RUNOUT_WRITE").is_some();
    let path = if write { example("touches.csv") } else { folder.path().join("touches.csv") };
    runout_points::write(&path, &table, &rows, &[]).unwrap();
    assert_eq!(std::fs::read_to_string(path).unwrap(), std::fs::read_to_string(example("touches.csv")).unwrap());
}

#[test]
fn the_pipeline_finds_noise_only() {
    let text = std::fs::read_to_string(example("pipeline.toml")).unwrap();
    let text = text.split("[diagnose]").next().unwrap();
    let sources = Sources::from_text("pipeline.toml", text, example(""), &[], "rig").unwrap();
    let pipeline = Pipeline::from_sources(&sources, &registry()).unwrap();
    let summary = runout_core::pipeline::run::run(&pipeline, None, &Silent).unwrap();
    for value in &summary.values {
        println!("{} {:?} {:.3?} ± {:.3?} {}", value.symbol, value.of, value.value, value.std(), value.unit);
    }
    for station in &summary.stations {
        println!("{station:?}");
    }
    for warning in &summary.warnings {
        println!("- {warning}");
    }
    let found = diagnose(&pipeline, None, &Silent).unwrap();
    println!("{:?} {:?}", found.verdict, found.before);
    assert_eq!(found.verdict, Verdict::AtNoiseFloor);
}
