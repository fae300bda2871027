//! How often intervals of roundness cover the true value where errors are large, by profiles that share no formula with the evaluation: sums of
//! cosines at angles, white noise at each angle, harmonics by sums over all angles, and reference circles by search over centres and by
//! Welzl's algorithm on very many points.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests; one prints a table for the documentation")]

use std::{collections::BTreeMap, f64::consts::TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{
    section_values,
    tests::{RADIUS_MM, evaluate, station},
};
use crate::{
    Value,
    trials::{fewest, trials},
};
use runout_numerics::Complex64;

/// Angles at which a profile is measured.
pub(super) const ANGLES: usize = 512;
/// Highest order that is kept of it.
pub(super) const HIGHEST: usize = 250;
/// Angles at which the true profile is evaluated.
pub(super) const DENSE: usize = 4096;

/// A form as waves (order, amplitude, phase).
pub(super) type Waves = Vec<(usize, f64, f64)>;

/// Six lines, or all orders with amplitudes that fall.
fn waves(lines: bool, random: &mut ChaCha8Rng) -> Waves {
    let mut wave = |order: usize, amplitude: f64| (order, amplitude, TAU * random.random::<f64>());
    if lines {
        let lines = [(2, 1.0), (3, 2.0), (5, 0.7), (12, 0.3), (40, 0.1), (100, 0.05)];
        lines.map(|(order, amplitude)| wave(order, amplitude)).to_vec()
    } else {
        (2..=HIGHEST).map(|order| wave(order, 2.0 * (order as f64).powf(-1.2))).collect()
    }
}

/// The profile at equal angles: cosines from a table of the angles.
pub(super) fn profile(waves: &Waves, angles: usize) -> Vec<f64> {
    let mut sum = vec![0.0; angles];
    for (order, amplitude, phase) in waves {
        for (index, sum) in sum.iter_mut().enumerate() {
            let turns = (order * index) % angles;
            *sum += amplitude * (TAU * turns as f64 / angles as f64 + phase).cos();
        }
    }
    sum
}

/// The steepest slope in µm/°, from sines at very many angles.
fn steepest(waves: &Waves) -> f64 {
    let angles = 2 * DENSE;
    let sines: Vec<f64> = (0..angles).map(|turn| (TAU * turn as f64 / angles as f64).sin()).collect();
    let cosines: Vec<f64> = (0..angles).map(|turn| (TAU * turn as f64 / angles as f64).cos()).collect();
    let mut slopes = vec![0.0; angles];
    for (order, amplitude, phase) in waves {
        let (sin, cos) = phase.sin_cos();
        let steepest = amplitude * (*order as f64).to_radians();
        for (index, slope) in slopes.iter_mut().enumerate() {
            let turns = (order * index) % angles;
            *slope -= steepest * (sines[turns] * cos + cosines[turns] * sin);
        }
    }
    slopes.iter().fold(0.0, |steepest, slope| f64::max(steepest, slope.abs()))
}

/// Harmonics by sums over all angles.
pub(super) fn harmonics(profile: &[f64]) -> Vec<(usize, Complex64)> {
    let cis: Vec<Complex64> = (0..ANGLES).map(|turn| Complex64::cis(-TAU * turn as f64 / ANGLES as f64)).collect();
    let of = |order: usize| {
        let sum: Complex64 =
            profile.iter().enumerate().map(|(index, value)| value * cis[(order * index) % ANGLES]).sum();
        (order, 2.0 / ANGLES as f64 * sum)
    };
    (2..=HIGHEST).map(of).collect()
}

type Point = [f64; 2];

fn distance(a: Point, b: Point) -> f64 {
    let (x, y) = (a[0] - b[0], a[1] - b[1]);
    (x * x + y * y).sqrt()
}

/// Largest and smallest distance of points from a centre.
fn ends(points: &[Point], centre: Point) -> [f64; 2] {
    let distances = points.iter().map(|point| distance(*point, centre));
    distances.fold([f64::NEG_INFINITY, f64::INFINITY], |[high, low], at| [high.max(at), low.min(at)])
}

/// Where a function of the ends about a centre is least: ever smaller steps in many directions, then among the points near the ends alone.
fn least(points: &[Point], of: impl Fn([f64; 2]) -> f64) -> Point {
    let search = |points: &[Point], mut centre: Point, mut step: f64, to: f64| {
        let (mut best, mut turn) = (of(ends(points, centre)), 0.0);
        while step > to {
            let next = (0..12).find_map(|direction| {
                let angle = TAU * f64::from(direction) / 12.0 + turn;
                let next = [centre[0] + step * angle.cos(), centre[1] + step * angle.sin()];
                let found = of(ends(points, next));
                (found < best).then_some((next, found))
            });
            turn += 0.7;
            match next {
                Some(next) => (centre, best) = next,
                None => step *= 0.6,
            }
        }
        centre
    };
    let centre = search(points, [0.0; 2], 0.5, 1e-3);
    let [high, low] = ends(points, centre);
    let margin = 0.03 * (high - low);
    let is_near = |point: &&Point| {
        let at = distance(**point, centre);
        at < low + margin || at > high - margin
    };
    let near: Vec<Point> = points.iter().filter(is_near).copied().collect();
    search(&near, centre, 1e-2, 1e-6)
}

/// The smallest circle around points by Welzl's algorithm without recursion: centre and radius.
fn around(points: &[Point]) -> Point {
    let outside = |circle: (Point, f64), point: Point| distance(circle.0, point) > circle.1 + 1e-9;
    let of_two = |a: Point, b: Point| ([0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])], 0.5 * distance(a, b));
    let of_three = |a: Point, b: Point, c: Point| {
        let ([bx, by], [cx, cy]) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
        let twice = 2.0 * (bx * cy - by * cx);
        let (b2, c2) = (bx * bx + by * by, cx * cx + cy * cy);
        let [x, y] = [(cy * b2 - by * c2) / twice, (bx * c2 - cx * b2) / twice];
        ([a[0] + x, a[1] + y], x.hypot(y))
    };
    let mut circle = (points[0], 0.0);
    for i in 1..points.len() {
        if outside(circle, points[i]) {
            circle = (points[i], 0.0);
            for j in 0..i {
                if outside(circle, points[j]) {
                    circle = of_two(points[i], points[j]);
                    for k in 0..j {
                        if outside(circle, points[k]) {
                            circle = of_three(points[i], points[j], points[k]);
                        }
                    }
                }
            }
        }
    }
    circle.0
}

