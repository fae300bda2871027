#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

mod by_encoder;
mod near_nyquist;
mod over_turns;

use std::f64::consts::TAU;

use runout_core::{
    Complex64,
    inspection::Inspection,
    measurement::{DefectKind, MemoryStream, Trim},
    profile::Rejection,
    separation::Quantity,
    spread::{Direction, Projection},
};

use super::*;
use crate::testing::{RATE_HZ, averager, marks, scatter, stream};

fn config(samples_per_rev: usize) -> SynchronousAverageConfig {
    SynchronousAverageConfig {
        samples_per_rev,
        min_turns: 5,
        turn_tolerance_percent: 5.0,
        outlier_sigma: None,
        speed_tolerance_percent: 2.0,
    }
}

fn average_with(config: SynchronousAverageConfig, input: MemoryStream) -> Result<Profile> {
    let profile = averager(config).average(Box::new(Inspection::new(Box::new(input))));
    if let Ok(profile) = &profile {
        let count = &profile.turns;
        let trimmed: usize = count.trimmed.iter().map(|trim| trim.turns).sum();
        assert_eq!(count.used + count.rejected.len() + trimmed, count.recorded, "every turn is accounted for");
    }
    profile
}

fn average(samples_per_rev: usize, input: MemoryStream) -> Result<Profile> {
    average_with(config(samples_per_rev), input)
}

/// A few harmonics of Re Σ cₙ e^{−inΦ}, other ones in every channel.
fn harmonics(channel: usize) -> Vec<(usize, Complex64)> {
    let turned = |amplitude: f64, phase: f64| Complex64::from_polar(amplitude, phase + channel as f64);
    vec![
        (0, Complex64::new(3.0 - channel as f64, 0.0)),
        (1, turned(5.0, 0.3)),
        (2, turned(1.0, -1.2)),
        (17, turned(0.1, 2.0)),
        (150, turned(0.02, 0.9)),
    ]
}

fn signal(harmonics: &[(usize, Complex64)], angle: f64) -> f64 {
    harmonics.iter().map(|(order, value)| (value * Complex64::cis(-(*order as f64) * angle)).re).sum()
}

/// Channels that hold [`harmonics`] of the turn that begins at `first` and is `length` samples long.
fn turning(channels: usize, frames: usize, first: f64, length: f64) -> Vec<Vec<f64>> {
    let channel = |index: usize| {
        let harmonics = harmonics(index);
        (0..frames).map(|frame| signal(&harmonics, TAU * (frame as f64 - first) / length)).collect()
    };
    (0..channels).map(channel).collect()
}

/// Largest difference from [`harmonics`] over all orders and channels, in µm.
fn worst(profile: &Profile) -> f64 {
    let mut worst = 0.0_f64;
    for channel in 0..profile.channels() {
        let known = harmonics(channel);
        for order in 0..=profile.max_order() {
            let expected = known.iter().find(|(known, _)| *known == order).map_or(Complex64::ZERO, |(_, value)| *value);
            worst = worst.max((profile.order(order)[channel] - expected).norm());
        }
    }
    worst
}

fn reasons(profile: &Profile) -> Vec<(usize, &Rejection)> {
    profile.turns.rejected.iter().map(|turn| (turn.turn, &turn.reason)).collect()
}

#[test]
fn samples_on_the_angles_pass_exactly() {
    for (length, samples_per_rev) in [(512, 512), (1024, 512), (1536, 512)] {
        let input = stream(&turning(4, 6 * length, 0.0, length as f64), marks(0.0, length as f64, 7));
        let profile = average(samples_per_rev, input).unwrap();
        assert_eq!((profile.turns.recorded, profile.turns.used, profile.max_order()), (6, 6, 255));
        // Rounding of a transform of values near 10.
        assert!(worst(&profile) < 2e-14, "{length}: {:e}", worst(&profile));
        assert_eq!(profile.warnings, [] as [String; 0]);
    }
}

