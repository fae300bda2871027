//! Drawing panels, by one plotting library.

mod vectors;

use kuva::{
    backend::{png::PngBackend, svg::SvgBackend},
    plot::{
        ColorMap, Heatmap, LegendPosition, LinePlot, LineStyle, LollipopPlot, ScatterPlot,
        polar::{PolarMode, PolarPlot},
    },
    render::{figure::Figure, layout::Layout, plots::Plot, render::render_multiple},
};
use runout_core::{
    surface::Surface,
    table::{
        figure::Line,
        panels::{Axis, Curve, Grid, Kind, Panel, Panels, Point},
    },
};

pub(crate) use kuva::render::render::Scene;

/// Points of a curve that are drawn: more cannot be distinguished on a screen.
const MOST_POINTS: usize = 1440;
/// Cells of a map, along the vertical and along the horizontal axis.
const MOST_CELLS: [usize; 2] = [120, 240];
/// Widths of an interval of 95 % in standard uncertainties, on each side.
const COVERAGE: f64 = 2.0;
/// Colours that differ for colour-blind readers and in print (Okabe and Ito).
const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"];

/// As SVG.
pub(crate) fn svg(scene: &Scene) -> String {
    numbered_from_0(SvgBackend::new().render_scene(scene))
}

/// The library counts clip paths over all drawings of a process. Here they count from 0 in each: equal scenes give equal texts.
fn numbered_from_0(svg: String) -> String {
    const ID: &str = "id=\"kuva-clip-";
    let numbers = svg.split(ID).skip(1).filter_map(|rest| rest.split('"').next()).map(str::to_owned);
    let numbers: Vec<String> = numbers.collect();
    numbers.iter().enumerate().fold(svg, |svg, (index, number)| {
        svg.replace(&format!("{ID}{number}\""), &format!("id=\"clip-{index}\""))
            .replace(&format!("(#kuva-clip-{number})"), &format!("(#clip-{index})"))
    })
}

/// As PNG.
pub(crate) fn png(scene: &Scene) -> Result<Vec<u8>, String> {
    PngBackend::new().render_scene(scene)
}

/// The scene of a figure; none where it has no points.
pub(crate) fn figure(figure: &Panels) -> Option<Scene> {
    let drawn = |panel: &&Panel| panel.curves.iter().any(|curve| !curve.points.is_empty());
    let panels: Vec<&Panel> = figure.drawn.iter().filter(drawn).collect();
    let (scale, unit) = figure.scaled();
    let cells = panels.iter().map(|panel| cell(figure, panel, scale, unit));
    let (plots, layouts): (Vec<_>, Vec<_>) = cells.unzip();
    let count = plots.len();
    let title = match figure.count() {
        all if all > count && count > 1 => format!("{} ({count} of {all})", figure.title),
        _ => figure.title.clone(),
    };
    match count {
        0 => None,
        1 => {
            let plots = plots.into_iter().next().unwrap_or_default();
            let layout = layouts.into_iter().next()?;
            let name = panels.first().map_or("", |panel| panel.name.as_str());
            let title = if name.is_empty() { title } else { format!("{title}: {name}") };
            let [width, height] = size(figure.kind);
            Some(render_multiple(plots, layout.with_title(title).with_width(width).with_height(height)))
        }
        _ => {
            let columns = (count as f64).sqrt().ceil() as usize;
            let [width, height] = size(figure.kind).map(|side| 0.7 * side);
            let grid = Figure::new(count.div_ceil(columns), columns).with_cell_size(width, height);
            Some(grid.with_title(title).with_plots(plots).with_layouts(layouts).render())
        }
    }
}

/// The scene of a surface: its deviation over angle and z, unrolled.
pub(crate) fn surface(surface: &Surface) -> Scene {
    let degrees = 360.0 / surface.angles as f64;
    let rings = surface.z_mm.iter().enumerate();
    let points: Vec<Point> = rings
        .flat_map(|(ring, z_mm)| {
            let cells = surface.ring(ring).iter().enumerate();
            cells.map(|(angle, height)| Point { x: angle as f64 * degrees, y: *z_mm, third: *height })
        })
        .collect();
    let axis = |name: &str, unit: &str| Axis { name: name.into(), unit: unit.into() };
    let axes = [axis("angle on the part", "deg"), axis("z", "mm")];
    let (plots, layout) = map(&points, &axes, &axis("deviation", "um"));
    let [width, height] = size(Kind::Map);
    render_multiple(plots, layout.with_title("Surface").with_x_tick_step(45.0).with_width(width).with_height(height))
}