/// True values by "symbol reference".
pub(super) fn truth(waves: &Waves, random: &mut ChaCha8Rng) -> BTreeMap<&'static str, f64> {
    let radius = 1e3 * RADIUS_MM;
    let profile = profile(waves, DENSE);
    let mut points: Vec<Point> = profile
        .iter()
        .enumerate()
        .map(|(index, form)| {
            let (sin, cos) = (TAU * index as f64 / DENSE as f64).sin_cos();
            [(radius + form) * cos, (radius + form) * sin]
        })
        .collect();
    // In any order, Welzl's algorithm is quick.
    for index in (1..DENSE).rev() {
        points.swap(index, random.random_range(0..=index));
    }
    let mut found = BTreeMap::new();
    // Orders from 2 on move the least-squares circle by form²/radius, 1e-4 µm.
    let [high, low] = ends(&points, [0.0; 2]);
    let mean = radius;
    found.extend([("RONt LSCI", high - low), ("RONp LSCI", high - mean), ("RONv LSCI", mean - low)]);
    found.insert("RONq LSCI", (profile.iter().map(|form| form * form).sum::<f64>() / DENSE as f64).sqrt());
    let [high, low] = ends(&points, least(&points, |[high, low]| high - low));
    found.insert("RONt MZCI", high - low);
    let [high, low] = ends(&points, least(&points, |[_, low]| -low));
    found.insert("RONt MICI", high - low);
    let [high, low] = ends(&points, around(&points));
    found.insert("RONt MCCI", high - low);
    found.insert("dr/dtheta LSCI", steepest(waves));
    found
}

