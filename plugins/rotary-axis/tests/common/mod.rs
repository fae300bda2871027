//! Campaigns for the tests.

#![allow(dead_code, clippy::unwrap_used, reason = "tests")]

use arrow_array::{Array, Float64Array};
use runout_core::{
    points::Points,
    stage::{Outcome, PointSeparator},
};
use runout_rotary_axis::{RotaryAxis, RotaryAxisConfig, simulate::Scenario};

pub(crate) const THREE_BALLS: &str = "balls = [
    { id = 'P1', x_mm = 120, y_mm = 0, z_mm = 60 },
    { id = 'P2', x_mm = -50, y_mm = 95, z_mm = 110 },
    { id = 'P3', x_mm = -70, y_mm = -80, z_mm = 40 },
]\n";

/// Component errors that fulfil the gauge: what is 1/rev in a plane turns against the table.
pub(crate) const COMPONENTS: &str = "component = [
    { error = 'EXC', order = 2, cosine = 2.0, sine = 1.0 },
    { error = 'EYC', order = 3, cosine = -1.5 },
    { error = 'EZC', order = 1, cosine = 1.0, sine = 2.0 },
    { error = 'EAC', order = 1, cosine = 8.0, sine = 3.0 },
    { error = 'EBC', order = 1, cosine = 3.0, sine = -8.0 },
    { error = 'EBC', order = 2, sine = 6.0 },
    { error = 'ECC', order = 1, cosine = 10.0 },
    { error = 'ECC', order = 4, sine = 5.0 },
]\n";

pub(crate) const LOCATION: &str = "location = { EX0C = 23.7, EY0C = 3.1, EA0C = 41.0, EB0C = 34.6 }\n";
pub(crate) const PLACEMENT: &str = "placement = { P1 = [30, -20, 12], P2 = [-15, 40, -33], P3 = [8, 5, 21] }\n";

pub(crate) fn scenario(text: &str) -> Scenario {
    toml::from_str(text).unwrap()
}

pub(crate) fn separator(text: &str) -> RotaryAxis {
    toml::from_str::<RotaryAxisConfig>(text).unwrap().separator().unwrap()
}

pub(crate) fn separated(config: &str, points: &Points) -> Outcome {
    separator(config).separate(points).unwrap()
}

/// A value and its standard uncertainty; NaN where lost.
pub(crate) fn value(outcome: &Outcome, symbol: &str) -> [f64; 2] {
    let found = outcome.values.iter().find(|value| value.symbol == symbol).unwrap();
    [found.value, found.std().unwrap_or(f64::NAN)]
}

/// A column of a table; NaN for null.
pub(crate) fn column(outcome: &Outcome, table: &str, name: &str) -> Vec<f64> {
    let rows = &outcome.tables.iter().find(|rows| rows.table == table).unwrap().rows;
    let array = rows.column_by_name(name).unwrap().as_any().downcast_ref::<Float64Array>().unwrap().clone();
    (0..array.len()).map(|row| if array.is_null(row) { f64::NAN } else { array.value(row) }).collect()
}
