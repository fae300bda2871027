use std::f64::consts::{PI, TAU};

use super::*;

#[test]
fn ra_of_a_cosine_is_its_amplitude_times_two_over_pi() {
    let profile: Vec<f64> =
        (0..36_000).map(|index| 3.0 + 2.0 * (TAU * 7.0 * f64::from(index) / 36_000.0).cos()).collect();
    // 1e-6: the rectangle rule on |cos| with 36 000 points.
    assert!((ra_um(&profile) - 4.0 / PI).abs() < 1e-6);
}

/// A turn of 100 mm: waves of 10 mm (1 µm) under waves of 0.5 mm (0.2 µm).
fn turn(points: usize) -> Vec<f64> {
    let wave = |count: f64, point: usize| (TAU * count * point as f64 / points as f64 + 0.2).sin();
    (0..points).map(|point| wave(10.0, point) + 0.2 * wave(200.0, point)).collect()
}

#[test]
fn a_sine_around_a_part_has_its_closed_forms() {
    let settings = Settings { lambda_c_mm: Some(2.5), ..Settings::default() };
    let found = around(&turn(8000), 100.0 / TAU, &settings);
    // What a high-pass of 2.5 mm passes of 0.5 mm and 10 mm waves: 1 − 2^−25 and 1 − 2^−(1/16).
    let (short, long) = (0.2 * (1.0 - (-25_f64).exp2()), 1.0 - (-1.0 / 16.0_f64).exp2());
    let rq = (0.5 * (short * short + long * long)).sqrt();
    assert!((found.rq - rq).abs() < 1e-6, "Rq {} instead of {rq}", found.rq);
    assert_eq!((found.points, found.missing, found.sections), (8000, 0, 40));
    // Each section holds five waves of 0.5 mm, sampled 40 times: its extremes are those of both waves together, within
    // the sampling's (π/40)²/2 and what the long wave bends.
    let section_peak = found.rp - short;
    assert!(section_peak.abs() < long, "Rp {} for {short}", found.rp);
    assert!((found.rt - 2.0 * (short + long)).abs() < 0.01, "Rt {}", found.rt);
    let slope = TAU * (0.5 * ((short / 500.0).powi(2) + (long / 1e4).powi(2))).sqrt();
    // Differences over seven points have an error of order (step)⁶: 40 points a wave leave 1e-6 of the slope.
    assert!((found.rdq / slope - 1.0).abs() < 1e-5, "Rdq {} instead of {slope}", found.rdq);
    assert!((found.rsm_mm - 0.5).abs() < 1e-3, "Rsm {}", found.rsm_mm);
}

#[test]
fn filters_take_the_wavelengths_they_are_asked_to() {
    let rq = |settings: Settings| around(&turn(8000), 100.0 / TAU, &settings).rq;
    let amplitude = |short: f64, long: f64| (0.5 * (0.04 * short * short + long * long)).sqrt();
    let none = Settings::default();
    assert!((rq(none) - amplitude(1.0, 1.0)).abs() < 1e-9);
    // At the cut-off, half.
    assert!((rq(Settings { lambda_s_mm: Some(0.5), ..none }) - amplitude(0.5, (-1.0_f64 / 400.0).exp2())).abs() < 1e-5);
    assert!((rq(Settings { lambda_c_mm: Some(10.0), ..none }) - amplitude(1.0, 0.5)).abs() < 1e-5);
}

