//! Where a result came from: enough to repeat the run.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use crate::input_file::Input;

/// Version of the toolkit.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Where a result came from.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Provenance {
    /// "runout 0.1.0".
    pub program: String,
    /// The pipeline as it ran, with a rig file and every `--set` in their places: it runs again as it is.
    pub configuration: String,
    /// The files that were read.
    pub inputs: Vec<Input>,
}
