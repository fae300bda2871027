#![allow(clippy::unwrap_used, reason = "tests")]

use std::f64::consts::TAU;

use runout_core::measurement::DefectKind;
use sci_rs::signal::filter::{design::Sos, sosfiltfilt_dyn};

use super::*;
use crate::testing::{RATE_HZ, conditioner, marks, read, scatter, stream};

fn low_pass(cutoff_hz: f64, order: usize) -> Box<dyn Conditioner> {
    conditioner(LowPassConfig { cutoff_hz, order })
}

/// Noise about a level and a slope, which determine how the ends are continued.
fn rough(frames: usize, channels: usize) -> Vec<Vec<f64>> {
    let mut scatter = scatter(1);
    let channel = |index: usize| {
        let mut channel = Vec::with_capacity(frames);
        channel.extend((0..frames).map(|frame| 50.0 + index as f64 + 0.001 * frame as f64 + scatter()));
        channel
    };
    (0..channels).map(channel).collect()
}

fn worst(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    found.iter().zip(expected).map(|(found, expected)| (found - expected).abs()).fold(0.0, f64::max)
}

#[test]
fn ends_and_middle_agree_with_an_independent_sosfiltfilt() {
    for order in 1..=8 {
        let channels = rough(3000, 3);
        let filter = low_pass(500.0, order);
        let (found, _, _) = read(filter.attach(Box::new(stream(&channels, Vec::new()))).unwrap()).unwrap();
        let sections: Vec<Sos<f64>> = sections(order, 500.0, RATE_HZ)
            .iter()
            .map(|section| Sos::new(section.b, [1.0, section.a[0], section.a[1]]))
            .collect();
        for (index, channel) in channels.iter().enumerate() {
            let expected: Vec<f64> = sosfiltfilt_dyn(channel.iter(), &sections);
            let found: Vec<f64> = found.iter().skip(index).step_by(3).copied().collect();
            // 1e-9 of readings near 50: rounding through sections whose poles are 0.1 from the unit circle.
            assert!(worst(&found, &expected) < 50e-9, "order {order}: {:e}", worst(&found, &expected));
        }
    }
}

#[test]
fn pieces_are_the_whole() {
    // The lookahead at 500 Hz is about 700 samples and at 4000 Hz less than 100; pieces are 4096 and more.
    for (cutoff_hz, channels) in [(500.0, 1), (4000.0, 4), (500.0, 11)] {
        let filter = low_pass(cutoff_hz, 4);
        let data = rough(60_000, channels);
        let reference = {
            let sections = sections(4, cutoff_hz, RATE_HZ);
            let (mut whole, mut cascade) = (Vec::new(), Cascade::new(&sections, channels));
            let frames = stream(&data, Vec::new()).samples;
            let kept = 16 * channels;
            reflect(&frames[..kept], channels, End::First, &mut whole);
            whole.extend_from_slice(&frames);
            reflect(&frames[frames.len() - kept..], channels, End::Last, &mut whole);
            cascade.settle(&whole[..channels]);
            cascade.run(&mut whole, Direction::Forward);
            cascade.settle(&whole[whole.len() - channels..]);
            cascade.run(&mut whole, Direction::Backward);
            whole[15 * channels..whole.len() - 15 * channels].to_vec()
        };
        for block_samples in [1, 1000, 17_000, usize::MAX] {
            let mut input = stream(&data, Vec::new());
            input.block_samples = block_samples;
            input.angle_rev = (0..60_000).map(|sample| f64::from(sample) / 1000.0).collect();
            let angles = input.angle_rev.clone();
            let (found, found_angles, _) = read(filter.attach(Box::new(input)).unwrap()).unwrap();
            // 1e-12 of readings up to 121.
            assert!(worst(&found, &reference) < 1e-10, "{block_samples}: {:e}", worst(&found, &reference));
            assert_eq!(found_angles, angles);
        }
    }
}

#[test]
fn amplitude_and_phase_are_those_of_two_passes() {
    let frequency_hz = 400.0;
    let channel = (0..20_000).map(|frame| (TAU * frequency_hz * f64::from(frame) / RATE_HZ).cos()).collect();
    let filter = low_pass(500.0, 4);
    let output = filter.attach(Box::new(stream(&[channel], Vec::new()))).unwrap();
    let response = output.capture().responses[0].clone();
    assert_eq!(response.description, "low-pass, zero-phase Butterworth, order 4 at 500 Hz twice, −3 dB at 448 Hz");
    let (found, _, _) = read(output).unwrap();
    // |H|² of one pass, with the frequencies prewarped, is what two passes do to an amplitude.
    let warped = |hz: f64| (0.5 * TAU * hz / RATE_HZ).tan();
    let gain = 1.0 / (1.0 + (warped(frequency_hz) / warped(500.0)).powi(8));
    for (frame, value) in found.iter().enumerate().skip(9000).take(2000) {
        let expected = gain * (TAU * frequency_hz * frame as f64 / RATE_HZ).cos();
        assert!((value - expected).abs() < 1e-12, "{frame}: {value} {expected}");
    }
}

/// Samples with one bad place.
struct Marred(runout_core::measurement::MemoryStream, u64);

impl SampleStream for Marred {
    fn capture(&self) -> &Capture {
        self.0.capture()
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        let more = self.0.next_block(block)?;
        if (block.start..block.start + block.samples.len() as u64).contains(&self.1) {
            block.defects.push(Defect { samples: self.1..self.1 + 1, channel: 0, kind: DefectKind::NotFinite });
        }
        Ok(more)
    }
}

#[test]
fn what_a_bad_sample_reaches_is_bad() {
    let place = 40_000;
    let mut data = rough(80_000, 1);
    let filter = low_pass(500.0, 4);
    let (good, _, _) = read(filter.attach(Box::new(stream(&data, Vec::new()))).unwrap()).unwrap();
    data[0][place] += 1.0;
    let mut input = stream(&data, Vec::new());
    input.block_samples = 777;
    let (marred, _, defects) = read(filter.attach(Box::new(Marred(input, place as u64))).unwrap()).unwrap();
    assert_eq!(defects.len(), 1);
    let range = defects[0].samples.start as usize..defects[0].samples.end as usize;
    assert!(range.contains(&place) && range.len() < 1000, "{range:?}");
    let reached = |frame: &usize| (good[*frame] - marred[*frame]).abs() > 1e-6;
    assert!((0..range.start).chain(range.end..80_000).all(|frame| !reached(&frame)));
}

#[test]
fn what_cannot_be_filtered_is_refused_with_the_reason() {
    let refused = |cutoff_hz, input: runout_core::measurement::MemoryStream| {
        let filter = low_pass(cutoff_hz, 4);
        filter.attach(Box::new(input)).and_then(read).unwrap_err().to_string()
    };
    let data = rough(100, 1);
    let input = || stream(&data, marks(0.0, 10.0, 5));
    assert!(refused(10_000.0, input()).contains("not below half of the sampling rate, 20000 Hz"));
    assert!(refused(0.1, input()).contains("too far below"));
    let mut unstated = input();
    unstated.capture.sample_rate_hz = None;
    assert!(refused(500.0, unstated).contains("states no sampling rate"));
    assert!(refused(500.0, stream(&rough(15, 1), Vec::new())).contains("15 samples, the filter needs more than 15"));
}
