//! The separator `drift`: thermal drift of a spindle or a machine over hours (ISO 230-3, the tests with a recording over time).
//!
//! | symbol | value |
//! | --- | --- |
//! | `drift` | of each axis: range of its displacement over the test |
//! | `combined-drift` | root of the sum of the squares of the axes' ranges |
//! | `stable-after` | time from which on an axis stays within `stable_um` of where it is in the last tenth of the test |
//!
//! Range and combination are those of a maker of spindle analysers (Lion Precision, *SpindleCheck*, manual M017-7500.004, page 29, which names
//! ISO 230-3); the criterion of stability is this program's. Displacements are means over `window_s`, without
//! single readings that are far from the others. Their noise is what most second differences of neighbouring means show, which a slow drift
//! has not, nor a few steps.
//!
//! # The interval of a range
//!
//! Noise σ ε of independent means can only raise a range on the whole: between the windows in which the axis is truly farthest out the reading differs
//! from the true range R by σ (ε − ε′), and the range found, R̂, is not below it; so R ≤ R̂ − σ (ε − ε′). And R̂ is at most R and the largest ε of
//! the windows that may be farthest out on each side; so R ≥ R̂ − σ (max ε + max ε′). The interval is from the 2.5 % quantile of the latter to the
//! 97.5 % quantile of the former. It holds for every course of means. Where an axis is farthest out in the first or the last window, it went on
//! within that by half of the change to the next one: so much the upper end is higher.

mod axis;
mod course;

use runout_core::{
    Error, ErrorKind, Result,
    draws::{Draw, NORMAL_95, Uncertainty, seed},
    fault::Fault,
    pipeline::{Context, StageConfig},
    points::{PointColumn, PointKind::Number, Points},
    stage::{Outcome, PointSeparator, Separator},
    summary::Value,
    table::{ColumnSpec, Figure, Measure, TableRows, TableSpec, numbers, stretches},
};
use schemars::JsonSchema;
use serde::Deserialize;

use axis::{Axis, BESIDE};
use course::{levels, range, rounding_of, stable_after};

/// Means that a test has at least: fewer show neither their noise nor a course.
const FEWEST_MEANS: usize = 20;
/// Share of an axis's own range that is stable where no length is stated.
const STABLE: f64 = 0.1;
/// Draws of the noise.
const DRAWS: usize = 1000;
/// Standard deviations of a smoothed mean by which noise moves a band in or out at most.
const AT_MOST: f64 = 3.0;
/// Windows with less than this share of the readings of most are left out.
const FILLED: f64 = 0.5;

/// `[separate] plugin = "drift"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DriftConfig {
    /// Readings are averaged over so many seconds: vibration is no drift.
    #[serde(default = "minute")]
    pub window_s: f64,
    /// How far from its last position an axis is stable, in µm; without it a tenth of its own range.
    pub stable_um: Option<f64>,
}

fn minute() -> f64 {
    60.0
}

impl StageConfig for DriftConfig {
    type Stage = Separator;

    const NAME: &'static str = "drift";
    const ABOUT: &'static str =
        "thermal drift over hours by ISO 230-3: range of each axis and combined, time to stability";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        for (key, value) in [("window_s", Some(self.window_s)), ("stable_um", self.stable_um)] {
            if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
                return Err(Fault::at(key, format!("expected a number above 0, found {value}")));
            }
        }
        Ok(Separator::Points(Box::new(Drift(self))))
    }
}

struct Drift(DriftConfig);

const AXES: [(&str, &str); 3] = [("x_um", "X"), ("y_um", "Y"), ("z_um", "Z")];
const TEMPERATURE: &str = "temperature_c";
const COLUMNS: [PointColumn; 5] = [
    PointColumn::needed("time_s", Number, "s", "time of the reading"),
    PointColumn::optional("x_um", Number, "um", "displacement along X").measured(),
    PointColumn::optional("y_um", Number, "um", "displacement along Y").measured(),
    PointColumn::optional("z_um", Number, "um", "displacement along Z").measured(),
    PointColumn::optional(TEMPERATURE, Number, "degC", "temperature beside the machine, or of its spindle"),
];

