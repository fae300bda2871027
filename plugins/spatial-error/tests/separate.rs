//! Predictions, what a layout loses, and bad input.

#![allow(clippy::unwrap_used, clippy::single_match_else, clippy::unnecessary_debug_formatting, reason = "tests")]

use crate::support::{column, flags, points, readings, scenario, separator, table, try_separator, value};
use runout_core::{points::Points, stage::PointSeparator};
use runout_spatial_error::simulate::{Layout, Scenario};

fn message(points: &Points, text: &str) -> String {
    let error = separator(text).separate(points).unwrap_err();
    format!("{error} | {}", error.advice().unwrap_or_default())
}

#[test]
fn a_grid_is_predicted_and_compensated() {
    let made = scenario(3).simulate();
    let outcome = separator("query = { grid_mm = [100.0, 100.0, 70.0] }").separate(&made.points()).unwrap();
    let rows = table(&outcome, "prediction");
    assert_eq!(rows.num_rows(), 7 * 5 * 6);
    let [x, y, z] = ["x_mm", "y_mm", "z_mm"].map(|name| column(&rows, name));
    let (mut squares, mut count, mut largest) = (0.0, 0.0, 0.0_f64);
    for (axis, name) in ["dx_um", "dy_um", "dz_um"].into_iter().enumerate() {
        let (mean, std) = (column(&rows, name), column(&rows, &format!("std_{name}")));
        for row in 0..rows.num_rows() {
            let z_score = (mean[row] - made.truth_um([x[row], y[row], z[row]])[axis]) / std[row];
            squares += z_score * z_score;
            count += 1.0;
            largest = largest.max(z_score.abs());
        }
    }
    assert!((0.5..1.7).contains(&(squares / count)) && largest < 6.0, "{} {largest}", squares / count);
    // The placement is found, and no correction takes it away.
    let tx = value(&outcome, "TX", None);
    assert!((tx.value - 120.0).abs() < 15.0, "{tx:?}");
    let of_compensation = table(&outcome, "compensation");
    let add = column(&of_compensation, "correct_x_um");
    assert!(add.iter().all(|add| add.abs() < 40.0), "{add:?}");
    // What remains is what is not known of the predictions, less the placement that fits best.
    let mut squares = 0.0;
    for name in ["dx_um", "dy_um", "dz_um"] {
        assert!(column(&of_compensation, &format!("remains_{name}")).iter().all(|left| left.abs() < 0.5), "{name}");
        squares += column(&rows, &format!("std_{name}")).iter().map(|std| std * std).sum::<f64>();
    }
    let [remains, error] = ["remains_rms", "error_rms"].map(|name| value(&outcome, name, None).value);
    assert!((0.85..1.1).contains(&(remains / (squares / rows.num_rows() as f64).sqrt())), "{remains}");
    assert!(error > 2.0 * remains, "{error} {remains}");
    for name in ["dx", "dy", "dz"] {
        let chi2 = value(&outcome, "left_out_chi2", Some(name)).value;
        assert!((0.6..1.5).contains(&chi2), "{name}: {chi2}");
        let noise = value(&outcome, "noise", Some(name));
        assert!((noise.value - 0.85).abs() < 0.2, "{noise:?}");
    }
}

#[test]
fn limits_are_kept_and_said() {
    let made = scenario(4).simulate();
    let outcome = separator("compensate = { limit_um = 2.0 }").separate(&made.points()).unwrap();
    let rows = table(&outcome, "compensation");
    let limited = flags(&rows, "limited");
    assert!(limited.contains(&true) && limited.contains(&false));
    for name in ["correct_x_um", "correct_y_um", "correct_z_um"] {
        let add = column(&rows, name);
        assert!(add.iter().all(|add| add.abs() <= 2.0 + 1e-9), "{name}");
    }
    assert!(outcome.remarks.iter().any(|remark| remark.contains("at the limit")), "{:?}", outcome.remarks);
}

#[test]
fn extrapolation_is_flagged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("targets.csv");
    std::fs::write(&path, "# targets\nx_mm;y_mm;z_mm\n300,5;200;100\n900;200;100\n300;200;360\n").unwrap();
    let outcome =
        separator(&format!("query = {{ path = {path:?} }}")).separate(&scenario(5).simulate().points()).unwrap();
    let rows = table(&outcome, "prediction");
    assert_eq!(flags(&rows, "extrapolated"), [false, true, true]);
    assert!((column(&rows, "x_mm")[0] - 300.5).abs() < 1e-12);
    let std = column(&rows, "std_dx_um");
    assert!(std[1] > 2.0 * std[0], "{std:?}");
}

fn flat(layout: Layout) -> Points {
    Scenario { layout, ..scenario(6) }.simulate().points()
}

