//! Touches of points, rings and spheres: values computed by hand, a simulated probe, and what cannot be evaluated.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::f64::consts::{PI, TAU};

use runout_core::stage::Outcome;
use runout_machine_tests::{Object, ProbingConfig};

use crate::{
    support::{Chance, Held, Rows, separated, value},
    trials::{fewest, trials},
};

const PLACES: [&str; 4] = ["x_mm", "y_mm", "z_mm", "repeat"];

fn config(object: Object, tool_changed: bool) -> ProbingConfig {
    ProbingConfig { object, tool_changed }
}

/// The touches of ISO 10360-5: one at the pole, four rings.
fn on_sphere() -> Vec<[f64; 3]> {
    let mut all = vec![[0.0, 0.0, 1.0]];
    for (polar_deg, count, turned) in [(22.5, 4, 0.0), (45.0, 8, 0.5), (67.5, 4, 0.25), (90.0, 8, 0.0)] {
        for index in 0..count {
            let (angle, polar) = (TAU * (f64::from(index) + turned) / f64::from(count), f64::to_radians(polar_deg));
            all.push([polar.sin() * angle.cos(), polar.sin() * angle.sin(), polar.cos()]);
        }
    }
    all
}

/// Pre-travel of a probe with three seats, in µm.
fn lobes_um([x, y, z]: [f64; 3], amplitude_um: f64) -> f64 {
    amplitude_um * ((3.0 * y.atan2(x)).cos() * (x * x + y * y) - 0.4 * z)
}

/// A sphere that is touched: the stylus comes to rest where the ball is, pushed on by the pre-travel along the normal.
#[allow(clippy::struct_field_names, reason = "all are in µm")]
struct Probe {
    amplitude_um: f64,
    noise_um: f64,
    moves_um: f64,
}

impl Probe {
    fn touched(&self, chance: &mut Chance, sets: usize, ring: bool) -> Rows {
        let mut rows = Rows::new("", if ring { &["x_mm", "y_mm", "repeat"] } else { &PLACES });
        let places: Vec<[f64; 3]> = if ring {
            (0..36).map(|step| (TAU * f64::from(step) / 36.0).sin_cos()).map(|(sin, cos)| [cos, sin, 0.0]).collect()
        } else {
            on_sphere()
        };
        for set in 0..sets {
            let centre = [120.0, -40.0, 15.0].map(|at| at + 1e-3 * self.moves_um * chance.normal());
            for place in &places {
                let radius =
                    12.5 + 3.0 + 1e-3 * (lobes_um(*place, self.amplitude_um) + self.noise_um * chance.normal());
                let at = [0, 1, 2].map(|axis| centre[axis] + radius * place[axis]);
                let repeat = set as f64 + 1.0;
                if ring {
                    rows.push("", &[at[0], at[1], repeat]);
                } else {
                    rows.push("", &[at[0], at[1], at[2], repeat]);
                }
            }
        }
        rows
    }
}

fn of(object: Object, rows: &Rows) -> Outcome {
    separated(config(object, false), rows).unwrap()
}

/// Two lobes of ±3 µm on a ring are no circle's: range 6 µm, wherever the ring is. An order 1 is its centre.
#[test]
fn lobes_of_a_ring_are_the_range() {
    let mut rows = Rows::new("", &["x_mm", "y_mm", "repeat"]);
    for step in 0..36 {
        let angle = TAU * f64::from(step) / 36.0;
        let radius = 25.0 + 3e-3 * (2.0 * angle).cos();
        rows.push("", &[300.0 + radius * angle.cos(), -80.0 + radius * angle.sin(), 1.0]);
    }
    let found = of(Object::Ring, &rows);
    let range = value(&found, "P_FTU,2D", "");
    assert!((range.value - 6.0).abs() < 1e-4, "{range:?}");
    assert!(range.uncertainty.is_none() && found.remarks.iter().any(|remark| remark.starts_with("one set of touches")));
}

