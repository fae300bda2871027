//! What lasts whatever happens to the machine: contents of files, names in folders.

use std::{fs::File, io, path::Path};

use super::faults;

/// Has the contents of files last that lie in these folders, and the names in them, where a system does that by one call for a file system; whether it
/// does. One after the other, each file and folder would wait for the disk.
pub(super) fn all_in<'a>(folders: impl IntoIterator<Item = &'a Path>) -> io::Result<bool> {
    #[cfg(target_os = "linux")]
    {
        use std::{collections::BTreeMap, os::unix::fs::MetadataExt};

        let mut file_systems = BTreeMap::new();
        for folder in folders {
            let folder = File::open(folder)?;
            file_systems.insert(folder.metadata()?.dev(), folder);
        }
        for folder in file_systems.into_values() {
            faults::step()?;
            rustix::fs::syncfs(folder)?;
        }
        Ok(true)
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = folders;
        Ok(false)
    }
}

/// Has the contents of a file last.
pub(super) fn file(path: &Path) -> io::Result<()> {
    faults::step()?;
    File::options().write(true).open(path)?.sync_all()
}

/// Makes names in a folder last. Where a system does not sync folders, it keeps their order itself.
pub(super) fn folder(folder: &Path) -> io::Result<()> {
    faults::step()?;
    #[cfg(unix)]
    {
        let synced = File::open(folder).and_then(|folder| folder.sync_all());
        // Some network file systems refuse it.
        synced.or_else(|error| if error.kind() == io::ErrorKind::InvalidInput { Ok(()) } else { Err(error) })?;
    }
    #[cfg(not(unix))]
    let _ = folder;
    Ok(())
}