/// Of each value, intervals that cover the true value and those stated, of so many profiles with noise of this standard deviation at an angle.
fn intervals(text: &str, lines: bool, noise_um: f64, profiles: u64) -> BTreeMap<&'static str, [u64; 2]> {
    let evaluate = evaluate(text).unwrap();
    // White noise at all angles, of which the average keeps these orders.
    let at_angle_um = noise_um * (0.5 * ANGLES as f64 / (HIGHEST - 1) as f64).sqrt();
    let variance = 4.0 * at_angle_um * at_angle_um / ANGLES as f64;
    let mut found_inside = BTreeMap::new();
    for number in 0..profiles {
        let mut random = ChaCha8Rng::seed_from_u64(77_000 + number);
        let waves = waves(lines, &mut random);
        let mut measured = profile(&waves, ANGLES);
        for value in &mut measured {
            let error: f64 = StandardNormal.sample(&mut random);
            *value += at_angle_um * error;
        }
        let mut result = station(0.0, &harmonics(&measured), HIGHEST, variance, &[]);
        result.station = format!("profile {number}");
        let found = section_values(&result, 0, &evaluate, RADIUS_MM);
        for (name, truth) in truth(&waves, &mut random).into_iter().filter(|(name, _)| *name != "RONt MICI") {
            let same =
                found.iter().find(|value| format!("{} {}", value.symbol, value.reference.as_deref().unwrap()) == name);
            let [inside, stated] = found_inside.entry(name).or_insert([0; 2]);
            if let Some(known) = &same.unwrap().uncertainty {
                let [low, high] = known.interval_95;
                *inside += u64::from(low <= truth && truth <= high);
                *stated += 1;
            }
        }
    }
    found_inside
}

const UNFILTERED: &str = "values = ['roundness']\nreferences = ['LSCI', 'MZCI', 'MCCI']\nfilter_upr = []";

#[test]
fn intervals_cover_the_true_value_where_errors_are_large() {
    let profiles = trials(60);
    for (lines, noise_um) in [(true, 0.1), (false, 0.1), (false, 0.003)] {
        for (name, [inside, stated]) in intervals(UNFILTERED, lines, noise_um, profiles as u64) {
            println!("{lines} {noise_um} µm {name}: {inside} of {stated}");
            assert_eq!(stated, profiles as u64, "{name}");
            // 95 % of 60 are 57 ± 1.7; three of those below it. Draws about the form found hold 47 to 55.
            let least = fewest(profiles, [52, 60], 0.95) as u64;
            assert!(inside >= least, "{lines} {noise_um} µm {name}: {inside} of {profiles}");
        }
    }
}

/// Lobes of 1.5 µm seen by three sensors: each order's noise is that of a reading over what the sensors' weighted sum sees of the order, which
/// differs a hundredfold. Of each value, intervals that cover the true value, of so many profiles.
fn intervals_of_lobes(lobes: usize, noise_um: f64, profiles: u64) -> BTreeMap<&'static str, u64> {
    const ORDERS: usize = 63;
    const TURNS: f64 = 59.0;
    let angles = [0.0, 99.844, 202.5].map(f64::to_radians);
    // No motion is in the weighted sum: Σ w cos = Σ w sin = 0.
    let weights = [(angles[2] - angles[1]).sin(), (angles[0] - angles[2]).sin(), (angles[1] - angles[0]).sin()];
    let seen = |order: usize| -> Complex64 {
        weights.iter().zip(angles).map(|(weight, angle)| Complex64::from_polar(*weight, order as f64 * angle)).sum()
    };
    let of_reading = 4.0 * noise_um * noise_um / (256.0 * TURNS);
    let variance =
        |order: usize| weights.iter().map(|weight| weight * weight).sum::<f64>() * of_reading / seen(order).norm_sqr();
    let evaluate = evaluate("values = ['roundness']\nreferences = ['LSCI', 'MZCI']\nfilter_upr = []").unwrap();
    let mut held = BTreeMap::new();
    for number in 0..profiles {
        let mut random = ChaCha8Rng::seed_from_u64(31_000 + number);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let waves: Vec<(usize, Complex64)> = (2..=ORDERS)
            .map(|order| {
                let error = (0.5 * variance(order)).sqrt() * Complex64::new(normal(), normal());
                (order, error + if order == lobes { Complex64::from(1.5) } else { Complex64::ZERO })
            })
            .collect();
        let mut result = station(0.0, &waves, ORDERS, f64::NAN, &[]);
        result.station = format!("lobes {number}");
        // As few as a run gives: two a wave of the highest order.
        result.angles = 2 * (ORDERS + 1);
        // The noise of each five orders is known from forty squares.
        result.separation.freedom = 8;
        for five in (2..=ORDERS).collect::<Vec<_>>().chunks(5) {
            let chance = (0..40).map(|_| normal().powi(2)).sum::<f64>() / 40.0;
            five.iter().for_each(|order| result.separation.variance[*order] = chance * variance(*order));
        }
        let found = section_values(&result, 0, &evaluate, RADIUS_MM);
        for (name, truth) in [("RONt LSCI", 3.0), ("RONp LSCI", 1.5), ("RONv LSCI", 1.5), ("RONt MZCI", 3.0)] {
            let same =
                found.iter().find(|value| format!("{} {}", value.symbol, value.reference.as_deref().unwrap()) == name);
            let [low, high] = same.unwrap().uncertainty.as_ref().unwrap().interval_95;
            // Of a zone about another centre, form²/radius.
            let exact = 1e-4;
            *held.entry(name).or_insert(0) += u64::from(low <= truth + exact && truth - exact <= high);
        }
    }
    held
}

