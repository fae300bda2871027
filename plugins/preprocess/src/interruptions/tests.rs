#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use std::path::Path;

use runout_core::{
    measurement::{DefectKind, MemoryStream},
    numerics::fourier::Fourier,
    pipeline::{Context, StageConfig},
    profile::Profile,
    rig::{RigConfig, Rotation, SensorConfig, SetupConfig},
    stage::Preprocessor,
};

use super::*;
use crate::{LowPassConfig, SynchronousAverageConfig, testing};

/// A keyway from 352° to 4° of the part, as sensors at 0° and 90° see it.
fn rig() -> Rig {
    let sensor = |id: &str, angle_deg: f64| SensorConfig {
        id: id.into(),
        angle_deg,
        section: "a".into(),
        sign: 1,
        ..SensorConfig::default()
    };
    let config = RigConfig {
        interruptions: Vec::new(),
        bearings: Vec::new(),
        part_radius_mm: 30.0,
        rotation: Rotation::Ccw,
        sensors: vec![sensor("S1", 0.0), sensor("S2", 90.0)],
        setups: vec![SetupConfig { id: "initial".into(), ..SetupConfig::default() }],
    };
    let mut gaps = Gaps::default();
    gaps.add(352_f64.to_radians(), 12_f64.to_radians());
    Rig { gaps: vec![gaps], ..config.check().unwrap() }
}

/// α = θ − Φ of each sensor, in degrees.
fn part_deg(sensor: usize, turns: f64) -> f64 {
    (90.0 * sensor as f64 - 360.0 * turns).rem_euclid(360.0)
}

/// 8 µm off centre, 2 µm of 7 lobes and 0.5 µm of 11.
fn form_um(part_deg: f64) -> f64 {
    let angle = part_deg.to_radians();
    8.0 * (angle - 1.0).cos() + 2.0 * (7.0 * angle).sin() + 0.5 * (11.0 * angle + 0.3).cos()
}

/// Turns of a length from a first mark, with a keyway of a depth, which is where the rig has it.
fn recorded(depth_um: f64, [first, length]: [f64; 2], turns: usize) -> MemoryStream {
    let marks = testing::marks(first, length, turns + 1);
    let frames = (first + length * turns as f64).ceil() as usize + 20;
    let reading = |sensor: usize, frame: usize| {
        let angle_deg = part_deg(sensor, (frame as f64 - first) / length);
        form_um(angle_deg) - if (4.0..352.0).contains(&angle_deg) { 0.0 } else { depth_um }
    };
    let channels: Vec<Vec<f64>> =
        (0..2).map(|sensor| (0..frames).map(|frame| reading(sensor, frame)).collect()).collect();
    testing::stream(&channels, marks)
}

fn average(input: impl SampleStream, rig: &Rig, cutoff_hz: Option<f64>) -> Profile {
    let context = Context { folder: Path::new(""), rig: Some(rig) };
    let config = SynchronousAverageConfig {
        samples_per_rev: 512,
        min_turns: 2,
        turn_tolerance_percent: 5.0,
        outlier_sigma: None,
        speed_tolerance_percent: 2.0,
    };
    let Preprocessor::Averager(averager) = config.check(&context).unwrap() else { panic!("no averager") };
    let low_pass = cutoff_hz.map(|cutoff_hz| LowPassConfig { cutoff_hz, order: 4 }.check(&context).unwrap());
    match &low_pass {
        Some(Preprocessor::Conditioner(low_pass)) => averager.average(low_pass.attach(Box::new(input)).unwrap()),
        _ => averager.average(Box::new(input)),
    }
    .unwrap()
}

/// Each sensor's mean turn.
fn turns(profile: &Profile, angles: usize) -> Vec<Vec<f64>> {
    let channel = |channel: usize| {
        let harmonics = profile.mean.iter().skip(channel).step_by(2).map(Complex64::conj);
        Fourier::new(angles).synthesise(harmonics).to_vec()
    };
    (0..2).map(channel).collect()
}

