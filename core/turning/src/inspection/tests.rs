#![allow(clippy::unwrap_used, reason = "tests")]

use std::f64::consts::TAU;

use super::*;
use crate::measurement::{Defect, DefectKind, MemoryStream};

const TURN: usize = 1000;

fn stream(channels: &[Vec<f64>], limits: Option<[f64; 2]>, block_samples: usize) -> MemoryStream {
    let count = channels.len();
    let frames = channels[0].len();
    let capture = Capture {
        object: "test.h5:/initial/s01".into(),
        setup: 0,
        station: "s01".into(),
        z_mm: 0.0,
        stated_speed_rpm: None,
        sample_rate_hz: None,
        samples: frames as u64,
        sensors: (0..count).collect(),
        sensor_ids: (1..=count).map(|number| format!("S{number}")).collect(),
        converter_limits_um: limits.map(|limits| vec![limits; count]),
        marks: (0..=frames / TURN).map(|turn| (turn * TURN) as f64).collect(),
        marks_within_samples: 0.0,
        encoder: false,
        trimmed: Vec::new(),
        responses: Vec::new(),
    };
    let samples = (0..frames).flat_map(|frame| channels.iter().map(move |channel| channel[frame])).collect();
    MemoryStream { capture, samples, angle_rev: Vec::new(), block_samples, next: 0 }
}

/// Everything that comes out, with the defects' pieces joined.
fn inspect(stream: MemoryStream) -> Result<(Vec<f64>, Vec<Defect>)> {
    let mut inspection = Inspection::new(Box::new(stream));
    let (mut samples, mut defects, mut block) = (Vec::new(), Vec::<Defect>::new(), Block::default());
    let count = inspection.capture().channels();
    while inspection.next_block(&mut block)? {
        assert_eq!(block.start as usize, samples.len() / count, "blocks follow each other");
        for defect in &block.defects {
            assert!(defect.samples.start >= block.start, "{defect:?} lies before the block at {}", block.start);
            match defects.iter_mut().rev().find(|earlier| earlier.channel == defect.channel) {
                Some(earlier) if earlier.kind == defect.kind && earlier.samples.end == defect.samples.start => {
                    earlier.samples.end = defect.samples.end;
                }
                _ => defects.push(defect.clone()),
            }
        }
        samples.extend_from_slice(&block.samples);
    }
    defects.sort_by_key(|defect| (defect.channel, defect.samples.start));
    Ok((samples, defects))
}

fn sine(frames: usize, amplitude_um: f64, phase: f64) -> Vec<f64> {
    (0..frames).map(|index| amplitude_um * (TAU * index as f64 / TURN as f64 + phase).sin()).collect()
}

fn defect(channel: usize, samples: std::ops::Range<u64>, kind: DefectKind) -> Defect {
    Defect { samples, channel, kind }
}

/// Any block size must give the same samples and the same places.
fn inspect_in_blocks(channels: &[Vec<f64>], limits: Option<[f64; 2]>) -> (Vec<f64>, Vec<Defect>) {
    let whole = inspect(stream(channels, limits, usize::MAX)).unwrap();
    for block_samples in [1, 7, 64, 1500] {
        assert_eq!(inspect(stream(channels, limits, block_samples)).unwrap(), whole, "{block_samples}");
    }
    whole
}

#[test]
fn good_samples_pass_untouched() {
    for width in [1, 4, 11] {
        let channels: Vec<Vec<f64>> = (0..width).map(|channel| sine(5 * TURN, 3.0, f64::from(channel))).collect();
        let (samples, defects) = inspect_in_blocks(&channels, None);
        assert_eq!(samples, stream(&channels, None, 1).samples);
        assert_eq!(defects, []);
    }
}

#[test]
fn what_is_not_finite_or_absurd_is_bridged_by_the_last_good_value() {
    let mut channels = vec![sine(3 * TURN, 3.0, 0.1), sine(3 * TURN, 3.0, 0.4)];
    let good = channels[1][1499];
    channels[1][1500..1503].fill(f64::NAN);
    channels[0][0] = f64::INFINITY;
    channels[0][2000] = -1e300;
    channels[0][2001] = 0.999e6;
    let (samples, defects) = inspect_in_blocks(&channels, None);
    assert!(samples.iter().all(|value| value.is_finite()));
    assert_eq!(samples[0].to_bits(), 0.0_f64.to_bits(), "nothing good before");
    assert!((1500..1503).all(|frame| samples[2 * frame + 1].to_bits() == good.to_bits()));
    assert_eq!(samples[2 * 2000].to_bits(), channels[0][1999].to_bits());
    assert_eq!(samples[2 * 2001].to_bits(), 0.999e6_f64.to_bits(), "a sensor far from its zero may read so much");
    let expected = [
        defect(0, 0..1, DefectKind::NotFinite),
        defect(0, 2000..2001, DefectKind::OutOfReach),
        defect(1, 1500..1503, DefectKind::NotFinite),
    ];
    assert_eq!(defects, expected);
}

