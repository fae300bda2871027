//! Mutated files: no panic, no hang, no memory without bound.

use std::{
    fs,
    path::Path,
    sync::Mutex,
    time::{Duration, Instant},
};

use crate::support::{all_assets, opened};

/// Longer is a hang.
const LONGEST: Duration = Duration::from_secs(5);
/// Memory that is allowed beyond four times the file.
const ALLOWANCE_KB: u64 = 100_000;
/// Samples of a channel that are read.
const MOST_READ: usize = 1 << 18;
/// Files of each asset in a usual run.
const FILES: u64 = 60;

/// One file at a time: the memory is that of the process.
static ALONE: Mutex<()> = Mutex::new(());

/// Opens a file and reads from each of its channels, within bounds of time and memory.
pub(crate) fn check(path: &Path, bytes: usize) {
    let _alone = ALONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let (begun, before_kb) = (Instant::now(), memory_kb("VmRSS:"));
    if memory_kb("VmHWM:") > before_kb + ALLOWANCE_KB / 4 {
        // Linux forgets the largest memory so far.
        let _ = fs::write("/proc/self/clear_refs", "5");
    }
    if let Ok(file) = opened(path) {
        for index in 0..file.channels().len().min(64) {
            let mut column = [Vec::new()];
            let Ok(mut reader) = file.read(&[index]) else { continue };
            let mut read = 0;
            while read < MOST_READ && reader.next(4096, &mut column).is_ok_and(|taken| taken > 0) {
                read += column[0].len();
                column[0].clear();
            }
        }
    }
    let taken_kb = memory_kb("VmHWM:").saturating_sub(before_kb);
    assert!(begun.elapsed() < LONGEST, "{}: {:?}", path.display(), begun.elapsed());
    let most_kb = ALLOWANCE_KB + 4 * bytes as u64 / 1000;
    assert!(taken_kb < most_kb, "{}: {taken_kb} kB of memory for {bytes} bytes", path.display());
}

/// A line of what Linux says of the process; 0 elsewhere.
fn memory_kb(name: &str) -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(name));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}

/// Numbers without order (Marsaglia's xorshift).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() >> 11) as usize % end.max(1)
    }

    /// Some changes of a kind each: bytes, numbers, cuts, repeated and moved pieces.
    fn mutated(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        for _ in 0..=self.below(6) {
            if bytes.is_empty() {
                break;
            }
            let at = self.below(bytes.len());
            let end = at + self.below(64.min(bytes.len() - at)) + 1;
            match self.below(8) {
                0 => bytes[at] ^= 1 << self.below(8),
                1 => bytes[at] = self.next() as u8,
                2 => {
                    let number = [0, 1, u64::MAX, 1 << 31, 1 << 40, self.next()][self.below(6)].to_le_bytes();
                    bytes.iter_mut().skip(at).zip(number).for_each(|(to, from)| *to = from);
                }
                3 => bytes.truncate(at),
                4 => drop(bytes.drain(at..end)),
                5 => {
                    let piece = bytes[at..end].to_vec();
                    let to = self.below(bytes.len());
                    bytes.splice(to..to, piece);
                }
                6 => bytes[at..end].fill(0),
                _ => bytes[at..end].reverse(),
            }
        }
        bytes
    }
}

fn mutate(files: u64) {
    let folder = tempfile::tempdir().unwrap();
    for (number, path) in all_assets().iter().enumerate() {
        let (bytes, mut random) = (fs::read(path).unwrap(), Random(0x9E37_79B9_7F4A_7C15 + number as u64));
        let mutated = folder.path().join(path.file_name().unwrap());
        for _ in 0..files {
            let bytes = random.mutated(&bytes);
            fs::write(&mutated, &bytes).unwrap();
            check(&mutated, bytes.len());
        }
    }
}

#[test]
fn mutated_files_do_no_harm() {
    mutate(FILES);
}

/// At least 10 000 of each format.
#[test]
#[ignore = "takes minutes"]
fn many_mutated_files_do_no_harm() {
    mutate(2500);
}