impl PointSeparator for Drift {
    fn columns(&self) -> Vec<PointColumn> {
        COLUMNS.into()
    }

    fn tables(&self) -> Vec<TableSpec> {
        vec![drift_table(), temperature_table()]
    }

    fn symbols(&self) -> Vec<(&'static str, &'static str)> {
        vec![("drift", "um"), ("combined-drift", "um"), ("stable-after", "min"), ("temperature-range", "K")]
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        let test = Test::of(points, self.0.window_s)?;
        let mut remarks: Vec<String> = test.gap().into_iter().collect();
        let mut values = self.values(&test, &mut remarks);
        if let Some(temperatures) = &test.temperatures {
            let about = "range of the temperature over the test, as recorded";
            let no_uncertainty = Some("nothing shows the error of the thermometer".to_owned());
            let value = Value::new("temperature-range", range(temperatures), f64::NAN, "K", about);
            values.push(Value { no_uncertainty, ..value });
        }
        let end_min = test.times_min.last().copied().unwrap_or_default();
        let notes = vec![format!(
            "{} means over {} s in {end_min:.1} min; their noise is {}",
            test.times_min.len(),
            self.0.window_s,
            test.axes
                .iter()
                .map(|axis| format!("{} {:.3} µm", axis.name, axis.noise_um))
                .collect::<Vec<_>>()
                .join(", ")
        )];
        Ok(Outcome {
            convention: "drift is displacement less that of the first mean".into(),
            tables: test.tables()?,
            values,
            remarks,
            notes,
            ..Outcome::default()
        })
    }
}

impl Drift {
    fn values(&self, test: &Test, remarks: &mut Vec<String>) -> Vec<Value> {
        let names: Vec<&str> = test.axes.iter().map(|axis| axis.name).collect();
        let found = with_combined(test.axes.iter().map(|axis| range(&axis.means)).collect());
        let mut draw = Draw::new(seed(&["drift", &names.join("")]));
        let (lows, highs): (Vec<_>, Vec<_>) = (0..DRAWS)
            .map(|_| {
                let ends = test.axes.iter().map(|axis| axis.ends(&mut draw));
                let (low, high) = ends.unzip();
                (with_combined(low), with_combined(high))
            })
            .unzip();
        let mut values: Vec<Value> = Vec::new();
        let mut squares = 0.0;
        for (index, value) in found.into_iter().enumerate() {
            let end = |draws: &[Vec<f64>], share: f64| {
                let mut ends: Vec<f64> = draws.iter().map(|draw| draw[index]).collect();
                ends.sort_by(f64::total_cmp);
                ends[(share * (DRAWS - 1) as f64).round() as usize]
            };
            let (mut low, high) = (end(&lows, 0.025), end(&highs, 0.975));
            match names.get(index) {
                // Of several axes that stand still, one does not seem to more often than a single one.
                Some(_) => squares += end(&lows, 0.025 / names.len() as f64).powi(2),
                None => low = low.min(squares.sqrt()),
            }
            let (symbol, about) = match names.get(index) {
                Some(_) => ("drift", "range of the displacement over the test (ISO 230-3)"),
                None => ("combined-drift", "root of the sum of the squares of the axes' ranges"),
            };
            let uncertainty = Some(of_interval([low, high], DRAWS));
            let of = names.get(index).map(|name| (*name).to_owned());
            let alone = match test.axes.get(index) {
                Some(axis) => axis.alone(&test.times_min),
                None => test.axes.iter().find_map(|axis| axis.alone(&test.times_min)),
            };
            let value = Value { of, uncertainty, ..Value::new(symbol, value, f64::NAN, "um", about) };
            values.push(value.refuted_by(alone).key());
        }
        for axis in &test.axes {
            remarks.extend((axis.left_out > 0).then(|| {
                format!(
                    "readings of {} that are far from the others of their window, and left out: {}",
                    axis.name, axis.left_out
                )
            }));
            values.extend(self.stability(test, axis, remarks));
        }
        values
    }

