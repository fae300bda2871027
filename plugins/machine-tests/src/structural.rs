//! The separator `structural-motion`: motion between the tool and the workpiece with the spindle still, drives on (ISO 230-7, structural motion with the
//! spindle not rotating).
//!
//! | symbol | value |
//! | --- | --- |
//! | `structural-motion` | of each axis: peak to valley of the displacement within `window_s`, mean over the windows |
//! | `structural-motion-max` | of each axis: the largest of the windows |
//!
//! The recording has no revolutions: it comes as points over time. The ± of the mean is the scatter of the windows; noise of the sensors is in the values. The largest of
//! the windows has no ±: it grows with their number.

use runout_core::{
    Error, ErrorKind, Result,
    draws::{Uncertainty, student_95},
    fault::Fault,
    pipeline::{Context, StageConfig},
    points::{PointColumn, PointKind::Number, Points},
    stage::{Outcome, PointSeparator, Separator},
    summary::Value,
    table::{ColumnSpec, Figure, Measure, TableRows, TableSpec, numbers, texts},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    probing::range,
    repeated::{Said, means_in_order},
    runs::{mean, std},
};

/// Readings of a window at least: fewer miss peaks.
const FEWEST_READINGS: usize = 20;
/// Windows whose scatter is an uncertainty.
const FEWEST_WINDOWS: usize = 5;
/// Share of the readings of the fullest window that a window has at least.
const FILLED: f64 = 0.9;
/// `[separate] plugin = "structural-motion"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StructuralMotionConfig {
    /// Time over which a peak to valley is taken, in s.
    pub window_s: f64,
}

impl StageConfig for StructuralMotionConfig {
    type Stage = Separator;

    const NAME: &'static str = "structural-motion";
    const ABOUT: &'static str =
        "motion with the spindle still by ISO 230-7: peak to valley of each axis within a stated time";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        if !(self.window_s.is_finite() && self.window_s > 0.0) {
            return Err(Fault::at("window_s", format!("expected a time above 0 s, found {}", self.window_s)));
        }
        Ok(Separator::Points(Box::new(StructuralMotion(self))))
    }
}

struct StructuralMotion(StructuralMotionConfig);

const AXES: [(&str, &str); 3] = [("x_um", "X"), ("y_um", "Y"), ("z_um", "Z")];
const COLUMNS: [PointColumn; 4] = [
    PointColumn::needed("time_s", Number, "s", "time of the reading"),
    PointColumn::optional("x_um", Number, "um", "displacement along X").measured(),
    PointColumn::optional("y_um", Number, "um", "displacement along Y").measured(),
    PointColumn::optional("z_um", Number, "um", "displacement along Z").measured(),
];

fn refuse(points: &Points, problem: String, help: &str) -> Error {
    Error::new("evaluate", points.input.display().to_string(), problem)
        .of(ErrorKind::InsufficientData)
        .help(help.to_owned())
}

/// Rows of each whole window, in the order of time.
fn windows(points: &Points, window_s: f64) -> Result<Vec<Vec<usize>>> {
    let times = points.column("time_s")?;
    let mut rows: Vec<usize> = (0..times.len()).collect();
    rows.sort_by(|a, b| times[*a].total_cmp(&times[*b]));
    let mut all: Vec<(u64, Vec<usize>)> = Vec::new();
    for row in &rows {
        // A reading on the border belongs to the later window, whatever the last digit is.
        let window = ((times[*row] - times[rows[0]]) / window_s + 1e-9).floor() as u64;
        match all.last_mut() {
            Some((last, of)) if *last == window => of.push(*row),
            _ => all.push((window, vec![*row])),
        }
    }
    let most = all.iter().map(|(_, of)| of.len()).max().unwrap_or(0);
    if most < FEWEST_READINGS {
        let problem = format!("expected at least {FEWEST_READINGS} readings in {window_s} s, found {most}");
        return Err(refuse(points, problem, "record faster than the machine vibrates, or state a longer `window_s`"));
    }
    Ok(all.into_iter().map(|(_, of)| of).filter(|of| of.len() as f64 >= FILLED * most as f64).collect())
}

