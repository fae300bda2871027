//! Whether a disk is full, from the errors of those who write to it.

use std::{error::Error, io};

/// What to do where a disk is full.
pub(super) const HELP: &str = "make room, or write elsewhere; files of earlier runs are as they were";

/// Whether the disk is full, or as full as this user may fill it. Libraries in C give the system's number as text.
pub(super) fn is_cause(error: &(dyn Error + 'static)) -> bool {
    let causes = std::iter::successors(Some(error), |error| Error::source(*error));
    let mut kinds = causes.filter_map(|error| error.downcast_ref::<io::Error>()).map(io::Error::kind);
    let of_system = |kind| matches!(kind, io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded);
    kinds.any(of_system) || error.to_string().contains("No space left on device")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use runout_error::ErrorKind;

    use super::{super::PendingFile, *};

    #[test]
    fn a_full_disk_is_named_as_such() {
        let folder = tempfile::tempdir().unwrap();
        let pending = PendingFile::new(folder.path().join("form.parquet")).unwrap();
        let full = io::Error::from(io::ErrorKind::StorageFull);
        // As HDF5 gives it, in the middle of a text.
        let in_words =
            io::Error::other("file write failed: errno = 28, error message = 'No space left on device', buf = 0x7f45");
        for error in [full, in_words] {
            let error = pending.caused(error);
            assert!(error.to_string().ends_with("form.parquet: no space is left there"), "{error}");
            assert!(error.kind() == ErrorKind::Io && error.advice().is_some());
        }
        let other = pending.caused(io::Error::from(io::ErrorKind::PermissionDenied));
        assert!(!other.to_string().contains("space"), "{other}");
    }
}
