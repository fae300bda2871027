//! The Gaussian as a local regression: even or uneven positions, ends, gaps.

use std::f64::consts::PI;

/// Degree of the polynomial that is fitted around each point under the Gaussian's weights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Degree {
    /// The weighted mean: keeps a constant, also at the ends.
    Zero,
    /// Keeps a slope, also at the ends (ISO 16610-28, first moment); elsewhere the Gaussian of ISO 16610-21.
    #[default]
    One,
    /// Keeps a curvature; the robust filter's (ISO 16610-31), with a wider Gaussian so that 50 % pass at the cut-off.
    Two,
}

impl Degree {
    /// Width of the Gaussian exp(−π (x/(width·λc))²), over the cut-off.
    ///
    /// With a = π (width·λc/λ)², e^−a passes of a sine at degrees 0 and 1 and (1 + a) e^−a at degree 2. Half of the
    /// amplitude: a = ln 2 and a = 1.678 346 990 (ISO 16610-31 rounds its root to 0.7309).
    pub(super) fn width(self) -> f64 {
        let half = if self == Self::Two { 1.678_346_990_016_661 } else { std::f64::consts::LN_2 };
        (half / PI).sqrt()
    }
}

/// Half-width of the Gaussian in its own widths: beyond, it is below 6·10⁻¹⁰ of its middle.
pub(super) const REACH: f64 = 2.6;

/// Spacings that differ by less than this share are one.
const EVEN: f64 = 1e-6;

/// A Gaussian regression filter on given positions.
#[derive(Debug, Clone)]
pub struct Smoother {
    /// Ascending, in widths of the Gaussian.
    positions: Vec<f64>,
    /// Length of a turn in widths, for a closed profile.
    period: Option<f64>,
    /// How much of the profile each point stands for.
    cells: Vec<f64>,
    /// On even positions the Gaussian by distance in points.
    kernel: Option<Vec<f64>>,
    degree: Degree,
}

impl Smoother {
    /// A filter for an open profile on ascending positions, with the cut-off wavelength in their unit.
    #[must_use]
    pub fn open(positions: &[f64], cutoff: f64, degree: Degree) -> Self {
        Self::new(positions.to_vec(), None, cutoff, degree)
    }

    /// A filter for a closed profile of equally spaced points, with the cut-off in undulations per revolution.
    #[must_use]
    pub fn closed(points: usize, cutoff_upr: f64, degree: Degree) -> Self {
        let positions = (0..points).map(|point| point as f64 / points as f64).collect();
        Self::new(positions, Some(1.0), cutoff_upr.recip(), degree)
    }

    fn new(mut positions: Vec<f64>, period: Option<f64>, cutoff: f64, degree: Degree) -> Self {
        let width = degree.width() * cutoff;
        for position in &mut positions {
            *position /= width;
        }
        let count = positions.len();
        let spacing = match (positions.first(), positions.last(), period) {
            (_, _, Some(period)) => period / width / count as f64,
            (Some(first), Some(last), None) if count > 1 => (last - first) / (count - 1) as f64,
            _ => 1.0,
        };
        let even = positions.windows(2).all(|pair| (pair[1] - pair[0] - spacing).abs() <= EVEN * spacing);
        let kernel = even.then(|| {
            let reach = (REACH / spacing).ceil() as usize;
            (0..=reach).map(|steps| gaussian(steps as f64 * spacing)).collect()
        });
        let cells = if even { vec![1.0; count] } else { cells(&positions) };
        Self { positions, period: period.map(|period| period / width), cells, kernel, degree }
    }

    /// What passes of the values; where one is missing (NaN), nothing. `weights` may give points less say, by 0 to 1.
    #[must_use]
    pub fn low_pass(&self, values: &[f64], weights: Option<&[f64]>) -> Vec<f64> {
        // Missing values get no say, and a number that can be multiplied.
        let shares: Vec<f64> = (0..values.len().min(self.cells.len()))
            .map(|point| {
                let weight = weights.map_or(1.0, |weights| weights.get(point).copied().unwrap_or(0.0));
                if values[point].is_finite() { weight * self.cells[point] } else { 0.0 }
            })
            .collect();
        let known: Vec<f64> = values.iter().map(|value| if value.is_finite() { *value } else { 0.0 }).collect();
        (0..shares.len())
            .map(|point| {
                if !values[point].is_finite() {
                    return f64::NAN;
                }
                let mut moments = Moments::default();
                self.around(point, |other, distance, gaussian| {
                    moments.add(distance, gaussian * shares[other], known[other]);
                });
                moments.level(self.degree)
            })
            .collect()
    }

