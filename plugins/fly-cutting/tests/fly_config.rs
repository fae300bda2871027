//! Bad input: each is answered by name.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::path::Path;

use crate::common::{CUT, scenario, separator};
use runout_core::{
    pipeline::{Context, StageConfig},
    points::{Column, Points},
    stage::PointSeparator,
};
use runout_fly_cutting::{FlyCuttingConfig, simulate::FlyCuttingScenario};

#[test]
fn keys_of_the_separator_are_checked() {
    for (key, value, problem) in [
        ("feed_um_per_rev = 8.3", "feed_um_per_rev = 0", "above 0 µm, found 0"),
        ("nose_radius_mm = 6.0", "nose_radius_mm = -6", "above 0 mm, found -6"),
        ("cutter_radius_mm = 250.0", "cutter_radius_mm = nan", "found NaN"),
        ("speed_rpm = 390.0", "speed_rpm = inf", "found inf"),
        ("feed_um_per_rev = 8.3", "feed_um_per_rev = 8300", "is it in µm per revolution?"),
        ("speed_rpm = 390.0", "speed_rpm = 390\nstd_nm = 0", "above 0 nm"),
        ("speed_rpm = 390.0", "speed_rpm = 390\nmax_frequency_ratio = 0", "expected 1 to 200"),
    ] {
        let fault = toml::from_str::<FlyCuttingConfig>(&CUT.replace(key, value)).unwrap().separator().unwrap_err();
        assert!(fault.to_string().contains(problem), "{fault}");
    }
}

#[test]
fn keys_of_the_simulator_are_checked() {
    let grid = "[grid]\nrows = 20\ncolumns = 20\nstep_x_mm = 0.01\nstep_y_mm = 0.01\n";
    for (from, to, problem) in [
        ("step_x_mm = 0.01", "step_x_mm = 0", "above 0 mm, found 0"),
        ("rows = 20", "rows = 1", "expected 2 to 20000, found 1"),
        ("rows = 20", "origin_y_mm = 249.9\nrows = 20", "beyond the cutter"),
        ("feed_um_per_rev = 8.3", "feed_um_per_rev = 0", "above 0 µm"),
        ("nose_radius_mm = 6.0", "nose_radius_mm = -1", "above 0 mm"),
        ("nose_radius_mm = 6.0", "nose_radius_mm = 0.008", "not below the nose radius"),
        ("[grid]", "[[line]]\nfrequency_hz = 5\namplitude_urad = 1\n[grid]", "amplitude in `amplitude_nm`"),
        (
            "[grid]",
            "[[effect]]\nplugin = 'table-straightness'\norder = 7\namplitude_nm = 1\n[grid]",
            "order from 2 to 5, found 7",
        ),
        ("[grid]", "[[effect]]\nplugin = 'nose-radius'\nchange_mm = -6.5\n[grid]", "leaves nothing"),
        (
            "[grid]",
            "[[effect]]\nplugin = 'spindle-line'\namplitude_nm = 1\n[grid]",
            "either `frequency_hz` or `frequency_ratio`",
        ),
        ("[grid]", "[spindle]\ndiagnosis = 'd.json'\naxial_nm_per_um = inf\n[grid]", "finite number"),
    ] {
        let text = format!("[cut]\n{CUT}{grid}").replace(from, to);
        let context = Context { folder: Path::new("."), rig: None };
        let fault = toml::from_str::<FlyCuttingScenario>(&text).unwrap().check(&context).err().unwrap();
        assert!(fault.to_string().contains(problem), "{fault}");
    }
}

#[test]
fn motion_that_is_none_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("motion.parquet");
    std::fs::write(&path, "no parquet").unwrap();
    let mut simulated = scenario(20, "");
    simulated.motion = Some(path);
    let error = simulated.heights().unwrap_err().to_string();
    assert!(error.contains("motion.parquet") && error.contains("of a spindle run"), "{error}");
    simulated.motion = Some("not-there.parquet".into());
    assert!(simulated.heights().unwrap_err().to_string().contains("not-there.parquet"));
}

fn points(columns: [Vec<f64>; 3]) -> Points {
    let named = ["x_mm", "y_mm", "height_nm"].into_iter().zip(columns);
    let columns = named.map(|(name, values)| Column { name: name.into(), values });
    Points { input: "map.csv".into(), columns: columns.collect(), ..Points::default() }
}

#[test]
fn points_that_are_no_grid_are_refused() {
    let grid = |rows: usize, columns: usize, x: fn(usize, usize) -> f64, y: fn(usize) -> f64| {
        let places = (0..rows * columns).map(|index| (index / columns, index % columns));
        let places: Vec<[f64; 2]> = places.map(|(row, column)| [x(row, column), y(row)]).collect();
        points([
            places.iter().map(|place| place[0]).collect(),
            places.iter().map(|place| place[1]).collect(),
            vec![0.0; rows * columns],
        ])
    };
    let even = |_: usize, column: usize| 0.01 * column as f64;
    let cases: [(Points, &str); 6] = [
        (grid(1, 50, even, |_| 0.0), "all its points have the same y"),
        (grid(20, 20, |_, _| 1.0, |row| 0.01 * row as f64), "all its points have the same x"),
        (grid(20, 20, even, |_| 0.0), "all its points have the same y"),
        (
            grid(20, 20, |row, column| 0.01 * column as f64 + 0.0031 * (row % 2) as f64, |row| 0.01 * row as f64),
            "not on a grid",
        ),
        (grid(20, 20, even, |row| 300.0 + 0.01 * row as f64), "`cutter_radius_mm` is 250"),
        (grid(20, 20, even, |row| if row == 19 { f64::NAN } else { 0.01 * row as f64 }), "not finite"),
    ];
    let separator = separator(CUT);
    for (points, problem) in cases {
        let error = separator.separate(&points).unwrap_err().to_string();
        assert!(error.contains("map.csv") && error.contains(problem), "{error}");
    }
}

/// Rows that are not in order, and holes: the same result.
#[test]
fn order_and_holes_do_not_matter() {
    let separator = separator(CUT);
    let mut grid = scenario(60, "noise_nm = 0.1").heights().unwrap();
    grid.height_nm[100..130].fill(f64::NAN);
    let mut points = Points::of_grid(grid, "map.h5".into());
    let found = separator.separate(&points).unwrap();
    assert!(
        found.remarks.iter().any(|remark| remark.contains("30 of 3600 points have no height")),
        "{:?}",
        found.remarks
    );
    for column in &mut points.columns {
        column.values.reverse();
    }
    let reversed = separator.separate(&points).unwrap();
    for (one, other) in found.values.iter().zip(&reversed.values) {
        assert_eq!(format!("{:.9}", one.value), format!("{:.9}", other.value));
    }
}
