//! The campaigns: points of each domain from formulas of their own, with errors of several kinds.

use std::{f64::consts::TAU, fmt::Write};

use super::Kind;
use crate::chance::Chance;

/// All kinds, domain by domain; sound ones first.
pub static ROWS: &[Kind] = &[
    cylinder("independent errors, 3 circles", |chance| circles(chance, 3, independent), &[]),
    cylinder("independent errors, 8 circles", |chance| circles(chance, 8, independent), &[]),
    cylinder("errors correlated over 4 points, 3 circles", |chance| circles(chance, 3, |c, n| walk(c, n, 4.0)), ALONG),
    cylinder(
        "errors correlated over 12 points, 8 circles",
        |chance| circles(chance, 8, |c, n| walk(c, n, 12.0)),
        ALONG,
    ),
    cylinder(
        "circles that sit elsewhere, 5 circles",
        |chance| circles(chance, 5, seated),
        &["differ", "disagree", "depend"],
    ),
    straightness("independent errors", |chance| traces(chance, independent)),
    straightness_troubled(
        "errors that are a random walk",
        |chance| traces(chance, random_walk),
        &["depend on each other"],
    ),
    probe("independent errors", |chance| touches(chance, 0.0), &[]),
    probe("one touch of 540 off by 13 std", |chance| touches(chance, 13.0), &["is off by"]),
    rotary("independent errors", |chance| r_test(chance, 0.0, 0.0), &[], None),
    rotary(
        "the second pass is offset by 4 std",
        |chance| r_test(chance, 6.0, 0.0),
        &["pass 2"],
        Some(("nest-step", 0, 6.0)),
    ),
    rotary("the turn does not close by 40 std", |chance| r_test(chance, 0.0, 60.0), &["close"], None),
    quadrature("independent errors", |chance| signal(chance, 0.0, independent)),
    quadrature("independent errors, slow samples of one turn", |chance| signal(chance, 1.0, independent)),
    spatial("independent errors of 4 µm", |chance| plate(chance, 0.0, false), &[]),
    spatial("dz was not measured", |chance| plate(chance, 0.0, true), &["not measured"]),
];

const ALONG: &[&str] = &["depend on each other along"];

const CYLINDER: &str = r#"
load = { plugin = "points", path = "points.csv" }
separate = { plugin = "least-squares-cylinder", radius_mm = 15.0, max_order = 8 }
"#;

const fn cylinder(trouble: &'static str, points: fn(&mut Chance) -> String, expected: &'static [&'static str]) -> Kind {
    let there = &["part-eccentricity", "axis-tilt", "lobes-3"];
    Kind { domain: "cylinder", trouble, pipeline: CYLINDER, points, expected, there, truth: Some(("lobes-3", 0, 2.0)) }
}

const STRAIGHTNESS: &str = r#"
load = { plugin = "points", path = "points.csv" }
separate = { plugin = "axial-reversal" }
"#;

const fn straightness(trouble: &'static str, points: fn(&mut Chance) -> String) -> Kind {
    straightness_troubled(trouble, points, &[])
}

const fn straightness_troubled(
    trouble: &'static str,
    points: fn(&mut Chance) -> String,
    expected: &'static [&'static str],
) -> Kind {
    Kind { domain: "straightness", trouble, pipeline: STRAIGHTNESS, points, expected, there: &[], truth: None }
}

const PROBE: &str = r#"
load = { plugin = "points", path = "points.csv" }
[separate]
plugin = "touch-probe"
ring_radius_mm = 25.0
max_order = 9
setups = [{ id = "r0" }, { id = "r100", ring_deg = 100.0 }, { id = "r217", ring_deg = 217.0 }]
"#;

