//! The least-squares circle by Gauss and Newton, and a first guess for the others.

#![allow(clippy::inline_always, reason = "see runout_numerics::lanes")]

use super::{Circle, Points};
use runout_numerics::{
    chebyshev::inverse,
    lanes::{NullaryFnOnce, load, vectorised},
};

const LANES: usize = 8;
/// Sums over the points: count, x, y, xx, xy, yy of the directions, and d, dx, dy, dd with the deviations.
type Sums = [f64; 10];
/// Points that the first guess uses, at most about.
const GLANCE: usize = 1024;
const MOST_STEPS: usize = 100;

/// LSCI: least Σ (|pᵢ − c| − r)², the orthogonal distance regression.
///
/// Each step solves the normal equations of dᵢ − eᵢ·s − r with the exact deviations dᵢ and directions eᵢ at the present
/// centre (Gauss, Newton; Shakarji, *J. Res. NIST* 103 (1998) 633); a step that does not lessen the sum is halved.
pub(super) fn circle(points: &Points) -> Option<Circle> {
    if points.there() < 3 {
        return None;
    }
    let mut place = guess(points);
    let (mut best, mut step, mut scale) = (f64::INFINITY, [0.0; 2], f64::INFINITY);
    let mut deviation = f64::NAN;
    for _ in 0..MOST_STEPS {
        let sums = sums(points, place);
        let squares = sums[9] - sums[6] * sums[6] / sums[0];
        // 1e-9: a sum of squares is flat where it is least; what rounds there is no reason to go back.
        if squares > best * (1.0 + 1e-9) {
            step = step.map(|step| 0.5 * step);
            place = [place[0] - step[0], place[1] - step[1]];
        } else {
            best = squares;
            let [count, x, y, xx, xy, yy, d, dx, dy, _] = sums;
            let inverse = inverse([[xx, xy, x], [xy, yy, y], [x, y, count]])?;
            let [s_x, s_y, radius] = inverse.map(|row| row[0] * dx + row[1] * dy + row[2] * d);
            (step, deviation) = ([s_x, s_y], radius);
            place = [place[0] + s_x, place[1] + s_y];
        }
        let length = step[0].hypot(step[1]);
        // What is left shrinks as this step did, or as the neglected curvature lets it; below rounding it is done.
        let shrinks = (length / scale).max(points.span_um / points.radius_um()).min(1.0);
        if length * shrinks <= 0.1 * points.tolerance() {
            break;
        }
        scale = length;
    }
    place.iter().all(|place| place.is_finite()).then(|| points.about(place, deviation, [vec![], vec![]]))
}

fn sums(points: &Points, place: [f64; 2]) -> Sums {
    let radius_um = points.radius_um();
    vectorised(SumsOf {
        levels: points.cloud.levels(),
        directions: [points.cloud.column(0), points.cloud.column(1)],
        place,
        common: points.common(&place),
        radius_um,
    })
}

struct SumsOf<'a> {
    levels: &'a [f64],
    directions: [&'a [f64]; 2],
    place: [f64; 2],
    common: f64,
    radius_um: f64,
}

impl NullaryFnOnce for SumsOf<'_> {
    type Output = Sums;

    #[inline(always)]
    fn call(self) -> Sums {
        let Self { levels, directions: [u, v], place, common, radius_um: radius } = self;
        let [x0, y0] = place.map(|place| place / radius);
        let mut sums = [[0.0; LANES]; 10];
        let whole = levels.len() - levels.len() % LANES;
        for offset in (0..whole).step_by(LANES) {
            let of = [load(u, offset), load(v, offset), load(levels, offset)];
            add(&mut sums, of, [place[0], place[1], x0, y0], common, radius);
        }
        let rest = |column: &[f64], missing: f64| -> [f64; LANES] {
            std::array::from_fn(|lane| column.get(whole + lane).copied().unwrap_or(missing))
        };
        let of = [rest(u, 0.0), rest(v, 0.0), rest(levels, f64::NAN)];
        add(&mut sums, of, [place[0], place[1], x0, y0], common, radius);
        sums.map(|lanes| lanes.iter().sum())
    }
}

