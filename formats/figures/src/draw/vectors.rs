//! Vectors at places, as lines that are longer than they are.

use kuva::{
    plot::{LinePlot, ScatterPlot},
    render::{layout::Layout, plots::Plot},
};
use runout_core::table::panels::{Arrow, Axis, Panel, Panels};

use super::{colour, label, symbol};

/// Vectors that are drawn: more cannot be distinguished.
const MOST: usize = 400;
/// The longest line, as a share of the longer side of the places.
const LONGEST: f64 = 0.08;

/// Seen along the third axis, in the layer of it that is nearest to the middle. A point is the place, the line its vector.
pub(super) fn draw(panel: &Panel, axes: &[Axis; 2], figure: &Panels) -> (Vec<Plot>, Layout) {
    let all: Vec<&Arrow> = panel.curves.iter().flat_map(|curve| &curve.arrows).collect();
    let ends = |of: &dyn Fn(&Arrow) -> f64| {
        let numbers = all.iter().map(|arrow| of(arrow));
        numbers.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], one| [low.min(one), high.max(one)])
    };
    let [low, high] = ends(&|arrow| arrow.place[2]);
    let middle = 0.5 * (low + high);
    let away = |arrow: &Arrow| (arrow.place[2] - middle).abs();
    let layer =
        all.iter().min_by(|one, other| away(one).total_cmp(&away(other))).map_or(middle, |arrow| arrow.place[2]);
    let in_layer: Vec<&&Arrow> =
        all.iter().filter(|arrow| (arrow.place[2] - layer).abs() <= 1e-9 * layer.abs()).collect();
    let stride = in_layer.len().div_ceil(MOST).max(1);
    let side = [0, 1]
        .map(|axis| ends(&|arrow| arrow.place[axis]))
        .map(|[low, high]| high - low)
        .into_iter()
        .fold(0.0, f64::max);
    let longest = in_layer.iter().map(|arrow| arrow.vector[0].hypot(arrow.vector[1])).fold(0.0, f64::max);
    let times = if longest > 0.0 && side > 0.0 { LONGEST * side / longest } else { 1.0 };
    let mut plots = Vec::new();
    let shown = || in_layer.iter().step_by(stride);
    let feet = shown().map(|arrow| (arrow.place[0], arrow.place[1])).collect::<Vec<_>>();
    for arrow in shown() {
        let [x, y, _] = arrow.place;
        let line = vec![(x, y), (x + times * arrow.vector[0], y + times * arrow.vector[1])];
        plots.push(Plot::Line(LinePlot::new().with_data(line).with_color(colour(0)).with_stroke_width(1.4)));
    }
    plots.push(Plot::Scatter(ScatterPlot::new().with_data(feet).with_color(colour(1)).with_size(2.0)));
    let unit = figure.vector.first().map_or("", |axis| symbol(&axis.unit));
    let (depth, along) = (figure.height(), |axis: &Axis| symbol(&axis.unit).to_owned());
    let said = format!("at {} = {layer:.4} {}; the longest line is {longest:.3} {unit}", depth.name, along(depth));
    let layout =
        Layout::auto_from_plots(&plots).with_subtitle(said).with_x_label(label(&axes[0])).with_y_label(label(&axes[1]));
    (plots, layout)
}
