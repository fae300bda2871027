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

/// A tip that bends in the middle of the campaign contradicts the touches as a whole: the values of the ring's form are marked as those of the
/// probe are.
#[test]
fn what_contradicts_the_touches_marks_the_form_too() {
    let folder = tempfile::tempdir().unwrap();
    let touches = std::fs::read_to_string(example("touches.csv")).unwrap();
    let rows = touches.lines().count();
    let bent = |(row, line): (usize, &str)| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if row > rows / 2 {
            let [direction, radius] = [2, 3].map(|cell| cells[cell].parse::<f64>().unwrap());
            cells[3] = (radius + 3e-3 * (direction - 40.0).to_radians().cos()).to_string();
        }
        cells.join(",") + "\n"
    };
    let text: String = touches.lines().enumerate().map(bent).collect();
    std::fs::write(folder.path().join("touches.csv"), text).unwrap();
    let pipeline = std::fs::read_to_string(example("pipeline.toml")).unwrap();
    let pipeline = pipeline.split("[diagnose]").next().unwrap();
    let sources = Sources::from_text("pipeline.toml", pipeline, folder.path().into(), &[], "rig").unwrap();
    let pipeline = Pipeline::from_sources(&sources, &registry()).unwrap();
    let summary = runout_core::pipeline::run::run(&pipeline, None, &Silent).unwrap();
    let of_form: Vec<_> =
        summary.stations.iter().flat_map(|station| &station.sections).flat_map(|section| &section.values).collect();
    assert!(!of_form.is_empty());
    for value in summary.values.iter().chain(of_form) {
        assert!(value.refuted_by.is_some(), "{} {:?}", value.symbol, value.of);
    }
}
