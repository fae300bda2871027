//! Error motion values (ISO 230-7) of simulated R-tests, by whole pipelines, and the errors of the motion that they are computed from.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::{fmt::Write, path::PathBuf};

use crate::{
    common::{COMPONENTS, LOCATION, PLACEMENT, THREE_BALLS, scenario, separated, separator},
    trials::{fewest, trials},
};
use runout_core::{
    Complex64,
    numerics::statistics::NORMAL_95,
    pipeline::{Pipeline, Registry, document::Sources},
    points::Points,
    stage::{AxisMotion, Evaluable, PointSeparator},
    summary::{Decision, Summary},
};

/// Mean height of the balls: radial motion is of the axis there.
const HEIGHT_MM: f64 = 70.0;

fn registry() -> Registry {
    let mut registry = Registry::default();
    runout_points::register(&mut registry);
    runout_rotary_axis::register(&mut registry);
    registry
}

/// What the check of such a pipeline says against it.
fn refused(config: &str, more: &str) -> Option<String> {
    let text =
        format!("[load]\nplugin = 'points'\npath = 'r-test.csv'\n[separate]\nplugin = 'rotary-axis'\n{config}\n{more}");
    let sources = Sources::from_text("test.toml", &text, PathBuf::new(), &[], "rig").unwrap();
    Pipeline::from_sources(&sources, &registry()).err().map(|error| format!("{error:?}"))
}

/// Points as a table of text.
fn table(points: &Points) -> String {
    let mut text =
        format!("ball,{}\n", points.columns.iter().map(|column| &*column.name).collect::<Vec<_>>().join(","));
    for (row, ball) in points.labels[0].values.iter().enumerate() {
        text.push_str(ball);
        points.columns.iter().for_each(|column| write!(text, ",{}", column.values[row]).unwrap());
        text.push('\n');
    }
    text
}

/// What a run of such a pipeline finds.
fn run(points: &Points, config: &str, more: &str) -> Summary {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("r-test.csv"), table(points)).unwrap();
    let text = format!(
        "[load]\nplugin = 'points'\npath = '{}'\n[separate]\nplugin = 'rotary-axis'\n{config}\n{more}",
        folder.path().join("r-test.csv").display()
    );
    let sources = Sources::from_text("test.toml", &text, folder.path().to_owned(), &[], "rig").unwrap();
    Pipeline::from_sources(&sources, &registry()).unwrap().run().unwrap()
}

