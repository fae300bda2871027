#![allow(clippy::unwrap_used, reason = "tests")]

use super::*;
use crate::{ColumnSpec, Measure, counts, numbers, texts};

fn table() -> TableSpec {
    TableSpec::new(
        "form",
        "form",
        vec![
            ColumnSpec::name("station", "station"),
            ColumnSpec::number("angle_deg", "deg", "angle"),
            ColumnSpec::number("form_um", "um", "form"),
            ColumnSpec::count("order", "", "order"),
        ],
    )
}

fn rows(station: &str, form_um: [f64; 3]) -> RecordBatch {
    let columns = vec![texts([station; 3]), numbers([0.0, 120.0, 240.0]), numbers(form_um), counts(0..3)];
    table().rows(columns).unwrap()
}

#[test]
fn panels_are_spread_over_all_stations() {
    let figure = Figure::polar("form", "Form", "angle_deg", [Measure::new("form_um")]).panels(["station"]);
    let mut panels = Panels::new(&table(), &figure, 4).unwrap();
    for station in 0..31 {
        panels.add(&rows(&format!("s{station}"), [f64::from(station), 1.0, f64::NAN]));
    }
    let names: Vec<&str> = panels.drawn.iter().map(|panel| panel.name.as_str()).collect();
    assert_eq!((panels.count(), names), (31, vec!["s0", "s8", "s16", "s24"]));
    // Rows that come again belong to the panel that is there; NaN is left out.
    panels.add(&rows("s8", [0.5, 0.5, 0.5]));
    assert_eq!(panels.drawn[1].curves.len(), 1);
    let heights: Vec<f64> = panels.drawn[1].curves[0].points.iter().map(|point| point.y).collect();
    assert_eq!(heights, [8.0, 1.0, 0.5, 0.5, 0.5]);
    assert_eq!(panels.drawn[1].curves[0].missing, [240.0]);
}

#[test]
fn a_column_that_the_table_lacks_is_an_error() {
    let figure = Figure::lines("residual", "Residual", "order", [Measure::new("after")]);
    let error = Panels::new(&table(), &figure, 4).err().unwrap().to_string();
    assert!(error.contains("residual") && error.contains("has no column after"), "{error}");
}

#[test]
fn a_thinned_curve_keeps_its_peak() {
    let mut points: Vec<Point> =
        (0..100_000).map(|index| Point { x: f64::from(index), y: 0.0, third: f64::NAN }).collect();
    points[43_211].y = 7.0;
    points[43_214].y = -3.0;
    let thin = Curve { points, ..Curve::default() }.thinned(1440, 1000.0);
    assert!(thin.points.len() <= 1440, "{} points", thin.points.len());
    for (x, y) in [(43_211.0, 7000.0), (43_214.0, -3000.0)] {
        assert!(thin.points.iter().any(|point| (point.x, point.y) == (x, y)));
    }
    assert!(thin.points.windows(2).all(|pair| pair[0].x <= pair[1].x));
}

#[test]
fn marks_and_places_are_named_by_their_columns() {
    let spec = TableSpec::new(
        "trend",
        "trend",
        vec![
            ColumnSpec::count("number", "", "number"),
            ColumnSpec::name("recording", "recording"),
            ColumnSpec::number("value", "", "value"),
            ColumnSpec::text("signals", "signals"),
        ],
    );
    let figure = Figure::lines("trend", "Trend", "number", [Measure::new("value").with_marks("signals")]);
    let mut panels = Panels::new(&spec, &figure.places("recording").level("limit", 2.0), 4).unwrap();
    let columns = vec![counts(1..4), texts(["a", "b", "c"]), numbers([1.0, 3.0, f64::NAN]), texts(["", "far", "far"])];
    let rows = spec.rows(columns).unwrap();
    panels.add(&rows);
    panels.add(&rows);
    let places: Vec<_> = panels.places.iter().map(|(x, name)| (*x, name.as_str())).collect();
    assert_eq!(places, [(1.0, "a"), (2.0, "b"), (3.0, "c")]);
    // What is not known has no mark.
    let mark = Mark { x: 2.0, y: 30.0, text: "far".into() };
    assert_eq!(panels.drawn[0].curves[0].thinned(10, 10.0).marks, [mark.clone(), mark]);
}

#[test]
fn axes_are_named_by_their_columns() {
    let figure = Figure::lines("form", "Form", "order", [Measure::new("form_um")]);
    let [x, y] = Panels::new(&table(), &figure, 4).unwrap().axes;
    assert_eq!((x.name.as_str(), y.name.as_str(), y.unit.as_str()), ("order", "form", "um"));
    assert_eq!(without_unit("tilt_x_urad", "urad"), "tilt x");
}

