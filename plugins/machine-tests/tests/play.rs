//! Circular paths of a machine whose axes have play: level arcs with steps at the reversals, which harmonics show as waves.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests; the shares are printed")]

use std::f64::consts::TAU;

use runout_core::stage::Outcome;
use runout_machine_tests::CircularConfig;

use crate::support::{Chance, Held, Rows, separated, value};

const RADIUS_MM: f64 = 150.0;
/// Speed of an axis, over that of the path, at which half of its play is through.
const THROUGH: f64 = 0.02;

/// Distance of the actual place from the centre of the instrument less the radius, where both axes stay behind by half of their play.
fn deviation_um(angle: f64, side: f64, play_um: f64) -> f64 {
    let behind_mm = |speed: f64| 0.5e-3 * play_um * (side * speed / THROUGH).tanh();
    let (sin, cos) = angle.sin_cos();
    let place = [RADIUS_MM * cos - behind_mm(-sin), RADIUS_MM * sin - behind_mm(cos)];
    1e3 * (place[0].hypot(place[1]) - RADIUS_MM)
}

/// Both directions, so many turns each.
fn measured(play_um: f64, readings: usize, turns: usize, mut noise_um: impl FnMut() -> f64) -> Outcome {
    let mut rows = Rows::new("", &["angle_deg", "deviation_um", "direction"]);
    for side in [1.0, -1.0] {
        for step in 0..turns * readings {
            let angle = side * TAU * step as f64 / readings as f64;
            rows.push("", &[angle.to_degrees(), deviation_um(angle, side, play_um) + noise_um(), side]);
        }
    }
    let config = CircularConfig { plane: "XY".into(), radius_mm: RADIUS_MM, radius_std_um: 0.0 };
    separated(config, &rows).unwrap()
}

/// Before the least form was taken as flat as it may be, and readings were drawn at their own angles, half of these intervals missed.
#[test]
fn intervals_cover_the_true_value_of_play_and_of_no_play() {
    let trials = crate::trials::trials(18) as u64;
    for (play_um, readings, turns) in [(5.0, 360, 5), (5.0, 1000, 5), (3.0, 360, 3), (0.0, 360, 5)] {
        let truth = measured(play_um, readings, 1, || 0.0);
        let mut held = Held::default();
        for seed in 0..trials {
            let mut chance = Chance::new(seed);
            let found = measured(play_um, readings, turns, || 0.3 * chance.normal());
            for symbol in ["G+", "G-", "G_b", "H", "F_max", "F_min"] {
                held.take(symbol, value(&found, symbol, ""), value(&truth, symbol, "").value);
            }
        }
        let [all, _] = held.shares(&format!("play {play_um} µm, {turns} turns of {readings}"));
        // 93 % of the full study; of fewer trials, less by the root of their number.
        assert!(all >= 1.0 - 0.07 * (18.0 / trials as f64).sqrt(), "{play_um} µm, {readings}: {all}");
    }
}

/// A path that begins within the first turn: the turn is named, and no value is stated without that. Sound paths, also with noise that lasts, say nothing.
#[test]
fn a_path_that_begins_within_a_turn_is_said() {
    let (readings, turns) = (360, 4);
    let begins =
        |readings: usize, step: usize, size_um: f64| size_um * (-(step as f64) / (0.05 * readings as f64)).exp();
    let trials = crate::trials::trials(24) as u64;
    for (size_um, lasting, said_of) in [(3.0, 0.0, true), (1.5, 0.0, true), (0.0, 0.0, false), (0.0, 0.9, false)] {
        let mut said = 0;
        for seed in 0..trials {
            let mut chance = Chance::new(70 + seed);
            let mut rows = Rows::new("", &["angle_deg", "deviation_um", "direction"]);
            for side in [1.0, -1.0] {
                let mut noise_um = 0.0;
                for step in 0..turns * readings {
                    let angle = side * TAU * step as f64 / readings as f64;
                    noise_um = lasting * noise_um + 0.25 * (1.0_f64 - lasting * lasting).sqrt() * chance.normal();
                    let own_um = 2.0 * (2.0 * angle).cos() + begins(readings, step, size_um);
                    rows.push("", &[angle.to_degrees(), own_um + noise_um, side]);
                }
            }
            let config = CircularConfig { plane: "XY".into(), radius_mm: RADIUS_MM, radius_std_um: 0.0 };
            let found = separated(config, &rows).unwrap();
            said += u64::from(found.values.iter().any(|value| value.refuted_by.is_some()));
        }
        println!("begins {size_um} µm off, noise that lasts {lasting}: said in {said} of {trials}");
        assert!(
            if said_of { 8 * said >= 7 * trials } else { 8 * said <= trials },
            "{size_um} {lasting}: {said} of {trials}"
        );
    }
}
