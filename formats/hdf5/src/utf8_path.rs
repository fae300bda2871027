//! Paths that the HDF5 library can open.

use std::path::Path;

use runout_core::{Error, Result};

/// Refuses a path that is not UTF-8: the library would call its file damaged.
///
/// # Errors
/// When it is not.
pub(crate) fn check(path: &Path) -> Result<()> {
    if path.to_str().is_some() {
        return Ok(());
    }
    let problem = "HDF5 needs a path in UTF-8, which this one is not";
    Err(Error::new("open", path.display().to_string(), problem)
        .help("rename the folder or the file, or work in its folder and name the file alone"))
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use std::{ffi::OsStr, os::unix::ffi::OsStrExt};

    use super::*;

    #[test]
    fn a_path_that_is_not_utf_8_is_refused() {
        check(Path::new("Fühler/shaft.h5")).unwrap();
        let error = check(Path::new(OsStr::from_bytes(b"f\xff/shaft.h5"))).unwrap_err();
        assert!(error.to_string().contains("needs a path in UTF-8"), "{error}");
    }
}