/// Marks on samples, marks between them with turns of whole samples, and turns of no whole number of samples.
#[test]
fn a_keyway_changes_nothing_beside_it() {
    let rig = rig();
    for (place, cutoff_hz) in [
        ([20.0, 512.0], None),
        ([20.4, 512.0], None),
        ([13.37, 512.6], None),
        ([13.37, 2561.3], None),
        ([13.37, 512.6], Some(4000.0)),
    ] {
        let [whole, grooved] = [0.0, 300.0].map(|depth_um| average(recorded(depth_um, place, 12), &rig, cutoff_hz));
        let apart = whole.mean.iter().zip(&grooved.mean).map(|(one, other)| (one - other).norm()).fold(0.0, f64::max);
        assert!(apart < 1e-9, "{place:?}: {apart}");
        // And what is beside it is the form, of which the bridge holds all orders, but for what a filter takes away.
        let mut gaps = rig.gaps[0].widened(grooved.bridged_beyond_rad);
        let guard = grooved.bridged_beyond_rad.to_degrees() * place[1] / 360.0;
        assert!((0.99..2.01).contains(&guard), "{guard} samples");
        if cutoff_hz.is_some() {
            gaps = gaps.widened(3_f64.to_radians());
        }
        let angles = 3600;
        let mut worst: f64 = 0.0;
        for (sensor, turn) in turns(&grooved, angles).iter().enumerate() {
            for (step, value) in turn.iter().enumerate() {
                let angle_deg = part_deg(sensor, step as f64 / angles as f64);
                if !gaps.hold(angle_deg.to_radians()) {
                    worst = worst.max((value - form_um(angle_deg)).abs());
                }
            }
        }
        println!("{place:?} {cutoff_hz:?}: {worst:.5} µm");
        // The raw bridge meets the readings beside it without a step, but not without a bend.
        assert!(worst < 0.02, "{place:?} {cutoff_hz:?}: {worst}");
    }
}

/// Every reading inside is bridged, none outside is touched, and blocks of any size give the same; by marks and by an
/// encoder.
#[test]
fn blocks_of_any_size_are_bridged_alike() {
    let rig = rig();
    for encoder in [false, true] {
        let make = |depth_um: f64, block_samples: usize| {
            let mut stream = recorded(depth_um, [13.37, 512.6], 6);
            let frames = stream.capture.samples as usize;
            stream.block_samples = block_samples;
            stream.capture.encoder = encoder;
            if encoder {
                stream.angle_rev = (0..frames).map(|frame| (frame as f64 - 13.37) / 512.6).collect();
            }
            stream
        };
        let through = |stream: MemoryStream| testing::read(bridged(Box::new(stream), Some(&rig))).unwrap();
        let (whole, angles, _) = through(make(300.0, usize::MAX));
        let given = make(0.0, 1);
        assert_eq!((whole.len(), angles.len()), (given.samples.len(), given.angle_rev.len()));
        for (index, (found, form)) in whole.iter().zip(&given.samples).enumerate() {
            let angle_deg = part_deg(index % 2, ((index / 2) as f64 - 13.37) / 512.6);
            let from_edge = (angle_deg - 358.0 + 540.0).rem_euclid(360.0) - 180.0;
            if from_edge.abs() > 6.0 + 360.0 / 512.6 {
                assert_eq!(found.to_bits(), form.to_bits(), "{angle_deg}°: {found}, not {form}");
            } else {
                assert!((found - form).abs() < 2.0, "{angle_deg}°: {found}, not {form}");
            }
        }
        for block_samples in [1, 7, 100, 1000] {
            let (found, found_angles, _) = through(make(300.0, block_samples));
            assert_eq!((found == whole, &found_angles), (true, &angles), "{block_samples}");
        }
    }
}

/// A stream with defects in its first block.
struct Broken(MemoryStream, Vec<Defect>);
impl SampleStream for Broken {
    fn capture(&self) -> &Capture {
        &self.0.capture
    }
    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        let more = self.0.next_block(block)?;
        block.defects = std::mem::take(&mut self.1);
        Ok(more)
    }
}

/// Readings that are no numbers, all in the keyway, cost no turn, also behind a low-pass.
#[test]
fn defects_inside_are_none() {
    let rig = rig();
    let stream = |inside: bool| {
        let mut stream = recorded(300.0, [13.37, 512.6], 12);
        // Sensor 0 sees the keyway about Φ = 2°; 30° is outside.
        let middle = 13 + 512 * 3 + if inside { 5 } else { 40 };
        let samples = middle as u64..middle as u64 + 3;
        samples.clone().for_each(|sample| stream.samples[2 * sample as usize] = f64::NAN);
        Broken(stream, vec![Defect { samples, channel: 0, kind: DefectKind::NotFinite }])
    };
    for cutoff_hz in [None, Some(4000.0)] {
        let found = average(stream(true), &rig, cutoff_hz);
        assert_eq!((found.turns.used, found.turns.rejected.len()), (12, 0), "{cutoff_hz:?}");
        assert!(found.mean.iter().all(|value| value.norm().is_finite()));
    }
    assert_eq!(average(stream(false), &rig, None).turns.rejected.len(), 1);
}

#[test]
fn a_whole_part_and_a_capture_without_marks_pass_unchanged() {
    let input = recorded(300.0, [13.37, 512.6], 6);
    let samples = input.samples.clone();
    let whole = Rig { gaps: vec![Gaps::default()], ..rig() };
    let unmarked = |mut stream: MemoryStream| {
        stream.capture.marks.clear();
        stream
    };
    for (rig, stream) in [(Some(&whole), input.clone()), (None, input.clone()), (Some(&rig()), unmarked(input))] {
        assert_eq!(testing::read(bridged(Box::new(stream), rig)).unwrap().0, samples);
    }
}
