//! Pictures, all through one plotting library.

use kuva::{
    backend::png::PngBackend,
    plot::{ColorMap, Heatmap, LinePlot, scatter::ScatterPlot},
    render::{layout::Layout, plots::Plot, render::render_multiple},
};

/// A named curve.
pub struct Curve {
    /// For the legend.
    pub name: String,
    /// In the order to be joined.
    pub points: Vec<(f64, f64)>,
    /// `#rrggbb`.
    pub colour: &'static str,
    /// Dashed instead of solid.
    pub dashed: bool,
    /// With a dot at each point.
    pub dots: bool,
}

/// Axes of a picture.
pub struct Axes<'a> {
    /// Above the picture.
    pub title: &'a str,
    /// With unit.
    pub x: &'a str,
    /// With unit.
    pub y: &'a str,
}

/// Draws curves as PNG.
///
/// # Errors
/// When the library cannot draw.
pub fn curves(axes: &Axes, curves: &[Curve]) -> Result<Vec<u8>, String> {
    let mut plots = Vec::new();
    for curve in curves {
        let line = LinePlot::new()
            .with_data(curve.points.clone())
            .with_color(curve.colour)
            .with_stroke_width(1.8)
            .with_legend(curve.name.clone());
        plots.push(Plot::Line(if curve.dashed { line.with_dashed() } else { line }));
        if curve.dots {
            plots.push(Plot::Scatter(
                ScatterPlot::new().with_data(curve.points.clone()).with_color(curve.colour).with_size(3.5),
            ));
        }
    }
    let layout = Layout::auto_from_plots(&plots)
        .with_title(axes.title)
        .with_x_label(axes.x)
        .with_y_label(axes.y)
        .with_width(720.0)
        .with_height(420.0);
    PngBackend::new().render_scene(&render_multiple(plots, layout))
}

/// Values on a rectangle, rows from the top.
pub struct Map {
    /// `[row][column]`.
    pub values: Vec<Vec<f64>>,
    /// First and last column.
    pub x: [f64; 2],
    /// Bottom and top row.
    pub y: [f64; 2],
}

/// Draws a map of deviations in µm as PNG.
///
/// # Errors
/// When the library cannot draw.
pub fn map(axes: &Axes, map: &Map) -> Result<Vec<u8>, String> {
    let heatmap = Heatmap::new()
        .with_data(map.values.clone())
        .with_color_map(ColorMap::Viridis)
        .with_x_range(map.x[0], map.x[1])
        .with_y_range(map.y[0], map.y[1]);
    let plots = vec![Plot::Heatmap(heatmap)];
    let layout = Layout::auto_from_plots(&plots)
        .with_title(axes.title)
        .with_subtitle("deviation / µm")
        .with_x_label(axes.x)
        .with_y_label(axes.y)
        .with_x_axis_min(map.x[0])
        .with_x_axis_max(map.x[1])
        .with_y_axis_min(map.y[0])
        .with_y_axis_max(map.y[1])
        .with_x_tick_step(45.0)
        .with_width(860.0)
        .with_height(420.0);
    PngBackend::new().render_scene(&render_multiple(plots, layout))
}
