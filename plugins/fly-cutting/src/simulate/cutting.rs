//! The surface by tool interference: at each point the lowest of all passes that reach it remains.

use super::{config::GridConfig, tool::Machine};

/// Step of the angle over which the height of the tool is taken as a straight line.
const SLOPE_STEP: f64 = 1e-4;

/// A pass where it crosses a row.
struct Pass {
    x_mm: f64,
    height_nm: f64,
    /// Change of the height with the angle, in nm per radian.
    slope_nm: f64,
}

/// Heights in nm, row by row.
pub(super) fn cut(machine: &Machine, grid: &GridConfig) -> Vec<f64> {
    let mut heights = Vec::with_capacity(grid.rows * grid.columns);
    for row in 0..grid.rows {
        let y_mm = grid.origin_y_mm + grid.step_y_mm * row as f64;
        if machine.rotation == 0.0 {
            cut_row(machine, grid, y_mm, &mut heights);
            continue;
        }
        let (sine, cosine) = machine.rotation.sin_cos();
        for column in 0..grid.columns {
            let x_mm = grid.origin_x_mm + grid.step_x_mm * column as f64;
            let origin_x_mm = x_mm * cosine - y_mm * sine;
            let point = GridConfig { columns: 1, origin_x_mm, ..grid.clone() };
            cut_row(machine, &point, x_mm * sine + y_mm * cosine, &mut heights);
        }
    }
    heights
}

fn cut_row(machine: &Machine, grid: &GridConfig, y_mm: f64, heights: &mut Vec<f64>) {
    let feed_mm = machine.feed_mm();
    let angle = machine.crossing(y_mm);
    let (sine, cosine) = angle.sin_cos();
    let last_mm = grid.origin_x_mm + grid.step_x_mm * (grid.columns - 1) as f64;
    // No pass farther than this is lower than the nearest one.
    let rise_mm = 1e-6 * 2.0 * machine.highest_nm();
    let nose_mm = machine.nose_radius_mm;
    let reach_mm = ((2.0 * nose_mm * rise_mm).sqrt() / cosine + 3.0 * feed_mm).min(nose_mm / cosine + 3.0 * feed_mm);
    let base_mm = machine.tip(0.0, angle).x_mm;
    let turn_at = |x_mm: f64| (x_mm - base_mm) / feed_mm;
    let first = turn_at(grid.origin_x_mm - reach_mm).floor() as i64;
    let last = turn_at(last_mm + reach_mm).ceil() as i64;
    let passes: Vec<Pass> = (first..=last)
        .map(|turn| {
            let [here, next] = [angle, angle + SLOPE_STEP].map(|angle| machine.tip(turn as f64, angle));
            let slope_nm = (next.height_nm - here.height_nm) / SLOPE_STEP;
            Pass { x_mm: here.x_mm, height_nm: here.height_nm, slope_nm }
        })
        .collect();
    let lowest_nm = passes.iter().map(|pass| pass.height_nm).fold(f64::INFINITY, f64::min);
    let section = Section { radius_mm: machine.cutter_radius_mm, sine, cosine, nose_mm };
    for column in 0..grid.columns {
        let x_mm = grid.origin_x_mm + grid.step_x_mm * column as f64;
        let nearest = (turn_at(x_mm).round() as i64 - first) as usize;
        let mut low_nm = f64::INFINITY;
        // Outward on both sides, until the nose alone is higher than what remains.
        let mut take = |pass: &Pass| {
            let (edge_nm, angle) = section.edge(x_mm - pass.x_mm);
            low_nm = low_nm.min(edge_nm + pass.height_nm + pass.slope_nm * angle);
            edge_nm + lowest_nm < low_nm
        };
        let (before, after) = passes.split_at(nearest.min(passes.len()));
        let _ = after.iter().position(|pass| !take(pass));
        let _ = before.iter().rev().position(|pass| !take(pass));
        heights.push(low_nm);
    }
}

/// The cutting edge where it crosses a row. It lies in the plane through the spindle's axis and the tip.
struct Section {
    radius_mm: f64,
    sine: f64,
    cosine: f64,
    nose_mm: f64,
}

impl Section {
    /// Height of the edge above the tip, in nm, at a point of the row that is `beside_mm` from where the tip crosses it; and by which
    /// angle the tool turns until its edge is over the point. Infinite where the nose does not reach.
    fn edge(&self, beside_mm: f64) -> (f64, f64) {
        let Self { radius_mm, sine, cosine, nose_mm } = self;
        // Distance of the point from the axis less that of the tip, without cancellation.
        let along_mm = 2.0 * radius_mm * cosine * beside_mm + beside_mm * beside_mm;
        let from_axis_mm = (radius_mm * radius_mm + along_mm).sqrt();
        let out_mm = along_mm / (from_axis_mm + radius_mm);
        let square = nose_mm * nose_mm - out_mm * out_mm;
        if square < 0.0 {
            return (f64::INFINITY, 0.0);
        }
        (1e6 * out_mm * out_mm / (nose_mm + square.sqrt()), -beside_mm * sine / from_axis_mm)
    }
}
