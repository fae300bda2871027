//! Sensors of unlike rates and starts, from a simulator: sums of sines, and noise.

use std::f64::consts::TAU;

use runout_core::{
    inspection::Inspection,
    measurement::{Block, Capture, Recording, SampleStream},
    rig::Unit,
};

use crate::turns::{csv, opened, pulses, rig, turns_at};

/// Rates of the sensors, and how much later the slow one starts.
const FAST_HZ: f64 = 5000.0;
const SLOW_HZ: f64 = 1000.0;
const LATER_S: f64 = 0.000_3;
const DURATION_S: f64 = 4.0;
const LOAD: &str = "pattern = \"{channel}.csv\"\nchannel_path = \"v\"\n";
const MARK: &str = "marker = { channel = \"Index\" }";

fn file(rate_hz: f64, start_s: f64, value: &dyn Fn(f64) -> f64) -> String {
    csv(rate_hz, start_s, &[("v", value)], (DURATION_S * rate_hz) as usize)
}

/// Files of both sensors and of the mark at a third rate.
fn files(fast: &dyn Fn(f64) -> f64, slow: &dyn Fn(f64) -> f64) -> [(&'static str, String); 3] {
    let mark = pulses(1.0, 5.0);
    [
        ("S1.csv", file(FAST_HZ, 0.0, fast)),
        ("S2.csv", file(SLOW_HZ, LATER_S, slow)),
        ("Index.csv", file(20_000.0, 0.0, &mark)),
    ]
}

/// Capture and inspected blocks, joined.
fn read(recording: &dyn Recording) -> (Capture, Block) {
    let mut stream = Inspection::new(recording.open(0, 0).unwrap());
    let (mut all, mut block) = (Block::default(), Block::default());
    while stream.next_block(&mut block).unwrap() {
        all.samples.append(&mut block.samples);
        all.angle_rev.append(&mut block.angle_rev);
        all.defects.append(&mut block.defects);
    }
    (stream.capture().clone(), all)
}

/// Time of a sample: a mark is where the simulated angle is whole.
fn start_s(capture: &Capture) -> f64 {
    let start_s = LATER_S + 32.0 / SLOW_HZ;
    for mark in &capture.marks {
        let turns = turns_at(start_s + mark / SLOW_HZ);
        assert!((turns - turns.round()).abs() < 1e-4, "{turns}");
    }
    assert!(capture.marks.len() > 20, "{}", capture.marks.len());
    start_s
}

/// Amplitude of a line at a frequency.
fn amplitude(values: impl Iterator<Item = f64>, frequency_hz: f64) -> f64 {
    let (mut re, mut im, mut whole) = (0.0, 0.0, 0.0);
    let values: Vec<f64> = values.collect();
    for (index, value) in values.iter().enumerate() {
        // Hann's window.
        let weight = 0.5 - 0.5 * (TAU * (index as f64 + 0.5) / values.len() as f64).cos();
        let angle = TAU * frequency_hz * index as f64 / SLOW_HZ;
        re += weight * value * angle.cos();
        im += weight * value * angle.sin();
        whole += weight;
    }
    2.0 * re.hypot(im) / whole
}

#[test]
fn common_instants_have_what_both_sensors_read_there() {
    let common = |time_s: f64| {
        (TAU * 37.3 * time_s).sin() + 0.5 * (TAU * 181.0 * time_s).cos() + 0.2 * (TAU * 389.0 * time_s).sin() + 3.0
    };
    // The fast one reads lines that would appear at 299.5, 493 and 100 Hz in every fifth sample.
    let more =
        |time_s: f64| (TAU * 700.5 * time_s).sin() + (TAU * 507.0 * time_s).sin() + (TAU * 2100.0 * time_s).sin();
    let (_folder, recording) = opened(
        &files(&|time| common(time) + more(time), &common),
        &format!("{LOAD}{MARK}"),
        &rig(&["only"], Unit::Micrometre),
    )
    .unwrap();
    let (capture, block) = read(&*recording);
    let start_s = start_s(&capture);
    assert_eq!((capture.sample_rate_hz, block.defects.len()), (Some(SLOW_HZ), 0));
    // From 0.0003 s, where the slow one begins, to 3.9998 s, where the fast one ends, without 32 samples at both.
    assert_eq!(capture.samples, (DURATION_S * SLOW_HZ) as u64 - 64);
    for (sample, pair) in block.samples.chunks_exact(2).enumerate() {
        let known = common(start_s + sample as f64 / SLOW_HZ);
        // Three lines that pass to 10⁻⁵, and three of amplitude 1 that are stopped to 10⁻⁵; S2 has the sign −1.
        assert!((pair[0] - known).abs() < 6e-5, "fast, {sample}: {} for {known}", pair[0]);
        assert!((pair[1] + known).abs() < 3e-5, "slow, {sample}: {} for {known}", pair[1]);
    }
    let remark = &recording.remarks().join(" ");
    assert!(remark.contains("v 5000 Hz from 0 s") && remark.contains("nothing above 500 Hz"), "{remark}");
    assert!(capture.responses[0].description.contains("at 1000 Hz"), "{:?}", capture.responses);
}

#[test]
fn the_stated_response_is_that_of_the_samples() {
    for frequency_hz in [150.0, 380.0, 400.0, 441.3, 450.0, 470.0, 520.0] {
        let line = move |time_s: f64| (TAU * frequency_hz * time_s).sin();
        let (_folder, recording) =
            opened(&files(&line, &line), &format!("{LOAD}{MARK}"), &rig(&["only"], Unit::Micrometre)).unwrap();
        let (capture, block) = read(&*recording);
        let passed = amplitude(block.samples.iter().step_by(2).copied(), frequency_hz);
        let stated = capture.responses[0].amplitude(frequency_hz);
        let (off, at_half) = (0.08, (frequency_hz - 441.3).abs() < 0.1);
        assert!(
            (passed - stated).abs() < if at_half { 0.002 } else { off },
            "{frequency_hz} Hz: {passed}, stated {stated}"
        );
        assert!(frequency_hz > 400.0 || passed > 0.9999, "{frequency_hz} Hz: {passed}");
        assert!(frequency_hz < 500.0 || passed < 3e-5, "{frequency_hz} Hz: {passed}");
    }
}

/// Numbers of the variance 1 without order, the same for the same time.
fn noise(time_s: f64) -> f64 {
    let mut state = ((time_s * 1e6).round() as i64 as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mut part = || {
        state ^= state >> 30;
        state = state.wrapping_mul(0xBF58_476D_1CE4_E5B9) ^ 0x1234_5678;
        state ^= state >> 27;
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    (0..12).map(|_| part()).sum()
}

#[test]
fn noise_of_no_sensor_is_less_per_hertz() {
    let (_folder, recording) =
        opened(&files(&noise, &noise), &format!("{LOAD}{MARK}"), &rig(&["only"], Unit::Micrometre)).unwrap();
    let (capture, block) = read(&*recording);
    // A line's standard deviation from white noise σ of N samples is σ √(2/N), of the sensor's own samples.
    for (channel, own_hz) in [(0, FAST_HZ), (1, SLOW_HZ)] {
        let duration_s = capture.samples as f64 / SLOW_HZ;
        let bins = (0.39 * SLOW_HZ * duration_s) as usize;
        let power = |bin: usize| {
            let values = block.samples.iter().skip(channel).step_by(2).copied();
            amplitude(values, bin as f64 / duration_s).powi(2)
        };
        let mean = (20..bins).step_by(7).map(power).sum::<f64>() / (20..bins).step_by(7).count() as f64;
        // Mean square amplitude 4 σ²/N; Hann's window has an equivalent bandwidth of 1.5 lines. Of 214 lines it is known to 7 %.
        let expected = 1.5 * 4.0 / (own_hz * duration_s);
        assert!((mean / expected - 1.0).abs() < 0.25, "channel {channel}: {mean:e}, expected {expected:e}");
    }
    let variance =
        block.samples.iter().skip(1).step_by(2).map(|value| value * value).sum::<f64>() / capture.samples as f64;
    // What the low-pass lets through of the slow one: 2 · 0.44 of its band.
    assert!((variance - 0.88).abs() < 0.06, "{variance}");
}

#[test]
fn defects_are_where_the_low_pass_spreads_them() {
    let line = |time_s: f64| (TAU * 20.0 * time_s).sin();
    let lost = |time_s: f64| if (time_s - 2.0).abs() < 1e-5 { f64::NAN } else { line(time_s) };
    let (_folder, recording) =
        opened(&files(&lost, &line), &format!("{LOAD}{MARK}"), &rig(&["only"], Unit::Micrometre)).unwrap();
    let (capture, block) = read(&*recording);
    let at = ((2.0 - start_s(&capture)) * SLOW_HZ) as u64;
    assert!(block.defects.iter().all(|defect| defect.channel == 0), "{:?}", block.defects);
    let [first, last] = [
        block.defects.iter().map(|defect| defect.samples.start).min().unwrap(),
        block.defects.iter().map(|defect| defect.samples.end).max().unwrap(),
    ];
    assert!(first.abs_diff(at - 31) <= 1 && last.abs_diff(at + 33) <= 1, "{first}..{last} around {at}");
    assert!(block.samples.iter().all(|value| value.is_finite()));
}

#[test]
fn what_cannot_be_brought_together_is_refused_with_words() {
    let line = |time_s: f64| (TAU * 20.0 * time_s).sin();
    let refused = |fast: String, slow: String| {
        let files = [("S1.csv", fast), ("S2.csv", slow)];
        let load = format!("{LOAD}marker = {{ channel = \"S1\" }}");
        opened(&files, &load, &rig(&["only"], Unit::Micrometre)).map(|_| ()).unwrap_err().to_string()
    };
    let apart = refused(csv(1000.0, 0.0, &[("v", &line)], 500), csv(1000.0, 0.6, &[("v", &line)], 500));
    assert!(apart.contains("from 0.6 to 0.499 s in common"), "{apart}");
    let short = refused(csv(1000.0, 0.0, &[("v", &line)], 60), csv(500.0, 0.0, &[("v", &line)], 30));
    assert!(short.contains("more than 0.128 s"), "{short}");
    let ratio = refused(csv(10_000.0, 0.0, &[("v", &line)], 500), csv(2.0, 0.0, &[("v", &line)], 500));
    assert!(ratio.contains("from 2 to 10000"), "{ratio}");
}
