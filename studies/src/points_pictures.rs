//! Pictures of results of measured points: component errors of a rotary axis, pre-travel of a touch-trigger probe.

use std::path::Path;

use kuva::{
    backend::png::PngBackend,
    plot::{
        LinePlot,
        polar::{PolarMode, PolarPlot},
    },
    render::{figure::Figure, layout::Layout, plots::Plot, render::render_multiple},
};
use runout_core::{
    Error, Result,
    closed_loop::Settings,
    pipeline::{
        INCLUDE_KEY, Pipeline, Registry,
        document::{ConfigError, Sources},
    },
    stage::{Outcome, Source},
    table::{Array, Float64Array},
};

const COLOURS: [&str; 3] = ["#1b6ca8", "#c1440e", "#3a7d44"];
/// A standard uncertainty is drawn this many times.
const COVERAGE: f64 = 2.0;

/// The result of the closed loop's final model on a pipeline of points.
fn diagnosed(pipeline: &Path) -> Result<(String, Outcome)> {
    let no_exports = ["export=[]".to_owned()];
    let configured = |error: ConfigError| Error::new("read", pipeline.display().to_string(), error);
    let sources = Sources::read(pipeline, &no_exports, INCLUDE_KEY).map_err(configured)?;
    let mut registry = Registry::default();
    for register in [runout_points::register, runout_rotary_axis::register, runout_touch_probe::register] {
        register(&mut registry);
    }
    let pipeline = Pipeline::from_sources(&sources, &registry).map_err(configured)?;
    let nothing = || Error::new("draw", &pipeline.title, "expected measured points with a model for the closed loop");
    let Source::Points(points) = pipeline.loader.open(&pipeline.request())? else { return Err(nothing()) };
    let model = pipeline.route.point_separator().and_then(|separator| separator.model()).ok_or_else(nothing)?;
    let settings = Settings { max_added: model.effects_of(&points)?.len(), ..Settings::default() };
    Ok((pipeline.title.clone(), model.diagnose(&points, &settings)?.after))
}

fn column(outcome: &Outcome, table: &str, name: &str) -> Result<Vec<f64>> {
    let lacks = || Error::new("draw", table, format!("there is no column of numbers `{name}`"));
    let rows = outcome.tables.iter().find(|rows| rows.table == table).ok_or_else(lacks)?;
    let array = rows.rows.column_by_name(name).and_then(|array| array.as_any().downcast_ref::<Float64Array>());
    let array = array.ok_or_else(lacks)?;
    Ok((0..array.len()).map(|row| if array.is_null(row) { f64::NAN } else { array.value(row) }).collect())
}

/// Component errors over the command, lengths above and angles below, with bands of two standard uncertainties; as PNG.
///
/// # Errors
/// When the pipeline fails, or gives no component errors.
pub fn component_errors(pipeline: &Path, axis: char) -> Result<Vec<u8>> {
    let (title, outcome) = diagnosed(pipeline)?;
    let name = axis.to_ascii_lowercase();
    let command = column(&outcome, "component_errors", &format!("{name}_deg"))?;
    let mut panels = Vec::new();
    let mut layouts = Vec::new();
    for (letters, unit, shown) in [(['x', 'y', 'z'], "um", "µm"), (['a', 'b', 'c'], "urad", "µrad")] {
        let mut plots = Vec::new();
        for (letter, colour) in letters.into_iter().zip(COLOURS) {
            let quantity = format!("e{letter}{name}_{unit}");
            let values = column(&outcome, "component_errors", &quantity)?;
            let stds = column(&outcome, "component_errors", &format!("std_{quantity}"))?;
            let edge = |sign: f64| values.iter().zip(&stds).map(move |(value, std)| value + sign * COVERAGE * std);
            let line = LinePlot::new()
                .with_data(command.iter().copied().zip(values.iter().copied()).collect::<Vec<_>>())
                .with_band(edge(-1.0).collect::<Vec<f64>>(), edge(1.0).collect::<Vec<f64>>())
                .with_color(colour)
                .with_stroke_width(1.8)
                .with_legend(format!("E{}{axis}", letter.to_ascii_uppercase()));
            plots.push(Plot::Line(line));
        }
        let layout = Layout::auto_from_plots(&plots)
            .with_x_label(format!("command of {axis} / °"))
            .with_y_label(format!("component error / {shown}"));
        panels.push(plots);
        layouts.push(layout);
    }
    let figure = Figure::new(2, 1).with_plots(panels).with_layouts(layouts).with_cell_size(760.0, 330.0);
    let scene = figure.with_title(format!("{title}: component errors ± {COVERAGE} u")).render();
    PngBackend::new().render_scene(&scene).map_err(|problem| Error::new("draw", &title, problem))
}

/// Pre-travel by direction, without mean and order 1, as a polar plot with its interval of two standard uncertainties; as PNG.
///
/// # Errors
/// When the pipeline fails, or gives no pre-travel.
pub fn pretravel(pipeline: &Path) -> Result<Vec<u8>> {
    let (title, outcome) = diagnosed(pipeline)?;
    let direction = column(&outcome, "pretravel", "direction_deg")?;
    let travel = column(&outcome, "pretravel", "pretravel_um")?;
    let std = column(&outcome, "pretravel", "std_pretravel_um")?;
    let closed = |values: Vec<f64>| values.iter().copied().chain(values.first().copied()).collect::<Vec<f64>>();
    let around: Vec<f64> = direction.iter().copied().chain(direction.first().map(|first| first + 360.0)).collect();
    let edge = |sign: f64| closed(travel.iter().zip(&std).map(|(value, std)| value + sign * COVERAGE * std).collect());
    let largest = travel.iter().zip(&std).map(|(value, std)| value.abs() + COVERAGE * std).fold(1.0, f64::max).ceil();
    let mut plot = PolarPlot::new().with_theta_start(90.0).with_clockwise(false).with_legend(true);
    // The middle is the largest travel inward; the circle half-way out is the mean.
    plot = plot.with_r_min(-2.0 * largest).with_r_max(2.0 * largest);
    let mean = vec![0.0; around.len()];
    for (values, label, colour) in [
        (closed(travel.clone()), "pre-travel less its mean, µm", COLOURS[0]),
        (edge(-1.0), "− 2 u", "#9ab8d3"),
        (edge(1.0), "+ 2 u", "#9ab8d3"),
        (mean, "mean", "#888888"),
    ] {
        plot = plot.with_series_labeled(values, around.clone(), label, PolarMode::Line).with_color(colour);
    }
    let plots = vec![Plot::Polar(plot)];
    let layout = Layout::auto_from_plots(&plots).with_title(title.clone()).with_width(720.0).with_height(560.0);
    PngBackend::new()
        .render_scene(&render_multiple(plots, layout))
        .map_err(|problem| Error::new("draw", &title, problem))
}