/// One touch 4 µm farther out than all others of a sphere: by the least-squares fit of the linear model.
#[test]
fn one_touch_of_a_sphere_is_the_range() {
    let places = on_sphere();
    let mut rows = Rows::new("", &PLACES);
    for (touch, place) in places.iter().enumerate() {
        let radius = 12.0 + if touch == 7 { 4e-3 } else { 0.0 };
        let [x, y, z] = place.map(|part| part * radius);
        rows.push("", &[x + 5.0, y, z - 7.0, 1.0]);
    }
    // The same by normal equations: 25 touches, columns of the directions and of 1.
    let columns: Vec<[f64; 4]> = places.iter().map(|[x, y, z]| [*x, *y, *z, 1.0]).collect();
    let mut matrix = [[0.0; 5]; 4];
    for (touch, row) in columns.iter().enumerate() {
        for (i, own) in row.iter().enumerate() {
            row.iter().enumerate().for_each(|(j, other)| matrix[i][j] += own * other);
            matrix[i][4] += own * if touch == 7 { 4.0 } else { 0.0 };
        }
    }
    for pivot in 0..4 {
        let own = matrix[pivot];
        for (row, line) in matrix.iter_mut().enumerate() {
            if row != pivot {
                let share = line[pivot] / own[pivot];
                line.iter_mut().zip(own).for_each(|(entry, own)| *entry -= share * own);
            }
        }
    }
    let solved: Vec<f64> = (0..4).map(|row| matrix[row][4] / matrix[row][row]).collect();
    let left: Vec<f64> = columns
        .iter()
        .enumerate()
        .map(|(touch, row)| {
            f64::from(u8::from(touch == 7)) * 4.0 - row.iter().zip(&solved).map(|(a, b)| a * b).sum::<f64>()
        })
        .collect();
    let expected = left.iter().fold(f64::MIN, |a, b| a.max(*b)) - left.iter().fold(f64::MAX, |a, b| a.min(*b));
    let found = of(Object::Sphere, &rows);
    let range = value(&found, "P_FTU,3D", "").value;
    assert!((range - expected).abs() < 2e-3 && expected < 4.0, "{range} {expected}");
}

#[test]
fn touches_of_a_point_have_their_range() {
    let mut rows = Rows::new("axis", &["deviation_um"]);
    let numbers = [0.3, -0.1, 0.9, 0.2, -0.5, 0.4, 0.1, 0.0, -0.2, 0.6];
    for one in numbers {
        rows.push("X", &[one]);
        rows.push("Z", &[7.0 + 2.0 * one]);
    }
    let found = of(Object::Point, &rows);
    for (axis, expected) in [("X", 1.4), ("Z", 2.8)] {
        let range = value(&found, "R_SPT", axis);
        let [low, high] = range.interval_95().unwrap();
        assert!((range.value - expected).abs() < 1e-12 && low < expected && high > expected);
        // The range of ten normal numbers has a mean of 3.078 and a standard deviation of 0.797 (control charts, d2 and d3).
        assert!((range.std().unwrap() / expected - 0.797 / 3.078).abs() < 0.01, "{range:?}");
    }
}

#[test]
fn intervals_of_repeated_touches_cover_the_mean_range() {
    for (count, mean_range) in [(5, 2.326), (10, 3.078)] {
        let mut held = Held::default();
        let mut chance = Chance::new(count as u64);
        for _ in 0..200 {
            let mut rows = Rows::new("axis", &["deviation_um"]);
            for axis in ["X", "Y", "Z"] {
                (0..count).for_each(|_| rows.push(axis, &[0.7 * chance.normal()]));
            }
            let found = of(Object::Point, &rows);
            for axis in ["X", "Y", "Z"] {
                held.take(axis, value(&found, "R_SPT", axis), 0.7 * mean_range);
            }
        }
        let [all, _] = held.shares(&format!("R_SPT of {count} touches"));
        assert!((0.93..0.975).contains(&all), "{all}");
    }
}

