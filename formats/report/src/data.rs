//! What the page's program draws: figures, surface and values as JSON, with numbers in base64.

use runout_core::{
    surface::Surface,
    table::{
        figure::Line,
        panels::{Axis, Curve, Grid, Kind, Panels, Point},
    },
};
use serde::Serialize;

use crate::{
    numbers::Numbers,
    one_line,
    shapes::{ArrowsData, CircleData, circles},
    symbol,
    values::Columns,
};

/// Points of a curve that are drawn: more are not visible on a screen.
const MOST_POINTS: usize = 2880;
/// Points of all curves together, of which a file of a few megabytes consists.
const MOST_POINTS_TOGETHER: usize = 1_500_000;
/// Points of a curve that are left of very many curves.
const FEWEST_POINTS: usize = 360;
/// Cells of a map, along the vertical and along the horizontal axis.
const MOST_CELLS: [usize; 2] = [400, 720];

/// All that is drawn.
#[derive(Serialize)]
pub(crate) struct Data<'a> {
    pub(crate) figures: Vec<FigureData>,
    pub(crate) surface: Option<MapData>,
    pub(crate) values: &'a Columns,
}

/// A figure with its panels.
#[derive(Serialize)]
pub(crate) struct FigureData {
    pub(crate) id: String,
    pub(crate) title: String,
    kind: &'static str,
    x: AxisData,
    y: AxisData,
    pub(crate) panels: Vec<PanelData>,
    thinned: bool,
    /// Names of places along x.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    places: Vec<(f64, String)>,
    #[serde(skip_serializing_if = "Option::is_none")]
    level: Option<LevelData>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    lines: Vec<LineData>,
    /// Named places along x.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    named: Vec<(f64, String)>,
}

/// A line over every panel.
#[derive(Serialize)]
struct LineData {
    name: String,
    x: Numbers,
    y: Numbers,
}

/// A horizontal line across every panel.
#[derive(Serialize)]
struct LevelData {
    name: String,
    value: f64,
}

#[derive(Serialize)]
struct AxisData {
    name: String,
    unit: String,
}

#[derive(Serialize)]
pub(crate) struct PanelData {
    name: String,
    curves: Vec<CurveData>,
    #[serde(skip_serializing_if = "Option::is_none")]
    map: Option<MapData>,
    #[serde(skip_serializing_if = "Option::is_none")]
    arrows: Option<ArrowsData>,
}

#[derive(Serialize)]
struct CurveData {
    name: String,
    x: Numbers,
    y: Numbers,
    /// Standard uncertainty of y.
    #[serde(skip_serializing_if = "Option::is_none")]
    std: Option<Numbers>,
    /// Places without a value.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    missing: Vec<f64>,
    /// Points that are marked, and what there is to say of them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    marks: Vec<(f64, f64, String)>,
    /// Whether it is a line where others are points.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    joined: bool,
    /// Reference circles about which it can be drawn.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    circles: Vec<CircleData>,
}

/// Heights on a grid, row by row along y.
#[derive(Serialize)]
pub(crate) struct MapData {
    x: AxisData,
    y: AxisData,
    height: AxisData,
    xs: Numbers,
    ys: Numbers,
    heights: Numbers,
    /// Nominal radius where x is the angle around a part.
    #[serde(skip_serializing_if = "Option::is_none")]
    radius_mm: Option<f64>,
    thinned: bool,
    /// What is left out of a surface, where something is.
    #[serde(skip)]
    pub(crate) note: Option<String>,
}

impl AxisData {
    fn of(axis: &Axis, unit: &str) -> Self {
        Self { name: axis.name.clone(), unit: symbol(unit) }
    }
}

impl FigureData {
    /// What of the table is not drawn, where something is not.
    pub(crate) fn note(&self) -> Option<&'static str> {
        match self.kind {
            _ if !self.thinned => None,
            "map" => Some("Of many points, the mean of those in each cell is drawn."),
            "vectors" => Some("Of many places, some at equal distances are drawn."),
            _ => Some("Of many points, the lowest and the highest of each stretch are drawn."),
        }
    }
}

