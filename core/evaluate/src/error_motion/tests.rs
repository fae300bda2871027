#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::f64::consts::TAU;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{polar::seen_from, *};
use crate::trials::{fewest, trials};
use runout_draws::IntervalKind;
use runout_numerics::Complex64;
use runout_standards::roundness::ront_lsci_um;
use runout_turning::{azimuth::Azimuth, profile::TurnCount, spread::Projection};

const ANGLES: usize = 720;
/// A chosen sensitive direction.
const LINE_DEG: f64 = 30.0;
const UNKNOWNS: [Quantity; 4] = [Quantity::X, Quantity::Y, Quantity::TiltX, Quantity::TiltY];

/// Harmonics (order, coefficients of x, y, tilt about x and y of Re c e^{−inΦ}) at z = 0.
pub(super) fn separation(harmonics: &[(usize, [Complex64; 4])]) -> Separation {
    let mut estimate = vec![Complex64::ZERO; 4 * 21];
    for (order, values) in harmonics {
        estimate[4 * order..4 * order + 4].copy_from_slice(values);
    }
    Separation {
        sections: Vec::new(),
        unknowns: UNKNOWNS.to_vec(),
        variance: vec![f64::NAN; estimate.len()],
        observable: vec![true; estimate.len()],
        estimate,
        ..Separation::default()
    }
}

/// A capture whose turns lie between `low` and `high` in every direction.
fn profile(rotation: f64, [low, high]: [f64; 2]) -> Profile {
    let rows = UNKNOWNS.iter().enumerate().map(|(sensor, quantity)| (*quantity, vec![(sensor, 1.0)])).collect();
    let projection = Projection { rows, z_mm: 40.0, rotation }.with_lines(&[Azimuth::of(LINE_DEG.to_radians())]);
    let directions = projection.directions();
    let length = directions.len() * ANGLES;
    let spread = Spread {
        variance: vec![0.04; directions.len()],
        projection,
        directions,
        angles: ANGLES,
        turns: 60,
        low: vec![low; length],
        high: vec![high; length],
    };
    Profile {
        turn_angles: 512,
        object: "test".into(),
        setup: 0,
        sensors: Vec::new(),
        samples_per_rev: ANGLES,
        mean: Vec::new(),
        covariance: None,
        scatter: None,
        spread: Some(spread),
        turns: TurnCount::default(),
        speed_rpm: None,
        responses: Vec::new(),
        warnings: Vec::new(),
        ..Profile::default()
    }
}

fn values(separation: &Separation, profiles: &[Profile], centre: Centre) -> impl Fn(&str) -> Value + use<> {
    values_of("s", separation, profiles, centre)
}

fn values_of(
    station: &str,
    separation: &Separation,
    profiles: &[Profile],
    centre: Centre,
) -> impl Fn(&str) -> Value + use<> {
    let station = ErrorMotion { station, z_mm: 60.0, angles: ANGLES, separation, profiles, slope: 0.0 };
    let values = station.values(&[centre]);
    move |symbol: &str| values.iter().find(|value| value.symbol == symbol).unwrap().clone()
}

const NONE: [Complex64; 4] = [Complex64::ZERO; 4];
const LSC: Centre = Centre::Plot(Reference::LeastSquares);

fn with(place: usize, value: f64) -> [Complex64; 4] {
    let mut values = NONE;
    values[place] = Complex64::from(value);
    values
}

/// x = 2 cos 4Φ and a tilt about y of 5 cos 4Φ µrad, which 100 mm further is 0.5 µm of x: 5 µm peak to valley.
#[test]
fn total_holds_all_turns_about_the_synchronous_plot() {
    let separation = separation(&[(4, [2.0, 0.0, 0.0, 5.0].map(Complex64::from)), (1, with(0, 3.0))]);
    let profiles = [profile(1.0, [-0.1, 0.2]), profile(1.0, [-0.3, 0.1])];
    for centre in Centre::ALL {
        let value = values(&separation, &profiles, centre);
        // 1e-4 µm: terms of motion²/base circle.
        let near = |symbol: &str, expected: f64| {
            let found = value(symbol);
            assert!((found.value - expected).abs() < 1e-4, "{symbol} about {}: {found:?}", centre.symbol());
        };
        near("synchronous-radial-x", 5.0);
        near("total-radial-x", 5.0 + 0.3 + 0.2);
        near("asynchronous-radial-x", 0.4);
        near("synchronous-radial-y", 0.0);
        near("residual-synchronous-tilt-y", 10.0);
        near("fundamental-radial", 6.0);
        assert!(value("synchronous-radial-x").source.contains("z = 100 mm"));
        assert_eq!(value("synchronous-radial-x").band_upr, [2, 20]);
    }
}

