//! A fly-cut surface as a picture: heights as measured, and without what the closed loop found.

use std::path::Path;

use arrow_array::{Array, Float64Array};
use kuva::{
    backend::png::PngBackend,
    plot::{ColorMap, Heatmap},
    render::{figure::Figure, layout::Layout, plots::Plot},
};
use runout_core::{
    Error, Result,
    closed_loop::Settings,
    pipeline::{
        INCLUDE_KEY, Pipeline, Registry,
        document::{ConfigError, Sources},
    },
    stage::{Outcome, Source},
};

/// Cells along the longer side, at most: more could not be seen.
const CELLS: usize = 200;

/// Runs the closed loop of a pipeline and draws the surface before and after, as PNG.
///
/// # Errors
/// When the pipeline fails, or gives no surface on a plane.
pub fn picture(pipeline: &Path) -> Result<Vec<u8>> {
    let no_exports = ["export=[]".to_owned()];
    let configured = |error: ConfigError| Error::new("read", pipeline.display().to_string(), error);
    let sources = Sources::read(pipeline, &no_exports, INCLUDE_KEY).map_err(configured)?;
    let mut registry = Registry::default();
    for register in [runout_points::register, runout_hdf5::register, runout_fly_cutting::register] {
        register(&mut registry);
    }
    let pipeline = Pipeline::from_sources(&sources, &registry).map_err(configured)?;
    let failure = |problem: &str| Error::new("draw", &pipeline.title, problem);
    let nothing = || failure("expected a height map with a model for the closed loop");
    let Source::Points(points) = pipeline.loader.open(&pipeline.request())? else { return Err(nothing()) };
    let model = pipeline.route.point_separator().and_then(|separator| separator.model()).ok_or_else(nothing)?;
    let outcome = model.diagnose(&points, &Settings::default())?.after;
    let [x, y] = ["x_mm", "y_mm"].map(|name| column(&outcome, name));
    let (x, y) = (x.ok_or_else(nothing)?, y.ok_or_else(nothing)?);
    let mut panels = Vec::new();
    let mut layouts = Vec::new();
    for (name, title) in [("height_nm", "as measured"), ("corrected_nm", "without what the loop found")] {
        let heights = column(&outcome, name).ok_or_else(nothing)?;
        let map = cells(&x, &y, &heights);
        let heatmap = Heatmap::new()
            .with_data(map.values)
            .with_color_map(ColorMap::Viridis)
            .with_x_range(map.x[0], map.x[1])
            .with_y_range(map.y[0], map.y[1]);
        let plots = vec![Plot::Heatmap(heatmap)];
        let layout = Layout::auto_from_plots(&plots)
            .with_title(title)
            .with_subtitle("height / nm")
            .with_x_label("x along the feed / mm")
            .with_y_label("y / mm")
            .with_x_axis_min(map.x[0])
            .with_x_axis_max(map.x[1])
            .with_y_axis_min(map.y[0])
            .with_y_axis_max(map.y[1]);
        panels.push(plots);
        layouts.push(layout);
    }
    let figure = Figure::new(1, 2).with_plots(panels).with_layouts(layouts).with_cell_size(560.0, 440.0);
    let scene = figure.with_title(pipeline.title.clone()).render();
    PngBackend::new().render_scene(&scene).map_err(|problem| failure(&problem))
}

fn column(outcome: &Outcome, name: &str) -> Option<Vec<f64>> {
    let rows = outcome.tables.iter().find(|rows| rows.table == "surface")?;
    let array = rows.rows.column_by_name(name)?.as_any().downcast_ref::<Float64Array>()?;
    Some((0..array.len()).map(|row| array.value(row)).collect())
}

struct Cells {
    /// `[row][column]`, rows from the top, in nm about the mean.
    values: Vec<Vec<f64>>,
    x: [f64; 2],
    y: [f64; 2],
}

/// Heights of the points nearest to the middle of each cell: a mean would hide scallops.
fn cells(x: &[f64], y: &[f64], heights: &[f64]) -> Cells {
    let extent = |values: &[f64]| {
        let fold = |start: f64, pick: fn(f64, f64) -> f64| values.iter().copied().fold(start, pick);
        [fold(f64::INFINITY, f64::min), fold(f64::NEG_INFINITY, f64::max)]
    };
    let (x_ends, y_ends) = (extent(x), extent(y));
    let [width, height] = [x_ends, y_ends].map(|[from, to]| to - from);
    let cell = width.max(height) / CELLS as f64;
    let count = |length: f64| ((length / cell).round() as usize).max(1);
    let (columns, rows) = (count(width), count(height));
    let mean = heights.iter().sum::<f64>() / heights.len().max(1) as f64;
    let mut values = vec![vec![f64::NAN; columns]; rows];
    for ((x, y), z) in x.iter().zip(y).zip(heights) {
        let place = |value: f64, from: f64, length: f64, count: usize| {
            (((value - from) / length * count as f64) as usize).min(count - 1)
        };
        let row = rows - 1 - place(*y, y_ends[0], height, rows);
        values[row][place(*x, x_ends[0], width, columns)] = z - mean;
    }
    Cells { values, x: x_ends, y: y_ends }
}
