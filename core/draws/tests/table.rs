//! How often intervals of values of closed profiles cover the true value, by form and noise: the table of docs/appendix/intervals.md.
//!
//! Forms, noise and variances that are known badly are drawn here; values are those of profiles on angles.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests; one prints a table")]

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};
use runout_draws::{Draws, Measured, VarianceFrom};
use runout_numerics::{Complex64, fourier::Fourier};

const ORDERS: usize = 120;
const ANGLES: usize = 512;
const NOISES_UM: [f64; 5] = [0.003, 0.02, 0.05, 0.1, 0.3];

type Harmonics = Vec<Complex64>;

fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

fn complex(random: &mut ChaCha8Rng) -> Complex64 {
    Complex64::new(normal(random), normal(random)) * 0.5_f64.sqrt()
}

/// All orders from 2 to a last one with mean amplitudes that fall, by chance, of this root mean square.
fn falling(rms_um: f64, fall: f64, last: usize, random: &mut ChaCha8Rng) -> Harmonics {
    let power = |order: usize| if (2..=last).contains(&order) { (order as f64).powf(-2.0 * fall) } else { 0.0 };
    let sum: f64 = (0..=ORDERS).map(power).sum();
    (0..=ORDERS).map(|order| complex(random) * (2.0 * rms_um * rms_um * power(order) / sum).sqrt()).collect()
}

fn lobes(lobes: usize, amplitude_um: f64, random: &mut ChaCha8Rng) -> Harmonics {
    let phase = TAU * random.random::<f64>();
    let of = |order| if order == lobes { Complex64::from_polar(amplitude_um, phase) } else { Complex64::ZERO };
    (0..=ORDERS).map(of).collect()
}

/// A Gaussian curve of a standard deviation of 2°, of this height.
fn bump(height_um: f64, random: &mut ChaCha8Rng) -> Harmonics {
    let place = TAU * random.random::<f64>();
    let curve = |order: usize| {
        if order < 2 { 0.0 } else { (-0.5 * (2_f64.to_radians() * order as f64).powi(2)).exp() }
    };
    let sum: f64 = (0..=ORDERS).map(curve).sum();
    (0..=ORDERS).map(|order| Complex64::from_polar(height_um * curve(order) / sum, order as f64 * place)).collect()
}

/// Heights over the angle whose edges are a degree wide, turned by chance.
fn of_heights(height_um: fn(f64) -> f64, random: &mut ChaCha8Rng) -> Harmonics {
    const HEIGHTS: usize = 4096;
    let place = TAU * random.random::<f64>();
    let mut harmonics = vec![Complex64::ZERO; ORDERS + 1];
    let angles = (0..HEIGHTS).map(|at| TAU * at as f64 / HEIGHTS as f64 + place);
    Fourier::new(HEIGHTS).analyse(angles.map(height_um), &mut harmonics);
    let edge = |order: usize| (-0.5 * (1_f64.to_radians() * order as f64).powi(2)).exp();
    harmonics.iter().enumerate().map(|(order, harmonic)| edge(order) * harmonic).collect()
}

fn sum(forms: &[Harmonics]) -> Harmonics {
    (0..=ORDERS).map(|order| forms.iter().map(|form| form[order]).sum()).collect()
}

type Form = fn(&mut ChaCha8Rng) -> Harmonics;

