//! The robust areal Gaussian filter (ISO 16610-71).

use nalgebra::{Matrix6, Vector6};

use super::{
    Degree, Robust,
    regression::{REACH, gaussian},
    robust::{Biweight, MOST_ITERATIONS},
};
use crate::height_map::HeightMap;

/// Exponents (across, along) of the polynomial of degree 2.
const POWERS: [[usize; 2]; 6] = [[0, 0], [1, 0], [0, 1], [2, 0], [1, 1], [0, 2]];
/// Highest exponent of a moment of the weights.
const HIGHEST: usize = 4;
/// [`HIGHEST`] as an exponent.
const HIGHEST_POWER: i32 = 4;

/// The robust areal Gaussian low-pass (ISO 16610-71) of a map: around each point a polynomial of degree 2 is fitted under the
/// Gaussian's weights, again and again with Tukey's biweight of the residual, as
/// [`robust_gaussian`](super::robust_gaussian) does along a profile. Round a closed map it is circular; ends keep a curvature.
/// Missing points have no say and stay missing. The cut-off is a wavelength along the surface, above 0; `weights` of the
/// result are those of the last iteration, `[row][column]`.
#[must_use]
pub fn robust_areal_gaussian(map: &HeightMap, cutoff_mm: f64) -> Robust {
    let heights = map.heights_um();
    let fit = Fit::new(map, cutoff_mm);
    let mut weights: Vec<f64> = heights.iter().map(|height| f64::from(u8::from(height.is_finite()))).collect();
    let mut low_pass = fit.low_pass(heights, &weights);
    let mut biweight = Biweight::default();
    for iterations in 1..=MOST_ITERATIONS {
        if biweight.next(heights, &low_pass, &mut weights) {
            return Robust { low_pass, weights, iterations, settled: true };
        }
        low_pass = fit.low_pass(heights, &weights);
    }
    Robust { low_pass, weights, iterations: MOST_ITERATIONS, settled: false }
}

/// The Gaussian times powers of the distance in widths, in one direction: from `reach` points before to as many after.
struct Kernel {
    reach: usize,
    /// `[power][point]`.
    powers: Vec<Vec<f64>>,
}

impl Kernel {
    fn new(spacing_mm: f64, width_mm: f64) -> Self {
        let spacing = spacing_mm / width_mm;
        let reach = (REACH / spacing).ceil() as usize;
        let distances = || (0..=2 * reach).map(|step| (step as f64 - reach as f64) * spacing);
        let power = |power: i32| distances().map(|u| gaussian(u) * u.powi(power)).collect();
        Self { reach, powers: (0..=HIGHEST_POWER).map(power).collect() }
    }
}

/// The fit of a polynomial around every point of one map.
struct Fit {
    rows: usize,
    columns: usize,
    closed: bool,
    across: Kernel,
    along: Kernel,
}

impl Fit {
    fn new(map: &HeightMap, cutoff_mm: f64) -> Self {
        let width_mm = Degree::Two.width() * cutoff_mm;
        let (across, along) = (Kernel::new(map.dx_mm(), width_mm), Kernel::new(map.dy_mm(), width_mm));
        Self { rows: map.rows(), columns: map.columns(), closed: map.closed(), across, along }
    }

    /// Sums along each row of a kernel times what is beside a point.
    fn over_row(&self, values: &[f64], power: usize) -> Vec<f64> {
        let (reach, kernel) = (self.across.reach, &self.across.powers[power]);
        let columns = self.columns;
        let mut sums = vec![0.0; values.len()];
        let mut framed = vec![0.0; columns + 2 * reach];
        for (row, target) in values.chunks_exact(columns).zip(sums.chunks_exact_mut(columns)) {
            framed[reach..reach + columns].copy_from_slice(row);
            if self.closed {
                for place in 0..reach {
                    // Narrow turns are gone round more than once.
                    framed[place] = row[(place + columns * reach.div_ceil(columns) - reach) % columns];
                    framed[reach + columns + place] = row[place % columns];
                }
            }
            for (step, weight) in kernel.iter().enumerate() {
                target.iter_mut().zip(&framed[step..]).for_each(|(sum, value)| *sum += weight * value);
            }
        }
        sums
    }

