//! Drawing panels, by one plotting library.

use kuva::{
    backend::{png::PngBackend, svg::SvgBackend},
    plot::{
        ColorMap, Heatmap, LegendPosition, LinePlot, LollipopPlot,
        polar::{PolarMode, PolarPlot},
    },
    render::{figure::Figure, layout::Layout, plots::Plot, render::render_multiple},
};
use runout_core::surface::Surface;

use crate::panels::{Axis, Curve, Kind, Panel, Panels, Point};

pub(crate) use kuva::render::render::Scene;

/// Points of a curve that are drawn: more cannot be told apart on a screen.
const MOST_POINTS: usize = 1440;
/// Cells of a map, along the vertical and along the horizontal axis.
const MOST_CELLS: [usize; 2] = [120, 240];
/// Widths of an interval of 95 % in standard uncertainties, on each side.
const COVERAGE: f64 = 2.0;
/// Colours that differ for colour-blind readers and in print (Okabe and Ito).
const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"];

/// As SVG.
pub(crate) fn svg(scene: &Scene) -> String {
    SvgBackend::new().render_scene(scene)
}

/// As PNG.
pub(crate) fn png(scene: &Scene) -> Result<Vec<u8>, String> {
    PngBackend::new().render_scene(scene)
}

/// The scene of a figure; none where it has no points.
pub(crate) fn figure(figure: &Panels) -> Option<Scene> {
    let drawn = |panel: &&Panel| panel.curves.iter().any(|curve| !curve.points.is_empty());
    let panels: Vec<&Panel> = figure.drawn.iter().filter(drawn).collect();
    let (scale, unit) = scaled(figure, &panels);
    let cells = panels.iter().map(|panel| cell(figure, panel, scale, &unit));
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
        Kind::Lines | Kind::Amplitudes => [720.0, 420.0],
        Kind::Map => [860.0, 460.0],
    }
}

/// A factor for the vertical axis and the unit that it gives: nm and nrad where µm and µrad have no digits left of 0.1.
fn scaled(figure: &Panels, panels: &[&Panel]) -> (f64, String) {
    let unit = figure.axes[1].unit.as_str();
    let points = panels.iter().flat_map(|panel| &panel.curves).flat_map(|curve| &curve.points);
    let largest = points.map(|point| point.y.abs()).fold(0.0, f64::max);
    let small = largest > 0.0 && largest < 0.1;
    match unit {
        "um" if small && figure.kind != Kind::Map => (1e3, "nm".into()),
        "urad" if small && figure.kind != Kind::Map => (1e3, "nrad".into()),
        _ => (1.0, unit.into()),
    }
}

fn cell(figure: &Panels, panel: &Panel, scale: f64, unit: &str) -> (Vec<Plot>, Layout) {
    let unscaled = &figure.axes;
    let axes = [unscaled[0].clone(), Axis { name: unscaled[1].name.clone(), unit: unit.to_owned() }];
    let curves: Vec<Curve> =
        panel.curves.iter().filter(|curve| !curve.points.is_empty()).map(|curve| thinned(curve, scale)).collect();
    let (plots, layout) = match figure.kind {
        Kind::Polar => polar(&curves, &axes[1]),
        Kind::Lines => lines(&curves, &axes),
        Kind::Amplitudes => amplitudes(&curves, &axes),
        Kind::Map => {
            let points = panel.curves.iter().flat_map(|curve| curve.points.iter().copied()).collect::<Vec<_>>();
            map(&points, &axes, &figure.height("nm"))
        }
    };
    (plots, layout.with_title(panel.name.clone()))
}

/// The curve with its vertical axis scaled: of many points the lowest and the highest of each of equal stretches.
fn thinned(curve: &Curve, scale: f64) -> Curve {
    let stretch = (2 * curve.points.len()).div_ceil(MOST_POINTS).max(1);
    let scaled = |point: Point| Point { x: point.x, y: scale * point.y, third: scale * point.third };
    let mut points = Vec::with_capacity(MOST_POINTS);
    if stretch <= 2 {
        points.extend(curve.points.iter().copied());
    } else {
        for points_of in curve.points.chunks(stretch) {
            let by_height = |a: &&Point, b: &&Point| a.y.total_cmp(&b.y);
            let ends = [points_of.iter().min_by(by_height), points_of.iter().max_by(by_height)];
            let mut ends: Vec<Point> = ends.into_iter().flatten().copied().collect();
            ends.sort_by(|a, b| a.x.total_cmp(&b.x));
            points.extend(ends);
        }
    }
    Curve { name: curve.name.clone(), points: points.into_iter().map(scaled).collect() }
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

fn lines(curves: &[Curve], axes: &[Axis; 2]) -> (Vec<Plot>, Layout) {
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
    }
    let layout = Layout::auto_from_plots(&plots).with_x_label(label(&axes[0])).with_y_label(label(&axes[1]));
    (plots, layout)
}