    /// From when on an axis is stable; nothing where it is not. Noise moves the band by [`AT_MOST`] of its standard deviations at most, and
    /// smoothing moves a step by its windows.
    fn stability(&self, test: &Test, axis: &Axis, remarks: &mut Vec<String>) -> Option<Value> {
        let band_um = self.0.stable_um.unwrap_or(STABLE * range(&axis.smooth));
        let Some(after) = stable_after(&axis.smooth, band_um) else {
            remarks.push(format!(
                "{} is not stable within the test: in its last tenth it leaves {band_um:.3} µm; record for longer, or state a larger `stable_um`",
                axis.name
            ));
            return None;
        };
        let last = test.times_min.len() - 1;
        let minutes = |place: usize| test.times_min[place.min(last)] - test.times_min[0];
        let noise_um = AT_MOST * axis.noise_um / ((2 * BESIDE + 1) as f64).sqrt() + axis.rounding_um;
        let at = |band_um: f64| stable_after(&axis.smooth, band_um);
        let earliest = at(band_um + noise_um).unwrap_or(after).saturating_sub(BESIDE + 1);
        let latest = at(band_um - noise_um).unwrap_or(last) + 1;
        let put_right = axis.put_right();
        let moved = stable_after(&put_right.smooth, band_um).filter(|other| !(earliest..=latest).contains(other));
        let alone = moved.map(|other| {
            format!(
                "without windows that are unlike those beside them, {} is stable after {:.1} min",
                axis.name,
                minutes(other)
            )
        });
        let about =
            "time from which on the axis stays within the band about its last position (criterion of this program)";
        let uncertainty = Some(of_interval([minutes(earliest), minutes(latest)], 0));
        let value = Value::new("stable-after", minutes(after), f64::NAN, "min", about);
        Some(Value { uncertainty, ..value }.refuted_by(alone).of(axis.name))
    }
}

/// What is known of a value by its interval.
fn of_interval(interval_95: [f64; 2], draws: usize) -> Uncertainty {
    Uncertainty::new((interval_95[1] - interval_95[0]) / (2.0 * NORMAL_95), interval_95, draws)
}

/// The axes' ranges, and the root of the sum of their squares.
fn with_combined(mut ranges: Vec<f64>) -> Vec<f64> {
    ranges.push(ranges.iter().map(|range| range * range).sum::<f64>().sqrt());
    ranges
}

struct Test {
    times_min: Vec<f64>,
    axes: Vec<Axis>,
    temperatures: Option<Vec<f64>>,
    /// Windows without readings, or with few, and all.
    empty: [usize; 2],
}

