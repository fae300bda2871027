//! The model beside the simulator, and its partials beside finite differences.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use runout_core::{closed_loop::Setting, points::Points};

use crate::{
    config::FlyCuttingConfig,
    effects::{MISSING, applied},
    heights::Heights,
    passes::Cut,
    simulate::FlyCuttingScenario,
};

const CUT: &str = "nose_radius_mm = 6.0\nfeed_um_per_rev = 8.3\ncutter_radius_mm = 250.0\nspeed_rpm = 390.0\n";
const GRID: &str =
    "[grid]\nrows = 60\ncolumns = 300\nstep_x_mm = 0.0131\nstep_y_mm = 0.07\norigin_x_mm = -1.3\norigin_y_mm = 40.0\n";

fn config() -> FlyCuttingConfig {
    toml::from_str(CUT).unwrap()
}

fn heights(effects: &str) -> Heights {
    let scenario: FlyCuttingScenario = toml::from_str(&format!("[cut]\n{CUT}{GRID}{effects}")).unwrap();
    Heights::new(&Points::of_grid(scenario.heights().unwrap(), "map.h5".into()), &config()).unwrap().0
}

/// Each effect, small and far beyond the usual.
const EFFECTS: [(usize, &[f64], &str); 12] = [
    (0, &[700.0, -90.0], "plugin = 'workpiece-tilt'\nx_urad = 700.0\ny_urad = -90.0"),
    (1, &[0.0, 300.0, 0.0, 0.0], "plugin = 'table-straightness'\norder = 3\namplitude_nm = 300.0"),
    (1, &[0.0, 0.0, 0.0, -4.0], "plugin = 'table-straightness'\norder = 5\namplitude_nm = -4.0"),
    (2, &[20_000.0], "plugin = 'feed-scale'\nscale_um_per_m = 20000"),
    (3, &[-2.0], "plugin = 'nose-radius'\nchange_mm = -2.0"),
    (4, &[0.31, 30.0, 20.0], "plugin = 'spindle-line'\nfrequency_ratio = 0.31\namplitude_nm = 30.0\nphase_deg = 20.0"),
    (
        4,
        &[2.46, 50.0, -70.0],
        "plugin = 'spindle-line'\nfrequency_ratio = 2.46\namplitude_nm = 50.0\nphase_deg = -70.0",
    ),
    (4, &[0.8, 1e-3, 0.0], "plugin = 'spindle-line'\nfrequency_ratio = 0.8\namplitude_nm = 1e-3"),
    (
        7,
        &[1.3, 0.4, 10.0],
        "plugin = 'spindle-line'\nfrequency_ratio = 1.3\namplitude_urad = 0.4\nphase_deg = 10.0\ndirection = 'tilt-x'",
    ),
    (9, &[400.0], "plugin = 'map-rotation'\nangle_urad = 400.0"),
    (9, &[-5.3], "plugin = 'map-rotation'\nangle_urad = -5.3"),
    (10, &[0.5], "plugin = 'cutter-radius'\nchange_mm = 0.5"),
];

/// Picometres: what the first order in the distance from a pass leaves.
#[test]
fn the_model_is_the_simulated_surface() {
    for (effect, values, text) in EFFECTS {
        let heights = heights(&format!("[[effect]]\n{text}\n"));
        let applied = applied(&[Setting { effect, values: values.to_vec() }]);
        let cut = Cut::new(&config(), heights.extent_mm(), applied).unwrap();
        let model = cut.surface(&heights, 0.0);
        let differences = heights.height_nm.iter().zip(&model.height_nm).map(|(height, model)| (height - model).abs());
        let farthest = differences.fold(0.0, f64::max);
        println!("{text}: {farthest:.2e} nm");
        assert!(farthest < 5e-3, "{text}: {farthest} nm");
    }
}

/// At the values above and near none, in a norm that a missing partial fails.
#[test]
fn partials_are_those_of_finite_differences() {
    let near_none = MISSING.iter().enumerate().map(|(effect, missing)| {
        let values = missing.effect().parameters.iter().map(|_| 1e-3).collect::<Vec<f64>>();
        (effect, if missing.line().is_some() { vec![0.4, 1e-3, 5.0] } else { values })
    });
    let cases: Vec<(usize, Vec<f64>)> =
        EFFECTS.iter().map(|(effect, values, _)| (*effect, values.to_vec())).chain(near_none).collect();
    let heights = heights("");
    for (effect, values) in cases {
        let at = |values: &[f64]| {
            let applied = applied(&[Setting { effect, values: values.to_vec() }]);
            let cut = Cut::new(&config(), heights.extent_mm(), applied).unwrap();
            let surface = cut.surface(&heights, 2e-3);
            (cut, surface)
        };
        let (cut, surface) = at(&values);
        let parameters = MISSING[effect].effect().parameters;
        let partials = MISSING[effect].partials(&values, &cut, &heights, &surface);
        for (index, (partial, parameter)) in partials.iter().zip(&parameters).enumerate() {
            // A ratio turns by thousands of passes.
            let step = 1e-6 * parameter.tolerance * if parameter.name == "frequency_ratio" { 1e-3 } else { 1.0 };
            let moved = |sign: f64| {
                let mut values = values.clone();
                values[index] += sign * step;
                at(&values).1
            };
            let [more, less] = [moved(1.0), moved(-1.0)];
            // Where another pass remains, the surface has an edge.
            let same = |point: &usize| more.pass[*point] == less.pass[*point];
            let (mut differences, mut all) = (0.0, 0.0);
            for point in (0..heights.len()).filter(same) {
                let finite = (more.height_nm[point] - less.height_nm[point]) / (2.0 * step);
                differences += (finite - partial[point]).powi(2);
                all += finite * finite;
            }
            assert!(all > 0.0 && differences < 1e-6 * all, "{effect} {}: {differences} of {all}", parameter.name);
        }
    }
}
