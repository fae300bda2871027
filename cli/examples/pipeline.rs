//! A pipeline, built and run from Rust: `cargo run -p runout --example pipeline`.

#![allow(clippy::print_stdout, reason = "a program that prints its result")]

use std::{error::Error, path::Path};

use runout_core::{pipeline::Pipeline, summary::Summary};

/// Separates the recording of example 8, and writes tables to a folder.
///
/// # Errors
/// When the recording cannot be read, or the folder cannot be written to.
pub(crate) fn separate(recording: &Path, out: &Path) -> Result<Summary, Box<dyn Error>> {
    let (recording, out) = (recording.display(), out.display());
    let configuration = format!(
        r#"
        title = "Three probes around a shaft"
        load = {{ plugin = "csv", pattern = '{recording}', stations = [{{ name = "shaft" }}], sample_rate_hz = 1280 }}
        preprocess = [{{ plugin = "synchronous-average", samples_per_rev = 128 }}]
        separate = {{ plugin = "three-point" }}
        export = [{{ plugin = "parquet", path = '{out}' }}]

        [rig]
        part_radius_mm = 20
        sensors = [{{ id = "A", angle_deg = 0 }}, {{ id = "B", angle_deg = 99.84375 }}, {{ id = "C", angle_deg = 202.5 }}]
        setups = [{{ id = "only" }}]
        "#
    );
    let registry = runout_cli::builtin::registry();
    Ok(Pipeline::from_toml(&configuration, ".", &registry)?.run()?)
}

#[allow(dead_code, reason = "a test calls `separate`")]
fn main() -> Result<(), Box<dyn Error>> {
    let recording = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/08-text-recording/shaft.csv");
    let summary = separate(Path::new(recording), &std::env::temp_dir().join("runout-pipeline"))?;
    println!("lost orders of the form: {:?}", summary.lost_orders.form);
    for value in summary.placed_values() {
        println!("{} {:.4} {}", value.value.symbol, value.value.value, value.value.unit);
    }
    println!("written: {:?}", summary.outputs);
    Ok(())
}
