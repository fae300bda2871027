//! Rows of a table as panels with curves.

use std::collections::HashMap;

use arrow_array::{Array, Float64Array, RecordBatch, StringArray, UInt32Array, cast::AsArray, types::Float64Type};
use runout_core::{
    Error, Result,
    table::{
        Figure, TableSpec,
        figure::{Drawing, Measure},
    },
};

/// The rows of one figure, collected while they come.
pub(crate) struct Panels {
    pub(crate) id: String,
    pub(crate) title: String,
    pub(crate) table: String,
    pub(crate) kind: Kind,
    /// What is along the horizontal axis, and along the vertical one.
    pub(crate) axes: [Axis; 2],
    pub(crate) drawn: Vec<Panel>,
    /// Panels that there were.
    numbers: HashMap<String, usize>,
    /// Each so many of them are kept.
    stride: usize,
    most: usize,
    panel_columns: Vec<String>,
    curve_columns: Vec<String>,
    only: Option<(String, String)>,
    values: Vec<Source>,
}

/// How curves are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Polar,
    Lines,
    Amplitudes,
    Map,
}

/// What an axis shows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Axis {
    pub(crate) name: String,
    pub(crate) unit: String,
}

/// Curves of one combination of names.
pub(crate) struct Panel {
    number: usize,
    pub(crate) name: String,
    pub(crate) curves: Vec<Curve>,
}

/// Points that are joined.
pub(crate) struct Curve {
    pub(crate) name: String,
    pub(crate) points: Vec<Point>,
}

/// A point of a curve, or a cell of a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Point {
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Standard uncertainty of y, NaN where there is none; of a map the height.
    pub(crate) third: f64,
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
    /// None yet.
    pub(crate) fn new(table: &TableSpec, figure: &Figure, most: usize) -> Result<Self> {
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
            Drawing::Amplitudes { order, parts: [real, imaginary] } => {
                let y = [Some(real.clone()), Some(imaginary.clone())];
                let source = Source { name: String::new(), x: order.clone(), y, third: None };
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
        Ok(Self {
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
    pub(crate) fn count(&self) -> usize {
        self.numbers.len()
    }

    /// Axis of the heights of a map.
    pub(crate) fn height(&self, unit: &str) -> Axis {
        let name = self.values.first().map_or("", |value| value.name.as_str());
        Axis { name: without_unit(name, unit), unit: unit.to_owned() }
    }

    /// Takes rows of the table.
    pub(crate) fn add(&mut self, rows: &RecordBatch) {
        let names = |columns: &[String]| columns.iter().map(|column| Names::of(rows, column)).collect::<Vec<_>>();
        let (panel_names, curve_names) = (names(&self.panel_columns), names(&self.curve_columns));
        let only = self.only.as_ref().map(|(column, name)| (Names::of(rows, column), name.clone()));
        let columns: Vec<[Option<Numbers>; 4]> = self.values.iter().map(|value| value.columns(rows)).collect();
        let mut last: Option<(String, String)> = None;
        let mut at: Option<(usize, usize)> = None;
        for row in 0..rows.num_rows() {
            if only.as_ref().is_some_and(|(column, name)| column.get(row) != name) {
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
                if x.is_finite() && y.is_finite() {
                    self.drawn[panel].curves[first + offset].points.push(Point { x, y, third });
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
        curves.extend(self.values.iter().map(|value| Curve { name: full(value), points: Vec::new() }));
        Some((index, first))
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

    use runout_core::table::{ColumnSpec, counts, numbers, texts};

    use super::*;

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
    }

    #[test]
    fn a_column_that_the_table_lacks_is_an_error() {
        let figure = Figure::lines("residual", "Residual", "order", [Measure::new("after")]);
        let error = Panels::new(&table(), &figure, 4).err().unwrap().to_string();
        assert!(error.contains("residual") && error.contains("has no column after"), "{error}");
    }

    #[test]
    fn axes_are_named_by_their_columns() {
        let figure = Figure::lines("form", "Form", "order", [Measure::new("form_um")]);
        let [x, y] = Panels::new(&table(), &figure, 4).unwrap().axes;
        assert_eq!((x.name.as_str(), y.name.as_str(), y.unit.as_str()), ("order", "form", "um"));
        assert_eq!(without_unit("tilt_x_urad", "urad"), "tilt x");
    }
}