    /// The filter at one point as weights on the points from the first one returned; they sum to 1.
    pub(super) fn row(&self, point: usize) -> (usize, Vec<f64>) {
        let mut terms = Vec::new();
        let mut moments = Moments::default();
        self.around(point, |other, distance, gaussian| {
            let weight = gaussian * self.cells[other];
            moments.add(distance, weight, 0.0);
            terms.push((other, distance, weight));
        });
        let first = terms.first().map_or(0, |(other, ..)| *other);
        let influence = moments.influence(self.degree);
        let weights =
            terms.iter().map(|(_, u, weight)| weight * (influence[0] + u * (influence[1] + u * influence[2])));
        (first, weights.collect())
    }

    /// Visits the points within reach of one: index, distance, Gaussian.
    fn around(&self, point: usize, mut visit: impl FnMut(usize, f64, f64)) {
        let count = self.positions.len();
        let here = self.positions[point];
        match (&self.kernel, self.period) {
            (Some(kernel), Some(period)) => {
                let reach = kernel.len() - 1;
                let spacing = period / count as f64;
                // Narrow turns are gone round more than once: the Gaussian of a periodic profile.
                let mut other = (point + count - reach % count) % count;
                for step in 0..=2 * reach {
                    let distance = (step as f64 - reach as f64) * spacing;
                    visit(other, distance, kernel[step.abs_diff(reach)]);
                    other = if other + 1 == count { 0 } else { other + 1 };
                }
            }
            (Some(kernel), None) => {
                let reach = kernel.len() - 1;
                for other in point.saturating_sub(reach)..(point + reach + 1).min(count) {
                    visit(other, self.positions[other] - here, kernel[other.abs_diff(point)]);
                }
            }
            (None, _) => {
                let first = self.positions.partition_point(|position| *position < here - REACH);
                let near = self.positions[first..].iter().take_while(|position| **position <= here + REACH);
                for (step, position) in near.enumerate() {
                    visit(first + step, position - here, gaussian(position - here));
                }
            }
        }
    }
}

pub(super) fn gaussian(widths: f64) -> f64 {
    (-PI * widths * widths).exp()
}

/// Half of the distance to both neighbours; the ends stand for as much on their far side.
fn cells(positions: &[f64]) -> Vec<f64> {
    let gap = |left: usize| positions.get(left + 1).zip(positions.get(left)).map(|(right, left)| right - left);
    (0..positions.len())
        .map(|point| {
            let [left, right] = [point.checked_sub(1).and_then(gap), gap(point)];
            0.5 * (left.or(right).unwrap_or(1.0) + right.or(left).unwrap_or(1.0))
        })
        .collect()
}

/// Σ w uᵏ and Σ w uᵏ z of a local regression.
#[derive(Default)]
struct Moments {
    weights: [f64; 5],
    values: [f64; 3],
}

impl Moments {
    #[inline]
    fn add(&mut self, distance: f64, weight: f64, value: f64) {
        let mut power = weight;
        for (order, moment) in self.weights.iter_mut().enumerate() {
            *moment += power;
            if let Some(sum) = self.values.get_mut(order) {
                *sum += power * value;
            }
            power *= distance;
        }
    }

    /// First row of the inverse normal matrix: the fit's level at distance 0 is its product with Σ w uᵏ z. Where the
    /// points are too few for a degree, the next lower one.
    fn influence(&self, degree: Degree) -> [f64; 3] {
        /// A determinant below this share of its largest term says that there are too few points.
        const SINGULAR: f64 = 1e-9;
        let [m0, m1, m2, m3, m4] = self.weights;
        if degree == Degree::Two {
            let minors = [m2 * m4 - m3 * m3, m2 * m3 - m1 * m4, m1 * m3 - m2 * m2];
            let determinant = m0 * minors[0] + m1 * minors[1] + m2 * minors[2];
            if determinant > SINGULAR * m0 * m2 * m4 {
                return minors.map(|minor| minor / determinant);
            }
        }
        if degree != Degree::Zero {
            let determinant = m0 * m2 - m1 * m1;
            if determinant > SINGULAR * m0 * m2 {
                return [m2 / determinant, -m1 / determinant, 0.0];
            }
        }
        [m0.recip(), 0.0, 0.0]
    }

    fn level(&self, degree: Degree) -> f64 {
        let level: f64 = self.influence(degree).iter().zip(self.values).map(|(influence, sum)| influence * sum).sum();
        if level.is_finite() { level } else { f64::NAN }
    }
}