#[test]
fn small_hills_are_part_of_a_dale() {
    // 20 waves of 1 mm; in each dale a hill of 0.05 µm that crosses the mean line, in each hill a dent that does.
    let wave = |z: f64| {
        (TAU * z).sin() + 1.02 * (-((z - 0.75) / 0.02).powi(2)).exp() - 1.02 * (-((z - 0.25) / 0.02).powi(2)).exp()
    };
    let positions: Vec<f64> = (0..=4000).map(|point| f64::from(point) * 0.005).collect();
    let profile: Vec<f64> = positions.iter().map(|z| wave(z.fract())).collect();
    let settings = Settings { section_mm: Some(2.0), ..Settings::default() };
    let found = along(&positions, &profile, &settings);
    assert!((found.rsm_mm - 1.0).abs() < 1e-3, "Rsm {}", found.rsm_mm);
    assert_eq!(found.sections, 10);
    // Where the crossings are real ones, they count.
    let taller: Vec<f64> = positions
        .iter()
        .zip(&profile)
        .map(|(z, height)| {
            let bump = |at: f64| (-((z.fract() - at) / 0.02).powi(2)).exp();
            height + 0.5 * bump(0.75) - 0.5 * bump(0.25)
        })
        .collect();
    assert!(along(&positions, &taller, &settings).rsm_mm < 0.4);
}

#[test]
fn uneven_spacings_weigh_what_they_stand_for() {
    // A ramp from 0 to 1 mm: Ra = 1/4, Rq = 1/√12 of its height, on points twice as dense in the first half.
    let positions: Vec<f64> = (0..4000)
        .map(|point| f64::from(point) / 8000.0)
        .chain((0..=2000).map(|point| 0.5 + f64::from(point) / 4000.0))
        .collect();
    let found = along(&positions, &positions, &Settings::default());
    // 1e-3: the ends' cells, 1/8000 and 1/4000.
    assert!((found.ra - 0.25).abs() < 1e-3 && (found.rq - 12_f64.sqrt().recip()).abs() < 1e-3, "{found:?}");
    assert!(found.rdq.is_nan());
}

#[test]
fn missing_points_are_left_out_and_counted() {
    let whole = turn(8000);
    let mut gapped = whole.clone();
    gapped[1000..1400].fill(f64::NAN);
    gapped[7990..].fill(f64::NAN);
    let settings = Settings { lambda_c_mm: Some(2.5), ..Settings::default() };
    let (all, some) = (around(&whole, 100.0 / TAU, &settings), around(&gapped, 100.0 / TAU, &settings));
    assert_eq!((some.points, some.missing), (7590, 410));
    // The gap leaves some ten of 200 waves out, and bends the mean line at its edges.
    for (a, b) in [(all.ra, some.ra), (all.rq, some.rq), (all.rz, some.rz), (all.rsm_mm, some.rsm_mm)] {
        assert!((a / b - 1.0).abs() < 0.05, "{all:?}\n{some:?}");
    }
    let nothing = around(&[f64::NAN; 100], 10.0, &settings);
    assert!(nothing.ra.is_nan() && nothing.rz.is_nan() && nothing.rt.is_nan() && nothing.rsm_mm.is_nan());
    assert!(along(&[], &[], &settings).rq.is_nan() && along(&[1.0], &[2.0], &settings).rsm_mm.is_nan());
}

/// Heights at equal steps from 0 to 1 µm, up and down: the whole curve is core, a hundredth of it for each percent.
#[test]
fn the_material_ratio_curve_of_a_triangle_is_a_line() {
    let triangle = |point: usize| 1.0 - (point % 200).abs_diff(100) as f64 / 100.0;
    let profile: Vec<f64> = (0..20_000).map(triangle).collect();
    let found = around(&profile, 100.0 / TAU, &Settings::default());
    // 200 points a wave: the ends of the curve are steps of 0.01 µm.
    for (found, expected) in [(found.rk, 1.0), (found.rpk, 0.0), (found.rvk, 0.0), (found.rdc, 0.6), (found.rc, 1.0)] {
        assert!((found - expected).abs() < 0.02, "{found} instead of {expected}");
    }
    assert!(found.rmrk1_percent < 1.0 && found.rmrk2_percent > 99.0, "{found:?}");
    assert!((found.rsm_mm - 1.0).abs() < 1e-9 && (found.values()[12] - 10.0).abs() < 1e-8);
    assert!((material_ratio_percent(&profile, 0.25) - 25.0).abs() < 1.0);
    assert!(material_ratio_percent(&[f64::NAN], 0.0).is_nan());
}