#[test]
fn irrational_turns_are_resampled_to_the_kernels_error() {
    // Below and above the samples per turn, hardly above, and many times: orders to 150 are in the pass band of all.
    for length in [731.123, 1000.0003, 1002.718, 1618.034, 7071.068] {
        for channels in [1, 4, 9] {
            let first = 30.4;
            let frames = (8.1 * length) as usize + 60;
            let input = stream(&turning(channels, frames, first, length), marks(first, length, 9));
            let samples_per_rev = if length < 1000.0 { 730 } else { 1000 };
            let profile = average(samples_per_rev, input).unwrap();
            assert_eq!(profile.turns.used, 8);
            // The kernel's share of an amplitude of 5 µm.
            assert!(worst(&profile) < 5.0 * kernel::ERROR, "{length}: {:e}", worst(&profile));
            let speed_rpm = profile.speed_rpm.unwrap();
            assert!((speed_rpm - 60.0 * RATE_HZ / length).abs() < 1e-9 * speed_rpm);
        }
    }
}

#[test]
fn what_lies_above_the_kept_orders_does_not_fold_onto_them() {
    let (length, first) = (1000.7, 40.0);
    let channel = |frame: usize| (140.0 * TAU * (frame as f64 - first) / length).cos();
    let input = stream(&[(0..9000).map(channel).collect()], marks(first, length, 8));
    let profile = average(200, input).unwrap();
    assert_eq!(profile.max_order(), 99);
    // On 200 angles it would appear as order 60, in full.
    let largest = profile.mean.iter().map(|value| value.norm()).fold(0.0, f64::max);
    assert!(largest < kernel::ERROR, "{largest:e}");
    // It is in no value, which is said.
    assert!((profile.absent_um - 0.5_f64.sqrt()).abs() < 1e-4, "{}", profile.absent_um);
    assert!(profile.warnings.iter().any(|warning| warning.contains("orders above 99")), "{:?}", profile.warnings);
    // Noise is not: of 40 turns its average has as much above the orders that are kept as in them.
    let mut noise = scatter(7);
    let channel = |frame: usize| (3.0 * TAU * (frame as f64 - first) / length).cos();
    let input = stream(&[(0..41_000).map(|frame| channel(frame) + 0.1 * noise()).collect()], marks(first, length, 41));
    assert!(average(200, input).unwrap().absent_um < f64::MIN_POSITIVE);
}

#[test]
fn turns_at_the_very_ends_are_used() {
    let length = 800.0;
    // A closing mark one past the last sample bounds the last turn; without it there is one turn less.
    for (count, used) in [(7, 6), (6, 5)] {
        let input = stream(&turning(2, 4800, 0.0, length), marks(0.0, length, count));
        let profile = average(800, input).unwrap();
        assert_eq!((profile.turns.recorded, profile.turns.used), (used, used));
        assert!(worst(&profile) < 2e-14);
    }
    // Between samples, the continuation of the ends bends a few of 4800 positions by what the signal bends in 10 samples.
    let (first, length) = (0.3, 799.7_f64);
    let frames = (first + 6.0 * length).ceil() as usize;
    let input = stream(&turning(2, frames, first, length), marks(first, length, 7));
    let profile = average(800, input).unwrap();
    assert_eq!(profile.turns.used, 6);
    assert!(worst(&profile) < 1e-4, "{:e}", worst(&profile));
    // A mark beyond the samples bounds nothing.
    let input = stream(&turning(2, 4700, first, length), marks(first, length, 7));
    let profile = average(800, input).unwrap();
    assert_eq!(reasons(&profile), [(5, &Rejection::Incomplete)]);
}

