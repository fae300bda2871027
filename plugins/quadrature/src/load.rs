//! The loader `quadrature-samples`.

use std::path::PathBuf;

use runout_core::{
    pipeline::{
        error::Fault,
        registry::{Context, StageConfig},
    },
    stage::Loader,
};
use runout_traces::Numbers;
use schemars::JsonSchema;
use serde::Deserialize;

/// `[load] plugin = "quadrature-samples"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuadratureSamplesConfig {
    /// CSV file with the columns phase_deg and radius_counts, in any order: the angle and the length of the pair (cosine,
    /// sine). Optional: time_s, and reference_deg, the true angle in degrees of the signal's own period, from any zero. A column
    /// deviation_counts is ignored. Separated by comma, semicolon or tab; the last two allow a decimal comma.
    pub path: PathBuf,
}

impl StageConfig for QuadratureSamplesConfig {
    type Stage = Box<dyn Loader>;

    const NAME: &'static str = "quadrature-samples";
    const ABOUT: &'static str = "phase and radius of a quadrature signal, from CSV";

    fn check(self, context: &Context) -> Result<Self::Stage, Fault> {
        runout_traces::loader(&self.path, context, |path| NUMBERS.read(path, "signal"))
    }
}

const NUMBERS: Numbers = Numbers {
    read: &["phase_deg", "radius_counts"],
    optional: &["time_s", "reference_deg"],
    ignored: &["deviation_counts"],
};