fn amplitudes(curves: &[Curve], axes: &[Axis; 2]) -> (Vec<Plot>, Layout) {
    let mut plots = Vec::new();
    let width = 0.6 / curves.len().max(1) as f64;
    for (index, curve) in curves.iter().enumerate() {
        // The first orders, side by side: eccentricity is no form, and high orders are noise.
        let shown = curve.points.iter().filter(|point| (2.0..=HIGHEST_ORDER).contains(&point.x));
        let stems = shown.map(|point| (point.x + width * index as f64, point.y)).collect::<Vec<_>>();
        let plot = LollipopPlot::new().with_points(stems).with_color(colour(index)).with_dot_radius(2.5);
        plots.push(Plot::Lollipop(if curve.name.is_empty() { plot } else { plot.with_legend(curve.name.clone()) }));
    }
    let layout = Layout::auto_from_plots(&plots).with_x_label("order / UPR").with_y_label(label(&axes[1]));
    (plots, layout)
}

/// The highest order of which the amplitude is drawn.
const HIGHEST_ORDER: f64 = 50.0;

fn map(points: &[Point], axes: &[Axis; 2], height: &Axis) -> (Vec<Plot>, Layout) {
    let x = Cells::of(points.iter().map(|point| point.x), MOST_CELLS[1]);
    let y = Cells::of(points.iter().map(|point| point.y), MOST_CELLS[0]);
    let mut sums = vec![vec![(0.0, 0_u32); x.count]; y.count];
    for point in points.iter().filter(|point| point.third.is_finite()) {
        // Pictures count rows from the top.
        let cell = &mut sums[y.count - 1 - y.index(point.y)][x.index(point.x)];
        cell.0 += point.third;
        cell.1 += 1;
    }
    let mean = |(sum, count): (f64, u32)| if count == 0 { f64::NAN } else { sum / f64::from(count) };
    let rows: Vec<Vec<f64>> = sums.into_iter().map(|row| row.into_iter().map(mean).collect()).collect();
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

/// Equal cells along an axis of a map.
struct Cells {
    from: f64,
    to: f64,
    count: usize,
}

impl Cells {
    /// As many cells as there are places, or as can be seen.
    fn of(places: impl Iterator<Item = f64>, most: usize) -> Self {
        let mut places: Vec<f64> = places.collect();
        places.sort_unstable_by(f64::total_cmp);
        let [first, last] = [places.first(), places.last()].map(|place| place.copied().unwrap_or_default());
        // Places that agree to a millionth of the range are one.
        places.dedup_by(|a, b| (*a - *b).abs() <= 1e-6 * (last - first));
        let half = 0.5 * (last - first) / (places.len().max(2) - 1) as f64;
        let half = if half > 0.0 { half } else { 0.5 };
        Self { from: first - half, to: last + half, count: places.len().clamp(1, most) }
    }

    fn index(&self, place: f64) -> usize {
        let share = (place - self.from) / (self.to - self.from);
        ((share * self.count as f64) as usize).min(self.count - 1)
    }
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
    fn a_thinned_curve_keeps_its_peak() {
        let mut points: Vec<Point> =
            (0..100_000).map(|index| Point { x: f64::from(index), y: 0.0, third: f64::NAN }).collect();
        points[43_211].y = 7.0;
        points[43_214].y = -3.0;
        let thin = thinned(&Curve { name: "a".into(), points }, 1000.0);
        assert!(thin.points.len() <= MOST_POINTS, "{} points", thin.points.len());
        for (x, y) in [(43_211.0, 7000.0), (43_214.0, -3000.0)] {
            assert!(thin.points.iter().any(|point| (point.x, point.y) == (x, y)));
        }
        assert!(thin.points.windows(2).all(|pair| pair[0].x <= pair[1].x));
    }

    #[test]
    fn polar_plots_have_round_circles() {
        for (value, expected) in
            [(0.0, 1.0), (0.93, 1.0), (1.0, 1.0), (1.2, 1.5), (23.0, 30.0), (6.1e-3, 8e-3), (9.7, 10.0)]
        {
            assert!((rounded_up(value) - expected).abs() < 1e-12 * expected, "{value}: {}", rounded_up(value));
        }
    }

    #[test]
    fn cells_of_a_map_are_as_many_as_the_grid_has() {
        let cells = Cells::of((0..50).map(|step| 0.1 * f64::from(step)).chain([0.1]), 320);
        assert_eq!(cells.count, 50);
        assert_eq!([0.0, 2.0, 4.9].map(|place| cells.index(place)), [0, 20, 49]);
        assert_eq!(Cells::of([3.0, 3.0].into_iter(), 320).count, 1);
    }

    #[test]
    fn an_expanded_uncertainty_has_two_digits() {
        let curve = |std: f64| Curve { name: "a".into(), points: vec![Point { x: 0.0, y: 0.0, third: std }; 3] };
        assert_eq!(legend(&curve(0.005_23), "um"), "a ± 0.010 µm");
        assert_eq!(legend(&curve(0.61), "um"), "a ± 1.2 µm");
        assert_eq!(legend(&curve(f64::NAN), "um"), "a");
    }
}