#[test]
fn blocks_of_any_size_give_the_same() {
    let (length, first) = (523.21, 7.3);
    let mut data = turning(3, 9 * 530, first, length);
    let mut scatter = scatter(3);
    data.iter_mut().flatten().for_each(|value| *value += 0.1 * scatter());
    data[1][1300] = f64::NAN;
    let whole = average(512, stream(&data, marks(first, length, 10))).unwrap();
    assert_eq!(whole.turns.used, 8);
    for block_samples in [1, 13, 500, 1234] {
        let mut input = stream(&data, marks(first, length, 10));
        input.block_samples = block_samples;
        let profile = average(512, input).unwrap();
        assert_eq!(profile.turns, whole.turns);
        // Rounding of positions that are counted from another frame.
        let off = profile.mean.iter().zip(&whole.mean).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(off < 1e-12, "{block_samples}: {off:e}");
        let covariances = profile.covariance.unwrap().into_iter().zip(whole.covariance.clone().unwrap());
        assert!(covariances.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) < 1e-14);
    }
}

/// Twelve turns with a few marks gone or added.
fn with_marks(change: impl FnOnce(&mut Vec<f64>)) -> Result<Profile> {
    let mut places = marks(20.0, 600.0, 13);
    change(&mut places);
    average(512, stream(&turning(2, 7300, 20.0, 600.0), places))
}

#[test]
fn a_missing_mark_costs_the_two_turns_beside_it() {
    let profile = with_marks(|marks| {
        marks.remove(4);
    })
    .unwrap();
    assert_eq!((profile.turns.recorded, profile.turns.used), (11, 10));
    let rejected = &profile.turns.rejected[0];
    assert_eq!((rejected.turn, rejected.start_sample), (3, 1820));
    assert!(matches!(rejected.reason, Rejection::MissingMark(length) if (length.samples - 1200.0).abs() < 1e-9));
    assert!(worst(&profile) < 5.0 * kernel::ERROR);
}

#[test]
fn a_doubled_mark_costs_the_turn_that_it_cuts() {
    // Whether the other piece is a turn by its length (0.98 of one) or not.
    for share in [0.02, 0.3, 0.5, 0.98] {
        let profile = with_marks(|marks| marks.insert(5, marks[4] + share * 600.0)).unwrap();
        assert_eq!((profile.turns.recorded, profile.turns.used), (13, 11), "{share}");
        assert!(
            matches!(reasons(&profile)[..], [(4, Rejection::DoubledMark(_)), (5, Rejection::DoubledMark(_))]),
            "{share}: {:?}",
            reasons(&profile)
        );
        assert!(worst(&profile) < 5.0 * kernel::ERROR);
    }
    // A mark that bounces belongs to either turn: neither is used.
    let profile = with_marks(|marks| marks.insert(5, marks[4] + 1.0)).unwrap();
    assert_eq!(profile.turns.used, 10);
}

#[test]
fn a_turn_off_speed_is_left_out() {
    let profile = with_marks(|marks| marks[6..].iter_mut().for_each(|mark| *mark += 60.0)).unwrap();
    assert!(matches!(reasons(&profile)[..], [(5, Rejection::Speed(_))]));
}

#[test]
fn bad_samples_cost_their_turns() {
    let places = marks(20.0, 600.3, 13);
    let mut data = turning(2, 7300, 20.0, 600.3);
    data[0][20 + 601 * 3 + 50] = f64::INFINITY;
    // Half of the turn at the highest reading so far, come to in a step.
    let top = data[1].iter().copied().fold(0.0, f64::max) + 1.0;
    data[1][4600..4700].fill(top);
    let profile = average(512, stream(&data, places)).unwrap();
    let defect = |sensor, kind| Rejection::Defect { sensor, kind };
    assert_eq!(reasons(&profile), [(3, &defect(0, DefectKind::NotFinite)), (7, &defect(1, DefectKind::Clipped))]);
    assert!(worst(&profile) < 5.0 * kernel::ERROR);
}

