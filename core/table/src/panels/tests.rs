#![allow(clippy::unwrap_used, reason = "tests")]

use super::*;
use crate::{ColumnSpec, counts, numbers, texts};

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