/// The figures that have something to draw.
pub(crate) fn figures(all: &[Panels]) -> Vec<FigureData> {
    let points = |figure: &Panels| -> usize {
        figure.drawn.iter().flat_map(|panel| &panel.curves).map(|curve| curve.points.len().min(MOST_POINTS)).sum()
    };
    let curves = |figure: &Panels| -> usize { figure.drawn.iter().map(|panel| panel.curves.len()).sum() };
    let drawn = || all.iter().filter(|figure| figure.kind != Kind::Map);
    let most = match drawn().map(points).sum::<usize>() {
        together if together > MOST_POINTS_TOGETHER => {
            let curves = drawn().map(curves).sum::<usize>().max(1);
            (MOST_POINTS_TOGETHER / curves).clamp(FEWEST_POINTS, MOST_POINTS)
        }
        _ => MOST_POINTS,
    };
    let shown = all.iter().filter(|figure| !is_at_one_place(figure));
    shown.map(|panels| figure(panels, most)).filter(|figure| !figure.panels.is_empty()).collect()
}

/// Whether nothing is along the horizontal axis: points of one place.
fn is_at_one_place(figure: &Panels) -> bool {
    let mut places = figure.drawn.iter().flat_map(|panel| &panel.curves).flat_map(|curve| &curve.points);
    let first = places.next().map(|point| point.x.to_bits());
    figure.kind == Kind::Points && places.all(|point| Some(point.x.to_bits()) == first)
}

fn figure(figure: &Panels, most: usize) -> FigureData {
    let (scale, unit) = figure.scaled();
    let [x, y] = &figure.axes;
    let mut thinned = false;
    let mut panels = Vec::new();
    for panel in &figure.drawn {
        let drawn = |curve: &&Curve| !curve.points.is_empty();
        let mut data = PanelData { name: one_line(&panel.name), curves: Vec::new(), map: None, arrows: None };
        if figure.kind == Kind::Map {
            let points: Vec<Point> = panel.curves.iter().flat_map(|curve| curve.points.iter().copied()).collect();
            data.map = (!points.is_empty()).then(|| map(figure, &points));
            thinned |= data.map.as_ref().is_some_and(|map| map.thinned);
        } else if figure.kind == Kind::Vectors {
            let (arrows, some) = ArrowsData::of(figure, &panel.curves).unzip();
            data.arrows = arrows;
            thinned |= some == Some(true);
        } else {
            thinned |= panel.curves.iter().any(|curve| curve.points.len() > most);
            data.curves.extend(panel.curves.iter().filter(drawn).map(|one| curve(&one.thinned(most, scale))));
        }
        if data.map.is_some() || data.arrows.is_some() || !data.curves.is_empty() {
            panels.push(data);
        }
    }
    let kind = match figure.kind {
        Kind::Polar => "polar",
        Kind::Lines => "lines",
        Kind::Amplitudes => "amplitudes",
        Kind::Points => "points",
        Kind::Bars => "bars",
        Kind::Map => "map",
        Kind::Vectors => "vectors",
    };
    let (x, y) = (AxisData::of(x, &x.unit), AxisData::of(y, unit));
    let places = figure.places.iter().map(|(x, name)| (*x, one_line(name))).collect();
    let level = figure.level.as_ref();
    let level = level.map(|level| LevelData { name: one_line(&level.name), value: scale * level.value });
    let lines = figure.lines.iter().map(|line| line_data(line, scale)).collect();
    let named = figure.named.iter().map(|(at, name)| (*at, one_line(name))).collect();
    FigureData {
        id: figure.id.clone(),
        title: figure.title.clone(),
        kind,
        x,
        y,
        panels,
        thinned,
        places,
        level,
        lines,
        named,
    }
}