/// Values of the campaign of [`COMPONENTS`]: at 70 mm x has 2 cos 2C + (1 + 0.07·6) sin 2C, y has −1.5 cos 3C, and both have 0.07·√73
/// that turns against the table.
fn truths() -> [(&'static str, f64); 9] {
    let against = 73.0_f64.sqrt();
    [
        ("synchronous-radial-x", 2.0 * 2.0_f64.hypot(1.42)),
        ("synchronous-radial-y", 3.0),
        ("synchronous-radial-x-rms", 2.0_f64.hypot(1.42) / 2.0_f64.sqrt()),
        ("residual-synchronous-tilt-x", 0.0),
        ("residual-synchronous-tilt-y", 12.0),
        ("fundamental-radial", 2.0 * 1e-3 * HEIGHT_MM * against),
        ("fundamental-tilt", 2.0 * against),
        ("synchronous-axial", 2.0 * 5.0_f64.sqrt()),
        ("fundamental-axial", 2.0 * 5.0_f64.sqrt()),
    ]
}

fn campaign(seed: u64, more: &str) -> Points {
    let text = format!(
        "{THREE_BALLS}{COMPONENTS}{LOCATION}{PLACEMENT}commands = {{ step_deg = 15, count = 24 }}\nseed = {seed}\n{more}"
    );
    scenario(&text).simulate().points()
}

const ONLY: &str = "[evaluate]\nvalues = ['error-motion']";

#[test]
fn values_are_those_of_the_simulated_motion() {
    let limits = "\n[[limit]]\nsymbol = 'synchronous-radial-x'\nupper = 5.0\nunit = 'um'\n\
        [[limit]]\nsymbol = 'synchronous-axial'\nsection = 'C'\nreference = 'PC'\nupper = 4.0\nunit = 'um'";
    let found =
        run(&campaign(1, "noise_um = 1e-4"), &format!("{THREE_BALLS}std_um = 1e-3"), &format!("{ONLY}{limits}"));
    for (symbol, truth) in truths() {
        let value = found.values.iter().find(|value| value.symbol == symbol).unwrap();
        assert!((value.value - truth).abs() < 5e-3 * truth.max(1.0), "{symbol}: {value:?} instead of {truth}");
        assert!(value.of.as_deref() == Some("C") && value.uncertainty.is_some(), "{value:?}");
    }
    let decisions: Vec<Decision> = found.limits.iter().map(|limit| limit.decision).collect();
    assert_eq!(decisions, [Decision::Conforms, Decision::DoesNotConform]);
    assert!(
        found.warnings.iter().any(|said| said.contains("C: standing positions have no turns")),
        "{:?}",
        found.warnings
    );
}

#[test]
fn intervals_of_the_values_cover_the_true_value() {
    for (noise, config) in [("noise_um = 1.0", "std_um = 1.0"), ("noise_um = 2.3\npasses = 2", "")] {
        let (campaigns, mut held) = (trials(200), truths().map(|(symbol, _)| (symbol, 0)));
        for seed in 0..campaigns as u64 {
            let found = run(&campaign(seed, noise), &format!("{THREE_BALLS}{config}"), ONLY);
            for ((symbol, held), (_, truth)) in held.iter_mut().zip(truths()) {
                let value = found.values.iter().find(|value| value.symbol == *symbol).unwrap();
                let [low, high] = value.interval_95().unwrap();
                *held += usize::from(low <= truth && truth <= high);
            }
        }
        println!("{noise:?}: {held:?} of {campaigns}");
        // 90 % of 200; 95 % are 190 ± 3.
        let least = fewest(campaigns, [180, 200], 0.95);
        assert!(held.iter().all(|(_, held)| *held >= least), "{noise:?}: {held:?} of {campaigns}");
    }
}

fn motion(points: &Points, config: &str) -> AxisMotion {
    match separated(config, points).evaluables.pop().unwrap() {
        Evaluable::AxisMotion(motion) => motion,
        other => panic!("{other:?}"),
    }
}

/// An order of one of the five, as a sum over the commands.
fn harmonic(angle_deg: &[f64], of: &[[f64; 5]], row: usize, order: f64) -> Complex64 {
    let terms = angle_deg.iter().zip(of).map(|(angle, at)| at[row] * Complex64::cis(-order * angle.to_radians()));
    2.0 / angle_deg.len() as f64 * terms.sum::<Complex64>()
}

/// Squares of errors of the harmonics over their stated variances: 1 in the mean, also where commands lack a ball or rows have
/// uncertainties of their own, so that what all commands share is no placement.
#[test]
fn stated_errors_are_those_of_simulated_campaigns() {
    let four = format!(
        "{}{{ id = 'P4', x_mm = 30, y_mm = 110, z_mm = 70 }},\n]\n",
        THREE_BALLS.trim_end().trim_end_matches(']')
    );
    let orders = [2.0, 3.0, 4.0, 5.0];
    for lacking in [false, true] {
        let (campaigns, mut sums) = (150, [0.0; 5]);
        for seed in 0..campaigns {
            let text = format!(
                "{four}{COMPONENTS}{LOCATION}{PLACEMENT}commands = {{ step_deg = 30, count = 12 }}\nseed = {seed}\nnoise_um = 2.0"
            );
            let made = scenario(&text).simulate();
            let mut points = made.points();
            let balls = &made.ball;
            let keep: Vec<bool> =
                (0..balls.len()).map(|row| !(lacking && balls[row] == "P4" && made.command_deg[row] < 175.0)).collect();
            for column in &mut points.columns {
                let mut keep = keep.iter();
                column.values.retain(|_| *keep.next().unwrap());
            }
            let mut kept = keep.iter();
            points.labels[0].values.retain(|_| *kept.next().unwrap());
            points.traces[0].points = 0..points.labels[0].values.len();
            let found = motion(&points, &format!("{four}std_um = 2.0"));
            let lever = 1e-3 * found.z_mm;
            let truth: Vec<[f64; 5]> =
                made.component.iter().map(|[x, y, z, a, b, _]| [x + lever * b, y - lever * a, *z, *a, *b]).collect();
            let errors = found.errors.as_ref().unwrap();
            assert!((found.z_mm - HEIGHT_MM).abs() < 1e-9);
            for (row, sum) in sums.iter_mut().enumerate() {
                for order in orders {
                    let of = |of: &[[f64; 5]]| harmonic(&found.angle_deg, of, row, order);
                    let own: f64 = errors.own.iter().map(|own| own[row][row]).sum();
                    let variance = own * (2.0 / 12.0_f64).powi(2)
                        + errors.common.iter().map(|change| of(change).norm_sqr()).sum::<f64>();
                    *sum += (of(&found.motion) - of(&truth)).norm_sqr()
                        / variance
                        / (campaigns * orders.len() as u64) as f64;
                }
            }
        }
        println!("lacking {lacking}: {sums:?}");
        // Mean of 600 squares, each of two real numbers: ± 0.04.
        assert!(sums.iter().all(|mean| (mean - 1.0).abs() < 0.15), "lacking {lacking}: {sums:?}");
    }
}

/// Two balls at one height leave the rotation about their line, which goes through neither the axis nor another height: at theirs, x and y
/// stay observable.
#[test]
fn two_balls_give_radial_motion_at_their_height_or_nothing() {
    let two =
        "balls = [{ id = 'P1', x_mm = 120, y_mm = 10, z_mm = 60 }, { id = 'P2', x_mm = -50, y_mm = 95, z_mm = 60 }]\n";
    let text = format!("{two}{COMPONENTS}noise_um = 1e-4\ncommands = {{ step_deg = 15, count = 24 }}");
    let made = scenario(&text).simulate();
    let found = motion(&made.points(), &format!("{two}std_um = 1e-3"));
    for order in [2.0, 3.0] {
        let truth: Vec<[f64; 5]> =
            made.component.iter().map(|[x, y, z, a, b, _]| [x + 0.06 * b, y - 0.06 * a, *z, *a, *b]).collect();
        for row in 0..5 {
            let value = harmonic(&found.angle_deg, &found.motion, row, order);
            let error = (value - harmonic(&found.angle_deg, &truth, row, order)).norm();
            // Lost, or right.
            assert!(value.is_nan() || error < 0.01, "{row} {order}: {value} off by {error}");
        }
    }
}

#[test]
fn what_no_campaign_of_this_kind_gives_is_refused_or_said() {
    let one = "balls = [{ id = 'P1', x_mm = 120, y_mm = 0, z_mm = 60 }]\n";
    for config in [one.to_owned(), format!("{THREE_BALLS}component_errors = false")] {
        assert!(separator(&config).evaluables().is_empty());
        assert!(refused(&config, ONLY).unwrap().contains("motion of an axis"), "{config}");
    }
    assert_eq!(refused(THREE_BALLS, ""), None);
    let total = refused(THREE_BALLS, "[[limit]]\nsymbol = 'total-radial-x'\nupper = 1.0\nunit = 'um'").unwrap();
    assert!(total.contains("no value `total-radial-x` is computed"), "{total}");
    let roundness = refused(THREE_BALLS, "[evaluate]\nvalues = ['roundness']").unwrap();
    assert!(roundness.contains("the separator offers axis-motion"), "{roundness}");

    let partial =
        format!("{THREE_BALLS}{PLACEMENT}noise_um = 1.0\ncommands = {{ from_deg = -30, step_deg = 10, count = 16 }}");
    let found = run(&scenario(&partial).simulate().points(), &format!("{THREE_BALLS}std_um = 1.0"), ONLY);
    assert!(found.values.iter().all(|value| !value.symbol.contains("radial")), "{:?}", found.values);
    assert!(
        found.warnings.iter().any(|said| said.contains("not at equal angles of a full turn")),
        "{:?}",
        found.warnings
    );

    // Without a stated noise it is that of the residual, from few degrees of freedom.
    let found = motion(&campaign(3, "noise_um = 1.0"), THREE_BALLS);
    let own = found.errors.unwrap();
    assert!(own.freedom > 20.0 && own.freedom < 72.0, "{}", own.freedom);
    let std_um = own.own[0][0][0].sqrt();
    assert!(std_um > 0.2 && std_um < 2.0 * NORMAL_95, "{std_um}");
}

/// Of an A axis, y and z are across.
#[test]
fn an_axis_along_x_has_the_letters_of_the_machine() {
    let balls = "axis = 'A'\nballs = [
        { id = 'P1', y_mm = 120, z_mm = 0, x_mm = 60 },
        { id = 'P2', y_mm = -50, z_mm = 95, x_mm = 110 },
        { id = 'P3', y_mm = -70, z_mm = -80, x_mm = 40 },
    ]\n";
    let text = format!(
        "{balls}noise_um = 1e-4\ncommands = {{ step_deg = 15, count = 24 }}\n\
         component = [{{ error = 'EZA', order = 3, sine = 2.0 }}, {{ error = 'EXA', order = 1, sine = 1.0 }}]"
    );
    let found = run(&scenario(&text).simulate().points(), &format!("{balls}std_um = 1e-3"), ONLY);
    let value = |symbol: &str| found.values.iter().find(|value| value.symbol == symbol).unwrap();
    for (symbol, truth) in [("synchronous-radial-z", 4.0), ("synchronous-radial-y", 0.0), ("fundamental-axial", 2.0)] {
        assert!((value(symbol).value - truth).abs() < 0.01, "{symbol}: {:?}", value(symbol));
    }
    assert!(value("synchronous-radial-z").source.contains("direction z, at x = 70 mm"));
    assert!(found.values.iter().all(|value| value.symbol != "synchronous-radial-x"));
}
