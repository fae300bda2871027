//! A diagnosis of earlier results beside newer ones: it would be taken for theirs.

use std::{fs, path::Path};

use super::config::Pipeline;
use runout_error::{Error, Result};

/// Removes the diagnosis that lies beside the files that a run has just written: an earlier version's, or that of
/// `[diagnose] path`. A file of that name that is no diagnosis stays.
///
/// # Errors
/// When it cannot be removed.
pub(super) fn remove(pipeline: &Pipeline) -> Result<()> {
    for path in pipeline.outdated_diagnoses().filter(|path| is_diagnosis(path)) {
        fs::remove_file(&path)
            .map_err(|error| Error::caused("remove the outdated", path.display().to_string(), error))?;
    }
    Ok(())
}

/// Whether a file holds a diagnosis of any version: an object with the keys that all of them have.
fn is_diagnosis(path: &Path) -> bool {
    let Ok(bytes) = fs::read(path) else { return false };
    let Ok(serde_json::Value::Object(keys)) = serde_json::from_slice(&bytes) else { return false };
    ["verdict", "before", "added", "after"].iter().all(|key| keys.contains_key(*key))
}