/// Elements of 1 mm, every fourth one twice as high: Rc = (3 · 2 + 4)/4 µm; the highest section holds such a one.
#[test]
fn elements_have_their_mean_height_and_sections_their_highest() {
    let wave = |z: f64| (TAU * z).sin() * if (z / 4.0).fract() < 0.25 { 2.0 } else { 1.0 };
    let positions: Vec<f64> = (0..=40_000).map(|point| f64::from(point) * 1e-3).collect();
    let profile: Vec<f64> = positions.iter().map(|z| wave(*z)).collect();
    let settings = Settings { section_mm: Some(2.0), ..Settings::default() };
    let found = along(&positions, &profile, &settings);
    // The first and last elements are not complete in one direction each.
    assert!((found.rc - 2.5).abs() < 0.05, "{}", found.rc);
    assert!((found.rz1max - 4.0).abs() < 1e-3 && (found.rz - 3.0).abs() < 0.01, "{} {}", found.rz1max, found.rz);
}

/// Half a cut-off from the ends, a profile's roughness is that of the same place in a line ten times as long, to 1 % of the
/// waviness; at the ends it is not.
#[test]
fn ends_where_the_filter_is_incomplete_are_left_out() {
    let settings = Settings { lambda_c_mm: Some(0.8), ..Settings::default() };
    let positions: Vec<f64> = (0..8000).map(|point| f64::from(point) * 0.005).collect();
    let wave = |z: &f64| 2.0 * (TAU * z / 2.3).sin() + (TAU * z / 0.7 + 0.3).sin() + 0.2 * (TAU * z / 0.1).sin();
    let profile: Vec<f64> = positions.iter().map(wave).collect();
    let low_pass = |from: usize, to: usize| {
        let filtered = |z: &[f64], profile: &[f64]| Smoother::open(z, 0.8, Degree::One).low_pass(profile, None);
        filtered(&positions[from..to], &profile[from..to])
    };
    let (long, short) = (low_pass(0, 8000), low_pass(3000, 3800));
    let error = |from: usize, to: usize| {
        let pairs = short[from..to].iter().zip(&long[3000 + from..3000 + to]);
        pairs.map(|(short, long)| (short - long).abs()).fold(0.0, f64::max)
    };
    // 160 points are one cut-off.
    let (at_the_end, inside) = (error(0, 80), error(80, 720));
    println!("waviness of 3 µm, λc 0.8 mm: {at_the_end:.3} µm within λc/2 of an end, {inside:.4} µm further in");
    assert!(at_the_end > 0.1 && inside < 0.03, "{at_the_end} and {inside}");
    let found = along(&positions[3000..3800], &profile[3000..3800], &settings);
    assert!((found.cropped_mm - 0.4).abs() < 1e-12 && found.points == 640, "{found:?}");
    // Too short a line keeps its ends.
    assert!(along(&positions[..300], &profile[..300], &settings).cropped_mm.abs() < 1e-12);
}

/// Circles a millimetre apart end sections and cropped ends exactly: places that are off by what the fit of an axis to noisy points
/// leaves change no value by a step.
#[test]
fn places_at_the_end_of_a_section_may_be_off_a_little() {
    let settings = Settings { lambda_c_mm: Some(4.0), ..Settings::default() };
    let profile: Vec<f64> = (0..25).map(|point| f64::from(point * point * 7919 % 101) / 50.0).collect();
    let places = |off: f64| -> Vec<f64> {
        (0..25).map(|point| f64::from(point) + off * f64::from(point * 31 % 7 - 3)).collect()
    };
    let exact = along(&places(0.0), &profile, &settings);
    assert_eq!((exact.sections, exact.cropped_mm), (5, 2.0));
    for off in [1e-7, -1e-7, 1e-5, -1e-5] {
        let near = along(&places(off), &profile, &settings);
        assert_eq!(near.sections, exact.sections);
        for (near, exact) in [(near.ra, exact.ra), (near.rq, exact.rq), (near.rz, exact.rz), (near.rp, exact.rp)] {
            assert!((near / exact - 1.0).abs() < 1e3 * off.abs(), "{near} for {exact}");
        }
    }
}

