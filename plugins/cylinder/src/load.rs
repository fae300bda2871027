//! The loader `cylinder-traces`: a CSV file of traces measured on a cylinder.

use std::path::PathBuf;

use runout_core::{
    pipeline::{
        error::Fault,
        registry::{Context, StageConfig},
    },
    stage::Loader,
};
use runout_traces::Columns;
use schemars::JsonSchema;
use serde::Deserialize;

/// `[load] plugin = "cylinder-traces"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderTracesConfig {
    /// CSV file with the columns trace, kind, z_mm, angle_deg, deviation_um, in any order; the points of a trace follow
    /// one another. Separated by comma, semicolon or tab; the last two allow a decimal comma.
    pub path: PathBuf,
}

impl StageConfig for CylinderTracesConfig {
    type Stage = Box<dyn Loader>;

    const NAME: &'static str = "cylinder-traces";
    const ABOUT: &'static str = "circles and generatrices measured on a cylinder, from CSV";

    fn check(self, context: &Context) -> Result<Self::Stage, Fault> {
        runout_traces::loader(&self.path, context, |path| COLUMNS.read(path))
    }
}

const COLUMNS: Columns = Columns { kind: "kind", numbers: &["z_mm", "angle_deg", "deviation_um"], optional: &[] };
