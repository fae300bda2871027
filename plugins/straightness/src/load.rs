//! The loader `axial-traces`: a CSV file of traces along an axis, in two setups.

use std::path::PathBuf;

use runout_core::{
    pipeline::{
        error::Fault,
        registry::{Context, StageConfig},
    },
    stage::Loader,
};
use runout_traces::{Columns, Optional};
use schemars::JsonSchema;
use serde::Deserialize;

/// `[load] plugin = "axial-traces"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxialTracesConfig {
    /// CSV file with the columns trace, setup, z_mm, reading_um, in any order; the points of a trace follow one
    /// another, with z rising or falling throughout. A reading grows when the surface comes nearer to the probe.
    /// Optional columns: flag (1 leaves the point out, 0 uses it) and time_s (for drifts along a trace; without it a trace
    /// is taken to run at constant speed in the order of its rows).
    /// Separated by comma, semicolon or tab; the last two allow a decimal comma.
    pub path: PathBuf,
}

impl StageConfig for AxialTracesConfig {
    type Stage = Box<dyn Loader>;

    const NAME: &'static str = "axial-traces";
    const ABOUT: &'static str = "traces along a cylinder or a straightedge in two setups, from CSV";

    fn check(self, context: &Context) -> Result<Self::Stage, Fault> {
        runout_traces::loader(&self.path, context, |path| COLUMNS.read(path))
    }
}

const COLUMNS: Columns = Columns {
    kind: "setup",
    numbers: &["z_mm", "reading_um"],
    optional: &[Optional::Number("time_s"), Optional::Flag("flag")],
};