#[test]
fn integers_are_clipped_at_the_converters_limit() {
    let step = 10.0 / 32768.0;
    let convert = |value: f64| (value / step).round().clamp(-32768.0, 32767.0) * step;
    let mut channels = vec![sine(2 * TURN, 8.0, 0.0).into_iter().map(convert).collect::<Vec<_>>()];
    let limits = [-32768.0 * step, 32767.0 * step];
    channels[0][700] = limits[0];
    let (_, defects) = inspect_in_blocks(&channels, Some(limits));
    assert_eq!(defects, [], "one sample may touch the limit");
    channels[0][40..43].fill(limits[1]);
    let (_, defects) = inspect_in_blocks(&channels, Some(limits));
    assert_eq!(defects, [defect(0, 40..43, DefectKind::Clipped)]);
}

/// Converters of 12, 16 and 32 bits without saturation: each step from one limit to the other is found, and nothing else; a converter that
/// only comes near both limits between two samples further apart wraps nowhere.
#[test]
fn integers_that_wrap_round_are_found_where_they_do() {
    for (bits, amplitude, phase) in [(12, 0.8, 0.3), (16, 1.1, 1.0), (32, 0.51, 2.0)] {
        let codes = f64::from(bits).exp2();
        let step = 20.0 / codes;
        let code = |value: f64| (20.0 * value / step).round();
        let wrap = |code: f64| (code + 0.5 * codes).rem_euclid(codes) - 0.5 * codes;
        let limits = [-0.5 * codes * step, (0.5 * codes - 1.0) * step];
        let codes_of = |frames| sine(frames, amplitude, phase).into_iter().map(code);
        let wrapped: Vec<f64> = codes_of(3 * TURN).map(|code| wrap(code) * step).collect();
        let of = |code: f64| ((code + 0.5 * codes) / codes).floor();
        let periods: Vec<f64> = codes_of(3 * TURN).map(of).collect();
        let expected = (1..3 * TURN).filter(|at| periods[*at].total_cmp(&periods[at - 1]).is_ne());
        let expected: Vec<Defect> =
            expected.map(|at| defect(0, at as u64..at as u64 + 1, DefectKind::WrappedRound)).collect();
        assert_eq!(expected.len(), 12, "{bits}");
        let (samples, defects) = inspect_in_blocks(std::slice::from_ref(&wrapped), Some(limits));
        assert_eq!((samples, defects), (wrapped, expected), "{bits}");
        let (_, defects) = inspect_in_blocks(&[sine(3 * TURN, 0.49 * codes * step, phase)], Some(limits));
        assert_eq!(defects, [], "{bits}: nearly the whole range, in small steps");
    }
}

#[test]
fn a_flat_top_is_clipped_and_a_quantised_crest_is_not() {
    // The top of the sine cut at 90 %: arcsin 0.9 to π − arcsin 0.9 is 14.4 % of a turn.
    let cut: Vec<f64> = sine(4 * TURN, 5.0, 0.0).into_iter().map(|value| value.min(4.5)).collect();
    let whole = sine(4 * TURN, 5.0, 0.0);
    let (_, defects) = inspect_in_blocks(&[whole, cut], None);
    assert_eq!(defects.len(), 4, "{defects:?}");
    for (turn, found) in defects.iter().enumerate() {
        let rise = TURN as f64 * 0.9_f64.asin() / TAU;
        let start = (turn * TURN) as f64 + rise;
        assert!((found.samples.start as f64 - start).abs() <= 1.0, "{found:?}, expected from {start}");
        assert!((found.samples.end as f64 - (start + 0.5 * TURN as f64 - 2.0 * rise)).abs() <= 1.0, "{found:?}");
    }
    // Crests of 1.4 to 14 % of a turn, without and with noise that dithers them.
    for (steps, noise) in [(10.0, 0.0), (30.0, 0.0), (100.0, 0.0), (1000.0, 0.0), (30.0, 0.4), (100.0, 1.0)] {
        for phase in [0.0, 0.25 * TAU, 2.0] {
            let mut state = 1_u32;
            let coarse: Vec<f64> = sine(20 * TURN, steps, phase)
                .into_iter()
                .map(|value| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    0.01 * (value + noise * (f64::from(state) / f64::from(u32::MAX) - 0.5)).round()
                })
                .collect();
            let (_, defects) = inspect(stream(&[coarse], None, 512)).unwrap();
            assert_eq!(defects, [], "{steps} steps, noise {noise}, phase {phase}");
        }
    }
}

