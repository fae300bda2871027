//! Location and component errors of simulated campaigns: recovery, coverage, and what is lost.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::{
    common::{COMPONENTS, LOCATION, PLACEMENT, THREE_BALLS, column, scenario, separated, separator, value},
    trials::trials,
};
use runout_core::{
    points::{Points, mistakes},
    stage::PointSeparator,
};

const LOCATION_SYMBOLS: [&str; 4] = ["EX0C", "EY0C", "EA0C", "EB0C"];
const TRUE_LOCATION: [f64; 4] = [23.7, 3.1, 41.0, 34.6];
const COMPONENT_COLUMNS: [&str; 6] = ["exc_um", "eyc_um", "ezc_um", "eac_urad", "ebc_urad", "ecc_urad"];

fn campaign(more: &str) -> String {
    format!("{THREE_BALLS}{COMPONENTS}{LOCATION}{PLACEMENT}commands = {{ step_deg = 15, count = 24 }}\n{more}")
}

#[test]
fn errors_far_larger_than_usual_are_recovered() {
    let text = format!(
        "{THREE_BALLS}{PLACEMENT}commands = {{ step_deg = 10, count = 36 }}
        noise_um = 1e-6
        location = {{ EX0C = 800, EY0C = -500, EA0C = 2000, EB0C = -3000 }}
        component = [
            {{ error = 'EXC', order = 2, cosine = 60, sine = 10 }},
            {{ error = 'EAC', order = 1, cosine = 300, sine = 100 }},
            {{ error = 'EBC', order = 1, cosine = 100, sine = -300 }},
            {{ error = 'ECC', order = 1, cosine = 900 }},
        ]"
    );
    let made = scenario(&text).simulate();
    let found = separated(&format!("{THREE_BALLS}std_um = 0.01"), &made.points());
    for (symbol, truth) in LOCATION_SYMBOLS.iter().zip([800.0, -500.0, 2000.0, -3000.0]) {
        let [number, _] = value(&found, symbol);
        assert!((number - truth).abs() < 1e-3, "{symbol} {number}");
    }
    for (index, name) in COMPONENT_COLUMNS.iter().enumerate() {
        for (number, truth) in column(&found, "component_errors", name).iter().zip(&made.component) {
            assert!((number - truth[index]).abs() < 1e-3, "{name} {number} {truth:?}");
        }
    }
}

/// Share of 95 % intervals that cover the true value, over campaigns.
fn coverage(config: &str, more: &str, seeds: u64) -> ([f64; 4], [f64; 6], [f64; 4]) {
    let separator = separator(config);
    let mut held = [0.0; 4];
    let mut components = [0.0; 6];
    let mut squares = [0.0; 4];
    let mut rows = 0.0;
    for seed in 0..seeds {
        let made = scenario(&campaign(&format!("seed = {seed}\n{more}"))).simulate();
        let found = separator.separate(&made.points()).unwrap();
        for (index, symbol) in LOCATION_SYMBOLS.iter().enumerate() {
            let [number, std] = value(&found, symbol);
            let error = (number - TRUE_LOCATION[index]) / std;
            held[index] += f64::from(u8::from(error.abs() < 1.96)) / seeds as f64;
            squares[index] += error * error / seeds as f64;
        }
        for (index, name) in COMPONENT_COLUMNS.iter().enumerate() {
            let std = column(&found, "component_errors", &format!("std_{name}"));
            let numbers = column(&found, "component_errors", name);
            for ((number, std), truth) in numbers.iter().zip(std).zip(&made.component) {
                components[index] += f64::from(u8::from(((number - truth[index]) / std).abs() < 1.96));
            }
            rows += numbers.len() as f64 / 6.0;
        }
    }
    (held, components.map(|count| count / rows), squares.map(f64::sqrt))
}

