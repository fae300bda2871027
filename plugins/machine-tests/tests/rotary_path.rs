//! Paths of a rotary axis: geometry computed by hand, a simulated table, and what cannot be evaluated.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use runout_machine_tests::{Ball, RotaryAxis, RotaryPathConfig, Test};

use crate::{
    support::{Chance, Held, Rows, separated, value},
    trials::{fewest, trials},
};

fn config(test: Test, axis: RotaryAxis, [x_mm, y_mm, z_mm]: [f64; 3]) -> RotaryPathConfig {
    RotaryPathConfig { test, axis, balls: vec![Ball { id: "P1".into(), x_mm, y_mm, z_mm }] }
}

fn names(command: &'static str) -> [&'static str; 5] {
    [command, "dx_mm", "dy_mm", "dz_mm", "direction"]
}

/// A turn by an axis through the origin, by Rodrigues' formula.
fn turned(axis: [f64; 3], [x, y, z]: [f64; 3], angle: f64) -> [f64; 3] {
    let place = [x, y, z];
    let (sin, cos) = angle.sin_cos();
    let cross = [axis[1] * z - axis[2] * y, axis[2] * x - axis[0] * z, axis[0] * y - axis[1] * x];
    let along = axis[0] * x + axis[1] * y + axis[2] * z;
    [0, 1, 2].map(|index| place[index] * cos + cross[index] * sin + axis[index] * along * (1.0 - cos))
}

/// A table whose axis stands 4 µm off along the first and −3 µm along the second of the other axes, is 12 µrad inclined, and lags by lost motion.
struct Table {
    axis: RotaryAxis,
    ball_mm: [f64; 3],
    noise_um: f64,
}

impl Table {
    fn normal(&self) -> [f64; 3] {
        let mut normal = [0.0; 3];
        normal[self.axis as usize] = 1.0;
        normal
    }

    /// Actual less nominal place of the ball, in mm.
    fn deviation_mm(&self, command_deg: f64, side: f64) -> [f64; 3] {
        let normal = self.normal();
        let next = (self.axis as usize + 1) % 3;
        let mut off = [0.0; 3];
        off[next] = 4e-3;
        off[(next + 1) % 3] = -3e-3;
        let mut inclined = normal;
        inclined[next] = 12e-6;
        let command = command_deg.to_radians();
        // Positioning of two waves, and 10 µrad of lost motion.
        let angle = command + 20e-6 * (2.0 * command).sin() - 5e-6 * side;
        let from_axis = [0, 1, 2].map(|index| self.ball_mm[index] - off[index]);
        let actual = turned(inclined, from_axis, angle);
        let nominal = turned(normal, self.ball_mm, command);
        let wobble = 1.5e-3 * command.cos();
        [0, 1, 2].map(|index| actual[index] + off[index] - nominal[index] + wobble * normal[index])
    }

    /// Radial, tangential and axial, in µm, by the nominal place.
    fn parts_um(&self, command_deg: f64, side: f64) -> [f64; 3] {
        let normal = self.normal();
        let place = turned(normal, self.ball_mm, command_deg.to_radians());
        let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let height = dot(place, normal);
        let arm = [0, 1, 2].map(|index| place[index] - height * normal[index]);
        let length = dot(arm, arm).sqrt();
        let radial = arm.map(|part| part / length);
        let tangential = [
            normal[1] * radial[2] - normal[2] * radial[1],
            normal[2] * radial[0] - normal[0] * radial[2],
            normal[0] * radial[1] - normal[1] * radial[0],
        ];
        let deviation = self.deviation_mm(command_deg, side);
        [radial, tangential, normal].map(|direction| 1e3 * dot(deviation, direction))
    }

    fn commands() -> Vec<f64> {
        (0..24).map(|step| 15.0 * f64::from(step)).collect()
    }

    fn rows(&self, chance: &mut Chance, passes: usize) -> Rows {
        let mut rows = Rows::new("ball", &names(["a_deg", "b_deg", "c_deg"][self.axis as usize]));
        for _ in 0..passes {
            for side in [1.0, -1.0] {
                let mut commands = Self::commands();
                if side < 0.0 {
                    commands.reverse();
                }
                for command in commands {
                    let [x, y, z] =
                        self.deviation_mm(command, side).map(|one| one + 1e-3 * self.noise_um * chance.normal());
                    rows.push("P1", &[command, x, y, z, side]);
                }
            }
        }
        rows
    }

    /// Range of both directions, of the positive one, and the largest difference, of a part.
    fn truth_um(&self, part: usize) -> [f64; 3] {
        let of = |side: f64| Self::commands().iter().map(|at| self.parts_um(*at, side)[part]).collect::<Vec<f64>>();
        let range =
            |all: &[f64]| all.iter().fold(f64::MIN, |a, b| a.max(*b)) - all.iter().fold(f64::MAX, |a, b| a.min(*b));
        let (ahead, back) = (of(1.0), of(-1.0));
        let reversal = ahead.iter().zip(&back).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        [range(&[ahead.clone(), back].concat()), range(&ahead), reversal]
    }
}

const PARTS: [&str; 3] = ["radial", "tangential", "axial"];

