//! Hybrid parameters (ISO 25178-2:2021, 4.4).

#![allow(clippy::inline_always, reason = "see runout_numerics::lanes")]

use super::HeightMap;
use runout_numerics::lanes::{NullaryFnOnce, load, vectorised};

const LANES: usize = 8;

/// The six-neighbour differences of ISO 25178-2's local gradient: the derivative of the polynomial of degree 6 through a
/// point and three on each side, times 60.
const GRADIENT: [f64; 3] = [45.0, -9.0, 1.0];

/// Slopes and area.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Hybrid {
    /// Root mean square gradient, over the points that have three measured neighbours on each side; NaN where none has.
    pub sdq: f64,
    /// Developed interfacial area ratio in %, over the cells whose four corners were measured.
    pub sdr_percent: f64,
}

impl Hybrid {
    pub(super) fn of(map: &HeightMap) -> Self {
        Self { sdq: gradient(map), sdr_percent: 100.0 * developed(map) }
    }
}

/// Derivative at the middle of seven values at distance 1.
#[inline(always)]
pub(crate) fn derivative(at: impl Fn(isize) -> f64) -> f64 {
    let [near, next, far] = GRADIENT;
    (near * (at(1) - at(-1)) + next * (at(2) - at(-2)) + far * (at(3) - at(-3))) / 60.0
}

fn gradient(map: &HeightMap) -> f64 {
    let (columns, rows) = (map.columns(), map.rows());
    // µm over mm.
    let [across, along] = [map.dx_mm(), map.dy_mm()].map(|distance| 1e-3 / distance);
    let mut found = Sum::default();
    for row in 3..rows.saturating_sub(3) {
        let ring = |step: isize| &map.heights_um()[row.saturating_add_signed(step) * columns..][..columns];
        let rings: [&[f64]; 7] = std::array::from_fn(|index| ring(index.cast_signed() - 3));
        let here = rings[3];
        found.add(vectorised(Gradients { rings, across, along }));
        let ends = if map.closed() {
            (0..3.min(columns)).chain(columns.saturating_sub(3).max(3)..columns)
        } else {
            (0..0).chain(0..0)
        };
        for column in ends {
            let beside = |step: isize| (column.cast_signed() + step).rem_euclid(columns.cast_signed()) as usize;
            let slope = across * derivative(|step| here[beside(step)]);
            let rise = along * derivative(|step| rings[(step + 3) as usize][column]);
            found.add_one(slope * slope + rise * rise);
        }
    }
    found.mean().sqrt()
}

/// A sum of what is there, and how much is.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    sum: f64,
    count: f64,
}

impl Sum {
    fn add(&mut self, other: Self) {
        self.sum += other.sum;
        self.count += other.count;
    }

    fn add_one(&mut self, value: f64) {
        if value.is_finite() {
            self.add(Self { sum: value, count: 1.0 });
        }
    }

    fn mean(self) -> f64 {
        self.sum / self.count
    }
}

/// Sums over lanes that do not wait for each other.
#[derive(Default)]
struct Lanes {
    sums: [f64; LANES],
    counts: [f64; LANES],
}

impl Lanes {
    #[inline(always)]
    fn add(&mut self, values: [f64; LANES]) {
        for l in 0..LANES {
            let there = values[l].abs() < f64::INFINITY;
            self.sums[l] += if there { values[l] } else { 0.0 };
            self.counts[l] += if there { 1.0 } else { 0.0 };
        }
    }

    #[inline(always)]
    fn sum(self) -> Sum {
        Sum { sum: self.sums.iter().sum(), count: self.counts.iter().sum() }
    }
}

/// The squared gradients of a ring at points with three neighbours on both sides, from three rings below to three above.
struct Gradients<'a> {
    rings: [&'a [f64]; 7],
    across: f64,
    along: f64,
}

impl NullaryFnOnce for Gradients<'_> {
    type Output = Sum;

    #[inline(always)]
    fn call(self) -> Sum {
        let Self { rings, across, along } = self;
        let inner = rings[0].len().saturating_sub(6);
        let whole = inner - inner % LANES;
        let mut lanes = Lanes::default();
        for offset in (0..whole).step_by(LANES) {
            let beside: [[f64; LANES]; 7] = std::array::from_fn(|index| load(rings[3], offset + index));
            let above: [[f64; LANES]; 7] = std::array::from_fn(|index| load(rings[index], offset + 3));
            let mut squares = [0.0; LANES];
            for l in 0..LANES {
                let of = |all: &[[f64; LANES]; 7]| derivative(|step| all[(step + 3) as usize][l]);
                let (slope, rise) = (across * of(&beside), along * of(&above));
                squares[l] = slope * slope + rise * rise;
            }
            lanes.add(squares);
        }
        let mut found = lanes.sum();
        for column in whole + 3..inner + 3 {
            let slope = across * derivative(|step| rings[3][column.saturating_add_signed(step)]);
            let rise = along * derivative(|step| rings[(step + 3) as usize][column]);
            found.add_one(slope * slope + rise * rise);
        }
        found
    }
}

/// Area over projected area, minus 1: each cell is the mean of its two triangulations (annex D).
fn developed(map: &HeightMap) -> f64 {
    let columns = map.columns();
    let [across, along] = [map.dx_mm(), map.dy_mm()].map(|distance| 1e-3 / distance);
    let mut found = Sum::default();
    let mut rows = map.heights_um().chunks_exact(columns);
    let Some(mut lower) = rows.next() else { return f64::NAN };
    for upper in rows {
        found.add(vectorised(Cells { lower, upper, across, along }));
        if map.closed() {
            let [left, right] = [columns - 1, 0].map(|column| [lower[column], upper[column]]);
            found.add_one(cell(left, right, across, along));
        }
        lower = upper;
    }
    found.mean()
}

/// Area of a cell over its projected area, minus 1, from its lower and upper corners.
#[inline(always)]
fn cell(left: [f64; 2], right: [f64; 2], across: f64, along: f64) -> f64 {
    let area = |p: f64, q: f64| (1.0 + p * p + q * q).sqrt();
    let [p0, p1] = [across * (right[0] - left[0]), across * (right[1] - left[1])];
    let [q0, q1] = [along * (left[1] - left[0]), along * (right[1] - right[0])];
    0.25 * (area(p0, q0) + area(p0, q1) + area(p1, q0) + area(p1, q1)) - 1.0
}

/// Cells between two rings, but for the one that closes them.
struct Cells<'a> {
    lower: &'a [f64],
    upper: &'a [f64],
    across: f64,
    along: f64,
}

impl NullaryFnOnce for Cells<'_> {
    type Output = Sum;

    #[inline(always)]
    fn call(self) -> Sum {
        let Self { lower, upper, across, along } = self;
        let cells = lower.len().saturating_sub(1);
        let whole = cells - cells % LANES;
        let mut lanes = Lanes::default();
        for offset in (0..whole).step_by(LANES) {
            let [left, right] =
                [offset, offset + 1].map(|at| -> [[f64; LANES]; 2] { [load(lower, at), load(upper, at)] });
            let mut areas = [0.0; LANES];
            for l in 0..LANES {
                areas[l] = cell([left[0][l], left[1][l]], [right[0][l], right[1][l]], across, along);
            }
            lanes.add(areas);
        }
        let mut found = lanes.sum();
        for column in whole..cells {
            let [left, right] = [column, column + 1].map(|at| [lower[at], upper[at]]);
            found.add_one(cell(left, right, across, along));
        }
        found
    }
}
