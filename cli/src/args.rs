//! The command line: types only.

use std::{num::NonZeroUsize, ops::RangeInclusive, path::PathBuf};

use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;

/// Separates the form of a turning part from the error motion of its spindle.
///
/// Exit status: 0 done; 1 the data or the work failed, or `--fail-on-limit` or `--fail-on-warning` found a reason; 2 the command line
/// or the configuration is wrong.
#[derive(Debug, Parser)]
#[command(name = "runout", version, arg_required_else_help = true)]
pub(crate) struct CommandLine {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// Print one JSON document on stdout, and everything else on stderr.
    #[arg(long, global = true)]
    pub json: bool,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Load, preprocess, separate, evaluate and export; a summary at the end.
    Run(RunArgs),
    /// Say everything that can be said without the data: configuration, what the rig can and cannot separate.
    Check(PipelineArgs),
    /// Find what the declared model lacks, name it or say that it cannot be named, add it: error before and after.
    Diagnose(DiagnoseArgs),
    /// Run several separators on the same data: values side by side, differences with their uncertainty, E_n.
    Compare(CompareArgs),
    /// Run one pipeline on many recordings: a data set of their results, and control charts of all values.
    Batch(BatchArgs),
    /// Make a campaign with declared truth and effects, as a measurement file.
    Simulate(SimulateArgs),
    /// Say what a rig can separate and how well, what to add to it, and better angles for its sensors.
    Plan(PlanArgs),
    /// Write an earlier result as one page to look at, for a browser and for print.
    Report(ReportArgs),
    /// List the plugins, or the keys of one.
    Plugins(PluginsArgs),
    /// Print JSON Schemas of configurations and results.
    Schema(SchemaArgs),
    /// Show the contents of a file (HDF5, Parquet, CSV, X3P, SDF, SUR).
    Inspect(InspectArgs),
    /// Write a pipeline to start from, for a method and, where it is given, a file.
    New(NewArgs),
    /// Write an example, a pipeline with its data, or list them.
    Example(ExampleArgs),
    /// Write a height map or a profile in another format (X3P, SDF, HDF5).
    Convert(ConvertArgs),
    /// Print the completion script of a shell.
    Completions(CompletionsArgs),
}

/// A pipeline and what to change in it.
#[derive(Debug, Args)]
pub(crate) struct PipelineArgs {
    /// The pipeline; paths in it are relative to it.
    #[arg(value_name = "PIPELINE.toml")]
    pub pipeline: PathBuf,
    #[command(flatten)]
    pub overrides: Overrides,
}

/// Keys to override.
#[derive(Debug, Args)]
pub(crate) struct Overrides {
    /// Override one configuration key: `load.path=other.h5`, `preprocess.0.cutoff_hz=300`. Repeatable.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

/// `runout run`.
#[derive(Debug, Args)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub pipeline: PipelineArgs,
    /// Stations worked on at a time; as many as there are processors without it.
    #[arg(long, value_name = "N", value_parser = threads)]
    pub threads: Option<NonZeroUsize>,
    #[command(flatten)]
    pub limits: LimitArgs,
    /// Print everything: turns and filters, all directions of motion, the surface, what the values are, notes, names of the files.
    #[arg(short, long)]
    pub verbose: bool,
    #[command(flatten)]
    pub warnings: WarningArgs,
}

/// Whether limits fail that are not proven to be kept.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct LimitArgs {
    /// End with exit status 1 unless every value under a [[limit]] is proven to keep it: its 95 % interval lies within (ISO
    /// 14253-1). A value without uncertainty, and a limit that names no value, prove nothing. Files and the summary are
    /// written all the same. Without any [[limit]] that is a mistake (exit status 2).
    #[arg(long)]
    pub fail_on_limit: bool,
}

/// Whether warnings fail.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct WarningArgs {
    /// End with exit status 1 where there is a warning of something in the data, of a single station too. Files and the report are
    /// written all the same; notes do not count.
    #[arg(long)]
    pub fail_on_warning: bool,
}

/// `runout batch`.
#[derive(Debug, Args)]
pub(crate) struct BatchArgs {
    #[command(flatten)]
    pub pipeline: PipelineArgs,
    /// The recordings: each takes the place of the file that [load] names. A folder is one recording whose files have the names
    /// that [load] gives them.
    #[arg(value_name = "RECORDINGS", required = true)]
    pub recordings: Vec<PathBuf>,
    /// Folder of the data set. Recordings whose results are there and up to date are skipped.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Recordings worked on at a time, each by one thread; as many as there are processors without it.
    #[arg(long, value_name = "N", value_parser = threads)]
    pub jobs: Option<NonZeroUsize>,
    #[command(flatten)]
    pub limits: LimitArgs,
    #[command(flatten)]
    pub warnings: WarningArgs,
    /// Folders of a recording's path that belong to its name, for files of the same name in different folders.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub name_folders: usize,
}

