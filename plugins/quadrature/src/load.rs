//! The loader `quadrature-samples`.

use std::path::PathBuf;

use runout_core::{
    Result,
    pipeline::{
        error::Fault,
        registry::{Context, StageConfig},
    },
    rig::Rig,
    stage::{Loader, Source, SourceKind},
};
use runout_traces::Numbers;
use schemars::JsonSchema;
use serde::Deserialize;

/// `[load] plugin = "quadrature-samples"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuadratureSamplesConfig {
    /// CSV file with the columns phase_deg and radius_counts, in any order: the angle and the length of the pair (cosine,
    /// sine). A column deviation_counts is left alone. Separated by comma, semicolon or tab; the last two allow a decimal
    /// comma.
    pub path: PathBuf,
}

impl StageConfig for QuadratureSamplesConfig {
    type Stage = Box<dyn Loader>;

    const NAME: &'static str = "quadrature-samples";
    const ABOUT: &'static str = "phase and radius of a quadrature signal, from CSV";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        if self.path.as_os_str().is_empty() {
            return Err(Fault::at("path", "expected the name of a file"));
        }
        Ok(Box::new(QuadratureSamples { path: context.path(&self.path) }))
    }
}

const NUMBERS: Numbers = Numbers { read: &["phase_deg", "radius_counts"], ignored: &["deviation_counts"] };

/// The loader `quadrature-samples`.
struct QuadratureSamples {
    path: PathBuf,
}

impl Loader for QuadratureSamples {
    fn kind(&self) -> SourceKind {
        SourceKind::Points
    }

    fn open(&self, _rig: Option<&Rig>) -> Result<Source> {
        NUMBERS.read(&self.path, "signal").map(Source::Points)
    }
}
