//! The separator `probing`: performance of a touch-trigger probe on a machine tool, from touches (ISO 230-10).
//!
//! | object | symbol | value |
//! | --- | --- | --- |
//! | `point` | `R_SPT` of each axis | range of repeated touches of one point along this axis (single-point probing repeatability) |
//! | `ring` | `P_FTU,2D` | range of the radial distances of the touches from the centre of the least-squares circle |
//! | `sphere` | `P_FTU,3D` | the same of the least-squares sphere |
//! | `ring`, `sphere` with `tool_changed` | `R_PTL` of each axis | range of the centre over sets between which the probe was changed in the spindle |
//!
//! A range of noise grows with the number of touches, and the value is that of as many as the test has: the interval is for the range that so many touches have on average.
//! Of several sets `P_FTU` is the mean. With one set nothing shows its uncertainty.

mod ball;
mod range;

use runout_core::{
    Error, ErrorKind, Result,
    consistency::groups::{Level, alike},
    draws::{Draw, MeasuredAgain, Truth, seed, without_noise},
    fault::Fault,
    pipeline::{Context, StageConfig},
    points::{
        PointColumn,
        PointKind::{Label, Number},
        Points,
        measured::unlike_units,
    },
    stage::{Outcome, PointSeparator, Separator},
    summary::Value,
    table::{ColumnSpec, Figure, Measure, TableRows, TableSpec, numbers, texts},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    draws::{Computed, with_uncertainty},
    repeated::{Said, in_order},
    runs::mean,
};
use ball::Touches;
pub(crate) use ball::range;
use range::of_range;

/// Touches of a sphere that the standard asks for.
const ON_SPHERE: usize = 25;
/// Fewest numbers whose range says something.
const FEWEST: usize = 3;
/// Sets of touches drawn for the mean range of one.
const SETS: usize = 30;
/// Length of the mean direction of the touches from which on they are on one side only.
const LOPSIDED: f64 = 0.75;
/// `[separate] plugin = "probing"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbingConfig {
    /// What was touched.
    pub object: Object,
    /// Whether the probe was changed in the spindle between sets (ring and sphere): the centre of each set is then evaluated too.
    #[serde(default)]
    pub tool_changed: bool,
}

/// What was touched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Object {
    /// One point of a plane in each axis, several times.
    Point,
    /// A ring gauge, all around.
    Ring,
    /// A sphere, from all sides that the probe reaches.
    Sphere,
}

impl StageConfig for ProbingConfig {
    type Stage = Separator;

    const NAME: &'static str = "probing";
    const ABOUT: &'static str = "performance of a probe on a machine tool by ISO 230-10: P_FTU of a sphere or a ring, repeatability R_SPT and R_PTL";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        if self.tool_changed && self.object == Object::Point {
            let message = "the centre of a point is not known: `tool_changed` is for a ring or a sphere";
            return Err(Fault::at("tool_changed", message));
        }
        Ok(Separator::Points(Box::new(Probing(self))))
    }
}

struct Probing(ProbingConfig);

const AXES: [(&str, &str); 3] = [("x_mm", "X"), ("y_mm", "Y"), ("z_mm", "Z")];

impl Probing {
    fn axes(&self) -> &'static [(&'static str, &'static str)] {
        if self.0.object == Object::Ring { &AXES[..2] } else { &AXES }
    }

    fn form(&self) -> (&'static str, &'static str) {
        match self.0.object {
            Object::Ring => (
                "P_FTU,2D",
                "2D probing error: range of the radial distances from the least-squares circle (ISO 230-10)",
            ),
            _ => (
                "P_FTU,3D",
                "3D probing error: range of the radial distances from the least-squares sphere (ISO 230-10)",
            ),
        }
    }
}

impl PointSeparator for Probing {
    fn columns(&self) -> Vec<PointColumn> {
        if self.0.object == Object::Point {
            return vec![
                PointColumn::needed("axis", Label, "", "the axis along which the point was touched: X, Y, Z, or X+ …"),
                PointColumn::needed("deviation_um", Number, "um", "place of the touch less the nominal one").measured(),
            ];
        }
        let place = |(name, _): &(&'static str, &'static str)| {
            // A coordinate along a circle of latitude is the same at each touch.
            PointColumn::needed(name, Number, "mm", "place of the stylus tip at the touch")
        };
        let mut columns: Vec<PointColumn> = self.axes().iter().map(place).collect();
        columns.push(PointColumn::optional("repeat", Number, "", "number of the set of touches; without it one set"));
        columns
    }

    fn tables(&self) -> Vec<TableSpec> {
        if self.0.object == Object::Point { vec![points_table()] } else { vec![touches_table()] }
    }

    fn symbols(&self) -> Vec<(&'static str, &'static str)> {
        match self.0.object {
            Object::Point => vec![("R_SPT", "um")],
            _ => vec![(self.form().0, "um"), ("R_PTL", "um")],
        }
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        if self.0.object == Object::Point { single_points(points) } else { self.sets(points) }
    }
}

fn refuse(points: &Points, problem: String, help: &str) -> Error {
    Error::new("evaluate", points.input.display().to_string(), problem)
        .of(ErrorKind::InsufficientData)
        .help(help.to_owned())
}

