//! A file's checksum from what is read of it anyway.
//!
//! BLAKE3 hashes a tree of 1 KiB chunks. The hash of a whole branch does not depend on what stands before or behind it, so that
//! the readers of a file can hash what passes through their hands, wherever it stands in the file and whenever they come to
//! it. What nobody has read is read at the end. (BLAKE3 specification, section 2.1.)

use std::{
    collections::HashMap,
    fs::File,
    io::{Read, Seek, SeekFrom},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use blake3::{
    Hasher,
    hazmat::{ChainingValue, HasherExt, Mode, left_subtree_len, merge_subtrees_non_root, merge_subtrees_root},
};

use crate::{input_file::InputFile, provenance::Input};
use runout_error::{Error, Result};

/// Bytes of a branch that is hashed as a whole: a power of two.
const BRANCH: u64 = 1 << 18;

/// Bytes of the pieces of a branch that are hashed at once: 16 chunks, as many as the widest vectors hold. Pieces that begin
/// elsewhere are hashed chunk by chunk, which takes up to twice the time.
const PIECE: usize = 1 << 14;

/// What is known of a file's tree: the branches that were read, by their number in the file.
#[derive(Debug, Clone)]
pub struct Checksum {
    file: InputFile,
    begun: Arc<AtomicBool>,
    branches: Arc<Mutex<HashMap<u64, ChainingValue>>>,
}

impl Checksum {
    /// Of a file of which nothing was read. Readers pay for it only once it has [begun](Self::begin).
    #[must_use]
    pub fn of(file: &InputFile) -> Self {
        Self { file: file.clone(), begun: Arc::default(), branches: Arc::default() }
    }

    /// From now on, what is read is hashed.
    pub fn begin(&self) {
        self.begun.store(true, Ordering::Relaxed);
    }

    /// Looks on while someone reads.
    #[must_use]
    pub fn reader(&self) -> Reader {
        Reader { checksum: self.clone(), next: 0, branch: None, rest: Vec::with_capacity(PIECE) }
    }

    /// The checksum of the whole file; what was not read is read now.
    ///
    /// # Errors
    /// When it cannot be read, or changed since it was first opened.
    pub fn finish(&self) -> Result<Input> {
        let bytes = self.file.bytes();
        if bytes <= BRANCH {
            return self.file.checksum();
        }
        let shown = self.file.path().display().to_string();
        let failure = |error: std::io::Error| Error::caused("checksum", &shown, error);
        let mut file = self.file.open()?;
        let left = left_subtree_len(bytes);
        let mut half = |start, end| self.subtree(&mut file, start, end).map_err(failure);
        let hash = merge_subtrees_root(&half(0, left)?, &half(left, bytes)?, Mode::Hash);
        self.file.check()?;
        Ok(Input { path: shown.clone(), bytes, blake3: hash.to_hex().to_string() })
    }

    fn subtree(&self, file: &mut File, start: u64, end: u64) -> std::io::Result<ChainingValue> {
        if end - start > BRANCH {
            let middle = start + left_subtree_len(end - start);
            let halves = [self.subtree(file, start, middle)?, self.subtree(file, middle, end)?];
            return Ok(merge_subtrees_non_root(&halves[0], &halves[1], Mode::Hash));
        }
        if let (Some(known), true) = (self.branch(start / BRANCH), end - start == BRANCH) {
            return Ok(known);
        }
        let mut hasher = begun(start);
        file.seek(SeekFrom::Start(start))?;
        hasher.update_reader(file.take(end - start))?;
        if hasher.count() < end - start {
            return Err(std::io::Error::new(std::io::ErrorKind::UnexpectedEof, "the file became shorter"));
        }
        Ok(hasher.finalize_non_root())
    }

    fn branch(&self, number: u64) -> Option<ChainingValue> {
        self.branches.lock().unwrap_or_else(PoisonError::into_inner).get(&number).copied()
    }
}

/// A hasher of the branch that begins here.
fn begun(start: u64) -> Hasher {
    let mut hasher = Hasher::new();
    hasher.set_input_offset(start);
    hasher
}

/// One reader's part of a checksum.
#[derive(Debug)]
pub struct Reader {
    checksum: Checksum,
    /// Where what comes next would go on.
    next: u64,
    /// The branch that was begun.
    branch: Option<Hasher>,
    /// What of it was read after its last whole piece.
    rest: Vec<u8>,
}

impl Reader {
    /// Takes bytes that stand at a place in the file. Whole branches are hashed; of others the beginning is missing.
    pub fn take(&mut self, start: u64, mut bytes: &[u8]) {
        if !self.checksum.begun.load(Ordering::Relaxed) {
            return;
        }
        if start != self.next {
            self.branch = None;
        }
        let mut at = start;
        while !bytes.is_empty() {
            let room = (BRANCH - at % BRANCH).min(bytes.len() as u64);
            let (here, behind) = bytes.split_at(room as usize);
            if at.is_multiple_of(BRANCH) {
                self.branch = Some(begun(at));
                self.rest.clear();
            }
            at += room;
            bytes = behind;
            self.hash(here);
            if at.is_multiple_of(BRANCH)
                && let Some(branch) = self.branch.take()
            {
                let mut branches = self.checksum.branches.lock().unwrap_or_else(PoisonError::into_inner);
                branches.insert(at / BRANCH - 1, branch.finalize_non_root());
            }
        }
        self.next = at;
    }

    /// Hashes the whole pieces of the branch that was begun, and keeps the rest. A branch is a multiple of pieces.
    fn hash(&mut self, mut bytes: &[u8]) {
        let Some(branch) = &mut self.branch else { return };
        if !self.rest.is_empty() {
            let (here, behind) = bytes.split_at(bytes.len().min(PIECE - self.rest.len()));
            self.rest.extend_from_slice(here);
            bytes = behind;
            if self.rest.len() < PIECE {
                return;
            }
            branch.update(&self.rest);
            self.rest.clear();
        }
        let (whole, rest) = bytes.split_at(bytes.len() / PIECE * PIECE);
        branch.update(whole);
        self.rest.extend_from_slice(rest);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn bytes(count: usize) -> Vec<u8> {
        (0..count as u64).map(|index| (index.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 56) as u8).collect()
    }

    /// The library's own hash of the whole is the reference.
    #[test]
    fn it_is_the_same_however_a_file_was_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let branch = BRANCH as usize;
        for length in [0, 1, branch - 1, branch, branch + 1, 2 * branch, 5 * branch + 1, 7 * branch - 3, 8 * branch] {
            let all = bytes(length);
            std::fs::write(&path, &all).unwrap();
            let expected = Input::of(&path).unwrap();
            // Pieces of a size, from a place on; and nothing at all.
            for (start, piece) in [(0, branch / 3 + 7), (1000, 4096), (branch + 5, 3 * branch + 1), (length, 1)] {
                let checksum = Checksum::of(&InputFile::new(&path).unwrap());
                checksum.begin();
                let mut reader = checksum.reader();
                for from in (start.min(length)..length).step_by(piece) {
                    reader.take(from as u64, &all[from..length.min(from + piece)]);
                }
                assert_eq!(checksum.finish().unwrap(), expected, "{length} bytes from {start} by {piece}");
            }
        }
    }

    #[test]
    fn what_was_read_is_what_counts() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let mut all = bytes(3 * BRANCH as usize);
        std::fs::write(&path, &all).unwrap();
        let checksum = Checksum::of(&InputFile::new(&path).unwrap());
        checksum.reader().take(0, &all);
        assert_eq!(checksum.branches.lock().unwrap().len(), 0, "it has not begun");
        checksum.begin();
        // Out of order, with a gap, by two readers.
        let (mut one, mut other) = (checksum.reader(), checksum.reader());
        let at = |branch: usize| branch * BRANCH as usize..(branch + 1) * BRANCH as usize;
        one.take(2 * BRANCH, &all[at(2)]);
        other.take(0, &all[at(0)][..500]);
        other.take(700, &all[at(0)][700..]);
        one.take(BRANCH, &all[at(1)]);
        assert_eq!(checksum.branches.lock().unwrap().len(), 2);
        assert_eq!(checksum.finish().unwrap(), Input::of(&path).unwrap());
        // The file changes behind the readers.
        all[at(1)].fill(0);
        all.push(0);
        std::fs::write(&path, &all).unwrap();
        assert!(checksum.finish().unwrap_err().to_string().contains("changed while it was read"));
    }
}