    /// Sums along the columns, of one row, of a kernel times what is beside a point.
    fn over_column(&self, values: &[f64], power: usize, row: usize, sums: &mut [f64]) {
        let (reach, kernel) = (self.along.reach, &self.along.powers[power]);
        sums.fill(0.0);
        for other in row.saturating_sub(reach)..(row + reach + 1).min(self.rows) {
            let weight = kernel[other + reach - row];
            let beside = &values[other * self.columns..][..self.columns];
            sums.iter_mut().zip(beside).for_each(|(sum, value)| *sum += weight * value);
        }
    }

    fn low_pass(&self, heights: &[f64], weights: &[f64]) -> Vec<f64> {
        let weighted: Vec<f64> = heights
            .iter()
            .zip(weights)
            .map(|(height, weight)| if height.is_finite() { height * weight } else { 0.0 })
            .collect();
        let of_weights: Vec<Vec<f64>> = (0..=HIGHEST).map(|power| self.over_row(weights, power)).collect();
        let of_heights: Vec<Vec<f64>> = (0..=2).map(|power| self.over_row(&weighted, power)).collect();
        let columns = self.columns;
        let index = |across: usize, along: usize| across * (HIGHEST + 1) + along;
        let mut moments = vec![vec![0.0; columns]; (HIGHEST + 1) * (HIGHEST + 1)];
        let mut products = vec![vec![0.0; columns]; POWERS.len()];
        let mut filtered = vec![f64::NAN; heights.len()];
        for row in 0..self.rows {
            for (across, sums) in of_weights.iter().enumerate() {
                for along in 0..=HIGHEST - across {
                    self.over_column(sums, along, row, &mut moments[index(across, along)]);
                }
            }
            for (product, [across, along]) in products.iter_mut().zip(POWERS) {
                self.over_column(&of_heights[across], along, row, product);
            }
            for column in (0..columns).filter(|column| heights[row * columns + column].is_finite()) {
                let normal = Matrix6::from_fn(|a, b| {
                    moments[index(POWERS[a][0] + POWERS[b][0], POWERS[a][1] + POWERS[b][1])][column]
                });
                let right = Vector6::from_fn(|a, _| products[a][column]);
                filtered[row * columns + column] = level(&normal, &right);
            }
        }
        filtered
    }
}