/// `runout diagnose`.
#[derive(Debug, Args)]
pub(crate) struct DiagnoseArgs {
    #[command(flatten)]
    pub pipeline: PipelineArgs,
    /// Stations read and averaged at a time; as many as there are processors without it.
    #[arg(long, value_name = "N", value_parser = threads)]
    pub threads: Option<NonZeroUsize>,
    /// Memory that the loop may take, in GB, in place of `memory_gb` in [diagnose]: it holds all stations at once.
    #[arg(long, value_name = "GB")]
    pub memory: Option<f64>,
    /// Write the corrected rig: the pipeline's [rig] with what was found, as a file that can replace it.
    #[arg(long, value_name = "RIG.toml")]
    pub write: Option<PathBuf>,
    /// Print everything: all values before and after, effects that the data cannot show, notes, names of the files.
    #[arg(short, long)]
    pub verbose: bool,
    #[command(flatten)]
    pub warnings: WarningArgs,
}

/// `runout compare`.
#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    #[command(flatten)]
    pub pipeline: PipelineArgs,
    /// Separators to compare with the pipeline's own, configured by their [[compare]] tables where there are any.
    /// Without it, all [[compare]] tables, or else every other separator.
    #[arg(long, value_name = "A,B,…", value_delimiter = ',')]
    pub with: Vec<String>,
    /// Write what came out order by order: a table (FILE.parquet) or the document (FILE.json).
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Write a page to look at: the tables of the comparison, and E_n by order.
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// Stations worked on at a time; as many as there are processors without it.
    #[arg(long, value_name = "N", value_parser = threads)]
    pub threads: Option<NonZeroUsize>,
    #[command(flatten)]
    pub warnings: WarningArgs,
}

/// `runout simulate`.
#[derive(Debug, Args)]
pub(crate) struct SimulateArgs {
    /// The scenario; paths in it are relative to it.
    #[arg(value_name = "SCENARIO.toml")]
    pub scenario: PathBuf,
    /// Write the measurement here instead of the scenario's `output`.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub overrides: Overrides,
}

/// `runout plan`.
#[derive(Debug, Args)]
pub(crate) struct PlanArgs {
    /// The rig: what stands under [rig] in a pipeline, in a file of its own. Or a pipeline of measured points, of which the layout
    /// is planned; the options but --set, --report and --json are of rigs.
    #[arg(value_name = "RIG.toml|PIPELINE.toml")]
    pub rig: PathBuf,
    /// Orders (undulations per revolution) to plan for, both ends included.
    #[arg(long, value_name = "FIRST..LAST", default_value = "2..150", value_parser = orders)]
    pub orders: RangeInclusive<usize>,
    /// Smallest angle between two sensors of one section.
    #[arg(long, value_name = "ANGLE", default_value = "15deg", value_parser = degrees, allow_negative_numbers = true)]
    pub clearance: f64,
    /// Look for better ones.
    #[arg(long, visible_alias = "optimize", value_name = "WHAT")]
    pub optimise: Option<Optimise>,
    /// How far each sensor may stand from where it should: angles are ranked by the worst placement.
    #[arg(long, value_name = "ANGLE", default_value = "0deg", value_parser = degrees, allow_negative_numbers = true, requires = "optimise")]
    pub angle_tolerance: f64,
    /// The noise gain of form that is to be low: the worst of all orders, or their root mean square.
    #[arg(long, value_enum, default_value = "worst", requires = "optimise")]
    pub criterion: Criterion,
    /// Another seed searches along another way.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "optimise")]
    pub seed: u64,
    /// Write noise gain by order and layout, to be plotted as a map: the rig's, those suggested and those found.
    #[arg(long, value_name = "FILE.csv")]
    pub map: Option<PathBuf>,
    /// Write a page to look at: the tables of the plan, the rig as a drawing, and noise gain by order.
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    #[command(flatten)]
    pub overrides: Overrides,
}

/// What can be made better.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Optimise {
    /// The angles of all sensors but the first.
    Angles,
}

/// What is to be low.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Criterion {
    /// The worst noise gain of form.
    Worst,
    /// The root mean square of the noise gains of form.
    Rms,
}

/// Above it, rounding of e^{inθ} is no longer small beside what distinguishes a lost order.
const HIGHEST_ORDER: usize = 10_000;

