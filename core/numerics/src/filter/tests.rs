use std::f64::consts::TAU;

use super::*;
use crate::{fourier::Fourier, height_map::HeightMap};

/// What half of the amplitude may differ by: 0.01 %.
const HALF: f64 = 1e-4;

fn sine(points: usize, upr: usize) -> Vec<f64> {
    (0..points).map(|point| (TAU * upr as f64 * point as f64 / points as f64 + 0.4).sin()).collect()
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// Share of a sine's rms that passes.
fn passed(filtered: &[f64], sine: &[f64]) -> f64 {
    rms(filtered) / rms(sine)
}

#[test]
fn half_of_a_sine_at_the_cut_off_passes_a_closed_filter() {
    let points = 7200;
    let mut fourier = Fourier::new(points);
    let mut filtered = |profile: &[f64], band: Band| {
        let mut harmonics = vec![Complex64::ZERO; fourier.max_order() + 1];
        fourier.analyse(profile.iter().copied(), &mut harmonics);
        band.apply(&mut harmonics);
        fourier.synthesise(harmonics).to_vec()
    };
    println!("UPR   low-pass   high-pass   regression 1   regression 2");
    for upr in [15, 50, 150, 500, 1500] {
        let profile = sine(points, upr);
        let cutoff = upr as f64;
        let low = passed(&filtered(&profile, Band::low_pass(cutoff)), &profile);
        let high = passed(&filtered(&profile, Band::high_pass(cutoff)), &profile);
        let [one, two] = [Degree::One, Degree::Two]
            .map(|degree| passed(&Smoother::closed(points, cutoff, degree).low_pass(&profile, None), &profile));
        println!("{upr:4} {:9.4} % {:9.4} % {:11.4} % {:11.4} %", 100.0 * low, 100.0 * high, 100.0 * one, 100.0 * two);
        for share in [low, high, one, two] {
            assert!((share - 0.5).abs() < HALF, "{upr} UPR: {share}");
        }
    }
    // Two cut-offs: half at each end, nearly all in between; far outside, nothing.
    let band = Band { above_upr: Some(15.0), below_upr: Some(500.0) };
    for (upr, share) in [(1, 0.003_08), (15, 0.499_7), (90, 0.978), (500, 0.5), (2000, 1.5e-5)] {
        let profile = sine(points, upr);
        let found = passed(&filtered(&profile, band), &profile);
        assert!((found - share).abs() < 1e-3 * (share + 0.1), "{upr} UPR: {found} instead of {share}");
    }
}

#[test]
fn half_of_a_sine_at_the_cut_off_passes_an_open_filter() {
    println!("λc/mm   degree 1, even   uneven   degree 2, even");
    for cutoff in [0.08, 0.25, 0.8, 2.5, 8.0] {
        // 10 wavelengths of 100 points; the uneven ones come and go by a third of their distance.
        let spacing = cutoff / 100.0;
        let even: Vec<f64> = (0..1000).map(|point| f64::from(point) * spacing).collect();
        let uneven: Vec<f64> =
            (0..1000).map(|point| (f64::from(point) + 0.3 * f64::from(point * 7 % 10) / 10.0) * spacing).collect();
        let share = |positions: &[f64], degree| {
            let profile: Vec<f64> = positions.iter().map(|z| (TAU * z / cutoff + 0.4).sin()).collect();
            let filtered = Smoother::open(positions, cutoff, degree).low_pass(&profile, None);
            // 3 wavelengths from the ends, where the Gaussian is whole; the amplitude by projection on the sine.
            let inner = 300..700;
            let product: f64 = filtered[inner.clone()].iter().zip(&profile[inner.clone()]).map(|(a, b)| a * b).sum();
            product / profile[inner].iter().map(|value| value * value).sum::<f64>()
        };
        let shares = [share(&even, Degree::One), share(&uneven, Degree::One), share(&even, Degree::Two)];
        println!("{cutoff:5} {:14.4} % {:9.4} % {:11.4} %", 100.0 * shares[0], 100.0 * shares[1], 100.0 * shares[2]);
        assert!((shares[0] - 0.5).abs() < HALF && (shares[2] - 0.5).abs() < HALF, "{shares:?}");
        // The rectangle rule on uneven cells is of second order: (spacing/λ)² · some units.
        assert!((shares[1] - 0.5).abs() < 10.0 * HALF, "{shares:?}");
    }
}

#[test]
fn ends_keep_what_the_degree_can_follow() {
    let positions: Vec<f64> = (0..60).map(|point| f64::from(point * point) * 0.01).collect();
    let polynomial = |z: &f64, degree: i32| 3.0 - 0.5 * z * f64::from(degree.min(1)) + z * z * f64::from(degree / 2);
    for (degree, power) in [(Degree::Zero, 0), (Degree::One, 1), (Degree::Two, 2)] {
        let profile: Vec<f64> = positions.iter().map(|z| polynomial(z, power)).collect();
        let filtered = Smoother::open(&positions, 8.0, degree).low_pass(&profile, None);
        for (found, expected) in filtered.iter().zip(&profile) {
            // 1e-9: rounding of the normal equations of values up to 1200.
            assert!((found - expected).abs() < 1e-9 * 1200.0, "{degree:?}: {found} instead of {expected}");
        }
    }
}

#[test]
fn missing_points_stay_missing_and_have_no_say() {
    let mut profile = sine(720, 2);
    profile[100..140].fill(f64::NAN);
    let filtered = Smoother::closed(720, 50.0, Degree::One).low_pass(&profile, None);
    for (found, given) in filtered.iter().zip(&profile) {
        assert_eq!(found.is_nan(), given.is_nan());
        // 2 UPR pass a cut-off of 50 but for 1 − 2^−0.0016 = 0.11 %; one-sided at the gap some times that.
        assert!(given.is_nan() || (found - given).abs() < 0.02, "{found} instead of {given}");
    }
    assert!(Smoother::open(&[], 1.0, Degree::One).low_pass(&[], None).is_empty());
    assert_eq!(Smoother::open(&[0.0, 100.0], 1.0, Degree::Two).low_pass(&[1.0, 2.0], None), [1.0, 2.0]);
}

#[test]
fn scratches_do_not_pull_the_robust_filter() {
    let waves = sine(1440, 3);
    let mut profile = waves.clone();
    // Texture of 0.1 µm, and six scratches of 5 µm, 3 % of the surface.
    for (point, value) in profile.iter_mut().enumerate() {
        *value += 0.1 * (TAU * 167.0 * point as f64 / 1440.0).sin() - if point % 240 < 7 { 5.0 } else { 0.0 };
    }
    let smoother = Smoother::closed(1440, 50.0, Degree::Two);
    let worst = |low_pass: &[f64]| low_pass.iter().zip(&waves).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let plain = worst(&smoother.low_pass(&profile, None));
    let robust = robust_gaussian(&smoother, &profile);
    assert!(robust.settled && robust.iterations < 30, "{} iterations", robust.iterations);
    // The linear filter follows the scratches by microns, the robust one stays within the texture.
    assert!(plain > 1.0 && worst(&robust.low_pass) < 0.05, "{plain} µm and {} µm", worst(&robust.low_pass));
    assert!(robust.weights[3] == 0.0 && robust.weights[100] > 0.3);
    // Along an open line, the same; but for a scratch right at its beginning, which a parabola can follow.
    let positions: Vec<f64> = (0..1440).map(f64::from).collect();
    let open = robust_gaussian(&Smoother::open(&positions, 1440.0 / 50.0, Degree::Two), &profile);
    let inner = open.low_pass[60..].iter().zip(&waves[60..]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(inner < 0.1, "{inner} µm");
}

#[test]
fn half_of_a_wave_at_the_cut_off_passes_the_areal_filter() {
    // 1 mm around a turn of 20 mm and along 10 mm, 50 points a millimetre; a wave around, along, and aslant (3-4-5).
    let map = |around: f64, along: f64, closed: bool| {
        let heights: Vec<f64> = (0..500 * 1000)
            .map(|point| {
                let (x, y) = (f64::from(point % 1000) / 50.0, f64::from(point / 1000) / 50.0);
                (TAU * (around * x + along * y)).sin()
            })
            .collect();
        HeightMap::new(heights, 1000, 0.02, 0.02, closed).unwrap()
    };
    for (around, along, closed) in [(1.0, 0.0, true), (0.0, 1.0, true), (0.6, 0.8, true), (0.6, 0.8, false)] {
        let wave = map(around, along, closed);
        let filtered = areal_gaussian(&wave, 1.0);
        let inner = |values: &[f64]| -> Vec<f64> {
            (100..400).flat_map(|row| values[row * 1000 + 100..row * 1000 + 900].to_vec()).collect()
        };
        let (kept, given) = (inner(&filtered), inner(wave.heights_um()));
        let share: f64 =
            kept.iter().zip(&given).map(|(a, b)| a * b).sum::<f64>() / given.iter().map(|b| b * b).sum::<f64>();
        assert!((share - 0.5).abs() < HALF, "({around}, {along}): {share}");
        // A gap changes nothing three cut-offs away from it, and stays a gap.
        let mut heights = wave.heights_um().to_vec();
        heights[250 * 1000 + 500] = f64::NAN;
        let gapped = areal_gaussian(&wave.with(heights), 1.0);
        assert!(gapped[250 * 1000 + 500].is_nan());
        assert!((gapped[250 * 1000 + 200] - filtered[250 * 1000 + 200]).abs() < 1e-9);
        assert!((gapped[250 * 1000 + 501] - filtered[250 * 1000 + 501]).abs() < 1e-3);
    }
}