const FORMS: [(&str, Form); 22] = [
    ("4 µm 1/n to 60", |random| falling(4.0, 1.0, 60, random)),
    ("1 µm 1/n", |random| falling(1.0, 1.0, ORDERS, random)),
    ("0.1 µm 1/n to 60", |random| falling(0.1, 1.0, 60, random)),
    ("0.4 µm flat", |random| falling(0.4, 0.0, ORDERS, random)),
    ("2 µm n^-1.2", |random| {
        let mut phase = || TAU * random.random::<f64>();
        let of = |order: usize| if order < 2 { 0.0 } else { 2.0 * (order as f64).powf(-1.2) };
        (0..=ORDERS).map(|order| Complex64::from_polar(of(order), phase())).collect()
    }),
    ("2 lobes 1 µm", |random| lobes(2, 1.0, random)),
    ("3 lobes 2 µm", |random| lobes(3, 2.0, random)),
    ("15 lobes 1 µm", |random| lobes(15, 1.0, random)),
    ("15 lobes + 0.1 µm 1/n", |random| sum(&[lobes(15, 1.0, random), falling(0.1, 1.0, 60, random)])),
    ("3 lobes + 0.02 µm 1/n", |random| sum(&[lobes(3, 1.0, random), falling(0.02, 1.0, 60, random)])),
    ("scratch 2 µm on 0.05", |random| sum(&[bump(-2.0, random), falling(0.05, 1.0, 60, random)])),
    ("scratch 0.3 µm on 0.1", |random| sum(&[bump(-0.3, random), falling(0.1, 1.0, 60, random)])),
    ("scratch 0.5 µm + 1 µm 1/n", |random| sum(&[bump(-0.5, random), falling(1.0, 1.0, 60, random)])),
    ("bump 1 µm alone", |random| bump(1.0, random)),
    ("nothing", |_| vec![Complex64::ZERO; ORDERS + 1]),
    ("4 lines", |random| sum(&[2, 3, 7, 22].map(|order| lobes(order, 1.0 / order as f64, random)))),
    ("mixture", |random| {
        sum(&[
            lobes(3, 0.5, random),
            lobes(12, 0.2, random),
            falling(0.15, 1.0, 80, random),
            bump(-0.6, random),
            lobes(48, 0.04, random),
        ])
    }),
    // Level arcs, which harmonics show as waves.
    ("4 arcs ±2.5 µm", |random| of_heights(|angle| 2.5 * (2.0 * angle).sin().signum(), random)),
    ("20 arcs ±0.2 µm", |random| of_heights(|angle| 0.2 * (10.0 * angle).sin().signum(), random)),
    ("step 0.8 µm", |random| of_heights(|angle| if angle.rem_euclid(TAU) < 2.0 { 0.8 } else { 0.0 }, random)),
    ("play 2.5 µm", |random| {
        of_heights(|angle| 2.5 * (angle.sin().signum() * angle.cos() - angle.cos().signum() * angle.sin()), random)
    }),
    ("12 cusps 1 µm", |random| of_heights(|angle| (6.0 * angle).sin().abs(), random)),
];

/// Variance of each order of noise of a standard deviation at an angle: white, or of three sensors whose weighted sum hardly sees some orders.
fn variance(of_three_sensors: bool, std_um: f64) -> Vec<f64> {
    let gain = |order: usize| {
        let [a1, a2] = [99.844_f64, 202.5].map(f64::to_radians);
        let (a, b) = (-a2.sin() / (a2 - a1).sin(), a1.sin() / (a2 - a1).sin());
        let seen = 1.0 + a * Complex64::cis(order as f64 * a1) + b * Complex64::cis(order as f64 * a2);
        (1.0 + a * a + b * b).sqrt() / seen.norm().max(0.02)
    };
    let mut squares: Vec<f64> = (2..=ORDERS).map(|order| gain(order).powi(2)).collect();
    squares.sort_by(f64::total_cmp);
    let median = squares[squares.len() / 2];
    let white = 2.0 * std_um * std_um / (ORDERS - 1) as f64;
    let of = |order: usize| {
        if order < 2 {
            0.0
        } else if of_three_sensors {
            white * (gain(order).powi(2) / median).min(1e4)
        } else {
            white
        }
    };
    (0..=ORDERS).map(of).collect()
}

/// Variances as they are estimated from 8, 24 and 40 squares, and those numbers.
fn estimated(variance: &[f64], random: &mut ChaCha8Rng) -> (Vec<f64>, Vec<usize>) {
    let (mut found, mut squares) = (variance.to_vec(), vec![0; ORDERS + 1]);
    let mut order = 2;
    while order <= ORDERS {
        let (together, of) = match order {
            2 | 3 => (1, 8),
            4 => (4, 24),
            _ => (5, 40),
        };
        let chance: f64 = ChiSquared::new(of as f64).unwrap().sample(random) / of as f64;
        for order in order..(order + together).min(ORDERS + 1) {
            found[order] *= chance;
            squares[order] = of;
        }
        order += together;
    }
    (found, squares)
}

const NAMES: [&str; 12] =
    ["RONt", "RONp", "RONv", "RONq", "RONt 50", "RONp 50", "RONv 50", "RONt 15", "RONq 15", "dr/dθ", "dr/dθ 15", "Ra"];

/// Which profiles values are of: cut-off of the Gaussian filter, and whether they are slopes.
const PROFILES: [(Option<f64>, bool); 5] =
    [(None, false), (Some(50.0), false), (Some(15.0), false), (None, true), (Some(15.0), true)];

