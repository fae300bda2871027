//! Diagonals: values computed by hand, a simulated machine, and what cannot be evaluated.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use runout_core::consistency::Check;
use runout_machine_tests::{DiagonalsConfig, PositioningConfig};

use crate::{
    support::{Chance, Held, Rows, separated, value},
    trials::{fewest, trials},
};

const NAMES: [&str; 3] = ["target_mm", "deviation_um", "direction"];

fn config(scale_std_ppm: f64) -> DiagonalsConfig {
    DiagonalsConfig { scale_std_ppm }
}

/// A machine of 400 × 300 × 250 mm: scales of its axes and squarenesses, in mm/m, and lost motion of each axis. A laser looks along a diagonal.
struct Machine {
    scale: [f64; 3],
    square: [f64; 3],
    lost_um: [f64; 3],
}

const SIZE_MM: [f64; 3] = [400.0, 300.0, 250.0];
const BODY: [(&str, [f64; 3]); 4] =
    [("PPP", [1.0, 1.0, 1.0]), ("NPP", [-1.0, 1.0, 1.0]), ("PNP", [1.0, -1.0, 1.0]), ("PPN", [1.0, 1.0, -1.0])];
const FACES: [(&str, [f64; 3]); 2] = [("PP0", [1.0, 1.0, 0.0]), ("NP0", [-1.0, 1.0, 0.0])];

impl Machine {
    /// Deviation at a share of a diagonal, reached ahead (1) or back (−1): the place of the tool along the line less the commanded one.
    fn deviation_um(&self, way: [f64; 3], share: f64, side: f64) -> f64 {
        let end = [0, 1, 2].map(|axis| way[axis] * SIZE_MM[axis]);
        let length = end.iter().map(|part| part * part).sum::<f64>().sqrt();
        // From the corner where the diagonal begins.
        let [x, y, z] = end.map(|part| part * share);
        let [a, b, c] = self.square;
        let wave = 2.0 * (5.0 * share).sin();
        let actual = [
            x * self.scale[0] - y * c + z * b + 0.5 * side * self.lost_um[0] * way[0],
            y * self.scale[1] - z * a + 0.5 * side * self.lost_um[1] * way[1],
            z * self.scale[2] + 0.5 * side * self.lost_um[2] * way[2],
        ];
        actual.iter().zip(end).map(|(actual, end)| actual * end / length).sum::<f64>() + wave
    }

    fn rows(&self, chance: &mut Chance, runs: usize, noise_um: f64, of_run_um: f64) -> Rows {
        let mut rows = Rows::new("diagonal", &NAMES);
        for (id, way) in BODY.into_iter().chain(FACES) {
            let length = [0, 1, 2].map(|axis| (way[axis] * SIZE_MM[axis]).powi(2)).iter().sum::<f64>().sqrt();
            for _ in 0..runs {
                let off = of_run_um * chance.normal();
                for (side, order) in [(1.0, (0..9).collect::<Vec<i32>>()), (-1.0, (0..9).rev().collect())] {
                    for step in order {
                        let share = (f64::from(step) + 0.1 * f64::from(step % 3)) / 9.0;
                        let deviation = self.deviation_um(way, share, side) + off + noise_um * chance.normal();
                        rows.push(id, &[length * share, deviation, side]);
                    }
                }
            }
        }
        rows
    }

    /// E, B, A and R of a diagonal by their definitions, for a stated standard deviation.
    fn truth_um(&self, way: [f64; 3], spread_um: f64) -> [f64; 4] {
        let at = |step: i32, side: f64| {
            let share = (f64::from(step) + 0.1 * f64::from(step % 3)) / 9.0;
            self.deviation_um(way, share, side)
        };
        let all: Vec<f64> = (0..9).flat_map(|step| [at(step, 1.0), at(step, -1.0)]).collect();
        let range = all.iter().fold(f64::MIN, |a, b| a.max(*b)) - all.iter().fold(f64::MAX, |a, b| a.min(*b));
        let lost = (0..9).map(|step| (at(step, 1.0) - at(step, -1.0)).abs()).fold(0.0, f64::max);
        [range, lost, range + 4.0 * spread_um, 4.0 * spread_um + lost]
    }
}

fn machine() -> Machine {
    Machine { scale: [0.020, -0.015, 0.010], square: [0.012, -0.008, 0.030], lost_um: [0.8, 1.1, 0.6] }
}