fn hold_in(config: &str, more: &str, seeds: usize) {
    let found = coverage(config, more, seeds as u64);
    let seeds = seeds as f64;
    println!("{found:?}");
    // 95 % within three binomial standard deviations of the campaigns.
    let off = 3.0 * (0.95 * 0.05 / seeds).sqrt();
    for share in found.0 {
        assert!((share - 0.95).abs() < off, "{found:?}");
    }
    // Commands of a campaign share its placement: 0.015 of 200 campaigns.
    for share in found.1 {
        assert!((share - 0.95).abs() < 0.015 * f64::max(1.0, 200.0 / seeds).sqrt(), "{found:?}");
    }
    for ratio in found.2 {
        assert!((ratio - 1.0).abs() < 3.0 / (2.0 * seeds).sqrt(), "{found:?}");
    }
}

#[test]
fn intervals_cover_the_true_value_with_stated_noise() {
    hold_in(&format!("{THREE_BALLS}std_um = 2.3"), "noise_um = 2.3", trials(300));
}

#[test]
fn intervals_cover_the_true_value_with_noise_from_repeats() {
    hold_in(THREE_BALLS, "noise_um = 2.3\npasses = 3", trials(200));
}

#[test]
fn a_drift_does_not_inflate_the_noise_of_repeats() {
    for drift in [
        "{ plugin = 'thermal-drift', targets = ['x'], drift_um = 40 }",
        "{ plugin = 'thermal-drift', targets = ['z'], drift_um = 30, time_constant = 0.3 }",
    ] {
        let text = campaign(&format!("noise_um = 1.5\npasses = 3\nball_by_ball = true\neffect = [{drift}]"));
        let found = separated(THREE_BALLS, &scenario(&text).simulate().points());
        let remark = found.notes.iter().find(|note| note.contains("scatter of repeats")).unwrap();
        let std: f64 = remark.split(": ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!((std - 1.5).abs() < 0.2, "{remark}");
    }
}

#[test]
fn repeats_in_opposite_directions_give_the_noise_without_lost_motion() {
    let text = campaign(
        "noise_um = 1.5\npasses = 2\nback_and_forth = true\neffect = [{ plugin = 'backlash', lost_motion_urad = 200 }]",
    );
    let found = separated(THREE_BALLS, &scenario(&text).simulate().points());
    let remark = found.notes.iter().find(|note| note.contains("scatter of repeats")).unwrap();
    let std: f64 = remark.split(": ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!((std - 1.5).abs() < 0.3, "{remark}");
}

#[test]
fn every_axis_is_the_same_with_other_names() {
    let c =
        separated(&format!("{THREE_BALLS}std_um = 2.0"), &scenario(&campaign("noise_um = 1e-4")).simulate().points());
    for (axis, order, letters) in [("A", [1, 2, 0], "A"), ("B", [2, 0, 1], "B")] {
        // Ball (x, y, z) of C stands at the coordinates that take the places of x, y and z.
        let places = [[120.0, 0.0, 60.0], [-50.0, 95.0, 110.0], [-70.0, -80.0, 40.0]];
        let names = ["x_mm", "y_mm", "z_mm"];
        let balls: Vec<String> = places
            .iter()
            .enumerate()
            .map(|(ball, place)| {
                let keys: Vec<String> =
                    (0..3).map(|index| format!("{} = {}", names[order[index]], place[index])).collect();
                format!("{{ id = 'P{}', {} }}", ball + 1, keys.join(", "))
            })
            .collect();
        let balls = format!("axis = '{axis}'\nballs = [{}]\n", balls.join(", "));
        let linear = ['X', 'Y', 'Z'].map(|letter| letter.to_string());
        let angular = ['A', 'B', 'C'].map(|letter| letter.to_string());
        let location = format!(
            "location = {{ E{}0{letters} = 23.7, E{}0{letters} = 3.1, E{}0{letters} = 41.0, E{}0{letters} = 34.6 }}\n",
            linear[order[0]], linear[order[1]], angular[order[0]], angular[order[1]]
        );
        let text = format!("{balls}{location}noise_um = 1e-4\ncommands = {{ step_deg = 15, count = 24 }}");
        let found = separated(&format!("{balls}std_um = 2.0"), &scenario(&text).simulate().points());
        for (own, of_c) in [(&linear, "XY"), (&angular, "AB")] {
            for (index, letter) in of_c.chars().enumerate() {
                let [number, std] = value(&found, &format!("E{}0{letters}", own[order[index]]));
                let [expected, expected_std] = value(&c, &format!("E{letter}0C"));
                assert!((number - expected).abs() < 0.01, "{axis} {letter}: {number} {expected}");
                assert!((std / expected_std - 1.0).abs() < 1e-3);
            }
        }
    }
}

#[test]
fn one_ball_determines_the_location_only_without_component_errors() {
    let ball = "balls = [{ id = 'P1', x_mm = 120, y_mm = 0, z_mm = 60 }]\n";
    let text = format!("{ball}{LOCATION}noise_um = 1.0\ncommands = {{ step_deg = 4, count = 91 }}");
    let points = scenario(&text).simulate().points();
    let lost = separated(&format!("{ball}std_um = 1.0"), &points);
    for symbol in LOCATION_SYMBOLS {
        assert!(value(&lost, symbol)[0].is_nan(), "{symbol}");
    }
    for name in COMPONENT_COLUMNS {
        assert!(column(&lost, "component_errors", name).iter().all(|number| number.is_nan()), "{name}");
    }
    assert!(lost.remarks.iter().any(|remark| remark.contains("not observable: EX0C, EY0C, EA0C, EB0C, EXC")));
    let found = separated(&format!("{ball}std_um = 1.0\ncomponent_errors = false"), &points);
    for (symbol, truth) in LOCATION_SYMBOLS.iter().zip(TRUE_LOCATION) {
        let [number, std] = value(&found, symbol);
        assert!((number - truth).abs() < 4.0 * std && std < 5.0, "{symbol} {number} {std}");
    }
    assert!(column(&found, "component_errors", "exc_um").is_empty());
}

#[test]
fn two_balls_at_one_height_show_the_rotation_about_the_axis_only() {
    let two = |z: f64| {
        format!(
            "balls = [{{ id = 'P1', x_mm = 120, y_mm = 10, z_mm = 60 }}, {{ id = 'P2', x_mm = -50, y_mm = 95, z_mm = {z} }}]\n"
        )
    };
    let at_one_height = two(60.0);
    let text =
        format!("{at_one_height}{LOCATION}{COMPONENTS}noise_um = 1.0\ncommands = {{ step_deg = 15, count = 24 }}");
    let made = scenario(&text).simulate();
    let found = separated(&format!("{at_one_height}std_um = 1.0"), &made.points());
    for symbol in LOCATION_SYMBOLS {
        assert!(value(&found, symbol)[0].is_nan(), "{symbol}");
    }
    for name in &COMPONENT_COLUMNS[..5] {
        assert!(column(&found, "component_errors", name).iter().any(|number| number.is_nan()), "{name}");
    }
    let [ecc, std] = ["ecc_urad", "std_ecc_urad"].map(|name| column(&found, "component_errors", name));
    for ((number, std), truth) in ecc.iter().zip(std).zip(&made.component) {
        assert!((number - truth[5]).abs() < 4.5 * std, "{number} {std} {truth:?}");
    }
    let notes = separator(&two(60.0)).notes();
    assert!(notes.iter().any(|note| note.contains("observable with all balls at all commands of a full turn: ECC;")));
    let notes = separator(&two(110.0)).notes();
    assert!(notes.iter().any(|note| note.contains("not observable with these balls")), "{notes:?}");
}

#[test]
fn balls_on_one_line_lose_the_rotation_about_it() {
    let line = "balls = [
        { id = 'P1', x_mm = 120, y_mm = 0, z_mm = 60 },
        { id = 'P2', x_mm = 0, y_mm = 60, z_mm = 80 },
        { id = 'P3', x_mm = -120, y_mm = 120, z_mm = 100 },
    ]\n";
    let text = format!("{line}{LOCATION}{PLACEMENT}noise_um = 1.0\ncommands = {{ step_deg = 15, count = 24 }}");
    let found = separated(&format!("{line}std_um = 1.0"), &scenario(&text).simulate().points());
    assert!(value(&found, "EA0C")[0].is_nan());
    let notes = separator(THREE_BALLS).notes();
    let all = "observable with all balls at all commands of a full turn: EX0C, EY0C, EA0C, EB0C, EXC, EYC, EZC, EAC, EBC, ECC";
    assert!(notes.iter().any(|note| note == all), "{notes:?}");
    assert!(notes.iter().any(|note| note.contains("sensor nest")));
}

#[test]
fn the_zero_error_of_the_nest_is_the_location() {
    let made = scenario(&campaign("noise_um = 1.0")).simulate();
    let config = format!("{THREE_BALLS}std_um = 1.0");
    let [plain, mut points] = [made.points(), made.points()];
    let column = points.columns.iter_mut().find(|column| column.name == "dx_mm").unwrap();
    column.values.iter_mut().for_each(|value| *value += 0.007);
    let [before, after] = [plain, points].map(|points| separated(&config, &points));
    for (symbol, moved) in LOCATION_SYMBOLS.iter().zip([7.0, 0.0, 0.0, 0.0]) {
        let change = value(&after, symbol)[0] - value(&before, symbol)[0];
        assert!((change - moved).abs() < 0.01, "{symbol} {change}");
    }
}

#[test]
fn a_turn_closed_by_360_degrees_counts_once() {
    let config = format!("{THREE_BALLS}std_um = 1.0");
    let text = |count| {
        format!(
            "{THREE_BALLS}{COMPONENTS}{LOCATION}{PLACEMENT}noise_um = 1e-4\ncommands = {{ step_deg = 15, count = {count} }}"
        )
    };
    for count in [24, 25] {
        let found = separated(&config, &scenario(&text(count)).simulate().points());
        for (symbol, truth) in LOCATION_SYMBOLS.iter().zip(TRUE_LOCATION) {
            assert!((value(&found, symbol)[0] - truth).abs() < 0.01, "{symbol} {count}");
        }
        assert_eq!(column(&found, "component_errors", "exc_um").len(), 24);
    }
}

#[test]
fn a_column_of_uncertainties_weighs_rows() {
    let made = scenario(&campaign("noise_um = 0.5")).simulate();
    let mut points = made.points();
    let rows = made.ball.len();
    // A reading far off, declared as such, changes nothing.
    let std_um = (0..rows).map(|row| if row == 30 { 1e4 } else { 0.5 }).collect();
    points.columns.push(runout_core::points::Column { name: "std_um".into(), values: std_um });
    points.columns[1].values[30] += 1.0;
    let found = separated(&format!("{THREE_BALLS}std_um = 77"), &points);
    for (symbol, truth) in LOCATION_SYMBOLS.iter().zip(TRUE_LOCATION) {
        let [number, std] = value(&found, symbol);
        assert!((number - truth).abs() < 4.5 * std, "{symbol} {number} {std}");
    }
}

#[test]
fn a_command_without_all_balls_is_lost_alone() {
    let made = scenario(&campaign("noise_um = 1.0")).simulate();
    let mut points = made.points();
    for column in &mut points.columns {
        column.values.remove(30);
    }
    points.labels[0].values.remove(30);
    let found = separated(&format!("{THREE_BALLS}std_um = 1.0"), &points);
    assert!(value(&found, "EX0C")[0].is_finite());
    let lost: Vec<usize> = column(&found, "component_errors", "exc_um")
        .iter()
        .enumerate()
        .filter(|(_, number)| number.is_nan())
        .map(|(row, _)| row)
        .collect();
    assert_eq!(lost, [6]);
    assert!(found.remarks.iter().any(|remark| remark.contains("1 of 24 commands were not measured with all balls")));
}

#[test]
fn commands_that_do_not_repeat_lose_everything() {
    let mut made = scenario(&campaign("noise_um = 1.0")).simulate();
    for (row, command) in made.command_deg.iter_mut().enumerate() {
        *command += 5.0 * (row / 24) as f64;
    }
    let found = separated(&format!("{THREE_BALLS}std_um = 1.0"), &made.points());
    assert!(value(&found, "EX0C")[0].is_nan());
    assert!(found.remarks.iter().any(|remark| remark.contains("72 of 72 commands were not measured with all balls")));
}

#[test]
fn bad_input_is_refused_or_warned_of() {
    let made = scenario(&campaign("noise_um = 1.0")).simulate();
    let config = format!("{THREE_BALLS}std_um = 1.0");
    let mut unknown = made.points();
    unknown.labels[0].values[5] = "P9".into();
    let error = separator(&config).separate(&unknown).unwrap_err();
    assert!(error.to_string().contains("point 6: `balls` has no ball `P9`"), "{error}");
    let mut two = made.points();
    two.columns.iter_mut().for_each(|column| column.values.truncate(2));
    two.labels[0].values.truncate(2);
    let error = separator(&config).separate(&two).unwrap_err();
    assert!(error.to_string().contains("at least 3 different commands"), "{error}");
    let mut radians = made.points();
    radians.columns[0].values.iter_mut().for_each(|value| *value = value.to_radians());
    let remarks = separator(&config).separate(&radians).unwrap().remarks;
    assert!(remarks.iter().any(|remark| remark.contains("are they in rad?")), "{remarks:?}");
    let mut micrometres = made.points();
    micrometres.columns[1..4].iter_mut().for_each(|column| column.values.iter_mut().for_each(|value| *value *= 1e3));
    match separator(&config).separate(&micrometres) {
        Ok(found) => {
            assert!(found.remarks.iter().any(|remark| remark.contains("are they in µm?")), "{:?}", found.remarks);
        }
        Err(error) => assert!(error.to_string().contains("mm"), "{error}"),
    }
    let mut direction = made.points();
    let rows = direction.columns[0].values.len();
    direction.columns.push(runout_core::points::Column { name: "direction".into(), values: vec![2.0; rows] });
    assert!(separator(&config).separate(&direction).is_err());
}

/// A campaign of the size of the paper's: 91 commands, deviations of a tenth of a millimetre.
#[test]
fn compensation_removes_most_on_commands_that_the_fit_has_not_seen() {
    let text = format!(
        "{THREE_BALLS}{PLACEMENT}noise_um = 2.3
        commands = {{ step_deg = 4, count = 91 }}
        location = {{ EX0C = 23.7, EY0C = 3.1, EA0C = 41.0, EB0C = 34.6 }}
        component = [
            {{ error = 'EXC', order = 2, cosine = 8, sine = 5 }},
            {{ error = 'EYC', order = 2, cosine = 4, sine = 9 }},
            {{ error = 'EZC', order = 1, cosine = 10, sine = 20 }},
            {{ error = 'ECC', order = 1, cosine = 300, sine = 100 }},
        ]"
    );
    let found = separated(&format!("{THREE_BALLS}std_um = 2.3"), &scenario(&text).simulate().points());
    for ball in ["P1", "P2", "P3"] {
        let range = |symbol: &str| {
            let value = found.values.iter().find(|value| value.symbol == symbol && value.of.as_deref() == Some(ball));
            value.unwrap().value
        };
        for coordinate in ["dx", "dy"] {
            let [before, after] = ["before", "after"].map(|when| range(&format!("{coordinate}_range_{when}")));
            println!("{ball} {coordinate} {before:.1} {after:.1}");
            assert!(after < 0.3 * before, "{ball} {coordinate} {before} {after}");
        }
    }
}

/// Columns of the file that are exchanged or have the other sign are named, and sound files are not.
#[test]
fn mistakes_of_the_file_are_named() {
    let text = format!(
        "{THREE_BALLS}{COMPONENTS}{LOCATION}{PLACEMENT}noise_um = 1.0\nseed = 5\ncommands = {{ step_deg = 10, count = 36 }}"
    );
    let points = scenario(&text).simulate().points();
    let said = |points: &Points| {
        let remarks = separated(&format!("{THREE_BALLS}std_um = 1.0"), points).remarks;
        remarks.into_iter().filter(|remark| remark.starts_with("it looks as if")).collect::<Vec<_>>()
    };
    assert_eq!(said(&points), Vec::<String>::new());
    // The sign of dz shows by tilts only, which are as small as the noise here; x and y turned by 90° are another frame, and leave no trace.
    let exchanged = [["dx_mm", "dy_mm"], ["dx_mm", "dz_mm"]];
    for (what, wrong) in mistakes::columns(&points, &exchanged, &[&["dx_mm"], &["c_deg"]]) {
        let said = said(&wrong);
        println!("{what}: {said:?}");
        if !what.contains("exchanged, ") {
            assert!(said.first().is_some_and(|first| first.contains(&what)), "{what}: {said:?}");
        }
    }
}
