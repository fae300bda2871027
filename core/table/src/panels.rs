//! Rows of a table as the panels and curves of a figure, for whatever draws them.

mod arrows;
mod circles;
mod columns;
mod grid;
mod source;
#[cfg(test)]
mod tests;

use std::collections::{HashMap, HashSet};

use arrow_array::RecordBatch;
use runout_error::{Error, Result};

use crate::{
    TableSpec,
    figure::{Figure, Level, Line},
};
pub use arrows::Arrow;
pub use circles::Circle;
use columns::{Names, Numbers, joined};
pub use grid::{Cells, Grid};
use source::{Drawn, Source, drawn};

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
    /// Names of places along the horizontal axis, where they have names.
    pub places: Vec<(f64, String)>,
    /// A horizontal line across every panel, in the unit of the vertical axis before it is [scaled](Self::scaled).
    pub level: Option<Level>,
    /// Lines over every panel, in the same unit.
    pub lines: Vec<Line>,
    /// Named places along the horizontal axis.
    pub named: Vec<(f64, String)>,
    /// The three components of vectors; empty where none are drawn.
    pub vector: Vec<Axis>,
    /// Name of the table of reference circles.
    circles: Option<String>,
    place_column: Option<String>,
    known_places: HashSet<u64>,
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
    /// Points over a common axis; curves that are [joined](Curve::joined) are lines.
    Points,
    /// Bars over the order.
    Bars,
    /// Heights over a rectangle.
    Map,
    /// Vectors at places in space.
    Vectors,
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
    /// Points that are marked.
    pub marks: Vec<Mark>,
    /// Whether it is a line where others are points.
    pub joined: bool,
    /// Reference circles about which it can be drawn.
    pub circles: Vec<Circle>,
    /// Of vectors, each with its place; then [`points`](Self::points) are the places.
    pub arrows: Vec<Arrow>,
}

/// A point of a curve with what there is to say of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// Along the horizontal axis.
    pub x: f64,
    /// Along the vertical axis.
    pub y: f64,
    /// What there is to say.
    pub text: String,
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

impl Panels {
    /// None yet; of more than `most` panels, those at equal distances are kept, unless they are of different quantities.
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
            // Rows of several quantities share a column; its unit begins with that of the figure's.
            let unit = table.column(column).and_then(|column| column.unit.split(';').next()).unwrap_or_default();
            Axis { name: without_unit(column, unit), unit: unit.to_owned() }
        };
        let Drawn { kind, axes, height, vector, values } = drawn(&figure.drawing, &axis);
        Ok(Self {
            height,
            id: figure.id.clone(),
            title: figure.title.clone(),
            table: table.name.clone(),
            kind,
            axes,
            drawn: Vec::new(),
            places: Vec::new(),
            level: figure.level.clone(),
            lines: figure.lines.clone(),
            named: figure.named.clone(),
            circles: figure.circles.clone(),
            vector,
            place_column: figure.places.clone(),
            known_places: HashSet::new(),
            numbers: HashMap::new(),
            stride: 1,
            most: if figure.every_panel { usize::MAX } else { most },
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

    /// Axis of the heights of a map, and of the third coordinate of vectors.
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

    /// Takes rows of a table where they are of the figure's own one, or of that of its reference circles, which come later.
    pub fn take(&mut self, table: &str, rows: &RecordBatch) {
        if self.table == table {
            self.add(rows);
        } else if self.circles.as_deref() == Some(table) {
            self.add_circles(rows);
        }
    }

    /// Takes rows of the table.
    pub fn add(&mut self, rows: &RecordBatch) {
        if self.kind == Kind::Vectors {
            self.add_arrows(rows);
            return;
        }
        let names = |columns: &[String]| columns.iter().map(|column| Names::of(rows, column)).collect::<Vec<_>>();
        let (panel_names, curve_names) = (names(&self.panel_columns), names(&self.curve_columns));
        let only = self.only.as_ref().map(|(column, names)| (Names::of(rows, column), names.clone()));
        let columns: Vec<[Option<Numbers>; 4]> = self.values.iter().map(|value| value.columns(rows)).collect();
        let marks: Vec<Option<Names>> =
            self.values.iter().map(|value| value.marks.as_ref().map(|column| Names::of(rows, column))).collect();
        let places = self.place_column.as_ref().map(|column| Names::of(rows, column));
        let named = || panel_names.iter().chain(&curve_names);
        let mut last: Option<usize> = None;
        let mut at: Option<(usize, Vec<usize>)> = None;
        for row in 0..rows.num_rows() {
            if only.as_ref().is_some_and(|(column, names)| names.iter().all(|name| column.get(row) != name)) {
                continue;
            }
            // Most rows go where the one before them went.
            if !last.is_some_and(|last| named().all(|names| names.get(row) == names.get(last))) {
                at = self.place(&joined(&panel_names, row), &joined(&curve_names, row));
            }
            last = Some(row);
            let Some((panel, places_of)) = &at else { continue };
            for (offset, columns) in columns.iter().enumerate() {
                let number = |column: &Option<Numbers>| column.as_ref().map_or(f64::NAN, |column| column.get(row));
                let [x, y, second, third] =
                    [number(&columns[0]), number(&columns[1]), number(&columns[2]), number(&columns[3])];
                let y = if columns[2].is_some() { y.hypot(second) } else { y };
                let curve = &mut self.drawn[*panel].curves[places_of[offset]];
                if self.values[offset].common && curve.points.last().is_some_and(|last| last.x.to_bits() == x.to_bits())
                {
                    continue;
                }
                if let Some(places) = &places
                    && x.is_finite()
                    && self.known_places.insert(x.to_bits())
                {
                    self.places.push((x, places.get(row).to_owned()));
                }
                if x.is_finite() && y.is_finite() {
                    curve.points.push(Point { x, y, third });
                    let text = marks[offset].as_ref().map_or("", |texts| texts.get(row));
                    if !text.is_empty() {
                        curve.marks.push(Mark { x, y, text: text.to_owned() });
                    }
                } else if x.is_finite() {
                    curve.missing.push(x);
                }
            }
        }
    }

    /// The panel of these names and its curves, value by value; none where the panel is not kept.
    fn place(&mut self, panel: &str, curve: &str) -> Option<(usize, Vec<usize>)> {
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
        let single = self.values.len() == 1;
        let place = |value: &Source| {
            let name = match (curve, value.name.as_str()) {
                ("", name) => name.to_owned(),
                (_, name) if value.common => name.to_owned(),
                (curve, "") => curve.to_owned(),
                // One value is named by the axis.
                (curve, _) if single => curve.to_owned(),
                (curve, name) => format!("{curve} {name}"),
            };
            curves.iter().position(|known| known.name == name).unwrap_or_else(|| {
                curves.push(Curve { name, joined: value.common, ..Curve::default() });
                curves.len() - 1
            })
        };
        Some((index, self.values.iter().map(place).collect()))
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
        let marks = self.marks.iter().map(|mark| Mark { y: scale * mark.y, ..mark.clone() }).collect();
        let circles = self.circles.iter().map(|circle| circle.scaled(scale)).collect();
        Self {
            name: self.name.clone(),
            points: points.into_iter().map(scaled).collect(),
            missing: self.missing.clone(),
            marks,
            joined: self.joined,
            circles,
            arrows: self.arrows.clone(),
        }
    }
}

/// `tilt_x_urad` as `tilt x`.
fn without_unit(column: &str, unit: &str) -> String {
    let unit = unit.to_lowercase();
    let name = if unit.is_empty() { column } else { column.strip_suffix(&format!("_{unit}")).unwrap_or(column) };
    name.replace('_', " ")
}