const fn probe(trouble: &'static str, points: fn(&mut Chance) -> String, expected: &'static [&'static str]) -> Kind {
    let there = &["pretravel", "lobing"];
    Kind { domain: "touch probe", trouble, pipeline: PROBE, points, expected, there, truth: None }
}

const ROTARY: &str = r#"
load = { plugin = "points", path = "points.csv" }
[separate]
plugin = "rotary-axis"
axis = "C"
balls = [{ id = "P1", x_mm = 120, y_mm = 0, z_mm = 60 }, { id = "P2", x_mm = -50, y_mm = 95, z_mm = 110 }]
component_errors = false
"#;

const fn rotary(
    trouble: &'static str,
    points: fn(&mut Chance) -> String,
    expected: &'static [&'static str],
    truth: Option<(&'static str, usize, f64)>,
) -> Kind {
    let there: &[&str] = if truth.is_some() { &["nest-step"] } else { &[] };
    Kind { domain: "rotary axis", trouble, pipeline: ROTARY, points, expected, there, truth }
}

const QUADRATURE: &str = r#"
load = { plugin = "points", path = "points.csv" }
separate = { plugin = "quadrature" }
"#;

const fn quadrature(trouble: &'static str, points: fn(&mut Chance) -> String) -> Kind {
    let there = &["quadrature-offset", "harmonic-2-forward"];
    Kind { domain: "quadrature", trouble, pipeline: QUADRATURE, points, expected: &[], there, truth: None }
}

const SPATIAL: &str = r#"
load = { plugin = "points", path = "points.csv" }
separate = { plugin = "spatial-error", declared = ["rigid"] }
"#;

const fn spatial(trouble: &'static str, points: fn(&mut Chance) -> String, expected: &'static [&'static str]) -> Kind {
    Kind { domain: "spatial error", trouble, pipeline: SPATIAL, points, expected, there: &[], truth: None }
}

/// Errors of one series of so many readings, in standard deviations.
type Errors = fn(&mut Chance, usize) -> Vec<f64>;

fn independent(chance: &mut Chance, count: usize) -> Vec<f64> {
    (0..count).map(|_| chance.normal()).collect()
}

/// Most of the variance is correlated over so many readings.
fn walk(chance: &mut Chance, count: usize, length: f64) -> Vec<f64> {
    let keeps = (-1.0 / length).exp();
    let mut state = chance.normal();
    let next = |_| {
        state = keeps * state + (1.0 - keeps * keeps).sqrt() * chance.normal();
        0.95 * state + 0.3 * chance.normal()
    };
    (0..count).map(next).collect()
}

fn random_walk(chance: &mut Chance, count: usize) -> Vec<f64> {
    let mut state = 0.0;
    let next = |_| {
        state += chance.normal();
        state
    };
    (0..count).map(next).collect()
}

/// Each circle has a centre and a level of its own.
fn seated(chance: &mut Chance, count: usize) -> Vec<f64> {
    let [x, y, level] = [chance.normal(), chance.normal(), chance.normal()];
    let place = |at: usize| TAU * at as f64 / count as f64;
    (0..count).map(|at| level + x * place(at).cos() + y * place(at).sin() + chance.normal()).collect()
}

/// A line of text; writing to a string cannot fail.
fn line(text: &mut String, cells: std::fmt::Arguments) {
    let _ = writeln!(text, "{cells}");
}

/// Circles of a tilted, eccentric cylinder with three lobes of 2 µm; errors of 0.5 µm.
fn circles(chance: &mut Chance, count: usize, errors: Errors) -> String {
    let mut text = String::from("trace,kind,z_mm,angle_deg,deviation_um\n");
    let points = 72;
    for circle in 0..count {
        let z_mm = 10.0 * circle as f64;
        for (point, error) in errors(chance, points).into_iter().enumerate() {
            let angle = TAU * point as f64 / points as f64;
            let run_out = (5.0 + 0.1 * z_mm) * angle.cos() - 3.0 * angle.sin();
            let deviation = run_out + 2.0 * (3.0 * angle).cos() + 0.5 * error;
            line(&mut text, format_args!("Z{circle},circle,{z_mm},{},{deviation:.6}", angle.to_degrees()));
        }
    }
    text
}

/// Four traces of a bent part on a bent slide, one of them before the reversal; errors in units of 0.05 µm.
fn traces(chance: &mut Chance, errors: Errors) -> String {
    let mut text = String::from("trace,setup,z_mm,reading_um\n");
    let count = 200;
    let shape = |chance: &mut Chance, size: f64| -> Vec<[f64; 2]> {
        (1..=12).map(|order| [size * chance.normal() / f64::from(order).powf(1.3), chance.between(0.0, TAU)]).collect()
    };
    let (part, slide) = (shape(chance, 2.0), shape(chance, 1.0));
    let at = |shape: &[[f64; 2]], along: f64| -> f64 {
        let wave =
            |(order, [size, phase]): (usize, &[f64; 2])| size * (0.5 * TAU * (order + 1) as f64 * along + phase).cos();
        shape.iter().enumerate().map(wave).sum()
    };
    for (trace, setup, sign) in
        [("d1", "initial", 1.0), ("f1", "reversed", -1.0), ("f2", "reversed", -1.0), ("f3", "reversed", -1.0)]
    {
        for (place, error) in errors(chance, count).into_iter().enumerate() {
            let along = place as f64 / count as f64;
            let reading = at(&part, along) + sign * at(&slide, along) + 0.05 * error;
            line(&mut text, format_args!("{trace},{setup},{place},{reading:.6}"));
        }
    }
    text
}

/// 540 touches of a ring in three positions by a probe with three lobes; errors of 0.9 µm, one of them so many standard deviations off.
fn touches(chance: &mut Chance, off: f64) -> String {
    let mut text = String::from("setup,repeat,direction_deg,radius_mm,time_s\n");
    let ring: Vec<[f64; 2]> =
        (2..=6).map(|order| [0.5 * chance.normal() / f64::from(order), chance.between(0.0, TAU)]).collect();
    let wild = chance.below(540);
    let mut number = 0;
    for (setup, turned) in [("r0", 0.0_f64), ("r100", 100.0), ("r217", 217.0)] {
        let centre = [5.0 * chance.normal(), 5.0 * chance.normal()];
        for repeat in 0..3 {
            for direction in 0..60 {
                let (degrees, angle) = (6.0 * f64::from(direction), TAU * f64::from(direction) / 60.0);
                let of_ring = |(order, [size, phase]): (usize, &[f64; 2])| {
                    size * ((order + 2) as f64 * (angle - turned.to_radians()) + phase).cos()
                };
                let form: f64 = ring.iter().enumerate().map(of_ring).sum();
                let error = 0.9 * (chance.normal() + if number == wild { off } else { 0.0 });
                let outward =
                    20.0 + 2.0 * (3.0 * angle + 0.4).cos() + centre[0] * angle.cos() + centre[1] * angle.sin();
                let radius = 25.0 + 1e-3 * (outward + form + error);
                line(&mut text, format_args!("{setup},{repeat},{degrees},{radius:.7},{}", 5 * number));
                number += 1;
            }
        }
    }
    text
}

/// An R-test with two balls and two passes; errors of 1.5 µm. The second pass is offset, and the last command of each pass is off.
fn r_test(chance: &mut Chance, offset_um: f64, open_um: f64) -> String {
    let mut text = String::from("ball,repeat,c_deg,dx_mm,dy_mm,dz_mm\n");
    let mut axis = |size: f64| [size * chance.normal(), size * chance.normal()];
    let (offset, tilt) = (axis(8.0), axis(8e-3));
    let balls = [("P1", [120.0, 0.0, 60.0_f64]), ("P2", [-50.0, 95.0, 110.0])]
        .map(|(ball, place)| (ball, place, [3.0 * chance.normal(), 3.0 * chance.normal(), 3.0 * chance.normal()]));
    for pass in 1..=2 {
        for (ball, place, seat) in balls {
            for step in 0..=24 {
                let degrees = -180.0 + 15.0 * f64::from(step);
                let (sine, cosine) = degrees.to_radians().sin_cos();
                // The axis stands off by `offset` at z = 0 and leans: the ball turns about where it is at the ball's height.
                let [off_x, off_y] = [offset[0] + tilt[1] * place[2], offset[1] - tilt[0] * place[2]];
                let x = off_x * (1.0 - cosine) + off_y * sine;
                let y = off_y * (1.0 - cosine) - off_x * sine;
                let moved = [place[0] * (cosine - 1.0) - place[1] * sine, place[0] * sine + place[1] * (cosine - 1.0)];
                let z = tilt[0] * moved[1] - tilt[1] * moved[0];
                let open = if step == 24 { open_um } else { 0.0 };
                let shift = if pass == 2 { offset_um } else { 0.0 };
                // A ball that sits elsewhere on the table turns with it.
                let seated = [seat[0] * cosine - seat[1] * sine, seat[0] * sine + seat[1] * cosine, seat[2]];
                let mut read = |truth: f64, seat: f64| 1e-3 * (truth + seat + 1.5 * chance.normal());
                let [dx, dy, dz] = [read(x + open, seated[0]), read(y + shift, seated[1]), read(z, seated[2])];
                line(&mut text, format_args!("{ball},{pass},{degrees},{dx:.6},{dy:.6},{dz:.6}"));
            }
        }
    }
    text
}

/// 2000 samples of a circle of 500 counts, 4 counts off its centre; errors of 1 count in each signal. Over 40 turns, or over `turns` in order.
fn signal(chance: &mut Chance, turns: f64, errors: Errors) -> String {
    let mut text = String::from("phase_deg,radius_counts\n");
    let count = 2000;
    let [cosine_errors, sine_errors] = [(); 2].map(|()| errors(chance, count));
    let turns = if turns > 0.0 { turns } else { 40.0 };
    for (sample, (of_cosine, of_sine)) in cosine_errors.into_iter().zip(sine_errors).enumerate() {
        let angle = TAU * turns * (sample as f64 + chance.between(0.0, 0.5)) / count as f64;
        let [x, y] = [500.0 * angle.cos() + 4.0 + of_cosine, 500.0 * angle.sin() + of_sine];
        line(&mut text, format_args!("{:.4},{:.3}", y.atan2(x).to_degrees().rem_euclid(360.0), x.hypot(y)));
    }
    text
}

/// 80 places of a plane: waves of 8 µm, errors of 4 µm in each component; dz may be missing.
fn plate(chance: &mut Chance, nugget_um: f64, flat: bool) -> String {
    let mut text = String::from("x_mm,y_mm,z_mm,dx_um,dy_um,dz_um\n");
    let waves: Vec<[f64; 5]> = (0..3)
        .flat_map(|component| (0..3).map(move |_| component))
        .map(|component| {
            let angle = chance.between(0.0, TAU);
            let length = chance.between(250.0, 600.0);
            let [k, l] = [angle.cos(), angle.sin()].map(|part| part * TAU / length);
            [f64::from(component), k, l, 5.0 * chance.normal(), chance.between(0.0, TAU)]
        })
        .collect();
    for _ in 0..80 {
        let [x, y] = [chance.between(-300.0, 300.0), chance.between(-300.0, 300.0)];
        let mut of = |component: f64| {
            let mine = waves.iter().filter(|wave| (wave[0] - component).abs() < 0.5);
            let smooth: f64 = mine.map(|[_, k, l, size, phase]| size * (k * x + l * y + phase).cos()).sum();
            smooth + (16.0 + nugget_um * nugget_um).sqrt() * chance.normal()
        };
        let [dx, dy, dz] = [of(0.0), of(1.0), of(2.0)];
        let dz = if flat { 0.0 } else { dz };
        line(&mut text, format_args!("{x:.3},{y:.3},0,{dx:.4},{dy:.4},{dz:.4}"));
    }
    text
}
