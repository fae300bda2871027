//! Mutated files: no panic, no hang, no memory without bound; of the formats, of what is inspected, and of the recording that is made of
//! the channels.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Mutex,
    time::{Duration, Instant},
};

use runout_channels::{ChannelFile, ChannelsConfig, FORMATS, MarkConfig, Suggestion, format_of, inspect};
use runout_core::{
    input_file::InputFile,
    measurement::Block,
    pipeline::{Context, StageConfig},
    rig::{RigConfig, SensorConfig, SetupConfig},
    stage::{Request, Source},
};

use crate::support::{all_assets, campaign, opened, written};

/// Longer is a hang.
const LONGEST: Duration = Duration::from_secs(5);
/// Memory that is allowed beyond four times the file.
const ALLOWANCE_KB: u64 = 100_000;
/// Samples of a channel that are read.
const MOST_READ: usize = 1 << 18;
/// Files of each format in a usual run, and in a long one.
const FILES: usize = 400;
const MANY: usize = 10_000;
/// Sensors that a recording is made of, at most.
const SENSORS: usize = 4;

/// One file at a time: the memory is that of the process.
static ALONE: Mutex<()> = Mutex::new(());

/// What a file took.
#[derive(Debug, Default)]
pub(crate) struct Taken {
    is_read: bool,
    time: Duration,
    /// Memory beyond what the process had.
    kb: u64,
}

