//! The model of a surface: heights of passes, and the lowest of them at each point.
//!
//! Pass n crosses a row at x = n·f + f·θ/2π + r(cos θ − 1) + p, with sin θ = y/r and p the phase of the scallops. At a distance d from
//! it, measured along the radius of the cutter, its edge is R − √(R² − d²) above its tip. A map that is turned by ε shows that place at
//! x(cos ε + sin ε tan θ) − y sin ε.

use std::f64::consts::TAU;

use runout_core::Complex64;

use crate::{
    config::FlyCuttingConfig,
    heights::{Heights, Row},
};

/// Lowest order of table straightness; the orders follow one another.
pub(crate) const FIRST_ORDER: usize = 2;
/// Orders of table straightness.
pub(crate) const ORDERS: usize = 4;

/// A line in the height of the tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Line {
    /// Periods a turn.
    pub ratio: f64,
    /// In nm; of a tilt about x in µrad.
    pub amplitude: f64,
    /// At the pass n = 0 and y = 0.
    pub phase: f64,
    /// A tilt about x: its height is the tilt times y.
    pub tilts: bool,
}

impl Line {
    /// What the amplitude is multiplied by in a row.
    pub(crate) fn lever(&self, row: &Row) -> f64 {
        if self.tilts { row.y_mm } else { 1.0 }
    }

    /// Phase at a pass, in radians.
    pub(crate) fn at(&self, pass: f64, row: &Row) -> f64 {
        TAU * self.ratio * (pass + row.angle / TAU) + self.phase
    }
}

/// How far a line of some periods a turn is at consecutive passes, as numbers on the unit circle.
#[derive(Debug, Clone)]
pub(crate) struct PassTurns {
    first: i64,
    units: Vec<Complex64>,
}

impl PassTurns {
    fn new(ratio: f64, first: i64, count: usize) -> Self {
        // Whole turns cancel before they cost digits.
        let unit = |index: usize| Complex64::cis(TAU * (ratio.fract() * (first as f64 + index as f64)).fract());
        Self { first, units: (0..count).map(unit).collect() }
    }

    /// At the passes of a surface.
    pub(crate) fn of(ratio: f64, passes: &[i32]) -> Self {
        let low = i64::from(passes.iter().min().copied().unwrap_or(0));
        let high = i64::from(passes.iter().max().copied().unwrap_or(-1));
        Self::new(ratio, low, (high - low + 1) as usize)
    }

    /// At one of these passes.
    pub(crate) fn at(&self, pass: i32) -> Complex64 {
        self.units[(i64::from(pass) - self.first) as usize]
    }

    /// From one of these passes on.
    fn from(&self, pass: i64) -> &[Complex64] {
        &self.units[(pass - self.first) as usize..]
    }
}

/// What is applied to the declared cut.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Applied {
    /// Relative error of the feed.
    pub feed_scale: f64,
    /// Actual less declared nose radius, in mm.
    pub radius_mm: f64,
    /// Angle of the map about its normal, in rad.
    pub rotation: f64,
    /// Actual less declared radius of the cutter, in mm.
    pub cutter_mm: f64,
    /// Slopes of the map along x and y, in µrad.
    pub tilt_urad: [f64; 2],
    /// Legendre polynomials of the table, from order 2, in nm.
    pub table_nm: [f64; ORDERS],
    /// Shape along y that all passes have: Legendre polynomials from order 2, in nm.
    pub shape_nm: [f64; ORDERS],
    pub lines: Vec<Line>,
}

impl Applied {
    /// Nothing.
    pub(crate) fn none() -> Self {
        Self {
            feed_scale: 0.0,
            radius_mm: 0.0,
            rotation: 0.0,
            cutter_mm: 0.0,
            tilt_urad: [0.0; 2],
            table_nm: [0.0; ORDERS],
            shape_nm: [0.0; ORDERS],
            lines: Vec::new(),
        }
    }
}

/// A cut with what is applied to it, over a map of some extent.
#[derive(Debug, Clone)]
pub(crate) struct Cut {
    /// Declared feed, in mm.
    pub declared_mm: f64,
    /// Actual feed, in mm.
    pub feed_mm: f64,
    pub nose_mm: f64,
    pub cutter_mm: f64,
    pub applied: Applied,
    /// Middle and half of the length of the map along x, and along y, in mm.
    pub middle_mm: [[f64; 2]; 2],
}

/// A surface as the model has it, without level.
#[derive(Debug, Clone, Default)]
pub(crate) struct Surface {
    /// Heights, in nm.
    pub height_nm: Vec<f64>,
    /// The pass that remains at each point.
    pub pass: Vec<i32>,
    /// Distance of each point from that pass, along the radius of the cutter, in mm.
    pub beside_mm: Vec<f64>,
}

