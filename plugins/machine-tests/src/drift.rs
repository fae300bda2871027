//! The separator `drift`: thermal drift of a spindle or a machine over hours (ISO 230-3, the tests with a recording over time).
//!
//! | symbol | value |
//! | --- | --- |
//! | `drift` | of each axis: range of its displacement over the test |
//! | `combined-drift` | root of the sum of the squares of the axes' ranges |
//! | `stable-after` | time from which on an axis stays within `stable_um` of where it is in the last tenth of the test |
//!
//! Range and combination are those of a maker of spindle analysers (Lion Precision, *SpindleCheck*, manual M017-7500.004, page 29, which names
//! ISO 230-3); the criterion of stability is this program's. Displacements are means over `window_s`. Their noise is what second differences of
//! neighbouring means show, which a slow drift has not.

use runout_core::{
    Error, ErrorKind, Result,
    draws::seed,
    fault::Fault,
    pipeline::{Context, StageConfig},
    points::{PointColumn, PointKind::Number, Points},
    stage::{Outcome, PointSeparator, Separator},
    summary::Value,
    table::{ColumnSpec, Figure, Measure, TableRows, TableSpec, numbers, stretches},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::draws::{Computed, Draw, Machine, with_uncertainty};

/// Means that a test has at least: fewer show neither their noise nor a course.
const FEWEST_MEANS: usize = 20;
/// Share of the test at its end that says where an axis is.
const END: f64 = 0.1;
/// Share of an axis's own range that is stable where no length is stated.
const STABLE: f64 = 0.1;
/// Means on each side of one that stability is looked at over.
const BESIDE: usize = 2;
/// Share of the test on each side of a mean that a course without noise is a mean over: what noise raises a range by is largest there.
const WIDE: f64 = 0.025;
/// What a mean of second differences has of the variance of single means: 1 + 1/4 + 1/4.
const OF_SECOND_DIFFERENCES: f64 = 1.5;

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
    PointColumn::optional("x_um", Number, "um", "displacement along X"),
    PointColumn::optional("y_um", Number, "um", "displacement along Y"),
    PointColumn::optional("z_um", Number, "um", "displacement along Z"),
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
        let mut remarks = Vec::new();
        let mut values = self.values(&test, &mut remarks);
        if let Some(temperatures) = &test.temperatures {
            let about = "range of the temperature over the test, as recorded";
            values.push(Value::new("temperature-range", range(temperatures), f64::NAN, "K", about));
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
        let seed = seed(&["drift", &names.join("")]);
        let ranges = |courses: &[Vec<f64>]| -> Vec<f64> {
            let mut ranges: Vec<f64> = courses.iter().map(|course| range(course)).collect();
            ranges.push(ranges.iter().map(|range| range * range).sum::<f64>().sqrt());
            ranges
        };
        let found = test.courses(Machine::Most);
        let computed = |(index, value): (usize, f64)| {
            let is_axis = index < names.len();
            let (symbol, about) = if is_axis {
                ("drift", "range of the displacement over the test (ISO 230-3)")
            } else {
                ("combined-drift", "root of the sum of the squares of the axes' ranges")
            };
            Computed { symbol: symbol.into(), value, about, is_key: true, least: 0.0 }
        };
        let all: Vec<Computed> = ranges(&found).into_iter().enumerate().map(computed).collect();
        let error = |machine: Machine, draw: &mut Draw| {
            let of_machine = test.courses(machine);
            let again = test.again(&of_machine, draw);
            ranges(&again).iter().zip(ranges(&of_machine)).map(|(again, truth)| again - truth).collect()
        };
        let mut values: Vec<Value> = with_uncertainty(&all, "um", seed, error);
        for (value, name) in values.iter_mut().zip(&names) {
            value.of = Some((*name).to_owned());
        }
        for axis in &test.axes {
            values.extend(self.stability(test, axis, remarks));
        }
        values
    }

    /// From when on an axis is stable; nothing where it is not.
    fn stability(&self, test: &Test, axis: &Axis, remarks: &mut Vec<String>) -> Option<Value> {
        let band_um = self.0.stable_um.unwrap_or(STABLE * range(&axis.smooth));
        let Some(after) = stable_after(&axis.smooth, band_um) else {
            remarks.push(format!(
                "{} is not stable within the test: in its last tenth it leaves {band_um:.3} µm; record for longer, or state a larger `stable_um`",
                axis.name
            ));
            return None;
        };
        let minutes = |place: usize| test.times_min[place] - test.times_min[0];
        let about =
            "time from which on the axis stays within the band about its last position (criterion of this program)";
        let computed =
            Computed { symbol: "stable-after".into(), value: minutes(after), about, is_key: false, least: 0.0 };
        let error = |machine: Machine, draw: &mut Draw| {
            // The smoothed course is the axis; what is measured again is smoothed again.
            let course = if machine == Machine::Most { &axis.smooth } else { &axis.course };
            let again: Vec<f64> = course.iter().map(|one| one + axis.noise_um * draw.normal()).collect();
            let at = |course: &[f64]| minutes(stable_after(course, band_um).unwrap_or(course.len() - 1));
            vec![at(&smoothed(&again, BESIDE)) - at(course)]
        };
        let mut values = with_uncertainty(&[computed], "min", seed(&["stable", axis.name]), error);
        values.pop().map(|value| value.of(axis.name))
    }
}

