//! Where a result came from: enough to repeat the run.

use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::input_file::InputFile;
use runout_error::Result;

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

/// A file that was read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Input {
    /// Its path, as it was opened.
    pub path: String,
    /// Its size in bytes.
    pub bytes: u64,
    /// BLAKE3 of its contents, in hexadecimal (`b3sum` prints the same).
    pub blake3: String,
}

impl Input {
    /// Reads the file once for its checksum.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn of(path: &Path) -> Result<Self> {
        InputFile::new(path)?.checksum()
    }
}
