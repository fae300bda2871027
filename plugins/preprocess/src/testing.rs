//! Captures in memory, for tests.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use std::path::Path;

use runout_core::{
    Result,
    measurement::{Block, Capture, Defect, MemoryStream, SampleStream},
    pipeline::{Context, StageConfig},
    stage::{Averager, Conditioner, Preprocessor},
};

pub(crate) const RATE_HZ: f64 = 20_000.0;

/// A capture of these channels, `[channel][sample]`, with these marks, in one block.
pub(crate) fn stream(channels: &[Vec<f64>], marks: Vec<f64>) -> MemoryStream {
    let frames = channels[0].len();
    let capture = Capture {
        object: "test.h5:/initial/s01".into(),
        setup: 0,
        station: "s01".into(),
        z_mm: 0.0,
        stated_speed_rpm: None,
        sample_rate_hz: Some(RATE_HZ),
        samples: frames as u64,
        sensors: (0..channels.len()).collect(),
        sensor_ids: (1..=channels.len()).map(|number| format!("S{number}")).collect(),
        converter_limits_um: None,
        marks,
        marks_within_samples: 0.0,
        encoder: false,
        trimmed: Vec::new(),
        responses: Vec::new(),
    };
    let samples = (0..frames).flat_map(|frame| channels.iter().map(move |channel| channel[frame])).collect();
    MemoryStream { capture, samples, angle_rev: Vec::new(), block_samples: usize::MAX, next: 0 }
}

/// Equally spaced marks.
pub(crate) fn marks(first: f64, length: f64, count: usize) -> Vec<f64> {
    (0..count).map(|mark| first + length * mark as f64).collect()
}

pub(crate) fn conditioner<C: StageConfig<Stage = Preprocessor>>(config: C) -> Box<dyn Conditioner> {
    match config.check(&Context { folder: Path::new(""), rig: None }).unwrap() {
        Preprocessor::Conditioner(conditioner) => conditioner,
        _ => panic!("no conditioner"),
    }
}

pub(crate) fn averager<C: StageConfig<Stage = Preprocessor>>(config: C) -> Box<dyn Averager> {
    match config.check(&Context { folder: Path::new(""), rig: None }).unwrap() {
        Preprocessor::Averager(averager) => averager,
        _ => panic!("no averager"),
    }
}

/// Everything that a stream gives: samples, angles, defects. Blocks must follow each other.
pub(crate) fn read(mut stream: Box<dyn SampleStream + '_>) -> Result<(Vec<f64>, Vec<f64>, Vec<Defect>)> {
    let channels = stream.capture().channels();
    let (mut samples, mut angles, mut defects, mut block) = (Vec::new(), Vec::new(), Vec::new(), Block::default());
    while stream.next_block(&mut block)? {
        assert_eq!(block.start as usize * channels, samples.len());
        assert!(block.defects.iter().all(|defect| defect.samples.end > block.start));
        samples.extend_from_slice(&block.samples);
        angles.extend_from_slice(&block.angle_rev);
        defects.append(&mut block.defects);
    }
    Ok((samples, angles, defects))
}

/// Numbers without pattern, −1 to 1.
pub(crate) fn scatter(seed: u64) -> impl FnMut() -> f64 {
    use rand::{RngExt, SeedableRng};
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    move || random.random_range(-1.0..1.0)
}
