//! A recording in memory, and ways to write and read one.

use std::path::{Path, PathBuf};

use runout_core::{
    Error, Result,
    marker::Marker,
    measurement::{Block, Capture, MemoryStream, Recording, SampleStream, StationKey, StationTruth},
    pipeline::{Context, StageConfig},
    rig::{Rig, RigConfig, Rotation, SensorConfig, SetupConfig},
    stage::{Request, Source},
};
use runout_hdf5::{Hdf5Config, WriteOptions, write_measurement};

pub(crate) const TURN: usize = 50;

/// Two sensors, the second of them turned round, and two setups.
pub(crate) fn rig() -> Rig {
    let sensor = |id: &str, sign| SensorConfig {
        id: id.into(),
        angle_deg: 0.0,
        z_mm: 0.0,
        section: id.into(),
        sign,
        ..SensorConfig::default()
    };
    let setup = |id: &str| SetupConfig { id: id.into(), ..SetupConfig::default() };
    let config = RigConfig {
        interruptions: Vec::new(),
        bearings: Vec::new(),
        part_radius_mm: 30.0,
        rotation: Rotation::Ccw,
        sensors: vec![sensor("S1", 1), sensor("S2", -1)],
        setups: vec![setup("initial"), setup("reversed")],
    };
    config.check().unwrap()
}

/// Numbers between −1 and 1 without a pattern (the multiplicative generator of Park and Miller, 1988).
pub(crate) fn noise(seed: u64) -> impl Iterator<Item = f64> {
    let mut state = seed % 2_147_483_646 + 1;
    std::iter::repeat_with(move || {
        state = state * 16_807 % 2_147_483_647;
        state as f64 / 1_073_741_823.5 - 1.0
    })
}

pub(crate) struct Memory {
    pub stations: Vec<StationKey>,
    /// `[station][setup]`.
    pub captures: Vec<Vec<MemoryStream>>,
    pub truth: Option<StationTruth>,
}

impl Memory {
    pub(crate) fn new(rig: &Rig, stations: &[(&str, f64)], samples: usize, encoder: bool) -> Self {
        let stations: Vec<StationKey> =
            stations.iter().map(|(name, z_mm)| StationKey { name: (*name).into(), z_mm: *z_mm }).collect();
        let captures = stations
            .iter()
            .enumerate()
            .map(|(index, key)| {
                let capture = |setup: usize| {
                    let seed = (10 * index + setup) as u64;
                    let turns: Vec<f64> = (0..samples).map(|sample| (sample as f64 + 0.25) / TURN as f64).collect();
                    MemoryStream {
                        capture: Capture {
                            object: "memory".into(),
                            setup,
                            station: key.name.clone(),
                            z_mm: key.z_mm,
                            stated_speed_rpm: Some(60.0),
                            sample_rate_hz: Some(TURN as f64),
                            samples: samples as u64,
                            sensors: vec![0, 1],
                            sensor_ids: vec!["S1".into(), "S2".into()],
                            converter_limits_um: None,
                            marks: (1..=samples / TURN).map(|turn| (turn * TURN) as f64 - 0.25).collect(),
                            marks_within_samples: 0.0,
                            encoder,
                            trimmed: Vec::new(),
                            responses: Vec::new(),
                        },
                        samples: noise(seed).map(|value| 12.5 * value).take(2 * samples).collect(),
                        angle_rev: if encoder { turns } else { Vec::new() },
                        block_samples: 1000,
                        next: 0,
                    }
                };
                (0..rig.setups.len()).map(capture).collect()
            })
            .collect();
        Self { stations, captures, truth: None }
    }
}

impl Recording for Memory {
    fn stations(&self) -> &[StationKey] {
        &self.stations
    }

    fn open(&self, station: usize, setup: usize) -> Result<Box<dyn SampleStream + '_>> {
        Ok(Box::new(self.captures[station][setup].clone()))
    }

    fn inputs(&self) -> Vec<PathBuf> {
        Vec::new()
    }

    fn truth(&self, _station: usize) -> Result<Option<StationTruth>> {
        Ok(self.truth.clone())
    }
}

pub(crate) fn write(recording: &Memory, rig: &Rig, path: &Path, options: &WriteOptions) -> Result<PathBuf> {
    write_measurement(recording, rig, path, options, &mut |_| {})
}

pub(crate) fn load(path: &Path, rig: &Rig) -> Result<Box<dyn Recording>> {
    load_marked(path, rig, None)
}

/// Loads a file; `marker` says how its mark is an analogue trace.
pub(crate) fn load_marked(path: &Path, rig: &Rig, marker: Option<Marker>) -> Result<Box<dyn Recording>> {
    load_as(rig, Hdf5Config { path: path.to_owned(), marker, follow_links: false })
}

/// Loads a file with these settings.
pub(crate) fn load_as(rig: &Rig, config: Hdf5Config) -> Result<Box<dyn Recording>> {
    let context = Context { folder: Path::new(""), rig: Some(rig) };
    let loader = config.check(&context).unwrap();
    match loader.open(&Request { rig: Some(rig), columns: &[] })? {
        Source::Turns(recording) => Ok(recording),
        Source::Points(_) => Err(Error::new("load", "a measurement", "it gave points")),
    }
}

/// A capture read to its end.
pub(crate) struct Read {
    pub capture: Capture,
    pub samples: Vec<f64>,
    pub angle_rev: Vec<f64>,
    pub blocks: usize,
}

pub(crate) fn read(recording: &dyn Recording, station: usize, setup: usize) -> Result<Read> {
    let mut stream = recording.open(station, setup)?;
    let capture = stream.capture().clone();
    let mut read = Read { capture, samples: Vec::new(), angle_rev: Vec::new(), blocks: 0 };
    let mut block = Block::default();
    while stream.next_block(&mut block)? {
        assert_eq!(block.start as usize * read.capture.channels(), read.samples.len(), "blocks follow each other");
        read.samples.extend_from_slice(&block.samples);
        read.angle_rev.extend_from_slice(&block.angle_rev);
        read.blocks += 1;
    }
    assert!(block.samples.is_empty(), "at the end the block is empty");
    Ok(read)
}

/// The message of what has to fail.
pub(crate) fn message<T>(result: Result<T>) -> String {
    result.err().map(|error| error.to_string()).unwrap_or_default()
}
