//! Points, tables and values of tests.

#![allow(clippy::unwrap_used, dead_code, reason = "tests")]

use std::path::Path;

use runout_core::{
    pipeline::Context,
    points::{Column, Points, Trace},
    stage::Outcome,
    summary::Value,
    table::RecordBatch,
};
use runout_spatial_error::{
    SpatialError, SpatialErrorConfig,
    simulate::{Field, Layout, Placement, Scenario, SimulatedEffect, Tracker},
};

/// A separator from TOML.
pub(crate) fn separator(text: &str) -> SpatialError {
    try_separator(text).unwrap()
}

pub(crate) fn try_separator(text: &str) -> Result<SpatialError, String> {
    let config: SpatialErrorConfig = toml::from_str(text).map_err(|error| error.to_string())?;
    config.separator(&Context { folder: Path::new("."), rig: None }).map_err(|fault| fault.to_string())
}

/// Points from columns.
pub(crate) fn points(columns: &[(&str, Vec<f64>)]) -> Points {
    let count = columns[0].1.len();
    Points {
        input: "test.csv".into(),
        columns: columns.iter().map(|(name, values)| Column { name: (*name).into(), values: values.clone() }).collect(),
        traces: vec![Trace { id: "points".into(), kind: "points".into(), points: 0..count }],
        ..Points::default()
    }
}

/// Points of places and readings.
pub(crate) fn readings(places: &[[f64; 3]], values: &[[f64; 3]]) -> Points {
    let of = |all: &[[f64; 3]], axis: usize| all.iter().map(|one| one[axis]).collect::<Vec<f64>>();
    points(&[
        ("x_mm", of(places, 0)),
        ("y_mm", of(places, 1)),
        ("z_mm", of(places, 2)),
        ("dx_um", of(values, 0)),
        ("dy_um", of(values, 1)),
        ("dz_um", of(values, 2)),
    ])
}

pub(crate) fn table(outcome: &Outcome, name: &str) -> RecordBatch {
    outcome.tables.iter().find(|table| table.table == name).unwrap().rows.clone()
}

pub(crate) fn column(rows: &RecordBatch, name: &str) -> Vec<f64> {
    let column = rows.column_by_name(name).unwrap_or_else(|| panic!("no column {name}"));
    let data = column.to_data();
    data.buffer::<f64>(0)[..column.len()].to_vec()
}

pub(crate) fn flags(rows: &RecordBatch, name: &str) -> Vec<bool> {
    let column = rows.column_by_name(name).unwrap();
    let data = column.to_data();
    let bits = data.buffers()[0].as_slice();
    (0..column.len()).map(|index| bits[index / 8] >> (index % 8) & 1 == 1).collect()
}

pub(crate) fn value<'a>(outcome: &'a Outcome, symbol: &str, of: Option<&str>) -> &'a Value {
    outcome.values.iter().find(|value| value.symbol == symbol && value.of.as_deref() == of).unwrap()
}

/// A machine with a travel of 600 × 400 × 350 mm and a smooth field, 120 places, each read twice in an order at random.
pub(crate) fn scenario(seed: u64) -> Scenario {
    Scenario {
        layout: Layout::Grid { from_mm: [0.0; 3], to_mm: [600.0, 400.0, 350.0], counts: [6, 5, 4] },
        passes: 2,
        random_order: true,
        seconds_per_point: 10.0,
        seed,
        chain: "XYZ".into(),
        tool_mm: [0.0; 3],
        tracker: Tracker { at_mm: [-1500.0, 200.0, 300.0], noise_um: 0.8, angle_urad: 0.2 },
        placement: Placement { shift_um: [120.0, -45.0, 310.0], turn_urad: [85.0, -140.0, 60.0] },
        field: Some(Field { std_um: [4.0, 3.0, 5.0], range_mm: [260.0, 220.0, 200.0], smoothness: Some(2.5) }),
        effect: Vec::<SimulatedEffect>::new(),
    }
}