#[test]
fn a_sensor_pegged_from_the_start_is_clipped() {
    let mut channel = sine(4 * TURN, 5.0, 0.0);
    channel[..1250].fill(9.0);
    let (_, defects) = inspect_in_blocks(&[channel], None);
    assert_eq!(defects, [defect(0, 0..1250, DefectKind::Clipped)]);
}

#[test]
fn a_dead_channel_is_an_error_that_names_it() {
    let none = "none of its 3000 samples is a number up to 1 m";
    for (value, said) in
        [(2.5, "all 3000 samples read 2.5 µm"), (-0.0, "all 3000 samples read 0 µm"), (f64::NAN, none), (1e9, none)]
    {
        for limits in [None, Some([-10.0, 10.0])] {
            let channels = vec![sine(3 * TURN, 3.0, 0.0), vec![value; 3 * TURN]];
            let error = inspect(stream(&channels, limits, 100)).unwrap_err().to_string();
            assert!(error.contains("sensor S2, channel 2 of test.h5:/initial/s01"), "{error}");
            assert!(error.contains(said), "{error}");
        }
    }
}

#[test]
fn a_channel_stuck_inside_its_swing_is_a_defect_from_the_first_repeat() {
    let step = 10.0 / 32768.0;
    let convert = |value: f64| (value / step).round() * step;
    for limits in [None, Some([-32768.0 * step, 32767.0 * step])] {
        let whole = sine(20 * TURN, 5.0, 0.3).into_iter().map(convert).collect::<Vec<_>>();
        let mut channel = whole.clone();
        let (value, short) = (channel[7400], channel[15_500]);
        channel[7400..11_390].fill(value);
        // Not yet a quarter of a turn.
        channel[15_500..15_749].fill(short);
        let (_, defects) = inspect_in_blocks(&[whole, channel], limits);
        assert_eq!(defects, [defect(1, 7401..11_390, DefectKind::Stuck)], "{limits:?}");
    }
}

#[test]
fn an_integer_channel_stuck_from_the_start_is_a_defect() {
    let mut channel = sine(4 * TURN, 5.0, 0.0);
    channel[..1250].fill(0.5);
    let (_, defects) = inspect_in_blocks(&[channel], Some([-10.0, 10.0]));
    assert_eq!(defects, [defect(0, 1..1250, DefectKind::Stuck)]);
}

#[test]
fn a_slow_swing_of_few_steps_is_not_stuck() {
    // At its crest a sine of 3 steps stands still for up to a quarter of a turn; of 1.2 steps, much longer.
    for steps in [1.2, 2.0, 3.0, 3.5, 5.0, 20.0] {
        let coarse: Vec<f64> = sine(20 * TURN, steps, 0.4).into_iter().map(|value| 0.01 * value.round()).collect();
        let (_, defects) = inspect_in_blocks(&[coarse], Some([-10.0, 10.0]));
        assert_eq!(defects, [], "{steps} steps");
    }
}

/// What is reported at the end.
fn spikes(stream: MemoryStream) -> Vec<Spike> {
    let (sender, reported) = std::sync::mpsc::channel();
    let mut inspection =
        Inspection::reporting(Box::new(stream), move |found: UnusualReadings| sender.send(found.spikes).unwrap());
    let mut block = Block::default();
    while inspection.next_block(&mut block).unwrap() {}
    drop(inspection);
    reported.recv().unwrap()
}

/// Numbers with a Gaussian distribution of deviation 1, the sum of twelve from Knuth's generator.
fn gaussian(count: usize, seed: u64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(2_654_435_761).wrapping_add(97);
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..count).map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0).collect()
}

fn with_noise(mut channel: Vec<f64>, std_um: f64, seed: u64) -> Vec<f64> {
    let noise = gaussian(channel.len(), seed);
    channel.iter_mut().zip(noise).for_each(|(value, noise)| *value += std_um * noise);
    channel
}

const TURNS: usize = 60;