#[test]
fn turns_keep_their_numbers_through_trim_and_filter() {
    use crate::{LowPassConfig, TrimConfig, testing::conditioner};
    let mut data = turning(2, 9 * 600 + 300, 140.0, 600.0);
    data[1][140 + 600 * 5 + 300] = f64::NAN;
    let mut places = marks(140.0, 600.0, 10);
    // Two turns of a start-up before the first at speed.
    places.splice(..0, [20.0, 90.0]);
    let trim = conditioner(TrimConfig { speed_tolerance_percent: 1.0, start_turns: 0, end_turns: 0 });
    let filter = conditioner(LowPassConfig { cutoff_hz: 8000.0, order: 2 });
    let mut input = stream(&data, places);
    input.block_samples = 250;
    let inspected = Box::new(Inspection::new(Box::new(input)));
    let conditioned = filter.attach(trim.attach(inspected).unwrap()).unwrap();
    let profile = averager(config(600)).average(conditioned).unwrap();
    assert_eq!(profile.turns.recorded, 11);
    assert_eq!((profile.turns.trimmed[0].first_turn, profile.turns.trimmed[0].turns), (0, 2));
    let reason = Rejection::Defect { sensor: 1, kind: DefectKind::NotFinite };
    assert_eq!(reasons(&profile), [(7, &reason)]);
    assert_eq!(profile.turns.used, 8);
    assert_eq!(profile.responses.len(), 1);
    // 2000 rpm: 33.33 Hz an order.
    let response = &profile.responses[0];
    let order: f64 = response.description.rsplit(" = order ").next().unwrap().parse().unwrap();
    // Three digits.
    assert!((order - response.half_power_hz * 600.0 / RATE_HZ).abs() < 0.6, "{}", response.description);
}

#[test]
fn a_dead_channel_fails_by_name() {
    let mut data = turning(3, 7300, 20.0, 600.0);
    data[2].fill(0.25);
    let error = average(512, stream(&data, marks(20.0, 600.0, 13))).unwrap_err().to_string();
    assert!(error.contains("sensor S3, channel 3 of test.h5:/initial/s01"), "{error}");
    assert!(error.contains("all 7300 samples read 0.25 µm"), "{error}");
}

#[test]
fn too_few_turns_fail_with_every_reason() {
    let mut data = turning(2, 4300, 20.0, 600.0);
    data[1][700] = f64::NAN;
    let mut places = marks(20.0, 600.0, 8);
    places.remove(4);
    let mut input = stream(&data, places);
    input.capture.trimmed.push(Trim { first_turn: 0, turns: 2, reason: "start_turns".into() });
    let error = average(512, input).unwrap_err();
    assert_eq!(
        error.to_string(),
        "cannot average test.h5:/initial/s01: 4 of 8 turns can be used, min_turns = 5; 2 set aside: start_turns; \
         1 × sensor S2 is not a number (turn 3); 1 × a mark is missing (turn 5)"
    );
    let error = average(512, stream(&data, Vec::new())).unwrap_err();
    assert!(error.to_string().contains("0 of 0 turns"), "{error}");
    assert!(error.advice().unwrap().contains("once-per-turn mark"));
}

#[test]
fn a_speed_far_from_the_stated_is_a_warning() {
    for (stated_rpm, warnings) in [(2000.0, 0), (1965.0, 0), (1000.0, 1)] {
        let mut input = stream(&turning(1, 6000, 0.0, 600.0), marks(0.0, 600.0, 11));
        input.capture.stated_speed_rpm = Some(stated_rpm);
        let profile = average(600, input).unwrap();
        assert!((profile.speed_rpm.unwrap() - 2000.0).abs() < 1e-9);
        assert_eq!(profile.warnings.len(), warnings, "{:?}", profile.warnings);
    }
}

#[test]
fn orders_that_the_recording_hardly_holds_are_a_warning() {
    let input = || stream(&turning(1, 6100, 0.5, 600.0), marks(0.5, 600.0, 11));
    assert!(average(600, input()).unwrap().warnings[0].contains("carry orders to 150"));
    let [above] = &average(300, input()).unwrap().warnings[..] else { panic!("order 150 is above 149") };
    assert!(above.contains("orders above 149, the highest of `samples_per_rev` = 300"), "{above}");
}