/// The mean range of one set, by many sets of the same probe.
fn truth_um(probe: &Probe, ring: bool) -> f64 {
    let mut chance = Chance::new(99);
    let sets = 1500;
    let found = of(if ring { Object::Ring } else { Object::Sphere }, &probe.touched(&mut chance, sets, ring));
    found.values[0].value
}

#[test]
fn intervals_of_probing_errors_cover_the_true_value() {
    for ring in [true, false] {
        for (amplitude_um, noise_um, sets) in [(3.0, 0.2, 3), (1.0, 0.5, 3), (0.0, 0.5, 5), (2.0, 0.3, 2)] {
            let probe = Probe { amplitude_um, noise_um, moves_um: 5.0 };
            let truth = truth_um(&probe, ring);
            let mut chance = Chance::new(sets as u64 + 40);
            let mut held = Held::default();
            let count = trials(200);
            for _ in 0..count {
                let rows = probe.touched(&mut chance, sets, ring);
                let found = of(if ring { Object::Ring } else { Object::Sphere }, &rows);
                held.take("P_FTU", &found.values[0], truth);
            }
            let [all, _] = held
                .shares(&format!("ring {ring}, {amplitude_um} µm, noise {noise_um} µm, {sets} sets, {truth:.2} µm"));
            assert!(all >= fewest(count, [186, 200], 0.95) as f64 / count as f64, "{all}");
        }
    }
}

#[test]
fn a_changed_probe_has_a_range_of_its_centre() {
    let probe = Probe { amplitude_um: 1.0, noise_um: 0.1, moves_um: 2.0 };
    let mut held = Held::default();
    let mut chance = Chance::new(6);
    for _ in 0..150 {
        let found = separated(config(Object::Sphere, true), &probe.touched(&mut chance, 5, false)).unwrap();
        // Five normal numbers of 2 µm, and what touches of 0.1 µm add to a centre: little.
        for axis in ["X", "Y"] {
            held.take(axis, value(&found, "R_PTL", axis), 2.0 * 2.326);
        }
    }
    let [all, _] = held.shares("R_PTL");
    assert!((0.93..0.98).contains(&all), "{all}");
    let few = separated(config(Object::Sphere, true), &probe.touched(&mut chance, 2, false)).unwrap_err();
    assert!(few.to_string().contains("expected at least 3 sets"), "{few}");
}

fn refuted(found: &Outcome, words: &str) -> bool {
    found.checks.iter().any(|check| check.refutes() && check.finding.contains(words))
}

