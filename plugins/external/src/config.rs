//! `plugin = "external"` of a file.

use std::path::{Component, Path, PathBuf};

use runout_core::{
    fault::Fault,
    pipeline::{Context, StageConfig},
    stage::{Exporter, Loader, Separator, require_rig},
};
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Map, Value};

use crate::{
    exporter::ProgramAsExporter, loader::ProgramAsLoader, points::ProgramForPoints, program::Program, session::Session,
    turns::TurnSeparator,
};

/// `[separate] plugin = "external"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExternalSeparatorConfig {
    /// The program and its arguments. It runs in the folder of the pipeline; a program whose name has a `/` is a path from there.
    pub command: Vec<String>,
    /// Columns of numbers that the program takes of measured points; without it, it takes the turns of a rig.
    #[serde(default)]
    pub columns: Option<Vec<String>>,
    /// Columns of texts that it takes of measured points.
    #[serde(default)]
    pub labels: Vec<String>,
    /// What the program gets as `runout.config`: keys of its own.
    #[serde(default)]
    pub config: Map<String, Value>,
    /// Longest time for one answer, of a station or of all points, in s; the first one includes the start of the program.
    #[serde(default = "default_timeout_s")]
    pub timeout_s: f64,
    /// Most memory that the program may write to, in MB, on Linux; without it, as much as there is.
    #[serde(default)]
    pub memory_mb: Option<u64>,
    /// Largest answer, in MB.
    #[serde(default = "default_output_mb")]
    pub output_mb: u64,
}

fn default_timeout_s() -> f64 {
    60.0
}

fn default_output_mb() -> u64 {
    64
}

impl StageConfig for ExternalSeparatorConfig {
    type Stage = Separator;

    const NAME: &'static str = "external";
    const ABOUT: &'static str = "a program in any language: tables on stdin and stdout";

    fn check(self, context: &Context) -> Result<Separator, Fault> {
        let program = Program::new(self.command, context.folder, self.timeout_s, self.memory_mb, self.output_mb)?;
        let (session, config) = (Session::new(program), Value::Object(self.config));
        match &self.columns {
            Some(columns) => {
                let separator = ProgramForPoints::new(session, config, columns, &self.labels)?;
                Ok(Separator::Points(Box::new(separator)))
            }
            None if !self.labels.is_empty() => {
                Err(Fault::at("labels", "turns have no columns").help("measured points need `columns` too"))
            }
            None => {
                let rig = require_rig(context.rig).map_err(|fault| {
                    fault.help(
                        "turns need sensors and setups in [rig]; measured points need `columns = [\"x_mm\", …]` here",
                    )
                })?;
                Ok(Separator::Stations(Box::new(TurnSeparator::new(session, config, rig)?)))
            }
        }
    }
}

/// `[load] plugin = "external"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExternalLoaderConfig {
    /// The program and its arguments. It runs in the folder of the pipeline; a program whose name has a `/` is a path from there.
    pub command: Vec<String>,
    /// The file that the program reads, relative to the TOML. Its checksum belongs to the result.
    pub path: PathBuf,
    /// What the program gets as `runout.config`: keys of its own.
    #[serde(default)]
    pub config: Map<String, Value>,
    /// Longest time for the answer, in s.
    #[serde(default = "default_timeout_s")]
    pub timeout_s: f64,
    /// Most memory that the program may write to, in MB, on Linux; without it, as much as there is.
    #[serde(default)]
    pub memory_mb: Option<u64>,
    /// Largest answer, in MB.
    #[serde(default = "default_output_mb")]
    pub output_mb: u64,
}

impl StageConfig for ExternalLoaderConfig {
    type Stage = Box<dyn Loader>;

    const NAME: &'static str = "external";
    const ABOUT: &'static str = "measured points by a program in any language";

    fn check(self, context: &Context) -> Result<Self::Stage, Fault> {
        if self.path.as_os_str().is_empty() {
            return Err(Fault::at("path", "expected the name of a file"));
        }
        let program = Program::new(self.command, context.folder, self.timeout_s, self.memory_mb, self.output_mb)?;
        let (config, path) = (Value::Object(self.config), context.path(&self.path));
        Ok(Box::new(ProgramAsLoader { program, config, path }))
    }
}

/// `[[export]] plugin = "external"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExternalExporterConfig {
    /// The program and its arguments. It runs in the folder of the pipeline; a program whose name has a `/` is a path from there.
    pub command: Vec<String>,
    /// Folder of the files, relative to the TOML. Made where it is missing.
    pub path: PathBuf,
    /// Names of the files that the program writes, at least one: `files = ["values.txt"]`.
    pub files: Vec<String>,
    /// What the program gets as `runout.config`: keys of its own.
    #[serde(default)]
    pub config: Map<String, Value>,
    /// Longest time for one answer, of one table of one station, in s; the first one includes the start of the program.
    #[serde(default = "default_timeout_s")]
    pub timeout_s: f64,
    /// Most memory that the program may write to, in MB, on Linux; without it, as much as there is.
    #[serde(default)]
    pub memory_mb: Option<u64>,
}

impl StageConfig for ExternalExporterConfig {
    type Stage = Box<dyn Exporter>;

    const NAME: &'static str = "external";
    const ABOUT: &'static str = "files of any format by a program in any language";

    fn check(self, context: &Context) -> Result<Self::Stage, Fault> {
        let is_name =
            |name: &String| matches!(Path::new(name).components().collect::<Vec<_>>()[..], [Component::Normal(_)]);
        let differ = self.files.iter().enumerate().all(|(at, name)| !self.files[..at].contains(name));
        if self.files.is_empty() || !self.files.iter().all(is_name) || !differ {
            let fault = Fault::at("files", "expected names of files in the folder `path`, at least one and none twice");
            return Err(fault.help("files = [\"values.txt\"]"));
        }
        // An answer is no more than its end and warnings.
        let program = Program::new(self.command, context.folder, self.timeout_s, self.memory_mb, 1)?;
        let (config, folder) = (Value::Object(self.config), context.path(&self.path));
        Ok(Box::new(ProgramAsExporter { program, config, folder, files: self.files }))
    }
}