#[test]
fn one_diagonal_is_an_axis_and_the_largest_is_of_all() {
    let rows = machine().rows(&mut Chance::new(4), 5, 0.2, 0.0);
    let found = separated(config(0.0), &rows).unwrap();
    let mut largest = [0.0_f64; 2];
    for (id, _) in BODY.into_iter().chain(FACES) {
        let mut alone = Rows::new("", &NAMES);
        let each = rows.texts.iter().enumerate().filter(|(_, text)| *text == id);
        each.for_each(|(row, _)| alone.push("", &[0, 1, 2].map(|column: usize| rows.numbers[column][row])));
        let axis = PositioningConfig { axis: id.into(), rotary: false, scale_std_ppm: 0.0 };
        let axis = separated(axis, &alone).unwrap();
        for symbol in ["A", "E", "R", "B", "B_mean", "M", "A+", "E-"] {
            let [one, other] = [&found, &axis].map(|outcome| value(outcome, symbol, id).value);
            assert!((one - other).abs() < 1e-12, "{id} {symbol}: {one} {other}");
        }
        let kind = usize::from(id.contains('0'));
        largest[kind] = largest[kind].max(value(&found, "E", id).value);
    }
    for (kind, expected) in ["body diagonals", "face diagonals"].into_iter().zip(largest) {
        assert!((value(&found, "E_d", kind).value - expected).abs() < 1e-12);
    }
    // Rows of another order are the same test.
    let mut reversed = rows.clone();
    reversed.numbers.iter_mut().for_each(|column| column.reverse());
    reversed.texts.reverse();
    let again = separated(config(0.0), &reversed).unwrap();
    assert!((value(&again, "A_d", "body diagonals").value - value(&found, "A_d", "body diagonals").value).abs() < 1e-9);
}

/// Diagonals of two targets: E+ of PPP is the scale along it.
#[test]
fn a_squareness_makes_diagonals_unlike() {
    let mut rows = Rows::new("diagonal", &NAMES);
    for (id, end_um) in [("PP0", 12.0), ("NP0", -7.0)] {
        for run in [0.0, 0.2] {
            for (target, side, deviation) in
                [(0.0, 1.0, 0.0), (500.0, 1.0, end_um), (500.0, -1.0, end_um + 1.0), (0.0, -1.0, 1.0)]
            {
                rows.push(id, &[target, deviation + run, side]);
            }
        }
    }
    let found = separated(config(0.0), &rows).unwrap();
    let s = 0.02_f64.sqrt();
    for (symbol, of, expected) in [
        ("E", "PP0", 13.0),
        ("E+", "NP0", 7.0),
        ("B", "PP0", 1.0),
        ("A", "PP0", 13.0 + 4.0 * s),
        ("E_d", "face diagonals", 13.0),
        ("B_d", "face diagonals", 1.0),
        ("R_d", "face diagonals", 4.0 * s + 1.0),
    ] {
        let found = value(&found, symbol, of).value;
        assert!((found - expected).abs() < 1e-12, "{symbol} {of}: {found} {expected}");
    }
    assert!(found.values.iter().all(|value| value.of.as_deref() != Some("body diagonals")));
}

#[test]
fn intervals_cover_the_true_value_of_a_simulated_machine() {
    let machine = machine();
    let mut worst = 1.0_f64;
    for (runs, noise_um, of_run_um) in [(5, 0.2, 0.0), (3, 0.5, 0.0), (5, 0.2, 0.4)] {
        let mut chance = Chance::new(runs as u64 + 10);
        let mut held = Held::default();
        let count = trials(100);
        for _ in 0..count {
            let found = separated(config(0.0), &machine.rows(&mut chance, runs, noise_um, of_run_um)).unwrap();
            let truth = BODY.map(|(_, way)| machine.truth_um(way, noise_um.hypot(of_run_um)));
            for (column, symbol) in ["E", "B", "A", "R"].into_iter().enumerate() {
                let largest = truth.iter().map(|one| one[column]).fold(0.0, f64::max);
                held.take(&format!("{symbol}_d"), value(&found, &format!("{symbol}_d"), "body diagonals"), largest);
                held.take(symbol, value(&found, symbol, "PPP"), truth[0][column]);
            }
        }
        let [all, least] = held.shares(&format!("{runs} runs, noise {noise_um} µm, of a run {of_run_um} µm"));
        assert!(all >= 0.95 - 0.02 * f64::sqrt(100.0 / count as f64), "{all}");
        worst = worst.min(least);
    }
    let count = trials(100);
    assert!(worst >= fewest(count, [85, 100], 0.95) as f64 / count as f64, "{worst}");
}