fn weight(profile: usize, order: usize) -> Complex64 {
    let (cutoff, is_slope) = PROFILES[profile];
    let passed = cutoff.map_or(1.0, |cutoff| 0.5_f64.powf((order as f64 / cutoff).powi(2)));
    passed * if is_slope { Complex64::I * order as f64 } else { Complex64::ONE }
}

/// Values of one of the profiles.
fn values(profile: usize, heights: &[f64]) -> Vec<f64> {
    let (low, high) =
        heights.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(*at), high.max(*at)));
    let mean = |of: &dyn Fn(f64) -> f64| heights.iter().map(|height| of(*height)).sum::<f64>() / heights.len() as f64;
    let rms = mean(&|height| height * height).sqrt();
    match profile {
        0 => vec![high - low, high, -low, rms, mean(&f64::abs)],
        1 => vec![high - low, high, -low],
        2 => vec![high - low, rms],
        _ => vec![high.max(-low)],
    }
}

/// Values of all profiles in the order of [`NAMES`].
fn in_order(of_profiles: [Vec<f64>; 5]) -> Vec<f64> {
    let [all, of_50, of_15, slopes, slopes_of_15] = of_profiles;
    [&all[..4], &of_50, &of_15, &slopes, &slopes_of_15, &all[4..]].concat()
}

/// Of each value: truths below and above the interval, and the mean width in standard deviations of the noise.
#[derive(Debug, Clone, Default)]
struct Cell {
    below: usize,
    above: usize,
    width: f64,
}

/// How well the variances of the noise are known.
#[derive(Debug, Clone, Copy)]
enum Known {
    FromSquares,
    /// Stated as exact, of a standard deviation so many times the true one.
    Stated(f64),
}

fn cells(form: Form, of_three_sensors: bool, std_um: f64, known: Known, trials: u64) -> Vec<Cell> {
    let exact = variance(of_three_sensors, std_um);
    let noise_um = (0.5 * exact.iter().sum::<f64>()).sqrt();
    let mut fourier = Fourier::new(ANGLES);
    let mut cells = vec![Cell::default(); NAMES.len()];
    for trial in 0..trials {
        let mut random = ChaCha8Rng::seed_from_u64(91_000 + trial);
        let mut truth = form(&mut random);
        truth[..2].fill(Complex64::ZERO);
        let harmonics: Harmonics =
            truth.iter().zip(&exact).map(|(truth, variance)| truth + complex(&mut random) * variance.sqrt()).collect();
        let (variance, squares) = match known {
            Known::FromSquares => estimated(&exact, &mut random),
            Known::Stated(times) => {
                (exact.iter().map(|variance| times * times * variance).collect(), vec![0; ORDERS + 1])
            }
        };
        let draws = Draws::of_section(
            &Measured { harmonics, variance, squares, variance_from: VarianceFrom::OrdersBeside, lowest: 2 },
            trial,
        )
        .unwrap();
        let of_truth = |profile: usize| {
            values(profile, fourier.synthesise(truth.iter().enumerate().map(|(n, c)| c * weight(profile, n))))
        };
        let truths = in_order([0, 1, 2, 3, 4].map(of_truth));
        let ends = |end: usize| {
            in_order([0, 1, 2, 3, 4].map(|profile| {
                let profiles = draws.profiles(|order| weight(profile, order), ANGLES, |_, _| ());
                let known = profiles.values_of_section(|heights, found| found.extend(values(profile, heights)));
                known.into_iter().map(|known| known.uncertainty.unwrap().interval_95[end]).collect()
            }))
        };
        let (low, high) = (ends(0), ends(1));
        for (cell, (truth, (low, high))) in cells.iter_mut().zip(truths.iter().zip(low.iter().zip(&high))) {
            let rounding = 1e-9 * (1.0 + truth);
            cell.below += usize::from(*truth < low - rounding);
            cell.above += usize::from(*truth > high + rounding);
            cell.width += (high - low) / noise_um / trials as f64;
        }
    }
    cells
}

/// Two forms of each kind that any change of the method has failed at.
#[test]
fn intervals_cover_the_true_value_of_unlike_forms() {
    const TRIALS: u64 = 40;
    for (form, of_three_sensors, std_um) in [
        (5, false, 0.05),
        (6, true, 0.02),
        (10, false, 0.1),
        (13, false, 0.02),
        (14, false, 0.1),
        (16, true, 0.05),
        (18, false, 0.1),
        (20, true, 0.02),
    ] {
        let (name, form) = FORMS[form];
        for (value, cell) in NAMES.iter().zip(cells(form, of_three_sensors, std_um, Known::FromSquares, TRIALS)) {
            // 95 % of 40 are 38 ± 1.4; four of those below it.
            assert!(cell.below + cell.above <= 7, "{name}, {std_um} µm, {value}: {cell:?} of {TRIALS}");
        }
    }
}

