#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod campaign;
mod channels;
mod effects;
mod faults;
mod profiles;
mod strangers;

use std::f64::consts::TAU;

use runout_core::{
    measurement::{Block, Recording},
    rig::{RigConfig, Rotation, SensorConfig, SetupConfig},
};

use super::*;

/// Samples a turn in these tests: angles at samples are then exact.
const TURN: usize = 128;

fn sensor(id: &str, angle_deg: f64, z_mm: f64, section: &str) -> SensorConfig {
    SensorConfig { id: id.into(), angle_deg, z_mm, section: section.into(), ..SensorConfig::default() }
}

fn setup(id: &str, part_deg: f64, sensors_deg: f64) -> SetupConfig {
    SetupConfig { id: id.into(), part_deg, sensors_deg, ..SetupConfig::default() }
}

/// Two sensors in each of two sections, part turned between two setups.
fn rig() -> RigConfig {
    RigConfig {
        interruptions: Vec::new(),
        bearings: Vec::new(),
        part_radius_mm: 30.0,
        rotation: Rotation::Ccw,
        sensors: vec![
            sensor("S1", 0.0, 200.0, "a"),
            sensor("S2", 90.0, 200.0, "a"),
            sensor("S3", 0.0, 230.0, "b"),
            sensor("S4", 90.0, 230.0, "b"),
        ],
        setups: vec![setup("initial", 0.0, 0.0), setup("turned", 99.844, 0.0)],
    }
}

/// Linear equations, a few turns, the first mark at the first sample: expectations can be written down.
fn plain() -> SpindleConfig {
    let mut config = SpindleConfig::new(rig());
    config.geometry = Geometry::Linear;
    config.recording.revolutions = 4;
    config.recording.samples_per_rev = TURN;
    config.recording.margin_samples = 0;
    config
}

/// As in the reference campaigns: 0.05 µm noise, 0.15 µm asynchronous, form 4 µm, motion 1.5 µm, eccentricity 8 µm.
fn reference() -> SpindleConfig {
    let mut config = SpindleConfig::new(rig());
    config.seed = 11;
    config.rig.setups = vec![setup("i", 0.0, 0.0), setup("ii", 99.844, 0.0), setup("iii", 202.5, 0.0)];
    config.recording.stations = StationsConfig { first_z_mm: 0.0, step_mm: 10.0, count: 4 };
    config.form.rms_um = 4.0;
    config.motion = MotionConfig { x_rms_um: 1.5, y_rms_um: 1.5, tilt_rms_urad: 2.0, ..MotionConfig::default() };
    config.eccentricity = EccentricityConfig { offset_um: 8.0, tilt_urad: 10.0 };
    config.asynchronous.rms_um = Some(0.15);
    config.noise.rms_um = 0.05;
    config
}

/// Every block of one capture, joined: readings by channel, and the encoder's angles.
fn read(recording: &SpindleRecording, station: usize, setup: usize) -> (Vec<Vec<f64>>, Vec<f64>) {
    let mut stream = recording.open(station, setup).unwrap();
    let channels = stream.capture().channels();
    let mut readings = vec![Vec::new(); channels];
    let mut angles = Vec::new();
    let mut block = Block::default();
    while stream.next_block(&mut block).unwrap() {
        assert_eq!(block.start, readings[0].len() as u64);
        for row in block.samples.chunks(channels) {
            readings.iter_mut().zip(row).for_each(|(channel, value)| channel.push(*value));
        }
        angles.extend_from_slice(&block.angle_rev);
    }
    assert_eq!(readings[0].len() as u64, stream.capture().samples);
    (readings, angles)
}

fn readings(config: &SpindleConfig, station: usize, setup: usize) -> Vec<Vec<f64>> {
    read(&simulator(config).unwrap().spindle_recording(), station, setup).0
}

/// Largest difference to a formula of the sample's spindle angle in rad.
fn largest_difference(channel: &[f64], expected: impl Fn(f64) -> f64) -> f64 {
    let differences = channel.iter().enumerate().map(|(sample, value)| {
        let phi = TAU * (sample as f64 / TURN as f64);
        (value - expected(phi)).abs()
    });
    differences.fold(0.0, f64::max)
}

fn rms(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = values.clone().count() as f64;
    (values.map(|value| value * value).sum::<f64>() / count).sqrt()
}