#[test]
fn a_plane_predicts_nothing_off_it() {
    let points = flat(Layout::Grid { from_mm: [0.0, 0.0, 50.0], to_mm: [600.0, 400.0, 50.0], counts: [9, 8, 1] });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("targets.csv");
    std::fs::write(&path, "x_mm,y_mm,z_mm\n310,200,50\n310,200,60\n").unwrap();
    let outcome = separator(&format!("query = {{ path = {path:?} }}")).separate(&points).unwrap();
    let rows = table(&outcome, "prediction");
    for name in ["dx_um", "dy_um", "dz_um", "std_dx_um"] {
        let values = column(&rows, name);
        assert!(values[0].is_finite() && values[1].is_nan(), "{name} {values:?}");
    }
    assert_eq!(flags(&rows, "extrapolated"), [false, true]);
    assert!(value(&outcome, "range_z", Some("dx")).value.is_nan());
    assert!(value(&outcome, "range_x", Some("dx")).value.is_finite());
    assert!(outcome.remarks.iter().any(|remark| remark.contains("one plane")), "{:?}", outcome.remarks);
}

#[test]
fn a_line_loses_the_rotation_about_it() {
    let points = flat(Layout::Grid { from_mm: [0.0, 100.0, 50.0], to_mm: [600.0, 100.0, 50.0], counts: [25, 1, 1] });
    let outcome = separator("").separate(&points).unwrap();
    assert!(value(&outcome, "RX", None).value.is_nan());
    assert!(value(&outcome, "RY", None).value.is_finite());
    let text = outcome.remarks.join("\n");
    assert!(text.contains("one line") && text.contains("rotation of the placement about x"), "{text}");
}

fn regular(count: usize, value: impl Fn(usize) -> f64) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
    let place = |index: usize| [index % 5, index / 5 % 5, index / 25].map(|at| 40.0 * at as f64);
    ((0..count).map(place).collect(), (0..count).map(|index| [value(index); 3]).collect())
}

#[test]
fn bad_numbers_are_named() {
    let (places, values) = regular(60, |index| (index as f64).sin());
    let good = readings(&places, &values);
    let with = |name: &str, change: &dyn Fn(&mut Vec<f64>)| {
        let mut bad = good.clone();
        match bad.columns.iter_mut().find(|column| column.name == name) {
            Some(column) => change(&mut column.values),
            None => {
                let mut values = vec![1.0; 60];
                change(&mut values);
                bad.columns.push(runout_core::points::Column { name: name.into(), values });
            }
        }
        bad
    };
    let text = message(&with("dy_um", &|values| values[7] = f64::NAN), "");
    assert!(text.contains("row 8 of the column `dy_um`"), "{text}");
    let text = message(&with("x_mm", &|values| values[2] = f64::INFINITY), "");
    assert!(text.contains("row 3 of the column `x_mm`"), "{text}");
    let text = message(&with("std_um", &|values| values[4] = 0.0), "");
    assert!(text.contains("row 5 of the column `std_um`"), "{text}");
    let text = message(&with("repeat", &|values| values[1] = 1.5), "");
    assert!(text.contains("row 2: `repeat`"), "{text}");
    let mut lacking = good.clone();
    lacking.columns.remove(2);
    assert!(message(&lacking, "").contains("z_mm"));
}

#[test]
fn too_few_places_are_refused() {
    let (places, values) = regular(7, |index| index as f64);
    let text = message(&readings(&places, &values), "");
    assert!(text.contains("7 distinct places") && text.contains("at least 10"), "{text}");
    assert!(message(&readings(&places[..1], &values[..1]), "").contains("1 distinct places"));
    let fixed = "declared = [\"translation\"]\nkriging = { variogram = \"spherical\", sill_um = 2.0, range_mm = [90, 90, 90], nugget_um = 0.3 }";
    assert!(separator(fixed).separate(&readings(&places, &values)).is_ok());
}

#[test]
fn duplicates_are_averaged_or_named() {
    let (mut places, mut values) = regular(50, |index| 3.0 * (0.3 * index as f64).sin());
    places.push(places[10]);
    values.push(values[10].map(|value| value + 1.0));
    let points = readings(&places, &values);
    let fixed = |nugget: f64| {
        format!(
            "declared = []\nkriging = {{ variogram = \"matern-3/2\", sill_um = 3.0, range_mm = [60, 60, 60], nugget_um = {nugget:?} }}"
        )
    };
    let text = message(&points, &fixed(0.0));
    assert!(text.contains("rows 11 and 51") && text.contains("nugget_um"), "{text}");
    // Two readings of one place count as one of half the variance.
    let averaged = separator(&fixed(0.5)).separate(&points).unwrap();
    let rows = table(&averaged, "prediction");
    let found = column(&rows, "dx_um")[10];
    assert!((found - values[10][0]).abs() < 1.0 && found > values[10][0], "{found}");
    assert!(averaged.remarks.iter().any(|remark| remark.contains("averaged")), "{:?}", averaged.remarks);
    assert!(separator("").separate(&points).is_ok());
}

