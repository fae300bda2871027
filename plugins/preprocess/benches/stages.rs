//! The stages between a recording and its profile, each on one capture of 4 channels, 120 turns of about 2560 samples.
#![allow(clippy::unwrap_used, clippy::panic, missing_docs, reason = "a benchmark")]

use std::{f64::consts::TAU, path::Path, sync::LazyLock};

use divan::{Bencher, black_box, counter::ItemsCount};
use runout_core::{
    inspection::Inspection,
    measurement::{Block, Capture, MemoryStream, SampleStream},
    pipeline::{Context, StageConfig},
    stage::{Averager, Conditioner, Preprocessor},
};
use runout_preprocess::{LowPassConfig, SynchronousAverageConfig};

const CHANNELS: usize = 4;
const TURNS: usize = 120;
/// No whole number, so that every value is interpolated.
const TURN_SAMPLES: f64 = 2560.3;

static RECORD: LazyLock<MemoryStream> = LazyLock::new(|| {
    let samples = (TURNS as f64 * TURN_SAMPLES) as usize + 2;
    // A few waves, and noise from Knuth's multiplicative hash.
    let reading = |sample: usize, channel: usize| {
        let angle = TAU * sample as f64 / TURN_SAMPLES + channel as f64;
        let noise = ((sample * CHANNELS + channel) as u32).wrapping_mul(2_654_435_761);
        3.0 * (2.0 * angle).cos() + 0.4 * (7.0 * angle).sin() + 0.1 * f64::from(noise) / f64::from(u32::MAX)
    };
    MemoryStream {
        capture: Capture {
            object: "bench".into(),
            setup: 0,
            station: "s00".into(),
            z_mm: 0.0,
            stated_speed_rpm: None,
            sample_rate_hz: Some(25_600.0),
            samples: samples as u64,
            sensors: (0..CHANNELS).collect(),
            sensor_ids: (0..CHANNELS).map(|channel| format!("S{channel}")).collect(),
            converter_limits_um: None,
            marks: (0..=TURNS).map(|turn| turn as f64 * TURN_SAMPLES).collect(),
            marks_within_samples: 0.0,
            encoder: false,
            trimmed: Vec::new(),
            responses: Vec::new(),
        },
        samples: (0..samples).flat_map(|sample| (0..CHANNELS).map(move |channel| reading(sample, channel))).collect(),
        angle_rev: Vec::new(),
        block_samples: 8192,
        next: 0,
    }
});

fn check<C: StageConfig<Stage = Preprocessor>>(config: C) -> Preprocessor {
    config.check(&Context { folder: Path::new(""), rig: None }).unwrap()
}

fn low_pass_stage() -> Box<dyn Conditioner> {
    match check(LowPassConfig { cutoff_hz: 5000.0, order: 4 }) {
        Preprocessor::Conditioner(conditioner) => conditioner,
        _ => panic!("an averager"),
    }
}

fn average_stage() -> Box<dyn Averager> {
    let config = SynchronousAverageConfig {
        samples_per_rev: 2560,
        min_turns: 5,
        turn_tolerance_percent: 5.0,
        outlier_sigma: None,
        speed_tolerance_percent: 2.0,
    };
    match check(config) {
        Preprocessor::Averager(averager) => averager,
        _ => panic!("a conditioner"),
    }
}

fn drain(mut stream: Box<dyn SampleStream + '_>) {
    let mut block = Block::default();
    while stream.next_block(&mut block).unwrap() {
        black_box(&block.samples);
    }
}

/// Benches what is done with the record; copying it for the next time is outside the clock.
fn bench(bencher: Bencher, work: impl Fn(Box<dyn SampleStream>) + Sync) {
    let values = ItemsCount::new(RECORD.samples.len());
    bencher.counter(values).with_inputs(|| Box::new(RECORD.clone())).bench_local_values(|record| work(record));
}

#[divan::bench]
fn blocks_alone(bencher: Bencher) {
    bench(bencher, |record| drain(record));
}

#[divan::bench]
fn inspection(bencher: Bencher) {
    bench(bencher, |record| drain(Box::new(Inspection::new(record))));
}

#[divan::bench]
fn zero_phase_low_pass(bencher: Bencher) {
    let stage = low_pass_stage();
    bench(bencher, |record| drain(stage.attach(record).unwrap()));
}

#[divan::bench]
fn resample_and_average(bencher: Bencher) {
    let stage = average_stage();
    bench(bencher, |record| drop(black_box(stage.average(record).unwrap())));
}

#[divan::bench]
fn from_samples_to_profile(bencher: Bencher) {
    let (filter, average) = (low_pass_stage(), average_stage());
    bench(bencher, |record| {
        let stream = filter.attach(Box::new(Inspection::new(record))).unwrap();
        drop(black_box(average.average(stream).unwrap()));
    });
}

fn main() {
    divan::main();
}