/// At 30°, x = 2 cos 4Φ and y = 1.2 cos 4Φ are 2.332 cos 4Φ; the rms is that over √2, and of all turns with 0.2 µm of
/// theirs.
#[test]
fn any_fixed_direction_has_values_peak_to_valley_and_rms() {
    let separation = separation(&[(4, [2.0, 1.2, 3.0, 5.0].map(Complex64::from)), (1, with(0, 3.0))]);
    let profiles = [profile(1.0, [-0.1, 0.2]), profile(1.0, [-0.3, 0.1])];
    let value = values(&separation, &profiles, LSC);
    let (sine, cosine) = LINE_DEG.to_radians().sin_cos();
    // The plane of the values is 100 mm from the spindle's reference.
    let shift = cosine * (2.0 + 0.1 * 5.0) + sine * (1.2 - 0.1 * 3.0);
    let tilt = cosine * 5.0 - sine * 3.0;
    for (symbol, expected) in [
        ("synchronous-radial-at-30deg", 2.0 * shift),
        ("synchronous-radial-at-30deg-rms", shift / 2.0_f64.sqrt()),
        ("residual-synchronous-tilt-at-30deg", 2.0 * tilt),
        ("residual-synchronous-tilt-at-30deg-rms", tilt / 2.0_f64.sqrt()),
        ("asynchronous-radial-at-30deg", 0.4),
        ("asynchronous-radial-at-30deg-rms", 0.2),
        ("total-radial-at-30deg", 2.0 * shift + 0.5),
        ("total-radial-at-30deg-rms", (0.5 * shift * shift + 0.04).sqrt()),
        ("synchronous-radial-x-rms", 2.5 / 2.0_f64.sqrt()),
    ] {
        let found = value(symbol);
        assert!((found.value - expected).abs() < 1e-9, "{expected}: {found:?}");
    }
    // 2.5 cos 4Φ + 3 cos Φ is 5.5 at Φ = 0, and lowest near Φ = 136°.
    let lowest = (0..100_000).map(|step| TAU * f64::from(step) * 1e-5).map(|a| 2.5 * (4.0 * a).cos() + 3.0 * a.cos());
    let expected = 5.5 - lowest.fold(f64::MAX, f64::min) + 0.5;
    let found = value("total-radial-x-with-fundamental");
    assert!((found.value - expected).abs() < 1e-3 && found.reference.as_deref() == Some("PC"), "{expected}: {found:?}");
    assert!(value("synchronous-radial-at-30deg").source.contains("at 30° from x"));
}

/// Limits are checked against these names before there is any data.
#[test]
fn every_value_has_a_known_symbol_and_unit() {
    let separation = separation(&[(4, [2.0, 1.0, 3.0, 5.0].map(Complex64::from))]);
    let profiles = [profile(1.0, [-0.1, 0.2])];
    let station = ErrorMotion {
        station: "s",
        z_mm: 0.0,
        angles: ANGLES,
        separation: &separation,
        profiles: &profiles,
        slope: 0.0,
    };
    let mut found: Vec<(String, String)> =
        station.values(&[LSC]).into_iter().map(|value| (value.symbol, value.unit)).collect();
    // Along one line there is motion only where x and y are not observable (`plugins/spindle/tests/error_motion.rs`).
    let symbols = symbols(&[Azimuth::of(LINE_DEG.to_radians())], &[]);
    // Along the axis where sensors look along it (`plugins/spindle/tests/axial.rs`).
    let of_plane =
        symbols.into_iter().filter(|known| !known.symbol.contains("-along") && !known.symbol.contains("-axial"));
    let mut known: Vec<(String, String)> = of_plane.map(|known| (known.symbol, known.unit.replace('µ', "u"))).collect();
    found.sort();
    known.sort();
    assert_eq!(found, known);
}

