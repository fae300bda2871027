//! The simulated surface: scallops, stripes, interference.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::common;
use crate::common::{of, scenario};

/// f²/8R and f²/8R·√(4/45) of a parabola, and of the circle that the nose is.
#[test]
fn scallops_have_the_height_of_a_parabola() {
    // 401 points a feed, five feeds.
    let text = |feed: f64, radius: f64| {
        format!(
            "[cut]\nnose_radius_mm = {radius}\nfeed_um_per_rev = {feed}\ncutter_radius_mm = 250.0\nspeed_rpm = 390.0\n
             [grid]\nrows = 2\ncolumns = 2001\nstep_x_mm = {}\nstep_y_mm = 0.01\n",
            1e-3 * feed / 400.0
        )
    };
    for (feed, radius) in [(8.3, 6.0), (2.0, 1.0), (40.0, 0.5)] {
        let grid = of(&text(feed, radius)).heights().unwrap();
        let row = &grid.height_nm[..2001];
        let high = row.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let low = row.iter().copied().fold(f64::INFINITY, f64::min);
        let scallop = 1e3 * feed * feed / (8.0 * 1e3 * radius);
        let mean = row[..2000].iter().sum::<f64>() / 2000.0;
        let rq = (row[..2000].iter().map(|z| (z - mean).powi(2)).sum::<f64>() / 2000.0).sqrt();
        println!("feed {feed} µm, radius {radius} mm: PV {:.4} nm, Rq {rq:.4} nm", high - low);
        assert!(((high - low) / scallop - 1.0).abs() < 5e-3);
        assert!((rq / (scallop * (4.0_f64 / 45.0).sqrt()) - 1.0).abs() < 5e-3);
    }
}

/// Stripes of F = 1.023·F0 − 1.026 Hz are f/|F/F0 − 1| apart: the exact slip of the phase from pass to pass.
#[test]
fn stripes_have_the_spacing_of_the_phase_slip() {
    for speed in [120.0_f64, 200.0, 390.0, 500.0, 800.0] {
        let turns_hz = speed / 60.0;
        let line_hz = 1.023 * turns_hz - 1.026;
        let text = format!(
            "[cut]\nnose_radius_mm = 6.0\nfeed_um_per_rev = 8.3\ncutter_radius_mm = 250.0\nspeed_rpm = {speed}\n
             [grid]\nrows = 2\ncolumns = 20000\nstep_x_mm = 0.00083\nstep_y_mm = 0.01\n
             [[line]]\nfrequency_hz = {line_hz}\namplitude_nm = 1.0\n"
        );
        let grid = of(&text).heights().unwrap();
        let slip = (line_hz / turns_hz - (line_hz / turns_hz).round()).abs();
        let exact_mm = 8.3e-3 / slip;
        // The period at which the row correlates most, within ± 20 %.
        let row = &grid.height_nm[..20_000];
        let mean = row.iter().sum::<f64>() / 20_000.0;
        let power = |period_mm: f64| {
            let (mut sine, mut cosine) = (0.0, 0.0);
            for (index, z) in row.iter().enumerate() {
                let angle = std::f64::consts::TAU * 0.00083 * index as f64 / period_mm;
                sine += (z - mean) * angle.sin();
                cosine += (z - mean) * angle.cos();
            }
            sine * sine + cosine * cosine
        };
        let periods = (-100..=100).map(|step| exact_mm * (1.0 + 0.002 * f64::from(step)));
        let best = periods.max_by(|one, other| power(*one).total_cmp(&power(*other))).unwrap();
        println!(
            "{speed} rpm: stripes {best:.5} mm apart, phase slip {exact_mm:.5} mm, {:.2} s of feed",
            exact_mm / (8.3e-3 * turns_hz)
        );
        assert!((best / exact_mm - 1.0).abs() < 0.01, "{speed}: {best} {exact_mm}");
    }
}

/// Beside a pass that is far lower, its neighbours leave nothing: each point is the lowest of all passes, not of three.
#[test]
fn a_deep_pass_takes_away_its_neighbours() {
    let grid = scenario(200, "[[line]]\nfrequency_hz = 0.65\namplitude_nm = 300.0\n").heights().unwrap();
    let direct = |x_mm: f64| {
        let pass = |n: i32| {
            let beside = x_mm - 8.3e-3 * f64::from(n);
            let height = 300.0 * (std::f64::consts::TAU * 0.1 * f64::from(n)).cos();
            1e6 * beside * beside / 12.0 + height
        };
        (-300..900).map(pass).fold(f64::INFINITY, f64::min)
    };
    for column in 0..200 {
        let x_mm = 0.02 * column as f64;
        assert!(
            (grid.height_nm[column] - direct(x_mm)).abs() < 0.01,
            "{x_mm}: {} {}",
            grid.height_nm[column],
            direct(x_mm)
        );
    }
}

/// 10 × 10 mm: `cargo test --release -p runout-fly-cutting fly_surface::time -- --ignored --nocapture` prints the time over the number
/// of points; `cargo bench` measures it well.
#[test]
#[ignore = "a measurement of time"]
fn time_over_points() {
    for side in [500, 1000, 2000] {
        let step_mm = 10.0 / f64::from(side);
        let text = format!(
            "[cut]\n{}[grid]\nrows = {side}\ncolumns = {side}\nstep_x_mm = {step_mm}\nstep_y_mm = {step_mm}\n
             [[line]]\nfrequency_hz = 5.6235\namplitude_nm = 4.0\n",
            common::CUT
        );
        let scenario = of(&text);
        let start = std::time::Instant::now();
        let points = scenario.heights().unwrap().height_nm.len();
        println!("{points} points: {:.2} s", start.elapsed().as_secs_f64());
    }
}
