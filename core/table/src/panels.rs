//! Rows of a table as the panels and curves of a figure, for whatever draws them.

mod grid;

use std::collections::HashMap;

use arrow_array::{Array, Float64Array, RecordBatch, StringArray, UInt32Array, cast::AsArray, types::Float64Type};
use runout_error::{Error, Result};

use crate::{
    TableSpec,
    figure::{Drawing, Figure, Measure},
};
pub use grid::{Cells, Grid};

/// The rows of one figure, collected while they come.
pub struct Panels {
    /// Id of the figure.
    pub id: String,
    /// Its title, without units.
    pub title: String,
    /// Name of its table.
    pub table: String,
    /// How curves are drawn.
    pub kind: Kind,
    /// What is along the horizontal axis, and along the vertical one.
    pub axes: [Axis; 2],
    /// The panels that are kept, in the order in which they came.
    pub drawn: Vec<Panel>,
    /// Panels that there were.
    numbers: HashMap<String, usize>,
    /// Each so many of them are kept.
    stride: usize,
    most: usize,
    panel_columns: Vec<String>,
    curve_columns: Vec<String>,
    only: Option<(String, Vec<String>)>,
    values: Vec<Source>,
    height: Axis,
}

/// How curves are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Deviations about a reference circle.
    Polar,
    /// Over a common axis.
    Lines,
    /// Absolute values over the order.
    Amplitudes,
    /// Heights over a rectangle.
    Map,
}

/// What an axis shows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Axis {
    /// Its name, without the unit.
    pub name: String,
    /// Its unit; empty for what has none.
    pub unit: String,
}

/// Curves of one combination of names.
pub struct Panel {
    number: usize,
    /// The names, joined; empty where the figure has one panel.
    pub name: String,
    /// Its curves.
    pub curves: Vec<Curve>,
}

/// Points that are joined.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curve {
    /// Its name in the legend; empty where the panel has one curve.
    pub name: String,
    /// Its points.
    pub points: Vec<Point>,
    /// Places along the horizontal axis without a value: of amplitudes the lost orders.
    pub missing: Vec<f64>,
}

/// A point of a curve, or a cell of a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Along the horizontal axis.
    pub x: f64,
    /// Along the vertical axis, or the deviation from the reference circle.
    pub y: f64,
    /// Standard uncertainty of y, NaN where there is none; of a map the height.
    pub third: f64,
}

/// Where the numbers of a curve are: x, y, and the third number.
struct Source {
    /// Name of the curve among those of its rows; empty where there is one only.
    name: String,
    x: String,
    y: [Option<String>; 2],
    third: Option<String>,
}

impl Panels {
    /// None yet; of more than `most` panels, those at equal distances are kept.
    ///
    /// # Errors
    /// When the figure names a column that the table lacks.
    pub fn new(table: &TableSpec, figure: &Figure, most: usize) -> Result<Self> {
        let missing = |column: &str| {
            Error::new(
                "draw",
                format!("the figure {}", figure.id),
                format!("the table {} has no column {column}", table.name),
            )
        };
        if let Some(column) = figure.columns().into_iter().find(|column| table.column(column).is_none()) {
            return Err(missing(column));
        }
        let axis = |column: &str| {
            let unit = table.column(column).map_or("", |column| &column.unit);
            Axis { name: without_unit(column, unit), unit: unit.to_owned() }
        };
        let values_axis = |values: &[Measure]| match values {
            [one] => axis(&one.column),
            several => {
                Axis { name: String::new(), ..several.first().map_or_else(|| axis(""), |one| axis(&one.column)) }
            }
        };
        let (kind, axes, values) = match &figure.drawing {
            Drawing::Polar { angle_deg: x, values } => {
                (Kind::Polar, [axis(x), values_axis(values)], curves(x, values, &axis))
            }
            Drawing::Lines { x, values } => (Kind::Lines, [axis(x), values_axis(values)], curves(x, values, &axis)),
            Drawing::Amplitudes { order, parts: [real, imaginary], std } => {
                let y = [Some(real.clone()), Some(imaginary.clone())];
                let source = Source { name: String::new(), x: order.clone(), y, third: std.clone() };
                // Coefficients of several quantities share a column; its unit begins with that of form.
                let unit = axis(real).unit.split(';').next().unwrap_or_default().to_owned();
                let amplitude = Axis { name: "amplitude".into(), unit };
                (Kind::Amplitudes, [axis(order), amplitude], vec![source])
            }
            Drawing::Map { x, y, value } => {
                let source = Source {
                    name: value.clone(),
                    x: x.clone(),
                    y: [Some(y.clone()), None],
                    third: Some(value.clone()),
                };
                (Kind::Map, [axis(x), axis(y)], vec![source])
            }
        };
        let height = match &figure.drawing {
            Drawing::Map { value, .. } => axis(value),
            _ => axis(""),
        };
        Ok(Self {
            height,
            id: figure.id.clone(),
            title: figure.title.clone(),
            table: table.name.clone(),
            kind,
            axes,
            drawn: Vec::new(),
            numbers: HashMap::new(),
            stride: 1,
            most,
            panel_columns: figure.panels.clone(),
            curve_columns: figure.curves.clone(),
            only: figure.only.clone(),
            values,
        })
    }