/// 2/rev that turns with the spindle only moves the circle that a turning tool cuts; what turns against it at 1/rev makes
/// that circle an ellipse.
#[test]
fn the_rotating_direction_sees_two_less_or_more() {
    for rotation in [1.0, -1.0] {
        let profiles = [profile(rotation, [-0.1, 0.1])];
        // y = ±sin nΦ is Re(±i e^{−inΦ}).
        let round = |amplitude: f64, sense: f64| {
            [
                Complex64::from(amplitude),
                Complex64::new(0.0, sense * rotation * amplitude),
                Complex64::ZERO,
                Complex64::ZERO,
            ]
        };
        let moved = separation(&[(2, round(1.5, 1.0))]);
        for (centre, expected) in [(Centre::PolarChart, 3.0), (LSC, 0.0), (Centre::Plot(Reference::MinimumZone), 0.0)] {
            let found = values(&moved, &profiles, centre)("synchronous-radial-rotating").value;
            assert!((found - expected).abs() < 1e-4, "{found} about {}", centre.symbol());
        }
        let ellipse = separation(&[(1, round(0.7, -1.0))]);
        let value = values(&ellipse, &profiles, LSC);
        assert!((value("synchronous-radial-rotating").value - 1.4).abs() < 1e-12);
        assert!((value("fundamental-radial").value - 1.4).abs() < 1e-12);
        assert!(value("synchronous-radial-x").value < 1e-12, "1/rev is no part of a fixed direction");
        assert_eq!(value("synchronous-radial-rotating").band_upr, [1, 20]);
    }
}

/// An error that turns with the spindle at order n is one of order n − 1 only in the rotating direction.
#[test]
fn errors_of_x_and_y_go_together() {
    let mut separation = separation(&[(5, with(0, 1.0))]);
    let mut covariance = vec![Complex64::ZERO; 16 * 21];
    let entry = |order: usize, row: usize, column: usize| (order * 4 + row) * 4 + column;
    for (row, column, value) in
        [(0, 0, Complex64::ONE), (1, 1, Complex64::ONE), (1, 0, Complex64::I), (0, 1, -Complex64::I)]
    {
        covariance[entry(5, row, column)] = 0.04 * value;
    }
    // Of x by itself at order 9: half of it is x² cos², a quarter of E|δ|² at each neighbour.
    covariance[entry(9, 0, 0)] = Complex64::from(0.04);
    separation.motion_covariance = Some(covariance);
    let spread = profile(1.0, [0.0; 2]).spread.unwrap();
    let plot = Synchronous::new(&separation, &spread.projection, Direction::Rotating, 0.0).unwrap();
    for (order, variance) in plot.variance.iter().enumerate() {
        let expected = match order {
            4 => 0.04,
            8 | 10 => 0.01,
            _ => 0.0,
        };
        assert!((variance - expected).abs() < 1e-15, "order {order}: {variance}");
    }
    let fixed = Synchronous::new(&separation, &spread.projection, Direction::X, 0.0).unwrap();
    assert_eq!((fixed.variance[5], fixed.variance[9]), (0.04, 0.04));
    let known = values(&separation, &[profile(1.0, [-0.1, 0.1])], LSC)("synchronous-radial-x").uncertainty.unwrap();
    // ½·(0.04 + 0.04) is the variance at an angle, 0.08 that of a range if both ends were independent: 0.28. Either kind of
    // draws gives 0.32 to 0.35, both together more, as they lie 0.4 apart.
    assert!((0.2..0.5).contains(&known.std), "{known:?}");
}

