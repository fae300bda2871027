//! A separator of one's own: the least-squares plane of measured points. `cargo run -p runout --example own_separator`.
//!
//! The loader `points` reads the columns that [`Plane`] asks for from CSV or Parquet; every exporter of tables writes its result.

#![allow(clippy::print_stdout, reason = "a program that prints its result")]

use std::{error::Error, path::Path};

use runout_core::{
    ErrorKind,
    fault::Fault,
    numerics::least_squares::{SINGULAR, least_norm},
    pipeline::{Context, Pipeline, Plugin, Registry, StageConfig},
    points::{PointColumn, PointKind, Points},
    stage::{Outcome, PointSeparator, Separator},
    summary::{Summary, Value},
    table::{ColumnSpec, TableRows, TableSpec, numbers},
};
use schemars::JsonSchema;
use serde::Deserialize;

/// `plugin = "plane"`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Plane {
    /// Standard uncertainty of a point's height, in µm.
    std_um: f64,
}

impl StageConfig for Plane {
    type Stage = Separator;
    const NAME: &'static str = "plane";
    const ABOUT: &'static str = "flatness of measured points about their least-squares plane";

    fn check(self, _context: &Context) -> Result<Separator, Fault> {
        if self.std_um > 0.0 && self.std_um.is_finite() {
            return Ok(Separator::Points(Box::new(self)));
        }
        Err(Fault::at("std_um", format!("expected a number above 0, found {}", self.std_um)))
    }
}

fn residual() -> TableSpec {
    let column = |name: &str, unit: &str, about: &str| ColumnSpec::number(name, unit, about);
    TableSpec::new(
        "plane",
        "distance of each point from the least-squares plane along z",
        vec![
            column("x_mm", "mm", "place"),
            column("y_mm", "mm", "place"),
            column("distance_um", "um", "above the plane"),
        ],
    )
}

impl PointSeparator for Plane {
    fn columns(&self) -> Vec<PointColumn> {
        [("x_mm", "mm"), ("y_mm", "mm"), ("z_um", "um")]
            .map(|(name, unit)| PointColumn::needed(name, PointKind::Number, unit, "coordinate of the point"))
            .into()
    }

    fn tables(&self) -> Vec<TableSpec> {
        vec![residual()]
    }

    fn separate(&self, points: &Points) -> runout_core::Result<Outcome> {
        let [x, y, z] = [points.column("x_mm")?, points.column("y_mm")?, points.column("z_um")?];
        let weighted = |values: &[f64]| values.iter().map(|value| value / self.std_um).collect::<Vec<f64>>();
        let plane = least_norm(&[weighted(&vec![1.0; z.len()]), weighted(x), weighted(y)], &weighted(z), SINGULAR);
        if plane.lost.contains(&true) {
            let problem = "they lie on a line, or are fewer than three";
            let error = runout_core::Error::new("fit a plane to", points.input.display().to_string(), problem);
            return Err(error.of(ErrorKind::InsufficientData).help("measure points that span a plane"));
        }
        let distance: Vec<f64> = plane.residual.iter().map(|value| value * self.std_um).collect();
        let range = distance.iter().fold(f64::NEG_INFINITY, |most, one| most.max(*one))
            - distance.iter().fold(f64::INFINITY, |least, one| least.min(*one));
        let columns = [x.to_vec(), y.to_vec(), distance].map(numbers);
        let slope = |index: usize| (plane.coefficients[index], plane.covariance[(index, index)].sqrt());
        let tilt = |axis: &str, (slope, std): (f64, f64)| -> Value {
            Value::new("slope", slope, std, "um/mm", "slope of the least-squares plane").of(axis)
        };
        let tables = vec![TableRows { table: "plane".into(), rows: residual().rows(columns.into())? }];
        // The range of noise is no uncertainty of a range: it has none here.
        let values = vec![
            Value::new("FLTt", range, f64::NAN, "um", "peak-to-valley flatness deviation LSPL (ISO 12781-1)"),
            tilt("x", slope(1)),
            tilt("y", slope(2)),
        ];
        Ok(Outcome { tables, values, ..Outcome::default() })
    }
}

/// Runs a pipeline with it.
///
/// # Errors
/// When the points cannot be read, or determine no plane.
pub(crate) fn flatness(points: &Path, out: &Path) -> Result<Summary, Box<dyn Error>> {
    let mut registry: Registry = runout_cli::builtin::registry();
    registry.separators.add(Plugin::of::<Plane>());
    let (points, out) = (points.display(), out.display());
    let configuration = format!(
        r#"
        load = {{ plugin = "points", path = '{points}' }}
        separate = {{ plugin = "plane", std_um = 0.1 }}
        export = [{{ plugin = "parquet", path = '{out}' }}]
        "#
    );
    Ok(Pipeline::from_toml(&configuration, ".", &registry)?.run()?)
}

#[allow(dead_code, reason = "a test calls `flatness`")]
fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::temp_dir().join("runout-plane");
    std::fs::create_dir_all(&folder)?;
    let points = folder.join("points.csv");
    std::fs::write(&points, "x_mm,y_mm,z_um\n0,0,1.0\n10,0,2.1\n0,10,0.9\n10,10,2.0\n5,5,1.7\n")?;
    for value in flatness(&points, &folder.join("out"))?.values {
        println!("{} {:?} ± {:?} {}", value.symbol, value.number(), value.std(), value.unit);
    }
    Ok(())
}