#[test]
fn what_is_odd_is_said() {
    let probe = Probe { amplitude_um: 2.0, noise_um: 0.3, moves_um: 0.0 };
    let usual = probe.touched(&mut Chance::new(2), 4, false);
    let found = of(Object::Sphere, &usual);
    assert!(found.remarks.is_empty() && !refuted(&found, "") && found.values[0].uncertainty.is_some(), "{found:?}");
    // Copies of one set.
    let mut copies = usual.clone();
    copies.numbers[..3].iter_mut().for_each(|column| *column = column[..25].repeat(4));
    let found = of(Object::Sphere, &copies);
    assert!(found.values[0].uncertainty.is_none());
    assert!(found.remarks.iter().any(|remark| remark.contains("copies show no uncertainty")), "{:?}", found.remarks);
    // One set that is another one, elsewhere.
    let mut again = usual.clone();
    for (axis, off_mm) in [0.013, -0.02, 0.004].into_iter().enumerate() {
        let first = again.numbers[axis][25..50].to_vec();
        again.numbers[axis][75..].iter_mut().zip(first).for_each(|(at, first)| *at = first + off_mm);
    }
    let found = of(Object::Sphere, &again);
    assert!(refuted(&found, "set 4 is equal to set 2, touch by touch"), "{:?}", found.checks);
    // One side that is noisier than the others, one set in µm, touches on a cap alone.
    let (mut loud, mut chance) = (usual.clone(), Chance::new(6));
    for (row, _) in on_sphere().iter().cycle().take(100).enumerate().filter(|(_, place)| place[0] > 0.7) {
        loud.numbers[0][row] += 4e-3 * chance.normal();
    }
    assert!(refuted(&of(Object::Sphere, &loud), "the side +x has"), "{:?}", of(Object::Sphere, &loud).checks);
    let mut in_um = usual.clone();
    in_um.numbers[..3].iter_mut().for_each(|column| column[75..].iter_mut().for_each(|at| *at *= 1e3));
    assert!(refuted(&of(Object::Sphere, &in_um), "set 4 are"), "{:?}", of(Object::Sphere, &in_um).checks);
    let mut cap = usual.clone();
    cap.numbers.iter_mut().for_each(|column| *column = column.chunks(25).flat_map(|set| set[..12].to_vec()).collect());
    cap.texts.truncate(48);
    assert!(of(Object::Sphere, &cap).remarks.iter().any(|remark| remark.contains("on a cap of the sphere")));
    // A disturbance that lasts for several touches.
    let mut slow = usual.clone();
    let (mut last, mut chance) = (0.0, Chance::new(5));
    for (row, place) in on_sphere().iter().cycle().take(100).enumerate() {
        last = 0.9 * last + 1.5e-3 * chance.normal();
        (0..3).for_each(|axis| slow.numbers[axis][row] += last * place[axis]);
    }
    let found = of(Object::Sphere, &slow);
    assert!(refuted(&found, "along the touches of a set"), "{:?}", found.checks);
    // Touches of a point that drift, and ones that are equal.
    let mut rows = Rows::new("axis", &["deviation_um"]);
    let mut chance = Chance::new(3);
    for touch in 0..10 {
        rows.push("X", &[0.5 * f64::from(touch) + 0.1 * chance.normal()]);
        rows.push("Y", &[0.25]);
    }
    let found = of(Object::Point, &rows);
    assert!(
        refuted(&found, "R_SPT: the last of the touches differs from the first of the touches by 4"),
        "{:?}",
        found.checks
    );
    assert!(found.remarks.iter().any(|remark| remark.contains("of Y: all 10 are equal")), "{:?}", found.remarks);
    assert!(value(&found, "R_SPT", "Y").uncertainty.is_none());
}

#[test]
fn what_cannot_be_evaluated_is_refused() {
    let refused = |object: Object, rows: &Rows| separated(config(object, false), rows).unwrap_err().to_string();
    let probe = Probe { amplitude_um: 1.0, noise_um: 0.1, moves_um: 0.0 };
    let usual = probe.touched(&mut Chance::new(1), 2, false);
    let mut few = Rows::new("", &PLACES);
    (0..4).for_each(|row| few.push("", &[0, 1, 2, 3].map(|column: usize| usual.numbers[column][row])));
    assert!(refused(Object::Sphere, &few).contains("expected at least 6 touches, found 4"));
    // Touches of a circle are no sphere.
    let mut flat = Rows::new("", &PLACES);
    for step in 0..24 {
        let (sin, cos) = (PI * f64::from(step) / 12.0).sin_cos();
        flat.push("", &[10.0 * cos, 10.0 * sin, 0.0, 1.0]);
    }
    assert!(refused(Object::Sphere, &flat).contains("determine no centre"));
    let mut missing = usual.clone();
    missing.numbers.iter_mut().for_each(|column| {
        column.pop();
    });
    assert!(refused(Object::Sphere, &missing).contains("25 touches, set 2 has 24"));
    let mut swapped = usual.clone();
    swapped.numbers[..3].iter_mut().for_each(|column| column.swap(30, 40));
    assert!(refused(Object::Sphere, &swapped).contains("touch 6 of set 2 is elsewhere"));
    let mut equal = usual.clone();
    equal.numbers[..3].iter_mut().for_each(|column| column.fill(3.0));
    assert!(refused(Object::Sphere, &equal).contains("determine no centre"));
    let mut two = Rows::new("axis", &["deviation_um"]);
    two.push("X", &[0.0]);
    two.push("X", &[1.0]);
    assert!(refused(Object::Point, &two).contains("expected at least 3 touches along X"));
}