/// Trials of 40 in which the truth is outside, of each value where noise is stated too large.
fn outside_where_stated_too_large(form: usize, std_um: f64, times: f64) -> Vec<(&'static str, usize)> {
    let (name, form) = FORMS[form];
    let cells = cells(form, false, std_um, Known::Stated(times), 40);
    let outside: Vec<_> = NAMES.into_iter().zip(cells.iter().map(|cell| cell.below + cell.above)).collect();
    println!("{name}, {std_um} µm stated {times} times too large, outside of 40: {outside:?}");
    outside
}

/// A variance that the data refute as too large does not make an interval too narrow.
#[test]
fn intervals_cover_the_true_value_where_noise_is_stated_too_large() {
    for (form, std_um, times) in [
        (0, 0.1, 30.0),
        (0, 0.1, 100.0),
        (2, 0.01, 30.0),
        (2, 0.003, 1000.0),
        (3, 0.1, 10.0),
        (14, 0.1, 10.0),
        (16, 0.05, 30.0),
    ] {
        for (value, outside) in outside_where_stated_too_large(form, std_um, times) {
            assert!(outside <= 7, "form {form}, {std_um} µm stated {times} times too large, {value}: {outside} of 40");
        }
    }
}

/// Noise that is small by chance hides as much as usual: no interval is a point.
#[test]
fn noise_that_is_small_by_chance_leaves_no_interval_of_width_0() {
    let exact = variance(false, 0.1);
    for trial in 0..20 {
        let mut random = ChaCha8Rng::seed_from_u64(trial);
        let noise = exact.iter().map(|variance| complex(&mut random) * (0.75 * variance).sqrt());
        let harmonics: Harmonics = noise.collect();
        let measured = Measured {
            harmonics,
            variance: exact.clone(),
            squares: vec![40; ORDERS + 1],
            variance_from: VarianceFrom::OrdersBeside,
            lowest: 2,
        };
        let draws = Draws::of_section(&measured, trial).unwrap();
        let profiles = draws.profiles(|order| weight(0, order), ANGLES, |_, _| ());
        for known in profiles.values_of_section(|heights, found| found.extend(values(0, heights))) {
            let [low, high] = known.uncertainty.unwrap().interval_95;
            assert!(low < 1e-9 && high > 0.01, "{trial}: {low} to {high}");
        }
    }
}

#[test]
#[ignore = "prints the table of docs/appendix/intervals.md, which takes minutes"]
fn table() {
    let trials: u64 = std::env::var("TRIALS").ok().and_then(|trials| trials.parse().ok()).unwrap_or(60);
    for of_three_sensors in [false, true] {
        let kind = if of_three_sensors { "three sensors" } else { "white" };
        let mut all: Vec<Vec<(f64, f64, String)>> = vec![Vec::new(); NAMES.len()];
        for (name, form) in FORMS {
            for std_um in NOISES_UM {
                for (all, cell) in all.iter_mut().zip(cells(form, of_three_sensors, std_um, Known::FromSquares, trials))
                {
                    let percent = 100.0 * (1.0 - (cell.below + cell.above) as f64 / trials as f64);
                    if percent < 85.0 {
                        println!("{name}, {kind}, {std_um} µm: {percent:.0} %");
                    }
                    all.push((percent, cell.width, format!("{name}, {std_um} µm, -{} +{}", cell.below, cell.above)));
                }
            }
        }
        println!("| value, {kind} | mean | lowest | cells from 93 % | median width |\n|---|---|---|---|---|");
        for (name, mut cells) in NAMES.iter().zip(all) {
            let count = cells.len() as f64;
            let mean = cells.iter().map(|cell| cell.0).sum::<f64>() / count;
            let good = cells.iter().filter(|cell| cell.0 >= 93.0).count() as f64 / count;
            cells.sort_by(|a, b| a.1.total_cmp(&b.1));
            let width = cells[cells.len() / 2].1;
            cells.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (lowest, _, at) = &cells[0];
            println!("| {name} | {mean:.1} % | {lowest:.0} % ({at}) | {:.0} % | {width:.2} |", 100.0 * good);
        }
    }
}