/// The range of numbers as a value, with its interval.
fn range_value(symbol: &str, of: &str, about: &str, numbers: &[f64], said: &mut Said) -> Value {
    let known = of_range(range(numbers), numbers.len(), seed(&["probing", symbol, of]));
    let value = Value::new(symbol, range(numbers), f64::NAN, "um", about).of(of).key();
    if known.is_none() {
        said.remarks.push(format!(
            "{symbol} of {of}: all {} are equal: copies, or too coarse a resolution, show no uncertainty",
            numbers.len()
        ));
    }
    said.checks.extend(in_order("the touches", &[(of, numbers)], "µm").into_iter().map(|check| check.within(symbol)));
    Value { uncertainty: known, ..value }
}

impl Probing {
    fn sets(&self, points: &Points) -> Result<Outcome> {
        let names: Vec<&str> = self.axes().iter().map(|(name, _)| *name).collect();
        let touches = Touches::of(points, &names)?;
        let mut said = Said::default();
        let mut values = vec![self.form_value(&touches, &mut said)];
        if self.0.tool_changed {
            if touches.sets.len() < FEWEST {
                let problem = format!("expected at least {FEWEST} sets of touches, found {}", touches.sets.len());
                return Err(refuse(
                    points,
                    problem,
                    "change the probe in the spindle between sets, and number them in `repeat`",
                ));
            }
            for (index, (_, axis)) in self.axes().iter().enumerate() {
                let first = touches.sets[0].centre_mm[index];
                let centres: Vec<f64> = touches.sets.iter().map(|set| 1e3 * (set.centre_mm[index] - first)).collect();
                let about =
                    "probing-tool location repeatability: range of the centre over changes of the probe (ISO 230-10)";
                values.push(range_value("R_PTL", axis, about, &centres, &mut said));
            }
        }
        let count = touches.sets[0].deviations_um.len();
        if self.0.object == Object::Sphere && count < ON_SPHERE {
            said.remarks
                .push(format!("{count} touches of a sphere: P_FTU,3D is of {ON_SPHERE}; fewer find less of the form"));
        }
        if touches.lopsidedness() > LOPSIDED {
            let of = if self.0.object == Object::Sphere { "a cap of the sphere" } else { "an arc of the ring" };
            said.remarks.push(format!(
                "the touches are on {of} alone: the form beyond it is in no value, and the value is too small"
            ));
        }
        let notes = vec![format!("{} sets of {count} touches", touches.sets.len())];
        let outcome = Outcome {
            convention: "a deviation is the distance of a touch from the centre of its set less the mean radius".into(),
            tables: vec![rows(&touches)?],
            values,
            checks: said.checks,
            remarks: said.remarks,
            notes,
            ..Outcome::default()
        };
        Ok(outcome.refuted())
    }

    /// The range of radial distances, mean over the sets.
    fn form_value(&self, touches: &Touches, said: &mut Said) -> Value {
        let (symbol, about) = self.form();
        let count = touches.sets.len();
        let ranges: Vec<f64> = touches.sets.iter().map(ball::Set::range_um).collect();
        let value = mean(&ranges);
        let plain = Value::new(symbol, value, f64::NAN, "um", about).key();
        if count < 2 {
            said.remarks.push("one set of touches: nothing shows its uncertainty; repeat it at the same places, and number the sets in `repeat`".into());
            return plain;
        }
        let noise = touches.noise_um();
        let squares: f64 = noise.iter().flatten().map(|one| one * one).sum();
        let freedom = touches.freedom();
        let std = (squares / freedom as f64).sqrt();
        // What two fits of copies differ by is rounding.
        if std < 1e-9 * value.max(1e-3) {
            said.remarks.push("the sets are identical: copies show no uncertainty".into());
            return plain;
        }
        said.checks.extend(touches.copies(1e-9 * value.max(1e-3)));
        let sizes = touches.sets.iter().zip(&ranges).map(|(set, range)| (format!("set {}", set.number), *range));
        said.checks.extend(unlike_units(&sizes.collect::<Vec<(String, f64)>>(), "convert their file"));
        let names: Vec<String> = (1..=count).map(|set| format!("touch of set {set}:")).collect();
        let of_sets: Vec<(&str, &[f64])> =
            names.iter().map(String::as_str).zip(noise.iter().map(Vec::as_slice)).collect();
        said.checks.extend(in_order("the touches of a set", &of_sets, "µm"));
        let copied = "its touches are copies, or it was not touched";
        said.checks.extend(alike("sides", &touches.sides(), Level::Others, copied));
        said.checks.extend(in_order("the sets", &[("range of set", &ranges)], "µm"));
        let means = touches.means_um();
        let power = means.iter().map(|one| one * one).sum::<f64>() / (means.len() - touches.fit.rank()) as f64;
        let share = without_noise(power, std * std / count as f64);
        let least: Vec<f64> = means.iter().map(|one| share * one).collect();
        let one_set = |means: &[f64], std: f64, draw: &mut Draw| {
            let mut set: Vec<f64> = means.iter().map(|one| one + std * draw.normal()).collect();
            touches.fit.remove_from(&mut set);
            range(&set)
        };
        let measure = |truth: Truth, draw: &mut Draw| {
            let std = std * draw.true_std_ratio(freedom);
            let means: Vec<f64> = match truth {
                Truth::Least => least.clone(),
                Truth::Most => means.clone(),
                Truth::Hidden => means.iter().map(|one| one + std / (count as f64).sqrt() * draw.normal()).collect(),
            };
            let mut mean_of = |sets: usize| (0..sets).map(|_| one_set(&means, std, draw)).sum::<f64>() / sets as f64;
            let truth = mean_of(SETS);
            MeasuredAgain { error: vec![mean_of(count) - truth], truth: vec![truth] }
        };
        let computed = [Computed { symbol: symbol.into(), value, about, is_key: true, least: 0.0 }];
        with_uncertainty(&computed, "um", seed(&["probing", symbol]), measure).pop().unwrap_or(plain)
    }
}

