//! The command line: types only.

use std::{num::NonZeroUsize, path::PathBuf};

use clap::{Args, Parser, Subcommand};

/// Separates the form of a turning part from the error motion of its spindle.
///
/// Exit status: 0 done; 1 the data or the work failed; 2 the command line or the configuration is wrong.
#[derive(Debug, Parser)]
#[command(name = "runout", version, arg_required_else_help = true)]
pub struct CommandLine {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// Print one JSON document on stdout, and everything else on stderr.
    #[arg(long, global = true)]
    pub json: bool,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Load, preprocess, separate, evaluate and export; a summary at the end.
    Run(RunArgs),
    /// Say everything that can be said without the data: configuration, what the rig can and cannot separate.
    Check(PipelineArgs),
    /// Make a campaign with declared truth and effects, as a measurement file.
    Simulate(SimulateArgs),
    /// List the plugins, or the keys of one.
    Plugins(PluginsArgs),
    /// Print JSON Schemas of configurations and results.
    Schema(SchemaArgs),
    /// Say what a file holds (HDF5, Parquet).
    Inspect(InspectArgs),
}

/// A pipeline and what to change in it.
#[derive(Debug, Args)]
pub struct PipelineArgs {
    /// The pipeline; paths in it are relative to it.
    #[arg(value_name = "PIPELINE.toml")]
    pub pipeline: PathBuf,
    #[command(flatten)]
    pub overrides: Overrides,
}

/// Keys to override.
#[derive(Debug, Args)]
pub struct Overrides {
    /// Override one configuration key: `load.path=other.h5`, `preprocess.0.cutoff_hz=300`. Repeatable.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

/// `runout run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    #[command(flatten)]
    pub pipeline: PipelineArgs,
    /// Stations worked on at a time; as many as there are processors without it.
    #[arg(long, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
}

/// `runout simulate`.
#[derive(Debug, Args)]
pub struct SimulateArgs {
    /// The scenario; paths in it are relative to it.
    #[arg(value_name = "SCENARIO.toml")]
    pub scenario: PathBuf,
    /// Write the measurement here instead of the scenario's `output`.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub overrides: Overrides,
}

/// `runout plugins`.
#[derive(Debug, Args)]
pub struct PluginsArgs {
    /// A plugin's name; `stage/name` where two stages have one of that name (`export/hdf5`).
    pub name: Option<String>,
}

/// `runout schema`.
#[derive(Debug, Args)]
pub struct SchemaArgs {
    /// `pipeline`, `scenario`, `rig`, `summary`, `check`, or a plugin's name; all the files' schemas without it.
    pub name: Option<String>,
    /// Write each file's schema to `NAME.schema.json` in this folder.
    #[arg(long, value_name = "DIR", conflicts_with = "name")]
    pub out: Option<PathBuf>,
}

/// `runout inspect`.
#[derive(Debug, Args)]
pub struct InspectArgs {
    /// A measurement, a result or a table.
    pub file: PathBuf,
}