/// 95 % intervals of synchronous values cover the true value where noise of high orders adds a good part of what is read: tilts of
/// 1 µrad rms that fall with order⁻¹ to 20 and of 0.03 µrad with order⁻², errors of 0.1 and 0.3 µrad at every angle in orders to 359, which have two
/// of the angles on a wave. As they contain two kinds of draws, they are wider than they need be; they may not be twice as wide as what was found
/// errs.
#[test]
fn intervals_of_synchronous_values_cover_the_true_value() {
    const HIGHEST: usize = 359;
    let count = trials(300);
    let mut random = ChaCha8Rng::seed_from_u64(22);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let profiles = [profile(1.0, [-0.1, 0.1])];
    for (fall, std, tilt_urad) in [(-1, 0.1, 1.0), (-2, 0.3, 0.03)] {
        let rms = (2..=20).map(|order| 0.5 * f64::from(order).powi(2 * fall)).sum::<f64>().sqrt() / tilt_urad;
        let symbols = ["residual-synchronous-tilt-x", "residual-synchronous-tilt-rotating", "synchronous-radial-x"];
        let (mut inside, mut found_bias, mut raw_bias) = ([0; 3], [0.0; 3], [0.0; 3]);
        let (mut squares, mut widths) = ([0.0; 3], [0.0; 3]);
        for trial in 0..count {
            let mut exact = separation(&[]);
            exact.estimate = vec![Complex64::ZERO; 4 * (HIGHEST + 1)];
            exact.observable = vec![true; exact.estimate.len()];
            exact.variance = vec![f64::NAN; exact.estimate.len()];
            for order in 2..=20 {
                for motion in 0..4 {
                    let phase = Complex64::new(normal(), normal());
                    exact.estimate[4 * order + motion] = phase / phase.norm() * ((order as f64).powi(fall) / rms);
                }
            }
            let mut noisy = exact.clone();
            let variance = 2.0 * std * std / (HIGHEST - 1) as f64;
            let share = (0.5 * variance).sqrt();
            noisy.estimate[8..]
                .iter_mut()
                .for_each(|value| *value += Complex64::new(share * normal(), share * normal()));
            let raw = values(&noisy, &profiles, LSC);
            let mut covariance = vec![Complex64::ZERO; 16 * (HIGHEST + 1)];
            let mut told = variance;
            for order in 2..=HIGHEST {
                if order.is_multiple_of(5) {
                    // Five orders have their variance in common.
                    told = variance * (0..40).map(|_| normal().powi(2)).sum::<f64>() / 40.0;
                }
                (0..4).for_each(|motion| covariance[16 * order + 5 * motion] = Complex64::from(told));
            }
            noisy.motion_covariance = Some(covariance);
            // The noise of each five orders is known from forty squares.
            noisy.freedom = 8;
            let (truth, found) =
                (values(&exact, &profiles, LSC), values_of(&format!("s{trial}"), &noisy, &profiles, LSC));
            for (index, symbol) in symbols.iter().enumerate() {
                let (truth, found, raw) = (truth(symbol).value, found(symbol), raw(symbol).value);
                let [low, high] = found.uncertainty.as_ref().unwrap().interval_95;
                let middle = 0.5 * (low + high);
                inside[index] += usize::from(low <= truth && truth <= high);
                found_bias[index] += (middle - truth) / count as f64;
                raw_bias[index] += (raw - truth) / count as f64;
                squares[index] += (middle - truth).powi(2) / count as f64;
                widths[index] += (high - low) / count as f64;
                // The value is what was measured; where noise has raised it out of its interval, it says so.
                assert!((found.value - raw).abs() < 1e-9, "{found:?}");
                assert!((low..=high).contains(&found.value) || found.raised_by_noise.is_some(), "{found:?}");
            }
        }
        let percent = inside.map(|inside| 100.0 * inside as f64 / count as f64);
        let wider = [0, 1, 2].map(|index| widths[index] / (2.0 * 1.96 * f64::sqrt(squares[index])));
        println!(
            "order^{fall}, {std}: {percent:.1?} %, {wider:.2?} times as wide as the errors, off by {found_bias:.3?}, with noise {raw_bias:.3?}"
        );
        for (inside, (bias, raw)) in inside.iter().zip(found_bias.iter().zip(raw_bias)) {
            // 95 % of 300 are 285 ± 3.8.
            assert!(*inside >= fewest(count, [275, 300], 0.95), "{inside} of {count}");
            assert!(bias.abs() < 0.5 * raw, "{bias} of {raw}");
        }
        assert!(wider.iter().all(|wider| *wider < 2.0), "{wider:?} times as wide");
    }
}