/// An instrument that writes 4 mm as 8000 points half a micrometre apart has as many sections as one that writes the last point too.
#[test]
fn a_length_without_its_last_point_has_all_sections() {
    let settings = Settings { lambda_c_mm: Some(0.8), ..Settings::default() };
    let of = |count: i32| {
        let places: Vec<f64> = (0..count).map(|point| 0.0005 * f64::from(point)).collect();
        let profile: Vec<f64> = (0..count).map(|point| f64::from(point * 7919 % 1013) / 500.0).collect();
        along(&places, &profile, &settings)
    };
    let (without, with) = (of(8000), of(8001));
    assert_eq!((without.sections, with.sections), (4, 4));
    assert!((without.rz / with.rz - 1.0).abs() < 0.01, "{} {}", without.rz, with.rz);
    assert_eq!(of(7900).sections, 3);
}

/// Waves of 1.6 mm with λc = 4 mm over 60 mm, of which a third was not measured: texture is that of the whole line, whether points are absent or
/// not numbers. Stretches shorter than a section and the ends of the filter have none.
#[test]
fn a_gap_is_no_length() {
    let settings = Settings { lambda_c_mm: Some(4.0), section_mm: Some(4.0), ..Settings::default() };
    let wave = |z: &f64| 0.8 * (TAU * z / 1.6 + 0.7).sin() + 0.1 * (TAU * z / 0.5).sin() + 3.0 * (TAU * z / 55.0).cos();
    let all: Vec<f64> = (0..=600).map(|point| 0.1 * f64::from(point)).collect();
    let whole = along(&all, &all.iter().map(wave).collect::<Vec<_>>(), &settings);
    assert!(over_gaps(&all, &all, &settings).is_none());
    let near = |found: &Texture| {
        let pairs = [
            (found.ra, whole.ra),
            (found.rq, whole.rq),
            (found.rz, whole.rz),
            (found.rp, whole.rp),
            (found.rsm_mm, whole.rsm_mm),
            (found.rc, whole.rc),
            (found.rdq, whole.rdq),
            (found.rk, whole.rk),
        ];
        assert!(pairs.iter().all(|(found, whole)| (found / whole - 1.0).abs() < 0.02), "{found:?}\n{whole:?}");
    };
    let is_gap = |z: f64| (17.0..37.0).contains(&z);
    let z: Vec<f64> = all.iter().copied().filter(|z| !is_gap(*z)).collect();
    let heights: Vec<f64> = z.iter().map(wave).collect();
    let absent = along(&z, &heights, &settings);
    // 17 mm and 23 mm, of which 2 mm at each end are left out.
    assert_eq!((absent.sections, absent.points, absent.missing), (3 + 4, 130 + 191, 0));
    near(&absent);
    let said = over_gaps(&z, &heights, &settings).unwrap();
    assert!(said.contains("2 of 2 stretches, 39.9"), "{said}");
    let numbers: Vec<f64> = all.iter().map(|z| if is_gap(*z) { f64::NAN } else { wave(z) }).collect();
    near(&along(&all, &numbers, &settings));
    // The first stretch is too short now; then both are.
    let shorter = along(&z[100..], &heights[100..], &settings);
    assert_eq!(shorter.sections, 4);
    near(&shorter);
    let none = along(&z[100..240], &heights[100..240], &settings);
    assert!(none.values().iter().all(|value| value.is_nan()), "{none:?}");
    assert!(over_gaps(&z[100..240], &heights[100..240], &settings).unwrap().contains("no values"));
    // The primary profile's section is the whole line.
    let primary = Settings { kind: Kind::P, lambda_c_mm: None, section_mm: Some(60.0), ..settings };
    assert!(along(&z, &heights, &primary).ra.is_nan());
}