/// Opens a file and reads from each of its channels, within bounds of time and memory.
pub(crate) fn check(path: &Path, bytes: usize) -> Taken {
    let _alone = ALONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let (begun, before_kb) = (Instant::now(), memory_kb("VmRSS:"));
    if memory_kb("VmHWM:") > before_kb + ALLOWANCE_KB / 4 {
        // Linux forgets the largest memory so far.
        let _ = fs::write("/proc/self/clear_refs", "5");
    }
    let file = opened(path);
    let is_read = file.is_ok();
    if let Ok(file) = file {
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
    if let Ok(Some(report)) = inspect(path) {
        record(path, report.suggestion);
    }
    let taken_kb = memory_kb("VmHWM:").saturating_sub(before_kb);
    let time = begun.elapsed();
    assert!(time < LONGEST, "{}: {time:?}", path.display());
    let most_kb = ALLOWANCE_KB + 4 * bytes as u64 / 1000;
    assert!(taken_kb < most_kb, "{}: {taken_kb} kB of memory for {bytes} bytes", path.display());
    Taken { is_read, time, kb: taken_kb }
}

/// Opens the recording that is suggested for a file, and reads from its setups.
fn record(path: &Path, mut suggestion: Suggestion) {
    suggestion.channels.truncate(SENSORS);
    let sensor =
        |[id, _]: &[String; 2]| SensorConfig { id: id.clone(), section: id.clone(), ..SensorConfig::default() };
    let setup = |id: &str| SetupConfig { id: id.to_owned(), ..SetupConfig::default() };
    let setups: Vec<SetupConfig> = suggestion.setups.iter().map(|[id, _]| setup(id)).collect();
    let rig = RigConfig {
        interruptions: Vec::new(),
        bearings: Vec::new(),
        part_radius_mm: 30.0,
        rotation: <_>::default(),
        sensors: suggestion.channels.iter().map(sensor).collect(),
        setups: if setups.is_empty() { vec![setup("only")] } else { setups },
    };
    let Ok(rig) = rig.check() else { return };
    let mut table: toml::Table = suggestion.to_string().parse().unwrap();
    let mut load = table.remove("load").unwrap();
    load.as_table_mut().unwrap().remove("plugin");
    let mut config: ChannelsConfig = load.try_into().unwrap();
    if config.angle.is_none() && config.marker.is_none() {
        let mark = suggestion.channels.first().map(|[_, channel]| channel.clone()).unwrap_or_default();
        config.marker = Some(MarkConfig { channel: mark, threshold: None, hysteresis: None, edge: <_>::default() });
    }
    let folder = path.parent().unwrap();
    let Ok(loader) = config.check(&Context { folder, rig: Some(&rig) }) else { return };
    let Ok(Source::Turns(recording)) = loader.open(&Request { rig: Some(&rig), columns: &[] }) else { return };
    for setup in 0..rig.setups.len() {
        let Ok(mut stream) = recording.open(0, setup) else { continue };
        let (mut block, mut read) = (Block::default(), 0);
        while read < MOST_READ && stream.next_block(&mut block).is_ok_and(|is_more| is_more) {
            read += block.samples.len();
        }
    }
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

/// So many files of a format, made of its assets in turns, and what they took. `RUNOUT_SEED` makes others.
#[allow(clippy::print_stderr, reason = "it measures")]
fn mutate(format: &str, files: usize) {
    let seed: u64 = std::env::var("RUNOUT_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(1);
    let is_of_it = |path: &PathBuf| format_of(&InputFile::new(path).unwrap(), None).unwrap().name == format;
    let folder = tempfile::tempdir().unwrap();
    let assets = all_assets().into_iter().chain(campaign()).filter(is_of_it);
    let assets: Vec<(PathBuf, Vec<u8>)> =
        assets.map(|path| (folder.path().join(path.file_name().unwrap()), fs::read(path).unwrap())).collect();
    let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
    let (mut read, mut longest, mut most_kb) = (0, Duration::ZERO, 0);
    for (place, bytes) in assets.iter().cycle().take(files) {
        let bytes = random.mutated(bytes);
        written(place, &bytes);
        let taken = check(place, bytes.len());
        read += usize::from(taken.is_read);
        (longest, most_kb) = (longest.max(taken.time), most_kb.max(taken.kb));
    }
    let size_kb = assets.iter().map(|(_, bytes)| bytes.len()).max().unwrap_or(0) / 1000;
    eprintln!(
        "| {format} | {files} | {read} | {} | {:.3} s | {most_kb} kB | {size_kb} kB |",
        files - read,
        longest.as_secs_f64()
    );
}

/// The reference to a text of variable length in HDF5 states its length, which the library takes memory for before it examines the text.
#[test]
fn a_text_that_is_said_to_be_longer_than_its_file_is_left_out_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.h5");
    let whole = fs::read(crate::support::assets().join("datasets.h5")).unwrap();
    let texts = |bytes: &[u8]| {
        written(&path, bytes);
        let units = |file: &dyn ChannelFile| file.channels().iter().filter(|channel| channel.unit.is_some()).count();
        opened(&path).ok().map(|file| units(&*file))
    };
    let all = texts(&whole).unwrap();
    let heap = whole.windows(4).position(|bytes| bytes == b"GCOL").unwrap() as u64;
    let references = (4..whole.len() - 12).filter(|at| whole[*at..*at + 8] == heap.to_le_bytes());
    let mut lost = 0;
    for at in references {
        let mut bytes = whole.clone();
        bytes[at - 1] = 0x7f;
        let taken = check(&path, bytes.len());
        lost += usize::from(texts(&bytes).is_some_and(|found| found < all));
        // 2 GB are cleared in more than this.
        assert!(taken.time < Duration::from_millis(300), "at {at}: {:?}", taken.time);
    }
    assert!(lost > 0, "no reference was found");
}

#[test]
fn mutated_files_do_no_harm() {
    FORMATS.iter().for_each(|format| mutate(format.name, FILES));
}

/// A test of many files a format, so that each says what it found.
macro_rules! many {
    ($($name:ident: $format:literal),*) => {
        $(
            #[test]
            #[ignore = "takes a minute"]
            fn $name() {
                mutate($format, MANY);
            }
        )*

        #[test]
        fn every_format_has_many_mutated_files() {
            assert_eq!(FORMATS.map(|format| format.name), [$($format),*]);
        }
    };
}
many! {
    many_of_tdms: "tdms",
    many_of_mat: "mat",
    many_of_hdf5: "hdf5",
    many_of_npy: "npy",
    many_of_npz: "npz",
    many_of_parquet: "parquet",
    many_of_arrow: "arrow",
    many_of_uff: "uff",
    many_of_wav: "wav",
    many_of_text: "text"
}