/// Values of the Legendre polynomials 2 to 5.
pub(crate) fn legendre(u: f64) -> [f64; ORDERS] {
    let square = u * u;
    [
        1.5 * square - 0.5,
        (2.5 * square - 1.5) * u,
        (4.375 * square - 3.75) * square + 0.375,
        ((7.875 * square - 8.75) * square + 1.875) * u,
    ]
}

impl Cut {
    pub(crate) fn new(config: &FlyCuttingConfig, extent_mm: [[f64; 2]; 2], applied: Applied) -> Option<Self> {
        let declared_mm = 1e-3 * config.feed_um_per_rev;
        let (feed_mm, nose_mm) = (declared_mm * (1.0 + applied.feed_scale), config.nose_radius_mm + applied.radius_mm);
        let middle_mm = extent_mm.map(|[from, to]| [0.5 * (from + to), 0.5 * (to - from)]);
        let cutter_mm = config.cutter_radius_mm + applied.cutter_mm;
        let reaches = extent_mm[1].iter().all(|y_mm| y_mm.abs() < cutter_mm);
        (reaches && applied.feed_scale > -0.5 && applied.feed_scale < 1.0 && nose_mm > feed_mm).then_some(Self {
            declared_mm,
            feed_mm,
            nose_mm,
            cutter_mm,
            applied,
            middle_mm,
        })
    }

    /// Where the pass 0 crosses a row, in mm: x times [`stretch`](Self::stretch) is counted from there.
    pub(crate) fn first_mm(&self, row: &Row) -> f64 {
        // r(cos θ − 1), without cancellation.
        let (y_mm, r) = (row.y_mm, self.cutter_mm);
        let sag_mm = -y_mm * y_mm / (r + (r * r - y_mm * y_mm).sqrt());
        sag_mm + self.feed_mm * row.angle / TAU + self.applied.rotation.sin() * y_mm
    }

    /// What places along a row of a turned map are multiplied by, since arcs cross it at a slope.
    pub(crate) fn stretch(&self, row: &Row) -> f64 {
        let (sine, cosine) = self.applied.rotation.sin_cos();
        cosine + sine * row.angle.tan()
    }

    /// Place of the table at a pass, from −1 to 1 over the map.
    pub(crate) fn table_at(&self, pass: f64, row: &Row) -> f64 {
        let [middle_mm, half_mm] = self.middle_mm[0];
        (self.feed_mm * (pass + row.angle / TAU) - middle_mm) / half_mm
    }

    /// Legendre polynomials of a row over the map.
    pub(crate) fn across(&self, row: &Row) -> [f64; ORDERS] {
        let [middle_mm, half_mm] = self.middle_mm[1];
        legendre((row.y_mm - middle_mm) / half_mm)
    }

    /// Height of the tip at consecutive passes, in nm.
    fn tips(&self, row: &Row, turns: &[PassTurns], first: i64, count: usize, tips: &mut Vec<f64>) {
        tips.clear();
        tips.resize(count, 0.0);
        for (line, turns) in self.applied.lines.iter().zip(turns) {
            let of_row = Complex64::from_polar(line.amplitude * line.lever(row), line.at(0.0, row));
            for (tip, unit) in tips.iter_mut().zip(turns.from(first)) {
                *tip += of_row.re * unit.re - of_row.im * unit.im;
            }
        }
        if !self.is_straight() {
            for (index, tip) in tips.iter_mut().enumerate() {
                let values = legendre(self.table_at(first as f64 + index as f64, row));
                *tip += values.iter().zip(self.applied.table_nm).map(|(value, size)| value * size).sum::<f64>();
            }
        }
    }

    /// Whether the table is.
    fn is_straight(&self) -> bool {
        self.applied.table_nm.iter().all(|size| *size == 0.0)
    }

    /// Passes to each side of the nearest one that may be lower than it.
    fn reach(&self, row: &Row, largest_step: impl FnOnce() -> f64) -> i64 {
        let waves: f64 = self.applied.lines.iter().map(|line| 2.0 * (line.amplitude * line.lever(row)).abs()).sum();
        if waves == 0.0 && self.is_straight() {
            return 0;
        }
        // What is not a line is smooth: its step from pass to pass is bounded.
        let steps = if self.is_straight() { 0.0 } else { largest_step() };
        let per_pass_mm = self.feed_mm * row.cosine;
        let most = (2.0 * self.nose_mm / per_pass_mm).ceil() as i64;
        let mut reach = 1;
        // The edge of the pass `reach + 1`, at half a feed less than so many, less that of the nearest pass.
        while reach < most {
            let edge_nm = |passes: f64| 1e6 * (passes * per_pass_mm).powi(2) / (2.0 * self.nose_mm);
            if edge_nm(reach as f64 + 0.5) - edge_nm(0.5) > waves + steps * (reach + 1) as f64 {
                break;
            }
            reach += 1;
        }
        reach
    }

