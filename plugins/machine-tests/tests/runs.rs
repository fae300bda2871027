//! What changes from run to run of a positioning test: the scale of an axis whose temperature is another one in each run.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests; the shares are printed")]

use runout_machine_tests::PositioningConfig;

use crate::{
    support::{Chance, Rows, separated},
    trials::{fewest, trials},
};

const TARGETS: usize = 11;
const STEP_MM: f64 = 50.0;
const NOISE_UM: f64 = 0.4;

/// Five runs both ways, the scale of each off by so much: µm per mm.
fn measured(chance: &mut Chance, scale_std: f64) -> Rows {
    let mut rows = Rows::new("", &["target_mm", "deviation_um", "direction"]);
    for _ in 0..5 {
        let scale = scale_std * chance.normal();
        for side in [1.0, -1.0] {
            for number in 0..TARGETS {
                let place = if side > 0.0 { number } else { TARGETS - 1 - number };
                let at = STEP_MM * place as f64;
                let deviation = 2.0 * (at / 90.0).sin() + 0.5 * side + scale * at + NOISE_UM * chance.normal();
                rows.push("", &[at, deviation, side]);
            }
        }
    }
    rows
}

/// The scale turns about the first target: all of what changes is at the other end.
#[test]
fn a_scale_that_changes_from_run_to_run_is_in_the_interval_of_repeatability() {
    let trials = trials(100);
    for scale_std in [0.0, 1.5e-3, 5e-3] {
        let mut chance = Chance::new(11);
        let widest = 4.0 * NOISE_UM.hypot(scale_std * STEP_MM * (TARGETS - 1) as f64);
        let wanted = [("R+", widest), ("R-", widest), ("R", widest + 1.0)];
        let mut held = [0; 3];
        for _ in 0..trials {
            let config = PositioningConfig { axis: "X".into(), rotary: false, scale_std_ppm: 0.0 };
            let found = separated(config, &measured(&mut chance, scale_std)).unwrap();
            for (held, (symbol, truth)) in held.iter_mut().zip(wanted) {
                let value = found.values.iter().find(|value| value.symbol == symbol).unwrap();
                let [low, high] = value.interval_95().unwrap();
                *held += usize::from((low..=high).contains(&truth));
            }
        }
        println!("simulated, scale {scale_std} µm/mm: R+, R-, R held {held:?} of {trials}");
        assert!(held.iter().all(|held| *held >= fewest(trials, [85, 100], 0.88)), "{scale_std}: {held:?} of {trials}");
    }
}