impl Test {
    fn of(points: &Points, window_s: f64) -> Result<Self> {
        let refuse = |problem: String, help: &str| {
            let object = points.input.display().to_string();
            Error::new("evaluate the drift", object, problem).of(ErrorKind::InsufficientData).help(help)
        };
        let times_s = points.column("time_s")?;
        if times_s.windows(2).any(|pair| pair[1] < pair[0]) {
            return Err(refuse("the time runs back".into(), "sort the rows by `time_s`, and give one test a file"));
        }
        let start_s = times_s.first().copied().unwrap_or_default();
        let window = |time_s: f64| ((time_s - start_s) / window_s).floor() as i64;
        let blocks: Vec<&[f64]> = times_s.chunk_by(|a, b| window(*a) == window(*b)).collect();
        let mut counts: Vec<usize> = blocks.iter().map(|block| block.len()).collect();
        counts.sort_unstable();
        let usual = counts.get(counts.len() / 2).copied().unwrap_or_default();
        let is_filled = |block: &&[f64]| block.len() as f64 >= FILLED * usual as f64;
        let filled = blocks.iter().filter(|block| is_filled(block)).count();
        // A last window that the test only begins is none.
        let all = times_s.last().map_or(0, |last| window(*last)) + i64::from(blocks.last().is_some_and(is_filled));
        let mut steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        if let Some(step_s) = steps.get(steps.len() / 2).filter(|step_s| **step_s > window_s) {
            let problem = format!("a window of {window_s} s is shorter than the time between readings, {step_s} s");
            return Err(refuse(problem, "state a longer `window_s`"));
        }
        if filled < FEWEST_MEANS {
            let problem = format!("{filled} means over {window_s} s, expected at least {FEWEST_MEANS}");
            return Err(refuse(problem, "record for longer, or state a shorter `window_s`"));
        }
        let windows = |column: &[f64]| -> (Vec<f64>, usize) {
            let mut rest = column;
            let mut windows = Vec::with_capacity(blocks.len());
            for block in &blocks {
                let (own, after) = rest.split_at(block.len());
                windows.extend(is_filled(block).then_some(own));
                rest = after;
            }
            levels(&windows)
        };
        let axes: Vec<Axis> = AXES
            .iter()
            .filter_map(|(column, name)| {
                let readings = points.column(column).ok()?;
                let (means, left_out) = windows(readings);
                Some(Axis { left_out, ..Axis::new(name, means, rounding_of(readings)) })
            })
            .collect();
        if axes.is_empty() {
            let known = AXES.map(|(column, _)| column).join(", ");
            return Err(refuse(format!("it has none of {known}"), "name the columns of displacements so in [load]"));
        }
        let times_min = windows(times_s).0.into_iter().map(|time_s| (time_s - start_s) / 60.0).collect();
        let temperatures = points.column(TEMPERATURE).ok().map(|column| windows(column).0);
        let all = usize::try_from(all).unwrap_or_default();
        Ok(Self { times_min, axes, temperatures, empty: [all.saturating_sub(filled), all] })
    }

    /// What is said of windows without readings.
    fn gap(&self) -> Option<String> {
        let [empty, all] = self.empty;
        (empty > 0).then(|| format!("{empty} of {all} windows have no reading, or less than half of the others': they are left out, and what the axes did there is in no value"))
    }

    fn tables(&self) -> Result<Vec<TableRows>> {
        let count = self.times_min.len();
        let spec = drift_table();
        let first = |axis: &Axis| axis.means.first().copied().unwrap_or_default();
        let rows = spec.rows(vec![
            stretches(self.axes.iter().map(|axis| (axis.name, count))),
            numbers(self.axes.iter().flat_map(|_| self.times_min.iter().copied())),
            numbers(self.axes.iter().flat_map(|axis| axis.means.iter().map(|mean| mean - first(axis)))),
            numbers(self.axes.iter().flat_map(|axis| std::iter::repeat_n(axis.noise_um, count))),
        ])?;
        let mut tables = vec![TableRows { table: spec.name, rows }];
        if let Some(temperatures) = &self.temperatures {
            let spec = temperature_table();
            let columns = vec![numbers(self.times_min.iter().copied()), numbers(temperatures.iter().copied())];
            tables.push(TableRows { rows: spec.rows(columns)?, table: spec.name });
        }
        Ok(tables)
    }
}

fn drift_table() -> TableSpec {
    TableSpec::new(
        "drift",
        "displacement of each axis over time, averaged over windows",
        vec![
            ColumnSpec::name("axis", "X, Y or Z"),
            ColumnSpec::number("time_min", "min", "time since the first reading").repeating(),
            ColumnSpec::number("drift_um", "um", "displacement less that of the first mean"),
            ColumnSpec::number("std_um", "um", "noise of a mean").repeating(),
        ],
    )
    .figure(
        Figure::lines("drift", "Thermal drift", "time_min", [Measure::new("drift_um").with_std("std_um")])
            .curves(["axis"]),
    )
}

fn temperature_table() -> TableSpec {
    TableSpec::new(
        "temperature",
        "temperature over time, averaged over the same windows",
        vec![
            ColumnSpec::number("time_min", "min", "time since the first reading").repeating(),
            ColumnSpec::number("temperature_degc", "degC", "temperature"),
        ],
    )
    .optional()
    .figure(Figure::lines("temperature", "Temperature", "time_min", [Measure::new("temperature_degc")]))
}