impl PointSeparator for StructuralMotion {
    fn columns(&self) -> Vec<PointColumn> {
        COLUMNS.into()
    }

    fn tables(&self) -> Vec<TableSpec> {
        vec![table()]
    }

    fn symbols(&self) -> Vec<(&'static str, &'static str)> {
        vec![("structural-motion", "um"), ("structural-motion-max", "um")]
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        let windows = windows(points, self.0.window_s)?;
        let time = points.column("time_s")?;
        let (mut values, mut said, mut each) = (Vec::new(), Said::default(), Vec::new());
        for (column, axis) in AXES {
            let Ok(readings) = points.column(column) else { continue };
            let ranges: Vec<f64> =
                windows.iter().map(|of| range(&of.iter().map(|row| readings[*row]).collect::<Vec<f64>>())).collect();
            each.extend(windows.iter().zip(&ranges).map(|(of, range)| (axis, time[of[0]], *range)));
            values.extend(self.values(axis, &ranges, &mut said));
        }
        if values.is_empty() {
            let help = "name the columns of displacements x_um, y_um, z_um";
            return Err(refuse(points, "there is none of x_um, y_um, z_um".into(), help));
        }
        let spec = table();
        let rows = spec.rows(vec![
            texts(each.iter().map(|(axis, ..)| *axis)),
            numbers(each.iter().map(|(_, from, _)| *from)),
            numbers(each.iter().map(|(.., range)| *range)),
        ])?;
        let outcome = Outcome {
            convention: "displacement of the tool against the workpiece, spindle still; as recorded, with what the sensors themselves make".into(),
            tables: vec![TableRows { table: spec.name, rows }],
            values,
            checks: said.checks,
            remarks: said.remarks,
            notes: vec![format!("{} windows of {} s", windows.len(), self.0.window_s)],
            ..Outcome::default()
        };
        Ok(outcome.refuted())
    }
}

impl StructuralMotion {
    fn values(&self, axis: &str, ranges: &[f64], said: &mut Said) -> [Value; 2] {
        let count = ranges.len();
        let about =
            format!("peak to valley within {} s, mean of the windows, spindle still (ISO 230-7)", self.0.window_s);
        let mut value = Value::new("structural-motion", mean(ranges), f64::NAN, "um", &about).of(axis).key();
        if count < FEWEST_WINDOWS {
            said.remarks.push(format!(
                "{axis}: {count} windows show no uncertainty: record {FEWEST_WINDOWS} or more of {} s",
                self.0.window_s
            ));
        } else if std(ranges) > 0.0 {
            let judged = means_in_order("the windows", &[("window", ranges)], "µm");
            let error = judged.factors[0] * std(ranges) / (count as f64).sqrt();
            said.checks.extend(judged.checks.into_iter().map(|check| check.within(axis)));
            let reach = student_95((count - 1) as f64) * error;
            let interval = [(value.value - reach).max(0.0), value.value + reach];
            value.uncertainty = Some(Uncertainty::new(error, interval, 0));
        } else {
            said.remarks.push(format!("{axis}: all windows have the same peak to valley: copies, or too coarse a resolution, show no uncertainty"));
        }
        let largest = ranges.iter().copied().fold(0.0, f64::max);
        let about = format!(
            "largest peak to valley within {} s, of {count} windows, spindle still (ISO 230-7)",
            self.0.window_s
        );
        let no_uncertainty = Some("the largest of the windows grows with their number".to_owned());
        let largest = Value::new("structural-motion-max", largest, f64::NAN, "um", &about).of(axis);
        [value, Value { no_uncertainty, ..largest }]
    }
}

fn table() -> TableSpec {
    TableSpec::new(
        "structural_motion",
        "peak to valley of each window",
        vec![
            ColumnSpec::name("axis", "X, Y or Z"),
            ColumnSpec::number("from_s", "s", "time of the first reading of the window").repeating(),
            ColumnSpec::number("peak_to_valley_um", "um", "of the displacement within the window"),
        ],
    )
    .figure(
        Figure::lines(
            "structural-motion",
            "Motion with the spindle still",
            "from_s",
            [Measure::new("peak_to_valley_um")],
        )
        .curves(["axis"]),
    )
}
