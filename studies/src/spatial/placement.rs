//! Placement of the tracker beside its truth: whether its standard uncertainty holds.

use std::fmt::Write as _;

use runout_core::{Error, Result, pipeline::Context, stage::PointSeparator, summary::Value};
use runout_spatial_error::{Query, SpatialErrorConfig};

use super::{
    known::Known,
    machine::{self, TRAVEL_MM},
};
use crate::{chance::Chance, each::each};

/// Coarse: predictions are not judged here.
const GRID_MM: [f64; 3] = [300.0, 200.0, 175.0];
/// Symbols of the placement.
const SYMBOLS: [&str; 6] = ["TX", "TY", "TZ", "RX", "RY", "RZ"];

/// Error over standard uncertainty of the six parameters of one machine.
#[derive(Debug, Clone, Copy)]
pub struct Placed {
    /// As stated.
    pub stated: [f64; 6],
    /// Of a fit with the true covariance.
    pub known: [f64; 6],
    /// Smoothness ν of the field; infinite of the smooth limit.
    pub smoothness: f64,
}

/// Placements of clean machines.
///
/// # Errors
/// When a machine cannot be fitted.
pub fn placements(machines: u64, seed: u64) -> Result<Vec<Placed>> {
    each(machines, seed, |index| one(&mut Chance::new(seed, index)))
}

fn one(chance: &mut Chance) -> Result<Placed> {
    let scenario = machine::draw(chance, None);
    let made = scenario.simulate();
    let config =
        SpatialErrorConfig { query: Query { grid_mm: Some(GRID_MM), path: None }, ..SpatialErrorConfig::default() };
    let context = Context { folder: std::path::Path::new("."), rig: None };
    let separator = config.separator(&context).map_err(|fault| Error::new("check", "the kriging", fault))?;
    let values = separator.separate(&made.points())?.values;
    // The placement counts from the middle of the measured volume, which of scattered places is not that of the travel.
    let middle = [0, 1, 2].map(|axis| {
        let each = || made.commands_mm.iter().map(|place| place[axis]);
        0.5 * (each().fold(f64::INFINITY, f64::min) + each().fold(f64::NEG_INFINITY, f64::max))
    });
    let from = [0, 1, 2].map(|axis| middle[axis] - 0.5 * TRAVEL_MM[axis]);
    let ([tx, ty, tz], [rx, ry, rz]) = (scenario.placement.shift_um, scenario.placement.turn_urad);
    let truth = [
        tx + 1e-3 * (ry * from[2] - rz * from[1]),
        ty + 1e-3 * (rz * from[0] - rx * from[2]),
        tz + 1e-3 * (rx * from[1] - ry * from[0]),
        rx,
        ry,
        rz,
    ];
    let of = |symbol: &str, truth: f64| {
        let found: Option<&Value> = values.iter().find(|value| value.symbol == symbol);
        found.and_then(|value| value.number().zip(value.std())).map_or(f64::NAN, |(value, std)| (value - truth) / std)
    };
    let known = Known::new(&scenario, &made)
        .ok_or_else(|| Error::new("invert", "the true covariance", "it is singular"))?
        .placement();
    let at_travel = [tx, ty, tz, rx, ry, rz];
    Ok(Placed {
        stated: [0, 1, 2, 3, 4, 5].map(|index| of(SYMBOLS[index], truth[index])),
        known: [0, 1, 2, 3, 4, 5].map(|index| (known[index][0] - at_travel[index]) / known[index][1]),
        smoothness: scenario.field.as_ref().map_or(f64::NAN, |field| field.smoothness.unwrap_or(f64::INFINITY)),
    })
}

/// A row each as Markdown.
#[must_use]
pub fn table(all: &[Placed]) -> String {
    let mut text = String::from(
        "| | values | mean square of error/std | root | within 1 | within 2 | within 3 | largest | mean square with the true \
         covariance |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    let mut row = |name: &str, columns: std::ops::Range<usize>, of: &dyn Fn(&Placed) -> bool| {
        let pick = |what: fn(&Placed) -> [f64; 6]| -> Vec<f64> {
            all.iter().filter(|one| of(one)).flat_map(|one| what(one)[columns.clone()].to_vec()).collect()
        };
        let (stated, known) = (pick(|one| one.stated), pick(|one| one.known));
        let mean = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64;
        let within =
            |most: f64| 100.0 * stated.iter().filter(|value| value.abs() <= most).count() as f64 / stated.len() as f64;
        let largest = stated.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {name} | {} | {:.2} | {:.2} | {:.0} % | {:.1} % | {:.1} % | {largest:.1} | {:.2} |",
            stated.len(),
            mean(&stated),
            mean(&stated).sqrt(),
            within(1.0),
            within(2.0),
            within(3.0),
            mean(&known),
        );
    };
    row("displacements", 0..3, &|_| true);
    row("rotations", 3..6, &|_| true);
    row("all", 0..6, &|_| true);
    for (name, smoothness) in [
        ("exponential fields", 0.5),
        ("matern-3/2 fields", 1.5),
        ("matern-5/2 fields", 2.5),
        ("gaussian fields", f64::INFINITY),
    ] {
        row(name, 0..6, &|one| one.smoothness.total_cmp(&smoothness).is_eq());
    }
    text
}