#[test]
fn constant_and_absurd_readings_do_not_panic() {
    let (places, mut values) = regular(75, |_| 0.0);
    for factor in [0.0, 1e-9, 1e12] {
        for (index, value) in values.iter_mut().enumerate() {
            *value = [factor * (index as f64).sin(), factor, 0.0];
        }
        match separator("").separate(&readings(&places, &values)) {
            Ok(outcome) => {
                let rows = table(&outcome, "prediction");
                assert!(column(&rows, "std_dx_um").iter().all(|std| *std >= 0.0), "{factor}");
            }
            Err(error) => assert!(error.to_string().contains("test.csv"), "{error}"),
        }
    }
    let (places, values) = regular(75, |index| 1e-4 * (index as f64).sin());
    let outcome = separator("").separate(&readings(&places, &values)).unwrap();
    assert!(outcome.remarks.iter().any(|remark| remark.contains("in mm?")), "{:?}", outcome.remarks);
}

#[test]
fn nothing_is_known_of_an_empty_file() {
    let empty = points(&["x_mm", "y_mm", "z_mm", "dx_um", "dy_um", "dz_um"].map(|name| (name, Vec::new())));
    assert!(message(&empty, "").contains("no reading"));
}

#[test]
fn a_configuration_that_cannot_be_is_refused() {
    for (text, expected) in [
        ("tool = [1, 2, 3]", "unknown field `tool`"),
        ("kriging = { variogram = \"cubic\" }", "unknown variant `cubic`"),
        ("kriging = { sill_um = 1.0, range_mm = [1.0, 1.0, 1.0] }", "`variogram`"),
        ("kriging = { variogram = \"gaussian\", sill_um = 1.0 }", "`range_mm`"),
        ("kriging = { variogram = \"gaussian\", sill_um = -1.0, range_mm = [1, 1, 1] }", "above 0"),
        ("kriging = { variogram = \"gaussian\", sill_um = 1.0, range_mm = [1, 0, 1] }", "above 0"),
        ("kriging = { variogram = \"gaussian\", sill_um = 1.0, range_mm = [1, 1, 1], nugget_um = nan }", "0 or above"),
        ("kriging = { full_places = 9 }", "from 100"),
        ("declared = [\"affine\"]", "unknown variant `affine`"),
        ("chain = [\"X\", \"X\", \"Z\"]", "each once"),
        ("tool_mm = [0.0, inf, 0.0]", "lengths in mm"),
        ("std_um = 0.0", "above 0 µm"),
        ("query = { grid_mm = [0, 1, 1] }", "above 0 mm"),
        ("query = { grid_mm = [1, 1, 1], path = \"a.csv\" }", "found both"),
        ("compensate = { limit_um = -3 }", "above 0 µm"),
        ("compensate = { axes = \"no-such-file.toml\" }", "no-such-file.toml"),
    ] {
        let problem = try_separator(text).unwrap_err();
        assert!(problem.contains(expected), "{text}: {problem}");
    }
}

#[test]
fn a_query_that_cannot_be_is_refused() {
    let good = scenario(7).simulate().points();
    let text = message(&good, "query = { grid_mm = [0.1, 0.1, 0.1] }");
    assert!(text.contains("2000000"), "{text}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("targets.csv");
    for (content, expected) in [
        ("x_mm,y_mm\n1,2\n", "`z_mm`"),
        ("x_mm,y_mm,z_mm\n1,2,3\n1,two,3\n", "row 2 of the column `y_mm`"),
        ("x_mm,y_mm,z_mm\n1,2,nan\n", "row 1 of the column `z_mm`"),
        ("x_mm,y_mm,z_mm\n", "no place"),
        ("x_mm,y_mm,z_mm\n1,2\n", "2 fields"),
    ] {
        std::fs::write(&path, content).unwrap();
        let text = message(&good, &format!("query = {{ path = {path:?} }}"));
        assert!(text.contains(expected), "{content}: {text}");
    }
    assert!(message(&good, "query = { path = \"no-such-file.csv\" }").contains("no-such-file.csv"));
}

#[test]
fn axes_of_a_file_correct() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("axes.toml");
    let text = r#"axes = [
        { id = "X", kind = "linear", direction = [1, 0, 0] },
        { id = "Y", kind = "linear", direction = [0, 1, 0], limit_um = 1.5 },
        { id = "Z", kind = "linear", direction = [0, 0, 1] },
        { id = "B", kind = "rotary", direction = [0, 1, 0], point_mm = [0, 0, 400], limit_urad = 10 },
    ]"#;
    std::fs::write(&path, text).unwrap();
    let outcome = separator(&format!("compensate = {{ axes = {path:?}, limit_um = 50 }}"))
        .separate(&scenario(8).simulate().points())
        .unwrap();
    let rows = table(&outcome, "compensation");
    let add = ["correct_x_um", "correct_y_um", "correct_z_um", "correct_b_urad"].map(|name| column(&rows, name));
    assert!(add[1].iter().all(|add| add.abs() <= 1.5 + 1e-9) && add[3].iter().all(|add| add.abs() <= 10.0 + 1e-9));
    std::fs::write(&path, "axes = [{ id = \"B\", kind = \"rotary\", direction = [0, 1, 0] }]").unwrap();
    let problem = try_separator(&format!("compensate = {{ axes = {path:?} }}")).unwrap_err();
    assert!(problem.contains("point_mm"), "{problem}");
}