    /// Panels that there were, drawn or not.
    #[must_use]
    pub fn count(&self) -> usize {
        self.numbers.len()
    }

    /// Axis of the heights of a map.
    #[must_use]
    pub fn height(&self) -> &Axis {
        &self.height
    }

    /// A factor for the vertical axis and the unit that it gives: nm and nrad where µm and µrad have no digits left of 0.1.
    #[must_use]
    pub fn scaled(&self) -> (f64, &str) {
        let unit = self.axes[1].unit.as_str();
        let points = self.drawn.iter().flat_map(|panel| &panel.curves).flat_map(|curve| &curve.points);
        let largest = points.map(|point| point.y.abs()).fold(0.0, f64::max);
        let small = largest > 0.0 && largest < 0.1;
        match unit {
            "um" if small && self.kind != Kind::Map => (1e3, "nm"),
            "urad" if small && self.kind != Kind::Map => (1e3, "nrad"),
            _ => (1.0, unit),
        }
    }

    /// Takes rows of the table.
    pub fn add(&mut self, rows: &RecordBatch) {
        let names = |columns: &[String]| columns.iter().map(|column| Names::of(rows, column)).collect::<Vec<_>>();
        let (panel_names, curve_names) = (names(&self.panel_columns), names(&self.curve_columns));
        let only = self.only.as_ref().map(|(column, names)| (Names::of(rows, column), names.clone()));
        let columns: Vec<[Option<Numbers>; 4]> = self.values.iter().map(|value| value.columns(rows)).collect();
        let mut last: Option<(String, String)> = None;
        let mut at: Option<(usize, usize)> = None;
        for row in 0..rows.num_rows() {
            if only.as_ref().is_some_and(|(column, names)| names.iter().all(|name| column.get(row) != name)) {
                continue;
            }
            let key = (joined(&panel_names, row), joined(&curve_names, row));
            if last.as_ref() != Some(&key) {
                at = self.place(&key.0, &key.1);
                last = Some(key);
            }
            let Some((panel, first)) = at else { continue };
            for (offset, columns) in columns.iter().enumerate() {
                let number = |column: &Option<Numbers>| column.as_ref().map_or(f64::NAN, |column| column.get(row));
                let [x, y, second, third] =
                    [number(&columns[0]), number(&columns[1]), number(&columns[2]), number(&columns[3])];
                let y = if columns[2].is_some() { y.hypot(second) } else { y };
                let curve = &mut self.drawn[panel].curves[first + offset];
                if x.is_finite() && y.is_finite() {
                    curve.points.push(Point { x, y, third });
                } else if x.is_finite() {
                    curve.missing.push(x);
                }
            }
        }
    }

    /// The panel of these names and its first curve; none where the panel is not kept.
    fn place(&mut self, panel: &str, curve: &str) -> Option<(usize, usize)> {
        let next = self.numbers.len();
        let number = *self.numbers.entry(panel.to_owned()).or_insert(next);
        if !number.is_multiple_of(self.stride) {
            return None;
        }
        let known = self.drawn.iter().position(|known| known.number == number);
        let index = if let Some(index) = known {
            index
        } else {
            if self.drawn.len() == self.most {
                self.stride *= 2;
                let stride = self.stride;
                self.drawn.retain(|panel| panel.number % stride == 0);
                if !number.is_multiple_of(stride) {
                    return None;
                }
            }
            self.drawn.push(Panel { number, name: panel.to_owned(), curves: Vec::new() });
            self.drawn.len() - 1
        };
        let curves = &mut self.drawn[index].curves;
        let full = |value: &Source| match (curve, value.name.as_str()) {
            ("", name) => name.to_owned(),
            (curve, "") => curve.to_owned(),
            (curve, name) => format!("{curve} {name}"),
        };
        let first = self.values.first().map(&full).unwrap_or_default();
        if let Some(first) = curves.iter().position(|known| known.name == first) {
            return Some((index, first));
        }
        let first = curves.len();
        curves.extend(self.values.iter().map(|value| Curve { name: full(value), ..Curve::default() }));
        Some((index, first))
    }
}