#[test]
fn intervals_of_lobes_cover_the_true_value_where_noise_depends_on_the_order() {
    for (lobes, noise_um) in [(3, 0.01), (15, 0.03)] {
        for (name, held) in intervals_of_lobes(lobes, noise_um, 60) {
            println!("{lobes} lobes, {noise_um} µm, {name}: {held} of 60");
            // 95 % of 60 are 57 ± 1.7, three of those below it. With noise taken as even over the orders, 40 to 50 are held.
            assert!(held >= 52, "{lobes} lobes, {noise_um} µm, {name}: {held} of 60");
        }
    }
}

/// A fine wave on lobes that have nearly all of the form's power, and errors whose power falls as 1/order^`falls`: the crests are those of
/// the fine wave, of which the angles of the draws have less than three. Of each value, intervals that cover the true value, of so many profiles.
fn intervals_of_fine_waves(fine_um: f64, falls: f64, noise_um: f64, profiles: u64) -> BTreeMap<&'static str, u64> {
    let falling = |order: usize| (order as f64).powf(-falls);
    let whole: f64 = (2..=HIGHEST).map(falling).sum();
    let variance = |order: usize| 2.0 * noise_um * noise_um * falling(order) / whole;
    let evaluate = evaluate(UNFILTERED).unwrap();
    let mut held = BTreeMap::new();
    for number in 0..profiles {
        let mut random = ChaCha8Rng::seed_from_u64(53_000 + number);
        let mut wave = |order: usize, amplitude: f64| (order, amplitude, TAU * random.random::<f64>());
        let waves: Waves = vec![wave(2, 6.0), wave(3, 8.0), wave(200, fine_um)];
        let found: Vec<(usize, Complex64)> = (2..=HIGHEST)
            .map(|order| {
                let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
                let error = (0.5 * variance(order)).sqrt() * Complex64::new(normal(), normal());
                let form = waves.iter().filter(|wave| wave.0 == order);
                (order, error + form.map(|wave| Complex64::from_polar(wave.1, wave.2)).sum::<Complex64>())
            })
            .collect();
        let mut result = station(0.0, &found, HIGHEST, f64::NAN, &[]);
        result.station = format!("fine wave {number}");
        (2..=HIGHEST).for_each(|order| result.separation.variance[order] = variance(order));
        let found = section_values(&result, 0, &evaluate, RADIUS_MM);
        for (name, truth) in
            truth(&waves, &mut random).into_iter().filter(|(name, _)| name.starts_with("RONt") && *name != "RONt MICI")
        {
            let same =
                found.iter().find(|value| format!("{} {}", value.symbol, value.reference.as_deref().unwrap()) == name);
            let [low, high] = same.unwrap().uncertainty.as_ref().unwrap().interval_95;
            *held.entry(name).or_insert(0) += u64::from(low <= truth && truth <= high);
        }
    }
    held
}

