//! The loader `r-test-points`.

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

/// `[load] plugin = "r-test-points"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RTestPointsConfig {
    /// CSV file with the columns a_deg, c_deg, dx_mm, dy_mm, dz_mm, in any order: commands of the rotary axes and the measured
    /// deviation of the ball. A column point is left alone. Separated by comma, semicolon or tab; the last two allow a
    /// decimal comma.
    pub path: PathBuf,
}

impl StageConfig for RTestPointsConfig {
    type Stage = Box<dyn Loader>;

    const NAME: &'static str = "r-test-points";
    const ABOUT: &'static str = "deviations of the ball in an R-test, from CSV";

    fn check(self, context: &Context) -> Result<Self::Stage, Fault> {
        runout_traces::loader(&self.path, context, |path| NUMBERS.read(path, "r-test"))
    }
}

const NUMBERS: Numbers =
    Numbers { read: &["a_deg", "c_deg", "dx_mm", "dy_mm", "dz_mm"], optional: &[], ignored: &["point"] };