/// The fit's height at its middle; of the plain mean where the points are too few for a polynomial.
fn level(normal: &Matrix6<f64>, right: &Vector6<f64>) -> f64 {
    /// A pivot below this share of its diagonal entry says that there are too few points.
    const SINGULAR: f64 = 1e-9;
    let solved = normal.cholesky().filter(|factor| {
        let pivots = factor.l_dirty().diagonal();
        pivots.iter().zip(normal.diagonal().iter()).all(|(pivot, entry)| pivot * pivot > SINGULAR * entry)
    });
    solved.map_or_else(|| right[0] / normal[(0, 0)], |factor| factor.solve(right)[0])
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    /// What the filter does, point by point on a small map, without moments or separation.
    fn by_brute_force(map: &HeightMap, cutoff_mm: f64, weights: &[f64]) -> Vec<f64> {
        let (columns, rows) = (map.columns(), map.rows());
        let width = Degree::Two.width() * cutoff_mm;
        let point = |at: usize| (at % columns, at / columns);
        (0..columns * rows)
            .map(|here| {
                let (x, y) = point(here);
                let (mut terms, mut right) = (Vec::new(), Vec::new());
                for (there, weight) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
                    let (ox, oy) = point(there);
                    let v = (oy as f64 - y as f64) * map.dy_mm() / width;
                    for turn in [-1.0, 0.0, 1.0] {
                        let u = (ox as f64 - x as f64 + turn * columns as f64) * map.dx_mm() / width;
                        let root = (weight * (-std::f64::consts::PI * (u * u + v * v)).exp()).sqrt();
                        terms.extend([1.0, u, v, u * u, u * v, v * v].map(|term| term * root));
                        right.push(root * map.heights_um()[there]);
                    }
                }
                let design = DMatrix::from_row_slice(right.len(), 6, &terms);
                let solution = design.svd(true, true).solve(&DVector::from_vec(right), 1e-12);
                solution.map_or(f64::NAN, |solution| solution[0])
            })
            .collect()
    }

    #[test]
    fn moments_give_what_brute_force_gives() {
        let height = |point: usize| {
            let (x, y) = (point % 24, point / 24);
            (0.26 * x as f64).sin() + 0.02 * (y * y) as f64 + if point % 37 == 5 { -3.0 } else { 0.0 }
        };
        let heights: Vec<f64> = (0..24 * 15).map(height).collect();
        let map = HeightMap::new(heights, 24, 0.1, 0.2, true);
        let Ok(map) = map else { panic!("a map") };
        let weights: Vec<f64> = (0..24 * 15).map(|point| if point % 37 == 5 { 0.0 } else { 1.0 }).collect();
        let found = Fit::new(&map, 0.9).low_pass(map.heights_um(), &weights);
        for (found, expected) in found.iter().zip(by_brute_force(&map, 0.9, &weights)) {
            // The Gaussian ends at 6e-10 of its middle, and its moments are some of its width.
            assert!((found - expected).abs() < 1e-6, "{found} instead of {expected}");
        }
    }

    #[test]
    fn scratches_and_curvature_do_not_pull_it() {
        let wave = |point: usize| {
            let (x, y) = (point % 200, point / 200);
            (std::f64::consts::TAU * x as f64 / 200.0).sin() + 1e-3 * (y as f64 - 20.0).powi(2)
        };
        let scratched = |point: usize| {
            let texture = 0.05 * (2.1 * (point % 200) as f64).sin();
            wave(point) + texture - if (point % 200 + point / 200) % 50 < 3 { 5.0 } else { 0.0 }
        };
        let map = HeightMap::new((0..8000).map(scratched).collect::<Vec<_>>(), 200, 0.1, 0.1, true);
        let Ok(map) = map else { panic!("a map") };
        let robust = robust_areal_gaussian(&map, 2.5);
        assert!(robust.settled && robust.iterations < 40, "{}", robust.iterations);
        let worst = |filtered: &[f64]| {
            filtered.iter().enumerate().map(|(point, value)| (value - wave(point)).abs()).fold(0.0, f64::max)
        };
        let plain = worst(&crate::filter::areal_gaussian(&map, 2.5));
        assert!(plain > 0.3 && worst(&robust.low_pass) < 0.06, "{plain} and {}", worst(&robust.low_pass));
        let mut heights = map.heights_um().to_vec();
        heights[4100..4110].fill(f64::NAN);
        let gapped = robust_areal_gaussian(&map.with(heights), 2.5).low_pass;
        assert!(gapped[4105].is_nan() && gapped.iter().filter(|value| value.is_nan()).count() == 10);
        assert!(worst(&gapped[..4000]) < 0.06);
    }

    /// Half of a wave at the cut-off passes, along both directions and aslant.
    #[test]
    fn half_passes_at_the_cut_off() {
        for (around, along) in [(1.0, 0.0), (0.0, 1.0), (0.6, 0.8)] {
            let wave: Vec<f64> = (0..200 * 200)
                .map(|point| {
                    let (x, y) = (f64::from(point % 200) / 20.0, f64::from(point / 200) / 20.0);
                    (std::f64::consts::TAU * (around * x + along * y)).sin()
                })
                .collect();
            let Ok(map) = HeightMap::new(wave, 200, 0.05, 0.05, true) else { panic!("a map") };
            let found = Fit::new(&map, 1.0).low_pass(map.heights_um(), &vec![1.0; 40_000]);
            let inner = (80..120).flat_map(|row| row * 200..row * 200 + 200);
            let (product, square) = inner.fold((0.0, 0.0), |(product, square), point| {
                let given = map.heights_um()[point];
                (product + given * found[point], square + given * given)
            });
            assert!((product / square - 0.5).abs() < 1e-3, "({around}, {along}): {}", product / square);
        }
    }
}