/// One laser measured all diagonals: its scale is one unknown number of them all, and its error reaches all of them.
#[test]
fn an_unknown_scale_is_that_of_all_diagonals() {
    let machine = Machine { scale: [0.02; 3], square: [0.0; 3], lost_um: [0.0; 3] };
    let rows = machine.rows(&mut Chance::new(3), 5, 0.01, 0.0);
    let [plain, scaled] = [0.0, 2.0].map(|ppm| separated(config(ppm), &rows).unwrap());
    let length_m = 1e-3 * SIZE_MM.iter().map(|size| size * size).sum::<f64>().sqrt();
    for (symbol, of) in [("E", "PPP"), ("E_d", "body diagonals")] {
        let [plain, scaled] = [&plain, &scaled].map(|found| value(found, symbol, of).std().unwrap());
        // 2 µm/m of the length between the outer targets: 8.2/9 of it; the largest of four has no less, where all have the same error.
        let expected = 2.0 * length_m * 8.2 / 9.0;
        assert!(plain < 0.05 && (0.75..1.25).contains(&(scaled / expected)), "{symbol}: {plain} {scaled} {expected}");
    }
}

#[test]
fn what_cannot_be_evaluated_is_refused_and_what_is_odd_is_said() {
    let machine = machine();
    let rows = machine.rows(&mut Chance::new(1), 5, 0.2, 0.0);
    let mut odd = rows.clone();
    odd.texts[3] = "XY".into();
    assert!(separated(config(0.0), &odd).unwrap_err().to_string().contains("`XY` is no diagonal"));
    let error = separated(config(0.0), &Rows::new("diagonal", &NAMES)).unwrap_err().to_string();
    assert!(error.contains("there is no row"), "{error}");
    let mut once = Rows::new("diagonal", &NAMES);
    for (target, side) in [(0.0, 1.0), (100.0, 1.0), (100.0, -1.0), (0.0, -1.0)] {
        once.push("PPP", &[target, 0.0, side]);
    }
    let error = separated(config(0.0), &once).unwrap_err().to_string();
    assert!(error.contains("PPP: expected at least 2 approaches"), "{error}");
    // Copies of one run.
    let mut copies = rows.clone();
    for column in &mut copies.numbers {
        let of_first: Vec<f64> = column.chunks(18).step_by(5).flat_map(|run| run.repeat(5)).collect();
        *column = of_first;
    }
    let found = separated(config(0.0), &copies).unwrap();
    assert!(found.values.iter().all(|value| value.uncertainty.is_none()));
    assert!(found.remarks.iter().any(|remark| remark.contains("copies show no uncertainty")), "{:?}", found.remarks);
    // A drift over the runs, and a disturbance that lasts for several targets.
    let mut drifting = rows.clone();
    drifting.numbers[1].iter_mut().enumerate().for_each(|(row, one)| *one += 0.5 * ((row % 90) / 18) as f64);
    let found = separated(config(0.0), &drifting).unwrap();
    assert!(found.remarks.iter().any(|remark| remark.starts_with("PPP: the runs drift")), "{:?}", found.remarks);
    let quiet = separated(config(0.0), &rows).unwrap();
    assert!(!quiet.checks.iter().any(Check::refutes), "{:?}", quiet.checks);
    let mut slow = rows.clone();
    let mut chance = Chance::new(8);
    let mut last = 0.0;
    for one in &mut slow.numbers[1] {
        last = 0.85 * last + chance.normal();
        *one += last;
    }
    let found = separated(config(0.0), &slow).unwrap();
    let depends = |check: &&Check| check.refutes() && check.finding.contains("depend on each other along the travel");
    assert!(found.checks.iter().filter(depends).count() >= 2, "{:?}", found.checks);
    let mut three = Rows::new("diagonal", &NAMES);
    for (row, text) in rows.texts.iter().enumerate().filter(|(_, text)| *text != "PPN") {
        three.push(text, &[0, 1, 2].map(|column: usize| rows.numbers[column][row]));
    }
    let found = separated(config(0.0), &three).unwrap();
    assert!(found.remarks.iter().any(|remark| remark.contains("3 of the 4 body diagonals")), "{:?}", found.remarks);
}