/// Width and height of a single panel.
fn size(kind: Kind) -> [f64; 2] {
    match kind {
        Kind::Polar => [560.0, 660.0],
        Kind::Lines | Kind::Points | Kind::Amplitudes | Kind::Bars => [720.0, 420.0],
        Kind::Map => [860.0, 460.0],
        Kind::Vectors => [720.0, 560.0],
    }
}

fn cell(figure: &Panels, panel: &Panel, scale: f64, unit: &str) -> (Vec<Plot>, Layout) {
    let unscaled = &figure.axes;
    let axes = [unscaled[0].clone(), Axis { name: unscaled[1].name.clone(), unit: unit.to_owned() }];
    let curves: Vec<Curve> = panel
        .curves
        .iter()
        .filter(|curve| !curve.points.is_empty())
        .map(|curve| curve.thinned(MOST_POINTS, scale))
        .collect();
    let level = figure.level.as_ref().map(|level| (level.name.as_str(), scale * level.value));
    let tallest = curves.iter().flat_map(|curve| &curve.points).map(|point| point.y).fold(0.0, f64::max);
    let lines_over = figure.lines.iter().enumerate().map(|(index, line)| over(line, scale, index));
    let over = lines_over.chain(named(&figure.named, tallest)).collect::<Vec<_>>();
    let (plots, layout) = match figure.kind {
        Kind::Polar => polar(&curves, &axes[1]),
        Kind::Lines => lines(&curves, &axes, level),
        Kind::Points => points(&curves, &axes),
        // Eccentricity is no form, and high orders are noise.
        Kind::Amplitudes => bars(&curves, &axes, 2.0, level, over),
        Kind::Bars => bars(&curves, &axes, 0.0, level, over),
        Kind::Vectors => vectors::draw(panel, &axes, figure),
        Kind::Map => {
            let points = panel.curves.iter().flat_map(|curve| curve.points.iter().copied()).collect::<Vec<_>>();
            map(&points, &axes, figure.height())
        }
    };
    (plots, layout.with_title(panel.name.clone()))
}

fn colour(index: usize) -> &'static str {
    COLOURS[index % COLOURS.len()]
}

/// Name of a curve with its expanded uncertainty, where that is the same all along.
fn legend(curve: &Curve, unit: &str) -> String {
    let std = curve.points.first().map_or(f64::NAN, |point| point.third);
    let same = curve.points.iter().all(|point| (point.third - std).abs() <= 1e-9 * std);
    if same && std > 0.0 {
        let expanded = COVERAGE * std;
        // Two digits of an uncertainty are enough (GUM 7.2.6).
        let digits = (1.0 - expanded.log10().floor()).clamp(0.0, 9.0) as usize;
        format!("{} ± {expanded:.digits$} {}", curve.name, symbol(unit)).trim().to_owned()
    } else {
        curve.name.clone()
    }
}

fn polar(curves: &[Curve], values: &Axis) -> (Vec<Plot>, Layout) {
    let largest = curves.iter().flat_map(|curve| &curve.points).map(|point| point.y.abs()).fold(0.0, f64::max);
    let span = rounded_up(largest);
    // 0 is on the second of three circles.
    let mut plot = PolarPlot::new()
        .with_theta_start(90.0)
        .with_clockwise(false)
        .with_r_min(-2.0 * span)
        .with_r_max(span)
        .with_r_grid_lines(3);
    for (index, curve) in curves.iter().enumerate() {
        let mut points = curve.points.clone();
        let whole = points.windows(2).all(|pair| pair[1].x > pair[0].x)
            && points.last().zip(points.first()).is_some_and(|(last, first)| {
                let step = (last.x - first.x) / (points.len().max(2) - 1) as f64;
                360.0 - (last.x - first.x) < 3.0 * step
            });
        points.extend(points.first().copied().filter(|_| whole));
        let (r, theta): (Vec<f64>, Vec<f64>) = points.iter().map(|point| (point.y, point.x)).unzip();
        plot =
            plot.with_series_labeled(r, theta, legend(curve, &values.unit), PolarMode::Line).with_color(colour(index));
    }
    let plots = vec![Plot::Polar(plot.with_legend(curves.iter().any(|curve| !legend(curve, &values.unit).is_empty())))];
    let layout = Layout::auto_from_plots(&plots)
        .with_subtitle(format!("deviation from the reference circle / {}", symbol(&values.unit)))
        .with_legend_position(LegendPosition::OutsideBottomCenter);
    (plots, layout)
}