#[test]
fn what_all_curves_share_is_one_line() {
    let columns = vec![
        ColumnSpec::number("speed_rpm", "rpm", "speed"),
        ColumnSpec::name("whirl", "whirl"),
        ColumnSpec::number("frequency_hz", "Hz", "frequency"),
        ColumnSpec::number("turn_hz", "Hz", "frequency of rotation"),
    ];
    let table = TableSpec::new("campbell", "modes", columns);
    let values = [Measure::new("frequency_hz"), Measure::new("turn_hz").with_symbol("1/rev").common()];
    let figure = Figure::points("campbell", "Campbell", "speed_rpm", values).curves(["whirl"]);
    let mut panels = Panels::new(&table, &figure, 4).unwrap();
    let whirls = texts(["forward", "backward", "forward", "backward"]);
    let rows =
        vec![numbers([0.0, 0.0, 60.0, 60.0]), whirls, numbers([9.0, 8.0, 10.0, 7.0]), numbers([0.0, 0.0, 1.0, 1.0])];
    panels.add(&table.rows(rows).unwrap());
    let found: Vec<_> =
        panels.drawn[0].curves.iter().map(|one| (one.name.as_str(), one.points.len(), one.joined)).collect();
    assert_eq!(found, [("forward", 2, false), ("1/rev", 2, true), ("backward", 2, false)]);
}

/// A circle belongs to the curve of its station and section; what is not known of it is NaN.
#[test]
fn circles_go_to_their_curves() {
    let names = || [ColumnSpec::name("station", "station"), ColumnSpec::name("section", "section")];
    let [station, section] = names();
    let form = TableSpec::new(
        "form",
        "form",
        vec![station, section, ColumnSpec::number("angle_deg", "deg", ""), ColumnSpec::number("form_um", "um", "")],
    );
    let circles = TableSpec::new("circles", "circles", names().into_iter().chain(crate::circles::columns()).collect());
    let figure = Figure::polar("form", "Form", "angle_deg", [Measure::new("form_um")])
        .panels(["station"])
        .curves(["section"])
        .circles("circles");
    let mut panels = Panels::new(&form, &figure, 4).unwrap();
    let one = |values: [f64; 2]| values.map(|value| numbers([value, value]));
    let rows =
        form.rows(vec![texts(["s1", "s1"]), texts(["a", "b"]), numbers([0.0, 0.0]), numbers([0.01, 0.02])]).unwrap();
    panels.take("form", &rows);
    let mut columns = vec![texts(["s1", "s9"]), texts(["b", "b"]), texts(["none", "none"]), numbers([0.0, 0.0])];
    columns.push(texts(["MZCI", "MZCI"]));
    columns.extend(one([1.0, 2.0]));
    columns.push(numbers([3.0, 3.0]));
    columns.extend([numbers([4.0, 4.0]), crate::numbers_or_null([None, None])]);
    columns.push(crate::texts_or_null([Some("a test"), None]));
    columns.extend(one([30.0, 0.5]));
    columns.extend(one([60.0, -0.5]));
    columns.extend([crate::numbers_or_null([None, None]), crate::numbers_or_null([None, None])]);
    panels.take("circles", &circles.rows(columns).unwrap());
    let [a, b] = &panels.drawn[0].curves[..] else { panic!("two curves") };
    assert!(a.circles.is_empty() && panels.drawn.len() == 1);
    // Heights below 0.1 µm are shown in nm.
    let (scale, unit) = panels.scaled();
    assert_eq!(unit, "nm");
    let [found] = &b.thinned(10, scale).circles[..] else { panic!("one circle") };
    assert_eq!((found.symbol.as_str(), found.filter.as_str(), found.gaussian_upr), ("MZCI", "none", 0.0));
    assert_eq!(
        (found.centre, found.radius, found.peak, found.valley),
        ([1e3, 2e3], 3e3, [30.0, 500.0], [60.0, -500.0])
    );
    assert!(
        found.is_refuted
            && (found.ront[0] - 4e3).abs() < 1e-9
            && found.ront[1].is_nan()
            && found.eccentricity[0].is_nan()
    );
}

#[test]
fn vectors_have_places_and_axes() {
    let names = ["x_mm", "y_mm", "z_mm", "dx_um", "dy_um", "dz_um"];
    let columns = names.map(|name| ColumnSpec::number(name, &name[name.len() - 2..], ""));
    let table = TableSpec::new("prediction", "prediction", columns.into());
    let [x, y, z, dx, dy, dz] = names.map(str::to_owned);
    let figure = Figure::vectors("map", "Map", [x, y, z], [dx, dy, dz]);
    let mut panels = Panels::new(&table, &figure, 4).unwrap();
    let number = |column: usize| numbers([f64::from(column as u32), if column == 4 { f64::NAN } else { 1.0 }]);
    panels.take("prediction", &table.rows((0..6).map(number).collect()).unwrap());
    let [curve] = &panels.drawn[0].curves[..] else { panic!("one curve") };
    assert_eq!(curve.arrows, [Arrow { place: [0.0, 1.0, 2.0], vector: [3.0, 4.0, 5.0] }]);
    let shown: Vec<&str> = panels.vector.iter().map(|axis| axis.name.as_str()).collect();
    assert_eq!((shown, panels.height().name.as_str()), (vec!["dx", "dy", "dz"], "z"));
}