/// One axis: means over the windows, smoothed a little, and the noise of one.
struct Axis {
    name: &'static str,
    means: Vec<f64>,
    smooth: Vec<f64>,
    /// Smoothed over far more: without noise.
    course: Vec<f64>,
    noise_um: f64,
}

struct Test {
    times_min: Vec<f64>,
    axes: Vec<Axis>,
    temperatures: Option<Vec<f64>>,
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
        if blocks.len() < FEWEST_MEANS {
            let problem = format!("{} means over {window_s} s, expected at least {FEWEST_MEANS}", blocks.len());
            return Err(refuse(problem, "record for longer, or state a shorter `window_s`"));
        }
        let means = |column: &[f64]| -> Vec<f64> {
            let mut rest = column;
            let mut means = Vec::with_capacity(blocks.len());
            for block in &blocks {
                let (own, after) = rest.split_at(block.len());
                means.push(own.iter().sum::<f64>() / own.len() as f64);
                rest = after;
            }
            means
        };
        let axes: Vec<Axis> = AXES
            .iter()
            .filter_map(|(column, name)| {
                let means = means(points.column(column).ok()?);
                let wide = ((WIDE * means.len() as f64) as usize).max(BESIDE);
                let (smooth, course) = (smoothed(&means, BESIDE), smoothed(&means, wide));
                Some(Axis { name, smooth, course, noise_um: noise_of(&means), means })
            })
            .collect();
        if axes.is_empty() {
            let known = AXES.map(|(column, _)| column).join(", ");
            return Err(refuse(format!("it has none of {known}"), "name the columns of displacements so in [load]"));
        }
        let times_min = means(times_s).into_iter().map(|time_s| (time_s - start_s) / 60.0).collect();
        let temperatures = points.column(TEMPERATURE).ok().map(means);
        Ok(Self { times_min, axes, temperatures })
    }

    /// The axes of the machine that is measured again: with the noise of its means, or smoothed.
    fn courses(&self, machine: Machine) -> Vec<Vec<f64>> {
        let of = |axis: &Axis| if machine == Machine::Most { axis.means.clone() } else { axis.course.clone() };
        self.axes.iter().map(of).collect()
    }

    /// Courses with the noise of means.
    fn again(&self, courses: &[Vec<f64>], draw: &mut Draw) -> Vec<Vec<f64>> {
        let mut with = |(course, axis): (&Vec<f64>, &Axis)| -> Vec<f64> {
            course.iter().map(|one| one + axis.noise_um * draw.normal()).collect()
        };
        courses.iter().zip(&self.axes).map(&mut with).collect()
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

fn range(course: &[f64]) -> f64 {
    let ends = |(low, high): (f64, f64), one: &f64| (low.min(*one), high.max(*one));
    let (low, high) = course.iter().fold((f64::INFINITY, f64::NEG_INFINITY), ends);
    high - low
}

/// Means over neighbours on both sides.
fn smoothed(means: &[f64], beside: usize) -> Vec<f64> {
    let around = |place: usize| {
        let beside = beside.min(place).min(means.len() - 1 - place);
        let own = &means[place - beside..=place + beside];
        own.iter().sum::<f64>() / own.len() as f64
    };
    (0..means.len()).map(around).collect()
}

/// Standard deviation of the noise of means, from their second differences.
fn noise_of(means: &[f64]) -> f64 {
    let differences = means.windows(3).map(|three| three[1] - 0.5 * (three[0] + three[2]));
    let squares: f64 = differences.map(|difference| difference * difference).sum();
    (squares / (OF_SECOND_DIFFERENCES * means.len().saturating_sub(2).max(1) as f64)).sqrt()
}

/// The first place from which on a course stays within a band about its mean over the last tenth; nothing where it leaves it there.
fn stable_after(course: &[f64], band_um: f64) -> Option<usize> {
    let end = course.len() - ((END * course.len() as f64) as usize).max(1);
    let last = course[end..].iter().sum::<f64>() / (course.len() - end) as f64;
    let after = course.iter().rposition(|one| (one - last).abs() > band_um).map_or(0, |place| place + 1);
    (after <= end).then_some(after)
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