fn line_data(line: &Line, scale: f64) -> LineData {
    let [x, y]: [Vec<f64>; 2] = [0, 1].map(|axis| line.points.iter().map(|point| point[axis]).collect());
    let y: Vec<f64> = y.into_iter().map(|y| scale * y).collect();
    LineData { name: one_line(&line.name), x: Numbers::of(&x), y: Numbers::of(&y) }
}

fn curve(curve: &Curve) -> CurveData {
    let numbers = |of: fn(&Point) -> f64| -> Vec<f64> { curve.points.iter().map(of).collect() };
    let std = numbers(|point| point.third);
    CurveData {
        name: one_line(&curve.name),
        x: Numbers::of(&numbers(|point| point.x)),
        y: Numbers::of(&numbers(|point| point.y)),
        std: std.iter().any(|std| std.is_finite()).then(|| Numbers::of(&std)),
        missing: curve.missing.clone(),
        marks: curve.marks.iter().map(|mark| (mark.x, mark.y, one_line(&mark.text))).collect(),
        joined: curve.joined,
        circles: circles(curve),
    }
}

fn map(figure: &Panels, points: &[Point]) -> MapData {
    let Grid { x, y, rows } = Grid::of(points, MOST_CELLS);
    let [across, up] = &figure.axes;
    let middles = |from: f64, to: f64, count: usize| {
        let step = (to - from) / count as f64;
        let middles: Vec<f64> = (0..count).map(|cell| from + step * (cell as f64 + 0.5)).collect();
        Numbers::of(&middles)
    };
    MapData {
        x: AxisData::of(across, &across.unit),
        y: AxisData::of(up, &up.unit),
        height: AxisData::of(figure.height(), &figure.height().unit),
        xs: middles(x.from, x.to, x.count),
        ys: middles(y.from, y.to, y.count),
        thinned: x.count < x.places || y.count < y.places,
        note: None,
        heights: Numbers::of(&rows.concat()),
        radius_mm: None,
    }
}

/// The surface, unrolled; of many angles and rings one of two, three, ….
pub(crate) fn surface(surface: &Surface) -> MapData {
    let around = surface.angles.div_ceil(MOST_CELLS[1]).max(1);
    let along = surface.z_mm.len().div_ceil(MOST_CELLS[0]).max(1);
    let degrees = 360.0 / surface.angles.max(1) as f64;
    let angles: Vec<f64> = (0..surface.angles).step_by(around).map(|angle| degrees * angle as f64).collect();
    let rings = (0..surface.z_mm.len()).step_by(along);
    let heights: Vec<f64> =
        rings.flat_map(|ring| surface.ring(ring).iter().step_by(around).copied().collect::<Vec<_>>()).collect();
    let places: Vec<f64> = surface.z_mm.iter().step_by(along).copied().collect();
    let axis = |name: &str, unit: &str| AxisData { name: name.into(), unit: unit.into() };
    MapData {
        x: axis("angle on the part", "°"),
        y: axis("z", "mm"),
        height: axis("deviation", "µm"),
        xs: Numbers::of(&angles),
        ys: Numbers::of(&places),
        heights: Numbers::of(&heights),
        radius_mm: Some(surface.radius_mm),
        thinned: around > 1 || along > 1,
        note: left_out(around, along),
    }
}

/// What is drawn of a surface: one of so many angles, and one of so many rings.
fn left_out(angles: usize, rings: usize) -> Option<String> {
    match (angles > 1, rings > 1) {
        (false, false) => None,
        (true, false) => Some(format!("One of {angles} angles is drawn.")),
        (false, true) => Some(format!("One of {rings} rings is drawn.")),
        (true, true) => Some(format!("One of {angles} angles and one of {rings} rings are drawn.")),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn a_surface_says_what_is_left_out() {
        assert_eq!(left_out(1, 1), None);
        assert_eq!(left_out(1, 3).unwrap(), "One of 3 rings is drawn.");
        assert_eq!(left_out(2, 3).unwrap(), "One of 2 angles and one of 3 rings are drawn.");
    }

    #[test]
    fn names_are_on_one_line() {
        assert_eq!(one_line("a\nb\t\u{7}c"), "a b  c");
    }
}