#[test]
fn parts_are_those_of_the_geometry_about_each_axis() {
    for axis in [RotaryAxis::A, RotaryAxis::B, RotaryAxis::C] {
        let table = Table { axis, ball_mm: [60.0, -45.0, 80.0], noise_um: 0.001 };
        let found = separated(config(Test::Bk2, axis, table.ball_mm), &table.rows(&mut Chance::new(1), 2)).unwrap();
        for (part, name) in PARTS.into_iter().enumerate() {
            let [both, ahead, reversal] = table.truth_um(part);
            for (symbol, expected) in [("", both), ("+", ahead), ("-reversal", reversal)] {
                let value = value(&found, &format!("{name}{symbol}"), "P1").value;
                assert!((value - expected).abs() < 0.01, "{axis:?} {name}{symbol}: {value} {expected}");
            }
        }
        assert!(found.values.iter().all(|value| value.source.contains("ISO 10791-6, BK2")));
    }
}

/// An axis off by 5 µm along x: the ball is read 5 µm off at each command, radial 5 cos, tangential −5 sin.
#[test]
fn an_offset_is_a_wave_of_5_um() {
    let mut rows = Rows::new("ball", &names("c_deg"));
    for pass in 0..2 {
        for side in [1.0, -1.0] {
            for step in 0..24 {
                let step = if side > 0.0 { step } else { 23 - step };
                rows.push("P1", &[15.0 * f64::from(step), 5e-3 + 1e-7 * f64::from(pass), 0.0, 0.0, side]);
            }
        }
    }
    let found = separated(config(Test::Bk2, RotaryAxis::C, [80.0, 0.0, 10.0]), &rows).unwrap();
    for (symbol, expected) in [("radial", 10.0), ("tangential", 10.0), ("axial", 0.0), ("radial-reversal", 0.0)] {
        assert!((value(&found, symbol, "P1").value - expected).abs() < 1e-3, "{symbol}");
    }
    // BK4 is along the machine's axes.
    let found = separated(config(Test::Bk4, RotaryAxis::C, [80.0, 0.0, 10.0]), &rows).unwrap();
    assert!(value(&found, "x", "P1").value < 1e-3 && found.values.iter().all(|value| value.symbol != "radial"));
}

#[test]
fn intervals_cover_the_true_value_of_a_simulated_table() {
    for (passes, noise_um) in [(2, 0.3), (3, 1.0), (5, 0.5)] {
        let table = Table { axis: RotaryAxis::C, ball_mm: [120.0, 20.0, 60.0], noise_um };
        let mut chance = Chance::new(passes as u64 + 20);
        let mut held = Held::default();
        let count = trials(100);
        for _ in 0..count {
            let found =
                separated(config(Test::Bk2, RotaryAxis::C, table.ball_mm), &table.rows(&mut chance, passes)).unwrap();
            for (part, name) in PARTS.into_iter().enumerate() {
                let [both, ahead, reversal] = table.truth_um(part);
                held.take(name, value(&found, name, "P1"), both);
                held.take(&format!("{name}+"), value(&found, &format!("{name}+"), "P1"), ahead);
                held.take(&format!("{name}-reversal"), value(&found, &format!("{name}-reversal"), "P1"), reversal);
            }
        }
        let [all, least] = held.shares(&format!("{passes} passes, noise {noise_um} µm"));
        let lowest = fewest(count, [82, 100], 0.95) as f64 / count as f64;
        assert!(all >= 0.95 - 0.02 * f64::sqrt(100.0 / count as f64) && least >= lowest, "{all} {least}");
    }
}

#[test]
fn mistakes_have_a_reason_and_what_is_odd_is_said() {
    use runout_core::pipeline::{Context, StageConfig};
    let table = Table { axis: RotaryAxis::C, ball_mm: [120.0, 20.0, 60.0], noise_um: 0.3 };
    let usual = table.rows(&mut Chance::new(2), 4);
    let bk2 = || config(Test::Bk2, RotaryAxis::C, table.ball_mm);
    let mut other = usual.clone();
    other.texts[5] = "P9".into();
    assert!(separated(bk2(), &other).unwrap_err().to_string().contains("`P9` is none of `balls`"));
    let error = separated(bk2(), &Rows::new("ball", &names("c_deg"))).unwrap_err().to_string();
    assert!(error.contains("there is no row of a ball"), "{error}");
    let fault = |config: RotaryPathConfig| {
        config.check(&Context { folder: std::path::Path::new("."), rig: None }).err().unwrap().to_string()
    };
    assert!(fault(config(Test::Bk1, RotaryAxis::C, [0.0, 0.0, 50.0])).contains("on the axis"));
    assert!(fault(config(Test::Bk1, RotaryAxis::C, [f64::NAN, 0.0, 50.0])).contains("expected numbers"));
    assert!(fault(RotaryPathConfig { balls: Vec::new(), ..bk2() }).contains("at least one ball"));
    let mut twice = bk2();
    twice.balls.push(twice.balls[0].clone());
    assert!(fault(twice).contains("two balls are named P1"));
    assert!(separated(bk2(), &usual).unwrap().remarks.is_empty());
    // Copies of one pass.
    let mut copies = usual.clone();
    copies.numbers.iter_mut().for_each(|column| *column = column[..48].repeat(4));
    let found = separated(bk2(), &copies).unwrap();
    assert!(found.values.iter().all(|value| value.uncertainty.is_none()));
    assert!(found.remarks.iter().any(|remark| remark.contains("copies show no uncertainty")));
    // The table drifts along z from pass to pass.
    let mut drifting = usual;
    drifting.numbers[3].iter_mut().enumerate().for_each(|(row, z)| *z += 2e-3 * (row / 48) as f64);
    let found = separated(bk2(), &drifting).unwrap();
    assert!(found.remarks.iter().any(|remark| remark.starts_with("P1 axial: the runs drift")), "{:?}", found.remarks);
}