/// Adds the terms of points (u, v, w).
#[inline(always)]
fn add(
    sums: &mut [[f64; LANES]; 10],
    [u, v, w]: [[f64; LANES]; 3],
    [place_x, place_y, x0, y0]: [f64; 4],
    common: f64,
    radius: f64,
) {
    let (mut there, mut d, mut x, mut y) = ([0.0; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for l in 0..LANES {
        let lifted = w[l] - u[l] * place_x - v[l] * place_y + common;
        there[l] = if lifted.is_nan() { 0.0 } else { 1.0 };
        let lifted = if lifted.is_nan() { 0.0 } else { lifted };
        let stretch = (1.0 + 2.0 * lifted / radius).max(f64::MIN_POSITIVE).sqrt();
        d[l] = 2.0 * lifted / (1.0 + stretch);
        let share = there[l] / stretch;
        x[l] = share * (u[l] - x0);
        y[l] = share * (v[l] - y0);
    }
    for l in 0..LANES {
        sums[0][l] += there[l];
        sums[1][l] += x[l];
        sums[2][l] += y[l];
        sums[3][l] += x[l] * x[l];
        sums[4][l] += x[l] * y[l];
        sums[5][l] += y[l] * y[l];
        sums[6][l] += d[l];
        sums[7][l] += d[l] * x[l];
        sums[8][l] += d[l] * y[l];
        sums[9][l] += d[l] * d[l];
    }
}

/// Sum of squared deviations of some points from a circle, and how many are there.
pub(super) struct Squares<'a> {
    pub levels: &'a [f64],
    pub directions: [&'a [f64]; 2],
    pub place: [f64; 2],
    pub common: f64,
    pub radius_um: f64,
    pub deviation_um: f64,
}

impl NullaryFnOnce for Squares<'_> {
    type Output = (f64, usize);

    #[inline(always)]
    fn call(self) -> (f64, usize) {
        let Self { levels, directions: [u, v], place, common, radius_um: radius, deviation_um } = self;
        let (mut squares, mut points) = ([0.0; LANES], [0.0; LANES]);
        let mut add = |[u, v, w]: [[f64; LANES]; 3]| {
            for l in 0..LANES {
                let lifted = w[l] - u[l] * place[0] - v[l] * place[1] + common;
                let stretch = (1.0 + 2.0 * lifted / radius).max(0.0).sqrt();
                let deviation = 2.0 * lifted / (1.0 + stretch) - deviation_um;
                let there = !lifted.is_nan();
                squares[l] += if there { deviation * deviation } else { 0.0 };
                points[l] += if there { 1.0 } else { 0.0 };
            }
        };
        let whole = levels.len() - levels.len() % LANES;
        for offset in (0..whole).step_by(LANES) {
            add([load(u, offset), load(v, offset), load(levels, offset)]);
        }
        let rest = |column: &[f64], missing: f64| -> [f64; LANES] {
            std::array::from_fn(|lane| column.get(whole + lane).copied().unwrap_or(missing))
        };
        add([rest(u, 0.0), rest(v, 0.0), rest(levels, f64::NAN)]);
        (squares.iter().sum(), points.iter().sum::<f64>() as usize)
    }
}

/// Centre of the algebraic least-squares circle of some of the points: least Σ (ρᵢ² − r²)², linear in the centre (Kåsa,
/// *IEEE Trans. Instrum. Meas.* IM-25 (1976) 8).
pub(super) fn guess(points: &Points) -> [f64; 2] {
    let (u, v, levels) = (points.cloud.column(0), points.cloud.column(1), points.cloud.levels());
    let mut normal = [[0.0; 3]; 3];
    let mut right = [0.0; 3];
    for point in (0..levels.len()).step_by(levels.len().div_ceil(GLANCE).max(1)).filter(|i| !levels[*i].is_nan()) {
        let row = [u[point], v[point], 1.0];
        for i in 0..3 {
            right[i] += row[i] * levels[point];
            (0..3).for_each(|j| normal[i][j] += row[i] * row[j]);
        }
    }
    let centre = inverse(normal).map(|inverse| [0, 1].map(|i| (0..3).map(|j| inverse[i][j] * right[j]).sum()));
    centre
        .filter(|centre: &[f64; 2]| centre[0].hypot(centre[1]) < points.radius_um() + points.span_um)
        .unwrap_or_default()
}