fn lines(curves: &[Curve], axes: &[Axis; 2], level: Option<(&str, f64)>) -> (Vec<Plot>, Layout) {
    let mut plots = Vec::new();
    for (index, curve) in curves.iter().enumerate() {
        let line = curve.points.iter().map(|point| (point.x, point.y)).collect::<Vec<_>>();
        let mut plot = LinePlot::new().with_data(line).with_color(colour(index)).with_stroke_width(1.6);
        if curve.points.iter().all(|point| point.third.is_finite()) {
            let side = |sign: f64| {
                curve.points.iter().map(move |point| point.y + sign * COVERAGE * point.third).collect::<Vec<_>>()
            };
            plot = plot.with_band(side(-1.0), side(1.0));
        }
        plots.push(Plot::Line(if curve.name.is_empty() { plot } else { plot.with_legend(curve.name.clone()) }));
        if !curve.marks.is_empty() {
            let marks = curve.marks.iter().map(|mark| (mark.x, mark.y)).collect::<Vec<_>>();
            plots.push(Plot::Scatter(ScatterPlot::new().with_data(marks).with_color(MARK).with_size(3.5)));
        }
    }
    plots.extend(level.map(|level| limit(level, curves, f64::INFINITY)));
    let layout = Layout::auto_from_plots(&plots).with_x_label(label(&axes[0])).with_y_label(label(&axes[1]));
    (plots, layout)
}

fn points(curves: &[Curve], axes: &[Axis; 2]) -> (Vec<Plot>, Layout) {
    let mut plots = Vec::new();
    for (index, curve) in curves.iter().enumerate() {
        let points = curve.points.iter().map(|point| (point.x, point.y)).collect::<Vec<_>>();
        let named = !curve.name.is_empty();
        if curve.joined {
            let plot = LinePlot::new().with_data(points).with_color(LIMIT).with_stroke_width(1.2);
            plots.push(Plot::Line(if named { plot.with_legend(curve.name.clone()) } else { plot }));
            continue;
        }
        let plot = ScatterPlot::new().with_data(points).with_color(colour(index)).with_size(2.5);
        plots.push(Plot::Scatter(if named { plot.with_legend(curve.name.clone()) } else { plot }));
        for point in curve.points.iter().filter(|point| point.third.is_finite()) {
            let ends = [-COVERAGE, COVERAGE].map(|side| (point.x, point.y + side * point.third));
            plots.push(Plot::Line(
                LinePlot::new().with_data(ends.to_vec()).with_color(colour(index)).with_stroke_width(0.8),
            ));
        }
    }
    let layout = Layout::auto_from_plots(&plots).with_x_label(label(&axes[0])).with_y_label(label(&axes[1]));
    (plots, layout)
}

/// The first orders, side by side.
fn bars(
    curves: &[Curve],
    axes: &[Axis; 2],
    lowest_order: f64,
    level: Option<(&str, f64)>,
    over: Vec<Plot>,
) -> (Vec<Plot>, Layout) {
    let mut plots = Vec::new();
    let width = 0.6 / curves.len().max(1) as f64;
    for (index, curve) in curves.iter().enumerate() {
        let shown = curve.points.iter().filter(|point| (lowest_order..=HIGHEST_ORDER).contains(&point.x));
        let stems = shown.map(|point| (point.x + width * index as f64, point.y)).collect::<Vec<_>>();
        let plot = LollipopPlot::new().with_points(stems).with_color(colour(index)).with_dot_radius(2.5);
        plots.push(Plot::Lollipop(if curve.name.is_empty() { plot } else { plot.with_legend(curve.name.clone()) }));
    }
    plots.extend(level.map(|level| limit(level, curves, HIGHEST_ORDER)));
    plots.extend(over);
    let layout =
        Layout::auto_from_plots(&plots).with_x_label("order / UPR").with_x_axis_min(0.0).with_y_label(label(&axes[1]));
    (plots, layout)
}

/// A line across all places of the curves, as far as they are shown.
fn limit((name, value): (&str, f64), curves: &[Curve], highest: f64) -> Plot {
    let places = curves.iter().flat_map(|curve| &curve.points).map(|point| point.x);
    let (from, to) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    let line = vec![(from, value), (to.min(highest), value)];
    Plot::Line(LinePlot::new().with_data(line).with_color(LIMIT).with_stroke_width(1.2).with_legend(name))
}