#[test]
fn intervals_of_fine_waves_cover_the_true_value_where_lobes_and_low_orders_have_the_power() {
    for (fine_um, falls, noise_um) in [(0.3, 2.0, 0.01), (0.3, 1.0, 0.01), (0.3, 0.5, 0.01), (0.03, 1.0, 0.1)] {
        let profiles = trials(60);
        for (name, held) in intervals_of_fine_waves(fine_um, falls, noise_um, profiles as u64) {
            println!("{fine_um} µm, noise {noise_um} µm to 1/n^{falls}, {name}: {held} of {profiles}");
            // 95 % of 60 are 57 ± 1.7, three of those below it.
            let least = fewest(profiles, [52, 60], 0.95) as u64;
            assert!(held >= least, "{fine_um} µm, noise {noise_um} µm to 1/n^{falls}, {name}: {held} of {profiles}");
        }
    }
}

/// Lobes that are alike in little noise: crests of 15 compete for the highest behind a filter; of two, the centre moves along the long axis.
#[test]
fn intervals_of_like_lobes_cover_the_true_value_where_noise_is_small() {
    for (order, filter, passed, names) in
        [(15, "Gaussian 15 UPR", 0.5, &["RONt LSCI", "RONp LSCI", "RONt MZCI"][..]), (2, "none", 1.0, &["RONt MCCI"])]
    {
        let evaluate = evaluate(&UNFILTERED.replace("[]", "[15]")).unwrap();
        let (noise_um, profiles, mut held) = (0.0016, 60, BTreeMap::new());
        for number in 0..profiles {
            let mut random = ChaCha8Rng::seed_from_u64(91_000 + number);
            let waves: Waves = vec![(order, 1.5, TAU * random.random::<f64>())];
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let measured: Vec<f64> = profile(&waves, ANGLES).iter().map(|value| value + noise_um * normal()).collect();
            let variance = 4.0 * noise_um * noise_um / ANGLES as f64;
            let mut result = station(0.0, &harmonics(&measured), HIGHEST, variance, &[]);
            result.station = format!("like lobes {number}");
            let found = section_values(&result, 0, &evaluate, RADIUS_MM);
            let waves = vec![(order, passed * 1.5, waves[0].2)];
            for (name, truth) in truth(&waves, &mut random).into_iter().filter(|(name, _)| names.contains(name)) {
                let is_same =
                    |value: &&Value| format!("{} {}", value.symbol, value.reference.as_deref().unwrap()) == name;
                let same = found.iter().filter(|value| value.filter.as_deref() == Some(filter)).find(is_same).unwrap();
                let [low, high] = same.uncertainty.as_ref().unwrap().interval_95;
                *held.entry(name).or_insert(0) += u64::from(low <= truth && truth <= high);
            }
        }
        println!("{order} lobes, {filter}: {held:?} of {profiles}");
        // 85 % of 60 are 51: forms of one line are those that what is drawn expects least.
        assert!(held.values().all(|held| *held >= 51), "{order} lobes: {held:?}");
    }
}

#[test]
#[ignore = "prints figures of docs/appendix/intervals.md"]
fn intervals_of_many_lobes() {
    for (lobes, noise_um) in [(3, 0.01), (3, 0.3), (15, 0.03), (15, 0.3)] {
        for (name, held) in intervals_of_lobes(lobes, noise_um, 400) {
            println!("{lobes} lobes, {noise_um} µm, {name}: {:.1} %", held as f64 / 4.0);
        }
    }
}

#[test]
#[ignore = "prints the table of docs/appendix/intervals.md, which takes minutes"]
fn intervals_of_independent_profiles() {
    for way in ["linear", "monte-carlo"] {
        for lines in [true, false] {
            for noise_um in [0.003, 0.02, 0.1, 0.5] {
                let text = format!("{UNFILTERED}\nuncertainty = '{way}'");
                for (name, [inside, stated]) in intervals(&text, lines, noise_um, 400) {
                    let percent = 100.0 * inside as f64 / stated as f64;
                    println!("{way} lines {lines} {noise_um} µm {name}: {percent:.1} % of {stated}");
                }
            }
        }
    }
}