/// 1300 places with a bound of 400 take nearest neighbours: the same predictions within a tenth of their uncertainty.
#[test]
fn nearest_neighbours_predict_what_all_places_do() {
    let layout = Layout::Scattered { from_mm: [0.0; 3], to_mm: [600.0, 400.0, 350.0], count: 1300 };
    let made = Scenario { layout, passes: 1, ..scenario(9) }.simulate();
    let kriging = "variogram = \"matern-3/2\", sill_um = 4.0, range_mm = [260.0, 220.0, 200.0], nugget_um = 0.9";
    let of = |full: usize| {
        let text = format!("query = {{ grid_mm = [150, 150, 150] }}\nkriging = {{ {kriging}, full_places = {full} }}");
        separator(&text).separate(&made.points()).unwrap()
    };
    let (all, near) = (of(2000), of(400));
    let rows = [table(&all, "prediction"), table(&near, "prediction")];
    for name in ["dx_um", "dy_um", "dz_um"] {
        let [all, near] = [0, 1].map(|index: usize| column(&rows[index], name));
        let [std_all, std_near] = [0, 1].map(|index: usize| column(&rows[index], &format!("std_{name}")));
        for row in 0..all.len() {
            assert!((all[row] - near[row]).abs() < 0.35 * std_all[row], "{name}: {} {}", all[row], near[row]);
            assert!((std_near[row] / std_all[row] - 1.0).abs() < 0.25, "{name}: {} {}", std_all[row], std_near[row]);
        }
    }
    assert!(near.notes.iter().any(|note| note.contains("beside the full solution")), "{:?}", near.notes);
}

#[test]
fn displaced_neighbours_drifts_and_units_are_remarked() {
    let remarks = |points: &runout_core::points::Points| {
        let outcome = separator("query = { grid_mm = [300, 200, 175] }").separate(points).unwrap();
        outcome.remarks.join("\n")
    };
    let made = scenario(21).simulate();
    let clean = remarks(&made.points());
    for text in ["neighbouring places", "readings drift", "in mm?", "copies"] {
        assert!(!clean.contains(text), "{clean}");
    }
    // The corner of least x, y, z and its neighbours along x and y.
    let mut all: Vec<[f64; 3]> = made.commands_mm.clone();
    all.sort_by(|one, other| one.iter().sum::<f64>().total_cmp(&other.iter().sum()));
    let corner = all[0];
    let next = |axis: usize| {
        let on = made
            .commands_mm
            .iter()
            .filter(|place| (0..3).all(|other| (other == axis) != ((place[other] - corner[other]).abs() < 1e-9)));
        *on.min_by(|one, other| one[axis].total_cmp(&other[axis])).unwrap()
    };
    let displaced = [corner, next(0), next(1)];
    let mut points = made.points();
    for (row, place) in made.commands_mm.iter().enumerate() {
        if displaced.contains(place) {
            for (name, by) in [("dx_um", 30.0), ("dy_um", 25.0), ("dz_um", -30.0)] {
                points.columns.iter_mut().find(|column| column.name == name).unwrap().values[row] += by;
            }
        }
    }
    let found = remarks(&points);
    for [x, y, z] in displaced {
        assert!(found.contains(&format!("({x}, {y}, {z}) mm by")), "{found}");
    }
    let mut drifts = made.points();
    let count = made.commands_mm.len() as f64;
    let dx = drifts.columns.iter_mut().find(|column| column.name == "dx_um").unwrap();
    dx.values.iter_mut().enumerate().for_each(|(row, value)| *value += 20.0 * row as f64 / count);
    assert!(remarks(&drifts).contains("readings drift from the first to the last: dx by"));
    let mut in_mm = made.points();
    for column in in_mm.columns.iter_mut().filter(|column| ["dx_um", "dy_um", "dz_um"].contains(&column.name.as_str()))
    {
        column.values.iter_mut().for_each(|value| *value *= 1e-3);
    }
    assert!(remarks(&in_mm).contains("in mm?"));
}