#[test]
fn what_is_lost_is_said_and_left_out() {
    let mut lossy = separation(&[(1, with(0, 3.0)), (2, with(0, 1.0)), (3, with(0, 7.0)), (4, with(1, 1.0))]);
    for (order, unknown) in [(1, 0), (3, 0), (4, 1)] {
        lossy.estimate[4 * order + unknown] = Complex64::new(f64::NAN, f64::NAN);
        lossy.observable[4 * order + unknown] = false;
    }
    let profiles = [profile(1.0, [-0.1, 0.1])];
    let value = values(&lossy, &profiles, LSC);
    assert!((value("synchronous-radial-x").value - 2.0).abs() < 1e-12);
    assert_eq!(value("synchronous-radial-x").lost_orders, [3]);
    assert_eq!(value("synchronous-radial-rotating").lost_orders, [1, 3, 4]);
    let station =
        ErrorMotion { station: "s", z_mm: 0.0, angles: ANGLES, separation: &lossy, profiles: &profiles, slope: 0.0 };
    assert!(station.values(&[LSC]).iter().all(|value| value.symbol != "fundamental-radial"));
    let mut without_y = lossy.clone();
    without_y.observable.iter_mut().skip(1).step_by(4).for_each(|told| *told = false);
    let station = ErrorMotion { separation: &without_y, ..station };
    let symbols: Vec<String> = station.values(&[LSC]).into_iter().map(|value| value.symbol).collect();
    assert!(!symbols.contains(&"synchronous-radial-y".into()) && symbols.contains(&"asynchronous-radial-y".into()));
    assert!(ErrorMotion { profiles: &[], ..station }.values(&[LSC]).is_empty(), "no spread, no values");
}

#[test]
fn setups_give_the_uncertainty_of_a_range() {
    assert_eq!(between_setups(&[1.0], 0.0), None);
    // By hand: mean 1.1, standard deviation 0.1, t = 4.302653 for 2 degrees of freedom, √(4/3).
    let known = between_setups(&[1.0, 1.1, 1.2], 0.0).unwrap();
    let half = 4.302_653 * 0.1 * (4.0_f64 / 3.0).sqrt();
    assert!((known.std - 0.1).abs() < 1e-12);
    // It is of another capture, and stays so where a declared form widens it.
    assert_eq!(known.kind, IntervalKind::Prediction);
    assert_eq!(bounded(Some(known.clone()), 0.1).map(|wider| wider.kind), Some(IntervalKind::Prediction));
    // The table's last digit.
    assert!((known.interval_95[0] - (1.1 - half)).abs() < 1e-6 && (known.interval_95[1] - (1.1 + half)).abs() < 1e-6);
}

/// Where a plot ends up does not depend on where its circle was centred.
#[test]
fn centres_follow_a_displaced_plot() {
    let angles = Angles::equal(ANGLES);
    let mut points = Points::default();
    let step = TAU / ANGLES as f64;
    let plot: Vec<f64> = (0..ANGLES)
        .map(|index| {
            let angle = step * index as f64;
            2.0 * angle.cos() - angle.sin() + 0.5 * (3.0 * angle).cos()
        })
        .collect();
    for centre in Centre::ALL.into_iter().skip(1) {
        let [x, y] = centre.of(&angles, &plot, &mut points).unwrap();
        assert!((x - 2.0).abs() < 1e-3 && (y + 1.0).abs() < 1e-3, "{}: {x} {y}", centre.symbol());
        let seen = seen_from([x, y], &angles, &plot);
        assert!((ront_lsci_um(&seen) - 1.0).abs() < 1e-3);
    }
}
