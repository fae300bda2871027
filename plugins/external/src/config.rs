//! `plugin = "external"` of a file.

use std::path::{Component, Path, PathBuf};

use runout_core::{
    fault::Fault,
    pipeline::{Context, StageConfig},
    stage::{Evaluator, Exporter, Loader, Preprocessor, Separator, require_rig},
};
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Value;

use crate::{
    corrector::ExternalCorrector,
    evaluator::ExternalEvaluator,
    exporter::ExternalExporter,
    loader::ExternalLoader,
    points::ExternalPointSeparator,
    recording::ExternalRecordings,
    responder::Responder,
    session::Session,
    turns::TurnSeparator,
    values::{Symbol, declared},
};

pub(crate) fn default_timeout_s() -> f64 {
    60.0
}

pub(crate) fn default_output_mb() -> u64 {
    64
}

/// The keys of a stage that is a program: its own, and those that every program has.
macro_rules! with_program {
    ($(#[$about:meta])* pub struct $name:ident { $($(#[$key:meta])* pub $field:ident: $of:ty,)* }) => {
        $(#[$about])*
        #[derive(Debug, Clone, serde::Deserialize, schemars::JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            /// The program and its arguments. It runs in the folder of the pipeline; a program whose name has a `/` is a path from there.
            pub command: Vec<String>,
            $($(#[$key])* pub $field: $of,)*
            /// What the program gets as `runout.config`: keys of its own.
            #[serde(default)]
            pub config: serde_json::Map<String, serde_json::Value>,
            /// Longest time for one answer, in s; the first one includes the start of the program.
            #[serde(default = "crate::config::default_timeout_s")]
            pub timeout_s: f64,
            /// Most memory that the program may write to, in MB, on Linux; without it, as much as there is.
            #[serde(default)]
            pub memory_mb: Option<u64>,
            /// Largest answer, in MB.
            #[serde(default = "crate::config::default_output_mb")]
            pub output_mb: u64,
        }

        impl $name {
            fn program(&self, context: &runout_core::pipeline::Context) -> std::result::Result<$crate::program::Program, runout_core::fault::Fault> {
                let limits = (self.timeout_s, self.memory_mb, self.output_mb);
                $crate::program::Program::new(self.command.clone(), context.folder, limits)
            }
        }
    };
}
pub(crate) use with_program;

with_program! {
    /// `[separate] plugin = "external"`.
    pub struct ExternalSeparatorConfig {
        /// Columns of numbers that the program takes of measured points; without it, it takes the turns of a rig.
        #[serde(default)]
        pub columns: Option<Vec<String>>,
        /// Columns of texts that it takes of measured points.
        #[serde(default)]
        pub labels: Vec<String>,
        /// Values that it gives of measured points, and no others: those that `[[limit]]` may name.
        #[serde(default)]
        pub symbols: Vec<Symbol>,
    }
}

impl StageConfig for ExternalSeparatorConfig {
    type Stage = Separator;

    const NAME: &'static str = "external";
    const ABOUT: &'static str = "a program in any language: tables on stdin and stdout";

    fn check(self, context: &Context) -> Result<Separator, Fault> {
        let program = self.program(context)?;
        let (responder, config) = (Responder::from(program), Value::Object(self.config));
        match &self.columns {
            Some(columns) => points(responder, config, columns, &self.labels, &self.symbols),
            None if !self.labels.is_empty() => {
                Err(Fault::at("labels", "turns have no columns").help("measured points need `columns` too"))
            }
            None if !self.symbols.is_empty() => {
                Err(Fault::at("symbols", "a separator of turns gives no values of its own")
                    .help("measured points need `columns` too; an [[evaluator]] gives values of turns"))
            }
            None => turns(responder, config, context).map_err(|fault| match context.rig {
                Some(_) => fault,
                None => fault.help(
                    "turns need sensors and setups in [rig]; measured points need `columns = [\"x_mm\", …]` here",
                ),
            }),
        }
    }
}

/// A separator of the turns of a rig.
///
/// # Errors
/// When there is no rig, or the protocol has no tables for it.
pub(crate) fn turns(responder: Responder, config: Value, context: &Context) -> Result<Separator, Fault> {
    let separator = TurnSeparator::new(Session::new(responder), config, require_rig(context.rig)?)?;
    Ok(Separator::Stations(Box::new(separator)))
}

/// A separator of points.
///
/// # Errors
/// When there are no columns of numbers, or a name is there twice.
pub(crate) fn points(
    responder: Responder,
    config: Value,
    columns: &[String],
    labels: &[String],
    symbols: &[Symbol],
) -> Result<Separator, Fault> {
    let symbols = declared(symbols)?;
    let separator = ExternalPointSeparator::new(Session::new(responder), config, [columns, labels], symbols)?;
    Ok(Separator::Points(Box::new(separator)))
}

/// A loader of points or of recorded turns.
///
/// # Errors
/// When the path is empty.
pub(crate) fn loader(
    responder: Responder,
    config: Value,
    path: &Path,
    gives: Gives,
    context: &Context,
) -> Result<Box<dyn Loader>, Fault> {
    if path.as_os_str().is_empty() {
        return Err(Fault::at("path", "expected the name of a file"));
    }
    let path = context.path(path);
    Ok(match gives {
        Gives::Points => Box::new(ExternalLoader { responder, config, path }),
        Gives::Samples => Box::new(ExternalRecordings { responder, config, path }),
    })
}

/// An exporter of files in a folder.
///
/// # Errors
/// When the names of the files cannot be.
pub(crate) fn exporter(
    responder: Responder,
    config: Value,
    folder: &Path,
    files: Vec<String>,
    context: &Context,
) -> Result<Box<dyn Exporter>, Fault> {
    let is_name =
        |name: &String| matches!(Path::new(name).components().collect::<Vec<_>>()[..], [Component::Normal(_)]);
    let differ = files.iter().enumerate().all(|(at, name)| !files[..at].contains(name));
    if files.is_empty() || !files.iter().all(is_name) || !differ {
        let fault = Fault::at("files", "expected names of files in the folder `path`, at least one and none twice");
        return Err(fault.help("files = [\"values.txt\"]"));
    }
    Ok(Box::new(ExternalExporter { responder, config, folder: context.path(folder), files }))
}

with_program! {
    /// `[load] plugin = "external"`.
    pub struct ExternalLoaderConfig {
        /// The file that the program reads, relative to the TOML. Its checksum belongs to the result.
        pub path: PathBuf,
        /// What it gives.
        #[serde(default)]
        pub gives: Gives,
    }
}

/// What a loader gives.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Gives {
    /// Measured points.
    #[default]
    Points,
    /// Samples of recorded turns.
    Samples,
}

impl StageConfig for ExternalLoaderConfig {
    type Stage = Box<dyn Loader>;

    const NAME: &'static str = "external";
    const ABOUT: &'static str = "measured points or recorded turns by a program in any language";

    fn check(self, context: &Context) -> Result<Self::Stage, Fault> {
        let program = self.program(context)?;
        loader(program.into(), Value::Object(self.config), &self.path, self.gives, context)
    }
}

with_program! {
    /// `[[preprocess]] plugin = "external"`.
    pub struct ExternalPreprocessorConfig {}
}

impl StageConfig for ExternalPreprocessorConfig {
    type Stage = Preprocessor;

    const NAME: &'static str = "external";
    const ABOUT: &'static str = "a change of averages, harmonic by harmonic, by a program in any language";

    fn check(self, context: &Context) -> Result<Preprocessor, Fault> {
        corrector(self.program(context)?.into(), Value::Object(self.config), context)
    }
}

/// A preprocessor of averages.
///
/// # Errors
/// When there is no rig.
pub(crate) fn corrector(responder: Responder, config: Value, context: &Context) -> Result<Preprocessor, Fault> {
    let rig = require_rig(context.rig)?.clone();
    Ok(Preprocessor::Corrector(Box::new(ExternalCorrector { session: Session::new(responder), config, rig })))
}

with_program! {
    /// `[[evaluator]] plugin = "external"`.
    pub struct ExternalEvaluatorConfig {
        /// Values that it gives, at least one, and no others: `symbols = [{ symbol = "lobing", unit = "um" }]`. `[[limit]]` may name them.
        pub symbols: Vec<Symbol>,
    }
}

impl StageConfig for ExternalEvaluatorConfig {
    type Stage = Box<dyn Evaluator>;

    const NAME: &'static str = "external";
    const ABOUT: &'static str = "values of a result by a program in any language";

    fn check(self, context: &Context) -> Result<Self::Stage, Fault> {
        let program = self.program(context)?;
        evaluator(program.into(), Value::Object(self.config), &self.symbols)
    }
}

/// An evaluator of these values.
///
/// # Errors
/// When there are none, or one is there twice.
pub(crate) fn evaluator(responder: Responder, config: Value, symbols: &[Symbol]) -> Result<Box<dyn Evaluator>, Fault> {
    if symbols.is_empty() {
        let fault = Fault::at("symbols", "expected at least one value, found none");
        return Err(fault.help("symbols = [{ symbol = \"lobing\", unit = \"um\" }]"));
    }
    Ok(Box::new(ExternalEvaluator { responder, config, symbols: declared(symbols)? }))
}

with_program! {
    /// `[[export]] plugin = "external"`.
    pub struct ExternalExporterConfig {
        /// Folder of the files, relative to the TOML. Made where it is missing.
        pub path: PathBuf,
        /// Names of the files that the program writes, at least one: `files = ["values.txt"]`.
        pub files: Vec<String>,
    }
}

impl StageConfig for ExternalExporterConfig {
    type Stage = Box<dyn Exporter>;

    const NAME: &'static str = "external";
    const ABOUT: &'static str = "files of any format by a program in any language";

    fn check(self, context: &Context) -> Result<Self::Stage, Fault> {
        let program = self.program(context)?;
        exporter(program.into(), Value::Object(self.config), &self.path, self.files, context)
    }
}