#[test]
fn an_outlier_is_left_out_where_asked_for() {
    let mut data = turning(2, 40 * 512, 0.0, 512.0);
    let mut scatter = scatter(5);
    data.iter_mut().flatten().for_each(|value| *value += 0.1 * scatter());
    data[1][512 * 21 + 100..512 * 21 + 180].iter_mut().for_each(|value| *value += 1.0);
    let input = || stream(&data, marks(0.0, 512.0, 41));
    assert_eq!(average(512, input()).unwrap().turns.used, 40);
    let profile = average_with(SynchronousAverageConfig { outlier_sigma: Some(3.0), ..config(512) }, input()).unwrap();
    assert_eq!(profile.turns.used, 39);
    let [(21, Rejection::Outlier { sensor: 1, distance_um })] = reasons(&profile)[..] else {
        panic!("{:?}", reasons(&profile));
    };
    // 1 µm over 80 of 512 samples, and noise of 0.1/√3 µm.
    let expected_um = (80.0 / 512.0 + 0.01 / 3.0_f64).sqrt();
    assert!((distance_um - expected_um).abs() < 0.05 * expected_um, "{distance_um} {expected_um}");
}

#[test]
fn marks_that_make_no_sense_are_no_panic() {
    let data = turning(1, 3000, 0.0, 100.0);
    for places in [
        vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0],
        vec![0.0; 9],
        vec![f64::NAN; 9],
        vec![-300.0, -200.0, -100.0, 0.0, 100.0, 200.0, 300.0, 400.0, 500.0, 600.0],
        vec![500.0, 600.0, 700.0, 100.0, 200.0, 300.0, 400.0, 500.0, 600.0],
        vec![1e300, 2e300, f64::INFINITY],
    ] {
        for block_samples in [1, 12, 3000] {
            let mut input = stream(&data, places.clone());
            input.block_samples = block_samples;
            let _ = average(16, input);
        }
    }
}

#[test]
fn a_filter_that_removes_the_form_is_a_warning() {
    use crate::{LowPassConfig, testing::conditioner};
    // 33.33 Hz an order; of order 4 twice, −3 dB lies a tenth below the cut-off.
    for (cutoff_hz, warned) in [(20.0, true), (60.0, true), (90.0, false)] {
        let filter = conditioner(LowPassConfig { cutoff_hz, order: 4 });
        let input = stream(&turning(1, 6000, 0.0, 600.0), marks(0.0, 600.0, 11));
        let profile = averager(config(300)).average(filter.attach(Box::new(input)).unwrap()).unwrap();
        let found = profile
            .warnings
            .iter()
            .any(|warning| warning.contains("removes the form") && warning.contains(" = order "));
        assert_eq!(found, warned, "{cutoff_hz}: {:?}", profile.warnings);
    }
}

#[test]
fn marks_in_seconds_are_an_error() {
    let places = marks(0.0, 600.0 / RATE_HZ, 11);
    let error = average(300, stream(&turning(1, 6000, 0.0, 600.0), places)).unwrap_err();
    assert!(error.to_string().contains("median turn is 0.0300 samples long"), "{error}");
    assert!(error.advice().unwrap().contains("sample positions"));
}

#[test]
fn orders_above_half_a_turns_samples_are_not_there() {
    let input = |length: f64| stream(&turning(1, 6000, 0.0, length), marks(0.0, length, 11));
    for (samples_per_rev, length, highest) in [(512, 511.8, 255), (512, 509.0, 254), (4096, 511.8, 255)] {
        let profile = average(samples_per_rev, input(length)).unwrap();
        assert_eq!((profile.samples_per_rev, profile.max_order()), (samples_per_rev, highest));
        assert_eq!(profile.covariance.as_ref().unwrap().len(), highest + 1);
        let said = profile.warnings.iter().any(|warning| warning.contains("have no orders above"));
        assert_eq!(said, highest < runout_core::numerics::fourier::max_order(samples_per_rev));
    }
}