    /// The surface at the points of a map, with the scallops at a phase.
    pub(crate) fn surface(&self, heights: &Heights, phase_mm: f64) -> Surface {
        let mut surface = Surface {
            height_nm: Vec::with_capacity(heights.len()),
            pass: Vec::with_capacity(heights.len()),
            beside_mm: Vec::with_capacity(heights.len()),
        };
        if heights.len() == 0 {
            return surface;
        }
        let rows = || heights.rows.iter().filter(|row| !row.points.is_empty());
        let ends = rows().map(|row| self.ends(heights, row, phase_mm));
        let whole =
            ends.fold([f64::INFINITY, f64::NEG_INFINITY], |whole, [low, high]| [whole[0].min(low), whole[1].max(high)]);
        let reach = |row| if self.is_straight() { self.reach(row, || 0.0) } else { self.most(row) };
        let beyond = rows().map(reach).max().unwrap_or(0);
        let (first, last) = (whole[0].round() as i64 - beyond, whole[1].round() as i64 + beyond);
        let count = (last - first + 1).max(0) as usize;
        let turns: Vec<PassTurns> =
            self.applied.lines.iter().map(|line| PassTurns::new(line.ratio, first, count)).collect();
        let mut tips = Vec::new();
        for row in rows() {
            self.row(heights, row, phase_mm, &turns, &mut tips, &mut surface);
        }
        surface
    }

    /// Passes to each side beyond which the edge does not reach.
    fn most(&self, row: &Row) -> i64 {
        (2.0 * self.nose_mm / (self.feed_mm * row.cosine)).ceil() as i64
    }

    /// Turns from the pass 0 to the first and the last point of a row.
    fn ends(&self, heights: &Heights, row: &Row, phase_mm: f64) -> [f64; 2] {
        let (start_mm, stretch) = (self.first_mm(row) + phase_mm, self.stretch(row));
        [row.points.start, row.points.end - 1].map(|point| (heights.x_mm[point] * stretch - start_mm) / self.feed_mm)
    }

    fn row(
        &self,
        heights: &Heights,
        row: &Row,
        phase_mm: f64,
        turns: &[PassTurns],
        tips: &mut Vec<f64>,
        surface: &mut Surface,
    ) {
        let [low, high] = self.ends(heights, row, phase_mm);
        let largest_step = || {
            let mut tips = Vec::new();
            self.tips(row, turns, low.round() as i64, (high.round() - low.round()) as usize + 1, &mut tips);
            tips.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max)
        };
        let reach = self.reach(row, largest_step).min(self.most(row));
        // Places count from the first pass, so that none is below 0.
        let first = low.round() as i64 - reach;
        let count = (high.round() as i64 + reach - first + 1) as usize;
        if reach == 0 {
            tips.clear();
            tips.resize(count, 0.0);
        } else {
            self.tips(row, turns, first, count, tips);
        }
        let square = self.nose_mm * self.nose_mm;
        let parabola = 0.5e6 / self.nose_mm;
        let per_pass_mm = self.feed_mm * row.cosine;
        let [tilt_x, tilt_y] = self.applied.tilt_urad;
        let shape_nm: f64 = self.across(row).iter().zip(self.applied.shape_nm).map(|(value, size)| value * size).sum();
        let start_mm = self.first_mm(row) + phase_mm + self.feed_mm * first as f64;
        let (per_mm, stretch) = (self.feed_mm.recip(), self.stretch(row));
        let reach = reach as usize;
        for x in &heights.x_mm[row.points.clone()] {
            let at = (x * stretch - start_mm) * per_mm;
            let nearest = ((at + 0.5) as usize).clamp(reach, count - 1 - reach);
            let mut best = (f64::INFINITY, 0, 0.0);
            let mut cut = |pass: usize| {
                let beside_mm = (at - pass as f64) * per_pass_mm;
                let (tip, across) = (tips[pass], beside_mm * beside_mm);
                // An arc is nowhere lower than its parabola: most passes beside the nearest are not evaluated.
                if across > square || across * parabola + tip > best.0 {
                    return;
                }
                let height = 1e6 * across / (self.nose_mm + (square - across).sqrt()) + tip;
                if height < best.0 {
                    best = (height, pass, beside_mm);
                }
            };
            cut(nearest);
            for beside in 1..=reach {
                cut(nearest - beside);
                cut(nearest + beside);
            }
            // µrad times mm is nm.
            surface.height_nm.push(best.0 + shape_nm + tilt_x * x + tilt_y * row.y_mm);
            surface.pass.push((first as f64 + best.1 as f64) as i32);
            surface.beside_mm.push(best.2);
        }
    }

    /// Change of the height with the distance from the pass, in nm/mm.
    pub(crate) fn slope(&self, beside_mm: f64) -> f64 {
        1e6 * beside_mm / (self.nose_mm * self.nose_mm - beside_mm * beside_mm).sqrt()
    }
}
