//! Tables and values of a rotor.

#![allow(clippy::unwrap_used, clippy::float_cmp, reason = "tests; orders and numbers of modes are whole")]

use crate::support::{MATERIALS, modal, near, points, separator, solved};
use arrow_array::{
    Array, RecordBatch,
    cast::AsArray,
    types::{Float64Type, UInt32Type},
};
use runout_core::{points::Points, stage::Outcome};
use std::{f64::consts::PI, path::Path};

const ROTOR: &str = r#"segments = [{ length_mm = 600, outer_mm = 40, material = "steel", elements = 6 }]
    disks = [{ z_mm = 400, mass_kg = 12, polar_kg_m2 = 0.12, diametral_kg_m2 = 0.07 }]
    bearings = [
        { z_mm = 0, kxx_n_per_m = 2e7, kyy_n_per_m = 2e7, cxx_n_s_per_m = 80, cyy_n_s_per_m = 80 },
        { z_mm = 600, kxx_n_per_m = 2e7, kyy_n_per_m = 2e7, cxx_n_s_per_m = 80, cyy_n_s_per_m = 80 },
    ]"#;

fn table<'a>(outcome: &'a Outcome, name: &str) -> &'a RecordBatch {
    &outcome.tables.iter().find(|table| table.table == name).unwrap().rows
}

fn numbers(rows: &RecordBatch, column: &str) -> Vec<f64> {
    let column = rows.column_by_name(column).unwrap();
    match column.as_primitive_opt::<Float64Type>() {
        Some(numbers) => numbers.iter().map(|value| value.unwrap_or(f64::NAN)).collect(),
        None => column.as_primitive::<UInt32Type>().values().iter().map(|count| f64::from(*count)).collect(),
    }
}

fn texts(rows: &RecordBatch, column: &str) -> Vec<String> {
    let column = rows.column_by_name(column).unwrap().as_string::<i32>();
    (0..column.len()).map(|row| column.value(row).to_owned()).collect()
}

#[test]
fn tables_hold_what_they_declare() {
    let outcome = solved(ROTOR, "modes = 5\ncampbell_rpm = [0, 3000, 9000]\navoid_orders = [1, 2]");
    let declared = separator("").unwrap().tables();
    assert_eq!(outcome.tables.len(), declared.len());
    for (table, spec) in outcome.tables.iter().zip(&declared) {
        assert_eq!((table.table.as_str(), table.rows.schema()), (spec.name.as_str(), spec.schema()));
    }
    let modes = table(&outcome, "modes");
    assert_eq!(numbers(modes, "mode"), [1.0, 2.0, 3.0, 4.0, 5.0]);
    let f = numbers(modes, "frequency_hz");
    assert!(f.is_sorted() && f[0] > 1.0, "{f:?}");
    // Equal planes: pairs of one frequency at rest, lines along x and along y; split by rotation.
    near(f[0], f[1], 1e-8);
    assert!(texts(modes, "whirl").iter().all(|whirl| whirl == "planar"), "{:?}", texts(modes, "whirl"));
    let campbell = table(&outcome, "campbell");
    assert_eq!(numbers(campbell, "speed_rpm").len(), 15);
    near(numbers(campbell, "frequency_hz")[0], f[0], 1e-8);
    let (split, whirl) = (&numbers(campbell, "frequency_hz")[10..], &texts(campbell, "whirl")[10..]);
    assert!(split[0] < f[0] && split[1] > f[1] && split[0] / split[1] < 0.999, "{split:?}");
    assert_eq!(whirl[..2], ["backward", "forward"]);
    // A pair of speeds for each pair of modes, and ranges about each crossing.
    let critical = numbers(table(&outcome, "critical_speeds"), "speed_rpm");
    assert!(critical.is_sorted() && critical[0] < 60.0 * f[0] && critical[1] > 60.0 * f[1], "{critical:?} {f:?}");
    let ranges = table(&outcome, "speeds_to_avoid");
    let [order, from, to] = ["order", "from_rpm", "to_rpm"].map(|column| numbers(ranges, column));
    let first = order.iter().position(|order| *order == 1.0).unwrap();
    assert!(from[first] < critical[0] && critical[0] < to[first]);
    // The gyroscopic moments move the frequency by about 1 % within a range.
    near(from[first], critical[0] / 1.15, 2e-2);
    near(to[first], critical[0] / 0.85, 2e-2);
    let second = order.iter().position(|order| *order == 2.0).unwrap();
    near(from[second], from[first] / 2.0, 2e-2);
}

#[test]
fn shapes_of_equal_planes_are_along_x_and_along_y() {
    let outcome = solved(ROTOR, "modes = 4");
    let shapes = table(&outcome, "mode_shapes");
    let [mode, z_mm, x, y] = ["mode", "z_mm", "x", "y"].map(|column| numbers(shapes, column));
    for (number, moves) in [(1.0, &x), (2.0, &y), (3.0, &x), (4.0, &y)] {
        let rows: Vec<usize> = (0..mode.len()).filter(|row| mode[*row] == number).collect();
        assert!(rows.windows(2).all(|pair| z_mm[pair[0]] < z_mm[pair[1]]));
        let largest = rows.iter().map(|row| moves[*row]).fold(f64::MIN, f64::max);
        near(largest, 1.0, 1e-9);
        let other = if std::ptr::eq(moves, &raw const x) { &y } else { &x };
        assert!(rows.iter().all(|row| other[*row].abs() < 1e-5), "{number}");
    }
}

/// A thin disk at the end of a thin shaft of one element: with P = 1.95·D the upper forward whirl comes from above to 1.95·Ω, so it
/// meets 2.6·Ω and never 1.4·Ω.
#[test]
fn a_range_without_an_end_is_null() {
    let parts = r#"segments = [{ length_mm = 500, outer_mm = 12, material = "light", elements = 1 }]
        supports = [{ z_mm = 0, kind = "clamped" }]
        disks = [{ z_mm = 500, mass_kg = 10, polar_kg_m2 = 0.8, diametral_kg_m2 = 0.41 }]"#;
    let outcome = solved(parts, "modes = 4\navoid_orders = [2]\navoid_within_percent = 30");
    let ends = numbers(table(&outcome, "speeds_to_avoid"), "to_rpm");
    assert_eq!(ends.iter().map(|end| end.is_nan()).collect::<Vec<_>>(), [false, false, false, true], "{ends:?}");
    let last = outcome.values.iter().rfind(|value| value.symbol == "avoid_to").unwrap();
    assert!(last.value.is_nan());
}

/// What the loader gives is what the separator takes, bit by bit.
#[test]
fn equations_travel_as_points() {
    let text = format!("{MATERIALS}{ROTOR}");
    let first: Points = points(&text, Path::new("")).unwrap();
    let outcome = separator("modes = 3").unwrap().separate(&first).unwrap();
    let direct = modal(ROTOR).at(0.0).unwrap();
    let f = numbers(table(&outcome, "modes"), "frequency_hz");
    for (one, mode) in f.iter().zip(&direct) {
        assert_eq!(one.to_bits(), (mode.frequency() / (2.0 * PI)).to_bits());
    }
    // A row out of place is an error that names it.
    let mut broken = first.clone();
    broken.columns[0].values[3] = 1.5;
    let message = separator("").unwrap().separate(&broken).unwrap_err().to_string();
    assert!(message.contains("matrix stiffness") && message.contains("found 1.5"), "{message}");
    let mut unknown = first;
    unknown.traces[0].id = "stifness".into();
    let message = separator("").unwrap().separate(&unknown).unwrap_err().to_string();
    assert!(message.contains("unknown matrix"), "{message}");
}