#[test]
fn a_reading_far_from_all_others_is_reported_with_its_place() {
    for (seed, place) in [0, 1, 999, 23_456, 40_000, TURNS * TURN - 1].into_iter().enumerate() {
        for (spike_um, noise_um) in [(40.0, 0.05), (-12.5, 0.05), (500.0, 0.0), (-45.0, 2.0)] {
            let [quiet, mut marred] = [0.0, 1.0].map(|phase| {
                with_noise(sine(TURNS * TURN, 10.0, phase), noise_um, seed as u64 + (phase * 50.0) as u64)
            });
            marred[place] = spike_um;
            let usual = |sign: f64| {
                let others = marred.iter().enumerate().filter(|(index, _)| *index != place);
                sign * others.map(|(_, value)| sign * value).fold(f64::NEG_INFINITY, f64::max)
            };
            for block_samples in [300, 5000, 100_000] {
                let found = spikes(stream(&[quiet.clone(), marred.clone()], None, block_samples));
                let [spike] = &found[..] else { panic!("{place}, {spike_um}: {found:?}") };
                assert_eq!((spike.channel, spike.stretches), (1, 1));
                assert_eq!((spike.near_sample, spike.within_samples), (place as u64, 0), "{spike:?}");
                assert_eq!(spike.reading_um.to_bits(), spike_um.to_bits());
                assert!((spike.usual_um - usual(spike_um.signum())).abs() < 1e-12, "{spike:?}");
            }
        }
    }
}

#[test]
fn readings_far_off_in_some_turns_are_counted() {
    let mut channel = with_noise(sine(TURNS * TURN, 10.0, 0.3), 0.05, 1);
    for turn in [5, 11, 29, 43, 44, 58] {
        channel[turn * TURN + 100] = -25.0 - 0.1 * turn as f64;
    }
    let found = spikes(stream(&[channel], None, 4096));
    let [Spike { near_sample, reading_um, stretches, .. }] = found[..] else { panic!("{found:?}") };
    assert_eq!((near_sample, reading_um.to_bits(), stretches), (58_100, (-30.8_f64).to_bits(), 6));
}

/// Noise, drifts however fast, run-ups, steps, beats and coarse converters are courses of the signal.
#[test]
fn a_course_of_the_signal_is_no_spike() {
    let frames = TURNS * TURN;
    let share = |index: usize| index as f64 / frames as f64;
    let of = |value: &dyn Fn(usize) -> f64| (0..frames).map(value).collect::<Vec<f64>>();
    let mut courses = vec![
        ("drift", of(&|index| 40.0 * share(index))),
        ("step", of(&|index| if index < 21_300 { 0.0 } else { 25.0 })),
        ("beats", of(&|index| 6.0 * (TAU * 0.387 * index as f64 / TURN as f64).sin())),
        ("wander", of(&|index| 15.0 * (TAU * 1.3 * share(index)).sin())),
        ("growth", of(&|index| 10.0 * share(index) * (TAU * index as f64 / TURN as f64).cos())),
        ("nothing", vec![0.0; frames]),
    ];
    for tau in [0.1, 0.2, 0.5, 1.0] {
        courses.push(("settling", of(&|index| -50.0 * (-share(index) / tau).exp())));
    }
    for (name, course) in courses {
        for (noise_um, step_um) in [(0.0, 0.0), (0.02, 0.0), (0.5, 0.0), (0.02, 0.3), (3.0, 0.01)] {
            for seed in 0..5 {
                let mut channel = with_noise(sine(frames, 10.0, seed as f64), noise_um, seed);
                channel.iter_mut().zip(&course).for_each(|(value, course)| *value += course);
                if step_um > 0.0 {
                    for value in &mut channel {
                        *value = (*value / step_um).round() * step_um;
                    }
                }
                let found = spikes(stream(&[channel], None, 4096));
                assert!(found.is_empty(), "{name}, noise {noise_um} µm, steps of {step_um} µm: {found:?}");
            }
        }
    }
}

#[test]
fn few_turns_or_none_have_no_usual_extremes() {
    let marred = |frames: usize| {
        let mut channel = sine(frames, 10.0, 0.3);
        channel[1234] = 300.0;
        stream(&[channel], None, 4096)
    };
    assert!(spikes(marred(6 * TURN)).is_empty());
    assert_eq!(spikes(marred(20 * TURN)).len(), 1);
    let mut unmarked = marred(20 * TURN);
    unmarked.capture.marks.clear();
    assert!(spikes(unmarked).is_empty());
}