fn orders(text: &str) -> Result<RangeInclusive<usize>, String> {
    let number = |text: &str| text.trim().parse::<usize>().ok();
    let pair = |separator| text.split_once(separator).and_then(|(a, b)| Some((number(a)?, number(b)?)));
    match pair("..").or_else(|| pair("..=")) {
        Some((0, last)) => Err(format!("orders count from 1; write `1..{last}`")),
        Some((first, last)) if first > last => Err(format!("there is no order from {first} to {last}")),
        Some((_, last)) if last > HIGHEST_ORDER => {
            Err(format!("the highest order that can be planned is {HIGHEST_ORDER}"))
        }
        Some((first, last)) => Ok(first..=last),
        None => Err(match ["-", "–", ":", ","].into_iter().find_map(pair) {
            Some((first, last)) => format!("did you mean `{first}..{last}`?"),
            None => "expected two orders, as in `2..80`".into(),
        }),
    }
}

fn threads(text: &str) -> Result<NonZeroUsize, String> {
    text.parse().map_err(|_| "expected a whole number from 1 on".into())
}

fn degrees(text: &str) -> Result<f64, String> {
    let number = text.strip_suffix("deg").or_else(|| text.strip_suffix('°')).unwrap_or(text).trim();
    match number.parse::<f64>() {
        Ok(angle) if (0.0..=180.0).contains(&angle) => Ok(angle),
        Ok(_) => Err("expected an angle from 0deg to 180deg".into()),
        Err(_) => Err("expected an angle in degrees, as in `15deg`".into()),
    }
}

/// `runout plugins`.
#[derive(Debug, Args)]
pub(crate) struct PluginsArgs {
    /// A plugin, a table without one (`rig`, `surface`, `evaluate`, `limit`, `diagnose`) or a stage; `stage/name` where two stages
    /// have a plugin of that name (`export/hdf5`).
    pub name: Option<String>,
    /// With the name `test`: a program that separates turns, with its arguments. Whether it keeps what every separator must.
    #[arg(last = true, value_name = "COMMAND")]
    pub command: Vec<String>,
    /// The rig that `test` gives the program; without it, three sensors around one section.
    #[arg(long, value_name = "RIG.toml", requires = "command")]
    pub rig: Option<PathBuf>,
}

/// `runout schema`.
#[derive(Debug, Args)]
pub(crate) struct SchemaArgs {
    /// `pipeline`, `scenario`, `rig`, `summary`, `diagnosis`, `compare`, `batch`, `check`, `plan`, `plan-points`, or a plugin's name; all the files' schemas without it.
    pub name: Option<String>,
    /// Write each file's schema to `NAME.schema.json` in this folder.
    #[arg(long, value_name = "DIR", conflicts_with = "name")]
    pub out: Option<PathBuf>,
}

/// `runout inspect`.
#[derive(Debug, Args)]
pub(crate) struct InspectArgs {
    /// A measurement, a result or a table.
    pub file: PathBuf,
}

/// `runout new`.
#[derive(Debug, Args)]
pub(crate) struct NewArgs {
    /// The method: a plugin of [separate], as `docs/methods.md` and `runout plugins` list them.
    pub method: String,
    /// The recording, points or map that is to be read: [load] is written for it.
    pub file: Option<PathBuf>,
    /// The pipeline to write; METHOD.toml without it.
    #[arg(long, value_name = "PIPELINE.toml")]
    pub out: Option<PathBuf>,
    /// Write over a pipeline that is there.
    #[arg(long)]
    pub overwrite: bool,
}

/// `runout example`.
#[derive(Debug, Args)]
pub(crate) struct ExampleArgs {
    /// Which one; without it they are listed.
    pub name: Option<String>,
    /// The folder to write; one of its name without it.
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
}

/// `runout convert`.
#[derive(Debug, Args)]
pub(crate) struct ConvertArgs {
    /// A height map or a profile: X3P, SDF, SUR, HDF5 (runout-surface), text.
    pub input: PathBuf,
    /// The file to write; its ending says the format: .x3p, .sdf, .h5.
    pub output: PathBuf,
    /// Name or number, from 1, of the map in a file that holds several.
    #[arg(long)]
    pub layer: Option<String>,
    /// Unit of heights of a file that names none (of text of its coordinates too): m, mm, um, nm.
    #[arg(long)]
    pub unit: Option<String>,
    /// Distance of columns (and rows) of a matrix as text, in mm.
    #[arg(long, value_name = "MM", num_args = 1..=2)]
    pub step_mm: Vec<f64>,
    /// Write over a file that is there.
    #[arg(long)]
    pub overwrite: bool,
}

/// `runout report`.
#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// A result file, which `[[export]] plugin = "hdf5"` of a run or a diagnosis wrote.
    #[arg(value_name = "RESULT.h5")]
    pub result: PathBuf,
    /// Write the report here; beside the result without it, as RESULT.html.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// `runout completions`.
#[derive(Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// The shell that reads the script: `runout completions bash > ~/.local/share/bash-completion/completions/runout`.
    pub shell: Shell,
}
