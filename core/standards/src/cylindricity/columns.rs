//! Points of a wall in separate columns, so that all of them are evaluated in vector registers.

#![allow(clippy::inline_always, reason = "see runout_numerics::lanes")]

use runout_numerics::lanes::{NullaryFnOnce, load, vectorised};

const LANES: usize = 8;
/// Sums over points of products of two of the derivatives by the axis, with a sign of their own, 1 and the deviation: the upper
/// triangle of a 6 by 6 matrix, row by row.
pub(super) type Squares = [f64; 21];

/// An axis inside: x and y midway and how far it leans until the end, in µm.
pub(super) type Axis = [f64; 4];

/// Points as f = p/R, w = (|p|² − R²)/2R and ζ, as `Points` describes them.
#[derive(Debug, Clone, Default)]
pub(super) struct Columns {
    u: Vec<f64>,
    v: Vec<f64>,
    levels: Vec<f64>,
    zeta: Vec<f64>,
}

/// An axis with what all points need of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct About {
    axis: Axis,
    slopes: [f64; 2],
    length: f64,
    radius_um: f64,
    half_um: f64,
}

impl About {
    pub(crate) fn new(axis: &Axis, radius_um: f64, half_um: f64) -> Self {
        let [a, b] = [axis[2] / half_um, axis[3] / half_um];
        Self { axis: *axis, slopes: [a, b], length: 1.0 + a * a + b * b, radius_um, half_um }
    }

    /// Distance of a point from the axis less R.
    #[inline(always)]
    pub(crate) fn deviation(&self, point: [f64; 4]) -> f64 {
        self.with_slopes(point).0
    }

    /// Distance of a point from the axis less R, and its derivatives by the axis.
    #[inline(always)]
    pub(crate) fn with_slopes(&self, [u, v, level, zeta]: [f64; 4]) -> (f64, Axis) {
        let Self { axis, slopes: [a, b], length, radius_um: radius, half_um } = *self;
        let [x, y] = [axis[0] + axis[2] * zeta, axis[1] + axis[3] * zeta];
        let [q_x, q_y] = [radius * u - x, radius * v - y];
        let along = a * q_x + b * q_y;
        let lifted = level - x * u - y * v + (x * x + y * y - along * along / length) / (2.0 * radius);
        let stretch = (1.0 + 2.0 * lifted / radius).max(f64::MIN_POSITIVE).sqrt();
        let across = |q: f64, slope: f64| (slope * along / length - q) / (radius * stretch);
        let turned = |q: f64, slope: f64| along * (slope * along / length - q) / (radius * stretch * length * half_um);
        let [s_x, s_y] = [across(q_x, a), across(q_y, b)];
        let slopes = [s_x, s_y, s_x * zeta + turned(q_x, a), s_y * zeta + turned(q_y, b)];
        (2.0 * lifted / (1.0 + stretch), slopes)
    }
}

impl Columns {
    pub(crate) fn len(&self) -> usize {
        self.levels.len()
    }

    pub(crate) fn push(&mut self, [u, v, level, zeta]: [f64; 4]) {
        self.u.push(u);
        self.v.push(v);
        self.levels.push(level);
        self.zeta.push(zeta);
    }

    pub(crate) fn truncate(&mut self, count: usize) {
        for column in [&mut self.u, &mut self.v, &mut self.levels, &mut self.zeta] {
            column.truncate(count);
        }
    }

    pub(crate) fn reserve(&mut self, more: usize) {
        for column in [&mut self.u, &mut self.v, &mut self.levels, &mut self.zeta] {
            column.reserve(more);
        }
    }

    pub(crate) fn at(&self, point: usize) -> [f64; 4] {
        [self.u[point], self.v[point], self.levels[point], self.zeta[point]]
    }

    /// The levels w; NaN where a point is missing.
    pub(crate) fn levels(&self) -> &[f64] {
        &self.levels
    }

    /// Deviation of each point from an axis; NaN where it is missing.
    pub(crate) fn deviations(&self, about: &About) -> Vec<f64> {
        let mut deviations = Vec::new();
        self.fill(about, &mut deviations);
        deviations
    }

    /// Writes the deviation of each point from an axis to `deviations`; NaN where it is missing.
    pub(crate) fn fill(&self, about: &About, deviations: &mut Vec<f64>) {
        deviations.resize(self.len(), 0.0);
        vectorised(Deviations { columns: self, about, out: deviations });
    }

    /// Sums for the least-squares cylinder, of the points that are there.
    pub(crate) fn squares(&self, about: &About) -> Squares {
        vectorised(SquaresOf { columns: self, about })
    }
}

struct Deviations<'a> {
    columns: &'a Columns,
    about: &'a About,
    out: &'a mut [f64],
}

impl NullaryFnOnce for Deviations<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { columns: Columns { u, v, levels, zeta }, about, out } = self;
        let about = *about;
        let points = u.iter().zip(v).zip(levels.iter().zip(zeta));
        for (deviation, ((u, v), (level, zeta))) in out.iter_mut().zip(points) {
            *deviation = about.deviation([*u, *v, *level, *zeta]);
        }
    }
}

struct SquaresOf<'a> {
    columns: &'a Columns,
    about: &'a About,
}

impl NullaryFnOnce for SquaresOf<'_> {
    type Output = Squares;

    #[inline(always)]
    fn call(self) -> Squares {
        let Self { columns: Columns { u, v, levels, zeta }, about } = self;
        let about = *about;
        let mut sums = [[0.0; LANES]; 21];
        let whole = levels.len() - levels.len() % LANES;
        for offset in (0..whole).step_by(LANES) {
            add(&mut sums, &about, [load(u, offset), load(v, offset), load(levels, offset), load(zeta, offset)]);
        }
        let rest = |column: &[f64], missing: f64| -> [f64; LANES] {
            std::array::from_fn(|lane| column.get(whole + lane).copied().unwrap_or(missing))
        };
        add(&mut sums, &about, [rest(u, 0.0), rest(v, 0.0), rest(levels, f64::NAN), rest(zeta, 0.0)]);
        sums.map(|lanes| lanes.iter().sum())
    }
}

/// Adds the terms of some points.
#[inline(always)]
fn add(sums: &mut [[f64; LANES]; 21], about: &About, [u, v, w, zeta]: [[f64; LANES]; 4]) {
    let mut rows = [[0.0; LANES]; 6];
    for l in 0..LANES {
        let there = !w[l].is_nan();
        let (d, [x, y, lean_x, lean_y]) = about.with_slopes([u[l], v[l], if there { w[l] } else { 0.0 }, zeta[l]]);
        let share = if there { 1.0 } else { 0.0 };
        rows[0][l] = -share * x;
        rows[1][l] = -share * y;
        rows[2][l] = -share * lean_x;
        rows[3][l] = -share * lean_y;
        rows[4][l] = share;
        rows[5][l] = share * d;
    }
    let mut place = 0;
    for i in 0..6 {
        for j in i..6 {
            for l in 0..LANES {
                sums[place][l] += rows[i][l] * rows[j][l];
            }
            place += 1;
        }
    }
}