impl Curve {
    /// The curve with its vertical axis scaled: of more than `most` points the lowest and the highest of each of equal
    /// stretches.
    #[must_use]
    pub fn thinned(&self, most: usize, scale: f64) -> Self {
        let stretch = (2 * self.points.len()).div_ceil(most.max(2)).max(1);
        let scaled = |point: Point| Point { x: point.x, y: scale * point.y, third: scale * point.third };
        let mut points = Vec::with_capacity(self.points.len().min(most));
        if stretch <= 2 {
            points.extend(self.points.iter().copied());
        } else {
            for points_of in self.points.chunks(stretch) {
                let by_height = |a: &&Point, b: &&Point| a.y.total_cmp(&b.y);
                let ends = [points_of.iter().min_by(by_height), points_of.iter().max_by(by_height)];
                let mut ends: Vec<Point> = ends.into_iter().flatten().copied().collect();
                ends.sort_by(|a, b| a.x.total_cmp(&b.x));
                points.extend(ends);
            }
        }
        Self { points: points.into_iter().map(scaled).collect(), ..self.clone() }
    }
}

impl Source {
    fn columns<'a>(&self, rows: &'a RecordBatch) -> [Option<Numbers<'a>>; 4] {
        let column = |name: Option<&String>| name.and_then(|name| Numbers::of(rows, name));
        [column(Some(&self.x)), column(self.y[0].as_ref()), column(self.y[1].as_ref()), column(self.third.as_ref())]
    }
}

fn curves(x: &str, values: &[Measure], axis: &dyn Fn(&str) -> Axis) -> Vec<Source> {
    let source = |value: &Measure| Source {
        name: match &value.symbol {
            Some(symbol) => symbol.clone(),
            None if values.len() > 1 => axis(&value.column).name,
            None => String::new(),
        },
        x: x.to_owned(),
        y: [Some(value.column.clone()), None],
        third: value.std.clone(),
    };
    values.iter().map(source).collect()
}

/// `tilt_x_urad` as `tilt x`.
fn without_unit(column: &str, unit: &str) -> String {
    let name = if unit.is_empty() { column } else { column.strip_suffix(&format!("_{unit}")).unwrap_or(column) };
    name.replace('_', " ")
}

/// Names of a row, those that are there.
fn joined(columns: &[Names], row: usize) -> String {
    let names = columns.iter().map(|column| column.get(row)).filter(|name| !name.is_empty());
    names.collect::<Vec<_>>().join(" ")
}

/// A column of names.
struct Names<'a>(Option<&'a StringArray>);

impl<'a> Names<'a> {
    fn of(rows: &'a RecordBatch, column: &str) -> Self {
        Self(rows.column_by_name(column).and_then(|column| column.as_string_opt::<i32>()))
    }

    fn get(&self, row: usize) -> &'a str {
        self.0.filter(|names| names.is_valid(row)).map_or("", |names| names.value(row))
    }
}

/// A column of numbers.
enum Numbers<'a> {
    Measured(&'a Float64Array),
    Counted(&'a UInt32Array),
}

impl<'a> Numbers<'a> {
    fn of(rows: &'a RecordBatch, column: &str) -> Option<Self> {
        let column = rows.column_by_name(column)?;
        let counted = || column.as_any().downcast_ref::<UInt32Array>().map(Self::Counted);
        column.as_primitive_opt::<Float64Type>().map(Self::Measured).or_else(counted)
    }

    fn get(&self, row: usize) -> f64 {
        match self {
            Self::Measured(numbers) if numbers.is_valid(row) => numbers.value(row),
            Self::Counted(numbers) if numbers.is_valid(row) => f64::from(numbers.value(row)),
            _ => f64::NAN,
        }
    }
}

#[cfg(test)]
mod tests {
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
    fn axes_are_named_by_their_columns() {
        let figure = Figure::lines("form", "Form", "order", [Measure::new("form_um")]);
        let [x, y] = Panels::new(&table(), &figure, 4).unwrap().axes;
        assert_eq!((x.name.as_str(), y.name.as_str(), y.unit.as_str()), ("order", "form", "um"));
        assert_eq!(without_unit("tilt_x_urad", "urad"), "tilt x");
    }
}
