//! What this process has begun to write and not finished.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    sync::{Condvar, Mutex, MutexGuard, PoisonError},
};

use super::PendingFile;
use runout_error::{ErrorKind, Result};

/// What this process has begun and not finished.
static UNDER_WAY: Mutex<UnderWay> = Mutex::new(UnderWay {
    files: Vec::new(),
    folders: BTreeSet::new(),
    locks: Vec::new(),
    abandoning: 0,
    publishing: 0,
});

/// That a publication has ended.
static PUBLISHED: Condvar = Condvar::new();

pub(super) struct UnderWay {
    /// Temporary files.
    pub files: Vec<PathBuf>,
    /// Folders that were made, and in which no file has its name yet.
    pub folders: BTreeSet<PathBuf>,
    /// Locks that are held.
    pub locks: Vec<PathBuf>,
    /// How many [`Abandoned`] there are.
    pub abandoning: usize,
    /// How many threads publish files now, side by side because syncing takes time; [`abandon_all`] waits for them.
    publishing: usize,
}

impl UnderWay {
    pub(crate) fn now() -> MutexGuard<'static, Self> {
        UNDER_WAY.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Removes a temporary file, and the folders made for it where nothing else came into them.
    pub(crate) fn remove(&mut self, temporary: &Path) {
        self.files.retain(|file| file != temporary);
        // Nothing more can be done about a temporary file that will not go.
        let _ = fs::remove_file(temporary);
        self.remove_made_folders(temporary);
    }

    /// Removes the folders that were made for a file, where nothing else came into them.
    pub(crate) fn remove_made_folders(&mut self, file: &Path) {
        for folder in file.ancestors().skip(1) {
            // Folders with something in them do not go.
            if !self.folders.contains(folder) || fs::remove_dir(folder).is_err() {
                break;
            }
            self.folders.remove(folder);
        }
    }

    /// Forgets a temporary file that has its name, and the folders above it: they stay.
    pub(crate) fn committed(&mut self, temporary: &Path) {
        self.files.retain(|file| file != temporary);
        for folder in temporary.ancestors().skip(1) {
            if !self.folders.remove(folder) {
                break;
            }
        }
    }

    /// Begins to give files their final names, which nothing can abandon from here on.
    pub(crate) fn publish(&mut self, files: &[PendingFile]) -> Result<Publishing> {
        let is_gone = |file: &&PendingFile| self.abandoning > 0 || !self.files.contains(&file.temporary);
        if let Some(gone) = files.iter().find(is_gone) {
            return Err(gone.failure(ABANDONED).of(ErrorKind::Interrupted));
        }
        self.publishing += 1;
        Ok(Publishing)
    }
}

/// A publication of this process, until it is dropped.
pub(super) struct Publishing;

impl Drop for Publishing {
    fn drop(&mut self) {
        UnderWay::now().publishing -= 1;
        PUBLISHED.notify_all();
    }
}

/// Why a file that was taken away cannot be finished.
pub(super) const ABANDONED: &str = "the work was abandoned";

/// Removes all that this process has begun and not finished, as a program does that is interrupted. What was abandoned cannot be
/// finished any more, and nothing can be begun while the returned value lives: both fail with [`ErrorKind::Interrupted`].
#[must_use = "new files can be begun as soon as it is dropped"]
pub fn abandon_all() -> Abandoned {
    let mut under_way = UnderWay::now();
    under_way.abandoning += 1;
    under_way = PUBLISHED.wait_while(under_way, |now| now.publishing > 0).unwrap_or_else(PoisonError::into_inner);
    while let Some(file) = under_way.files.pop() {
        under_way.remove(&file);
    }
    while let Some(lock) = under_way.locks.pop() {
        let _ = fs::remove_file(&lock);
        under_way.remove_made_folders(&lock);
    }
    Abandoned(())
}

/// While it lives, no file can be begun: [`abandon_all`].
#[derive(Debug)]
pub struct Abandoned(());

impl Drop for Abandoned {
    fn drop(&mut self) {
        UnderWay::now().abandoning -= 1;
    }
}
