//! Where a result came from: enough to repeat the run.

use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use runout_error::{Error, Result};

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
        let shown = path.display().to_string();
        let failure = |error: std::io::Error| Error::caused("checksum", &shown, error);
        let mut file = std::fs::File::open(path).map_err(failure)?;
        let bytes = file.metadata().map_err(failure)?.len();
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(&mut file).map_err(failure)?;
        Ok(Self { path: shown.clone(), bytes, blake3: hasher.finalize().to_hex().to_string() })
    }
}