fn single_points(points: &Points) -> Result<Outcome> {
    let labels = points.labels("axis").unwrap_or_default();
    let deviations = points.column("deviation_um")?;
    let mut ids: Vec<&String> = labels.iter().collect();
    ids.sort();
    ids.dedup();
    let (mut values, mut said) = (Vec::new(), Said::default());
    let mut each: Vec<(&str, usize, f64)> = Vec::new();
    for id in ids {
        let of: Vec<f64> =
            labels.iter().zip(deviations).filter(|(label, _)| *label == id).map(|(_, one)| *one).collect();
        if of.len() < FEWEST {
            let problem = format!("expected at least {FEWEST} touches along {id}, found {}", of.len());
            return Err(refuse(points, problem, "touch one point ten times along each axis"));
        }
        let about = "single-point probing repeatability: range of the touches (ISO 230-10)";
        values.push(range_value("R_SPT", id, about, &of, &mut said));
        each.extend(of.iter().enumerate().map(|(touch, one)| (id.as_str(), touch + 1, *one)));
    }
    if values.is_empty() {
        return Err(refuse(points, "there is no touch".into(), "each row is a touch"));
    }
    let spec = points_table();
    let rows = spec.rows(vec![
        texts(each.iter().map(|(id, ..)| *id)),
        numbers(each.iter().map(|(_, touch, _)| *touch as f64)),
        numbers(each.iter().map(|(.., deviation)| *deviation)),
    ])?;
    let outcome = Outcome {
        convention: "a range is of as many touches as there are".into(),
        tables: vec![TableRows { table: spec.name, rows }],
        values,
        checks: said.checks,
        remarks: said.remarks,
        ..Outcome::default()
    };
    Ok(outcome.refuted())
}

fn points_table() -> TableSpec {
    TableSpec::new(
        "probing_points",
        "touches of one point along each axis",
        vec![
            ColumnSpec::name("axis", "the axis along which the point was touched"),
            ColumnSpec::number("touch", "", "number of the touch").repeating(),
            ColumnSpec::number("deviation_um", "um", "place of the touch less the nominal one"),
        ],
    )
    .figure(
        Figure::lines("probing-points", "Touches of a point", "touch", [Measure::new("deviation_um")]).curves(["axis"]),
    )
}

fn touches_table() -> TableSpec {
    TableSpec::new(
        "probing",
        "radial deviation at each place that was touched, from the centre of its set",
        vec![
            ColumnSpec::number("touch", "", "number of the place").repeating(),
            ColumnSpec::number("to_x", "", "direction of the place from the centre, along x"),
            ColumnSpec::number("to_y", "", "direction of the place from the centre, along y"),
            ColumnSpec::number("to_z", "", "direction of the place from the centre, along z; 0 of a ring"),
            ColumnSpec::number("mean_um", "um", "radial deviation, mean over the sets"),
            ColumnSpec::number("low_um", "um", "smallest of the sets"),
            ColumnSpec::number("high_um", "um", "largest of the sets"),
        ],
    )
    .figure(Figure::lines(
        "probing",
        "Probing error",
        "touch",
        [
            Measure::new("mean_um").with_symbol("mean"),
            Measure::new("low_um").with_symbol("lowest"),
            Measure::new("high_um").with_symbol("highest"),
        ],
    ))
}

fn rows(touches: &Touches) -> Result<TableRows> {
    let spec = touches_table();
    let first = &touches.sets[0];
    let along = |axis: usize| numbers(first.directions.iter().map(move |to| to.get(axis).copied().unwrap_or(0.0)));
    let end = |of: fn(f64, f64) -> f64| {
        let place =
            move |place: usize| touches.sets.iter().map(|set| set.deviations_um[place]).reduce(of).unwrap_or(f64::NAN);
        numbers((0..first.deviations_um.len()).map(place))
    };
    let rows = spec.rows(vec![
        numbers((0..first.directions.len()).map(|touch| touch as f64 + 1.0)),
        along(0),
        along(1),
        along(2),
        numbers(touches.means_um()),
        end(f64::min),
        end(f64::max),
    ])?;
    Ok(TableRows { table: spec.name, rows })
}