/// A limit that differs from order to order, as far as orders are shown; several are dashed differently.
fn over(line: &Line, scale: f64, index: usize) -> Plot {
    let shown = line.points.iter().filter(|point| point[0] <= HIGHEST_ORDER);
    let points = shown.map(|[x, y]| (*x, scale * y)).collect::<Vec<_>>();
    let plot = LinePlot::new().with_data(points).with_color(LIMIT).with_stroke_width(1.2);
    let styles = [LineStyle::Dashed, LineStyle::Dotted, LineStyle::DashDot, LineStyle::Solid];
    Plot::Line(plot.with_line_style(styles[index % styles.len()].clone()).with_legend(line.name.clone()))
}

/// A line from the bottom to the top at each named place, as far as orders are shown, with its name in the legend.
fn named(places: &[(f64, String)], tallest: f64) -> impl Iterator<Item = Plot> {
    let shown = places.iter().filter(|(at, _)| *at <= HIGHEST_ORDER);
    shown.enumerate().map(move |(index, (at, name))| {
        let line = LinePlot::new().with_data(vec![(*at, 0.0), (*at, tallest)]).with_color(colour(index + 2));
        Plot::Line(line.with_stroke_width(0.8).with_legend(name.clone()))
    })
}

/// Colours of marked points and of limits.
const MARK: &str = "#b3261e";
const LIMIT: &str = "#666666";
/// The highest order that is drawn.
const HIGHEST_ORDER: f64 = 50.0;

fn map(points: &[Point], axes: &[Axis; 2], height: &Axis) -> (Vec<Plot>, Layout) {
    let Grid { x, y, mut rows } = Grid::of(points, MOST_CELLS);
    // Pictures count rows from the top.
    rows.reverse();
    let plot = Heatmap::new()
        .with_data(rows)
        .with_color_map(ColorMap::Viridis)
        .with_x_range(x.from, x.to)
        .with_y_range(y.from, y.to)
        // Without gaps between cells.
        .with_cell_size(1.0);
    let plots = vec![Plot::Heatmap(plot)];
    let layout = Layout::auto_from_plots(&plots)
        .with_subtitle(label(height))
        .with_x_label(label(&axes[0]))
        .with_y_label(label(&axes[1]))
        .with_x_axis_min(x.from)
        .with_x_axis_max(x.to)
        .with_y_axis_min(y.from)
        .with_y_axis_max(y.to);
    (plots, layout)
}

/// The next of 1, 1.5, 2, 3, 4, 5, 6, 8 and 10 times a power of ten.
fn rounded_up(value: f64) -> f64 {
    if value <= 0.0 {
        return 1.0;
    }
    let power = 10.0_f64.powf(value.log10().floor());
    let steps = [1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
    steps.into_iter().map(|step| step * power).find(|step| *step >= value).unwrap_or(10.0 * power)
}

/// `z / mm`, by ISO 80000-1.
fn label(axis: &Axis) -> String {
    match (axis.name.as_str(), symbol(&axis.unit)) {
        (name, "") => name.to_owned(),
        ("", unit) => unit.to_owned(),
        (name, unit) => format!("{name} / {unit}"),
    }
}

fn symbol(unit: &str) -> &str {
    match unit {
        "um" => "µm",
        "urad" => "µrad",
        "deg" => "°",
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polar_plots_have_round_circles() {
        for (value, expected) in
            [(0.0, 1.0), (0.93, 1.0), (1.0, 1.0), (1.2, 1.5), (23.0, 30.0), (6.1e-3, 8e-3), (9.7, 10.0)]
        {
            assert!((rounded_up(value) - expected).abs() < 1e-12 * expected, "{value}: {}", rounded_up(value));
        }
    }

    #[test]
    fn an_expanded_uncertainty_has_two_digits() {
        let curve = |std: f64| Curve {
            name: "a".into(),
            points: vec![Point { x: 0.0, y: 0.0, third: std }; 3],
            ..Curve::default()
        };
        assert_eq!(legend(&curve(0.005_23), "um"), "a ± 0.010 µm");
        assert_eq!(legend(&curve(0.61), "um"), "a ± 1.2 µm");
        assert_eq!(legend(&curve(f64::NAN), "um"), "a");
    }
}
