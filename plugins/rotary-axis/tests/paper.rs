//! The paper's methods beside the weighted fit.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::common::{COMPONENTS, LOCATION, PLACEMENT, THREE_BALLS, column, scenario, separated, value};
use runout_core::{
    pipeline::{Context, StageConfig},
    points::Points,
    stage::Outcome,
};
use runout_rotary_axis::{CircleFitConfig, ThreePointConfig};

const SYMBOLS: [&str; 4] = ["EX0C", "EY0C", "EA0C", "EB0C"];
const TRUTH: [f64; 4] = [23.7, 3.1, 41.0, 34.6];

/// A separator of the registry, checked as the pipeline does.
fn by<C: StageConfig<Stage = runout_core::stage::Separator> + serde::de::DeserializeOwned>(
    config: &str,
    points: &Points,
) -> runout_core::Result<Outcome> {
    let config: C = toml::from_str(config).unwrap();
    let context = Context { folder: std::path::Path::new("."), rig: None };
    let runout_core::stage::Separator::Points(separator) = config.check(&context).unwrap() else { panic!() };
    separator.separate(points)
}

/// Root mean square errors of the four location errors over campaigns, in units of the weighted fit's uncertainty.
fn errors(more: &str) -> [[f64; 4]; 3] {
    let mut squares = [[0.0; 4]; 3];
    for seed in 0..40 {
        let text = format!(
            "{THREE_BALLS}{LOCATION}{more}noise_um = 2.3\nseed = {seed}\ncommands = {{ step_deg = 15, count = 24 }}"
        );
        let points = scenario(&text).simulate().points();
        let config = format!("{THREE_BALLS}std_um = 2.3");
        let fit = separated(&config, &points);
        let circle = by::<CircleFitConfig>(&config, &points).unwrap();
        let three = by::<ThreePointConfig>(&config, &points).unwrap();
        for (found, squares) in [&fit, &circle, &three].into_iter().zip(&mut squares) {
            for (index, symbol) in SYMBOLS.iter().enumerate() {
                let scale = value(&fit, symbol)[1];
                squares[index] += ((value(found, symbol)[0] - TRUTH[index]) / scale).powi(2) / 40.0;
            }
        }
    }
    squares.map(|all| all.map(f64::sqrt))
}

#[test]
fn the_weighted_fit_is_better_where_balls_are_placed_and_errors_vary() {
    let ideal = errors("");
    let real = errors(&format!("{PLACEMENT}{COMPONENTS}"));
    println!("nothing else: {ideal:#?}\nplacement and component errors: {real:#?}");
    for index in 0..4 {
        assert!(real[0][index] < 1.4, "{real:?}");
        // Without placement and component errors the circle of one ball is right.
        assert!(ideal[1][index] < 4.0, "{ideal:?}");
        assert!(real[1][index].max(real[2][index]) > 2.0, "{real:?}");
    }
}

#[test]
fn three_points_give_component_errors_where_balls_stand_as_nominal() {
    let text =
        format!("{THREE_BALLS}{LOCATION}{COMPONENTS}noise_um = 0.01\ncommands = {{ step_deg = 15, count = 24 }}");
    let made = scenario(&text).simulate();
    let found = by::<ThreePointConfig>(&format!("{THREE_BALLS}std_um = 0.01"), &made.points()).unwrap();
    for (index, name) in ["exc_um", "eyc_um", "ezc_um", "eac_urad", "ebc_urad", "ecc_urad"].iter().enumerate() {
        let std = column(&found, "component_errors", &format!("std_{name}"));
        for ((number, std), truth) in column(&found, "component_errors", name).iter().zip(std).zip(&made.component) {
            assert!((number - truth[index]).abs() < 4.5 * std + 0.01, "{name} {number} {std} {truth:?}");
        }
    }
}
