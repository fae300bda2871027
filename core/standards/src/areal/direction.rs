//! Texture direction: the angular power spectrum of a map (ISO 25178-2:2021, 3.1 and 4.3.4).
//!
//! f(s) = ∫ r·|F(r cos s, r sin s)|² dr along rays from the origin of the spectrum, in steps of 0.5°. F is of windowed parts of the map that are as
//! long across as along, so that a wave makes a round peak in the spectrum, and half of each part is the next one's (Welch's method); around a closed
//! map there are whole waves and no window. Between the spectrum's lines |F|² is interpolated: sums over the lines in a sector follow where their
//! lattice has lines, 0° before all. What does not rise above the noise floor is left out: sampled unequally, the map has more of it in some directions
//! than in others.

use std::{f64::consts::PI, sync::Arc};

use super::HeightMap;
use runout_numerics::{
    Complex64,
    fourier::{Fft, RealToComplex, complex_forward, real_forward},
};

/// Rays over half a turn: steps of 0.5°.
const ANGLES: usize = 360;
/// Transforms have so many times the points of a part: between lines that near, a cubic meets the peak of a wave.
const PAD: usize = 2;
/// Times the median of |F|² below which it is the noise floor; of independent errors 3 % lie above.
const FLOOR: f64 = 5.0;
/// Values of which the median is taken, at most.
const MEDIAN_OF: usize = 1 << 18;
/// Distance of points along a ray, in lines of the spectrum.
const RADIAL_STEP: f64 = 0.5;
/// Columns that are transformed together, for the sake of cache lines.
const TOGETHER: usize = 8;

/// How the parts of a map lie along one side.
struct Side {
    starts: Vec<usize>,
    window: Vec<f64>,
    /// Points of the transform.
    length: usize,
    /// Distance of the spectrum's lines, in 1/mm.
    line: f64,
}

impl Side {
    /// All points around.
    fn closed(points: usize, distance_mm: f64) -> Self {
        let line = (points as f64 * distance_mm).recip();
        Self { starts: vec![0], window: vec![1.0; points], length: points, line }
    }

    /// Parts of a length, under Hann's window.
    fn open(points: usize, distance_mm: f64, part_mm: f64) -> Self {
        let part = ((part_mm / distance_mm).round() as usize).clamp(2.min(points), points);
        let steps = (2 * (points - part)).div_ceil(part);
        let starts = (0..=steps).map(|step| step * (points - part) / steps.max(1)).collect();
        let window = (0..part).map(|point| (PI * (point as f64 + 0.5) / part as f64).sin().powi(2)).collect();
        Self { starts, window, length: PAD * part, line: ((PAD * part) as f64 * distance_mm).recip() }
    }
}

/// What finds the texture direction of maps on one grid.
pub(super) struct Directions {
    columns: usize,
    across: Side,
    along: Side,
    /// Spectrum of the window across.
    window: Vec<Complex64>,
    forward: Arc<dyn RealToComplex<f64>>,
    down: Arc<dyn Fft<f64>>,
}

impl Directions {
    pub(super) fn new(map: &HeightMap) -> Self {
        let (columns, rows, dx_mm, dy_mm) = (map.columns(), map.rows(), map.dx_mm(), map.dy_mm());
        let part_mm = (columns as f64 * dx_mm).min(rows as f64 * dy_mm);
        let across = if map.closed() { Side::closed(columns, dx_mm) } else { Side::open(columns, dx_mm, part_mm) };
        let along = Side::open(rows, dy_mm, part_mm);
        let forward = real_forward(across.length);
        let down = complex_forward(along.length);
        let mut found = Self { columns, across, along, window: Vec::new(), forward, down };
        found.window = found.row_spectra(&vec![1.0; columns], 0);
        found
    }

    /// Of heights with mean 0, `[row][column]`, missing ones 0; NaN of a flat map.
    pub(super) fn direction_deg(&self, heights: &[f64]) -> f64 {
        let mut power = vec![0.0; self.lines() * self.along.length];
        self.columns(heights, |part, column| add(&mut power, part % self.lines(), column.iter().copied()));
        self.strongest_deg(&power)
    }

    /// The spectra of all parts, for [`both_deg`](Self::both_deg).
    pub(super) fn spectra(&self, heights: &[f64]) -> Vec<Complex64> {
        let mut spectra = Vec::new();
        self.columns(heights, |_, column| spectra.extend_from_slice(column));
        spectra
    }

    /// Directions with errors added and taken away, from the spectra without them.
    pub(super) fn both_deg(&self, spectra: &[Complex64], errors: &[f64]) -> [f64; 2] {
        let mut powers = [1.0, -1.0].map(|sign| (sign, vec![0.0; self.lines() * self.along.length]));
        self.columns(errors, |part, errors| {
            let own = &spectra[part * errors.len()..(part + 1) * errors.len()];
            for (sign, power) in &mut powers {
                let both = own.iter().zip(errors).map(|(own, error)| own + *sign * error);
                add(power, part % self.lines(), both);
            }
        });
        powers.map(|(_, power)| self.strongest_deg(&power))
    }

    /// Lines across, from 0 on.
    fn lines(&self) -> usize {
        self.across.length / 2 + 1
    }

    /// Spectra of rows under the window across, of the part that starts at a column.
    fn row_spectra(&self, heights: &[f64], start: usize) -> Vec<Complex64> {
        let mut row = self.forward.make_input_vec();
        let mut scratch = self.forward.make_scratch_vec();
        let mut spectra = vec![Complex64::ZERO; heights.len() / self.columns * self.lines()];
        for (heights, target) in heights.chunks_exact(self.columns).zip(spectra.chunks_exact_mut(self.lines())) {
            row.fill(0.0);
            for ((target, height), weight) in row.iter_mut().zip(&heights[start..]).zip(&self.across.window) {
                *target = height * weight;
            }
            // The buffers have the plan's lengths.
            let _ = self.forward.process_with_scratch(&mut row, target, &mut scratch);
        }
        spectra
    }

    /// Shows the spectrum of each part, less its mean, column by column.
    fn columns(&self, heights: &[f64], mut show: impl FnMut(usize, &[Complex64])) {
        let (lines, length) = (self.lines(), self.along.length);
        let mut block = vec![Complex64::ZERO; TOGETHER * length];
        let mut scratch = vec![Complex64::ZERO; self.down.get_inplace_scratch_len()];
        let weights: f64 = self.along.window.iter().sum::<f64>() * self.window[0].re;
        let mut part = 0;
        for left in &self.across.starts {
            let rows = self.row_spectra(heights, *left);
            for lower in &self.along.starts {
                let rows = || rows[lower * lines..].chunks_exact(lines).zip(&self.along.window);
                let mean = rows().map(|(row, weight)| weight * row[0].re).sum::<f64>() / weights;
                for first in (0..lines).step_by(TOGETHER) {
                    let together = TOGETHER.min(lines - first);
                    let block = &mut block[..together * length];
                    block.fill(Complex64::ZERO);
                    for (place, (row, weight)) in rows().enumerate() {
                        for (column, line) in (first..first + together).enumerate() {
                            block[column * length + place] = (row[line] - mean * self.window[line]) * *weight;
                        }
                    }
                    self.down.process_with_scratch(block, &mut scratch);
                    for column in block.chunks_exact(length) {
                        show(part, column);
                        part += 1;
                    }
                }
            }
        }
    }

    /// Where the angular spectrum of a power is largest.
    fn strongest_deg(&self, power: &[f64]) -> f64 {
        let stride = power.len().div_ceil(MEDIAN_OF).max(1);
        let mut some: Vec<f64> = power.iter().copied().step_by(stride).collect();
        let middle = some.len() / 2;
        let floor = FLOOR * *some.select_nth_unstable_by(middle, f64::total_cmp).1;
        let mut best = (0.0, f64::NAN);
        for place in 0..ANGLES {
            let angle_deg = place as f64 * 180.0 / ANGLES as f64;
            let sum = self.ray(power, floor, angle_deg.to_radians());
            if sum > best.0 {
                best = (sum, angle_deg);
            }
        }
        best.1
    }

    /// ∫ r·(|F|² above the floor) dr along a ray, as far as the map's sampling goes.
    fn ray(&self, power: &[f64], floor: f64, angle: f64) -> f64 {
        // Lines across and along, by a unit of frequency.
        let [u, v] = [angle.cos() / self.across.line, angle.sin() / self.along.line];
        let end = |lines: f64, length: usize| (length as f64 / 2.0 - 1.0) / lines.abs();
        let longest = end(u, self.across.length).min(end(v, self.along.length));
        let step = RADIAL_STEP / u.abs().max(v.abs());
        let points = (longest / step).max(0.0) as usize;
        let along_ray = (1..=points).map(|point| {
            let r = point as f64 * step;
            r * self.between(power, floor, [r * u, r * v])
        });
        along_ray.sum::<f64>() * step
    }

    /// The power above the floor between lines, by cubics through the four nearest each way.
    fn between(&self, power: &[f64], floor: f64, [u, v]: [f64; 2]) -> f64 {
        // A line and its opposite have the same power.
        let [u, v] = if u < 0.0 { [-u, -v] } else { [u, v] };
        let (left, lower) = (u.floor(), v.floor());
        let (in_u, in_v) = (cubic(u - left), cubic(v - lower));
        let (width, height) = (self.across.length.cast_signed(), self.along.length.cast_signed());
        let mut sum = 0.0;
        for (index, of_u) in in_u.into_iter().enumerate() {
            let line = (left as isize - 1 + index.cast_signed()).rem_euclid(width);
            let (line, sign) = if line > width / 2 { (width - line, -1) } else { (line, 1) };
            let column = &power[(line * height) as usize..][..height as usize];
            for (index, of_v) in in_v.into_iter().enumerate() {
                let place = (sign * (lower as isize - 1 + index.cast_signed())).rem_euclid(height);
                sum += of_u * of_v * (column[place as usize] - floor).max(0.0);
            }
        }
        sum
    }
}

/// Adds the squares of a column of a spectrum.
fn add(power: &mut [f64], line: usize, column: impl ExactSizeIterator<Item = Complex64>) {
    let length = column.len();
    power[line * length..(line + 1) * length].iter_mut().zip(column).for_each(|(sum, one)| *sum += one.norm_sqr());
}

/// Weights of the values at −1, 0, 1 and 2 for a place from 0 to 1.
fn cubic(t: f64) -> [f64; 4] {
    [
        -t * (t - 1.0) * (t - 2.0) / 6.0,
        (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
        -(t + 1.0) * t * (t - 2.0) / 2.0,
        (t + 1.0) * t * (t - 1.0) / 6.0,
    ]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use std::f64::consts::TAU;

    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn off(found: f64, true_deg: f64) -> f64 {
        let off = (found - true_deg).rem_euclid(180.0);
        off.min(180.0 - off)
    }

    /// A lay of three waves that are as long as a fraction of the shorter side, with white noise, on a grid.
    fn lay(grid: (usize, usize, f64, f64), true_deg: f64, waves: f64, noise: f64, random: &mut ChaCha8Rng) -> Vec<f64> {
        let (rows, columns, dx, dy) = grid;
        let frequency = waves / (rows as f64 * dy).min(columns as f64 * dx);
        let (sin, cos) = true_deg.to_radians().sin_cos();
        let phases: [f64; 3] = std::array::from_fn(|_| random.random::<f64>() * TAU);
        let mut height = |point: usize| {
            let along = cos * dx * (point % columns) as f64 + sin * dy * (point / columns) as f64;
            let wave = |(share, phase): (f64, f64)| (TAU * share * frequency * along + phase).sin();
            let uniform = random.random::<f64>() + random.random::<f64>() - 1.0;
            [1.0, 0.73, 1.37].into_iter().zip(phases).map(wave).sum::<f64>() + 6_f64.sqrt() * noise * uniform
        };
        (0..rows * columns).map(&mut height).collect()
    }

    /// Every direction, whatever the map's sides, its sampling and the wavelength.
    #[test]
    fn a_lay_at_any_angle_has_its_direction() {
        let mut random = ChaCha8Rng::seed_from_u64(31);
        let grids = [(150, 150, 0.01, 0.01), (70, 260, 0.02, 0.02), (260, 90, 0.01, 0.013), (90, 130, 0.004, 0.011)];
        for grid in grids {
            for (waves, noise) in [(6.0, 0.0), (9.0, 0.0), (9.0, 0.7), (13.0, 0.7)] {
                for degrees in (0..180).step_by(15) {
                    let true_deg = f64::from(degrees) + random.random::<f64>() * 15.0;
                    let heights = lay(grid, true_deg, waves, noise, &mut random);
                    let map = HeightMap::new(heights, grid.1, grid.2, grid.3, false).unwrap();
                    let found = Directions::new(&map).direction_deg(map.heights_um());
                    assert!(off(found, true_deg) < 1.0, "{grid:?} {waves} {noise}: {found} instead of {true_deg}");
                }
            }
        }
    }

    /// Waves that go round a whole number of times, along any number of times.
    #[test]
    fn a_helix_has_its_direction() {
        let (rows, columns, dx, dy) = (80, 256, 0.05, 0.1);
        for (around, along) in [(0.0, 7.3), (1.0, 9.1), (12.0, 0.0), (12.0, 4.6), (25.0, -8.3), (40.0, 3.2)] {
            let (fx, fy) = (around / (columns as f64 * dx), along / (rows as f64 * dy));
            let wave = |point: usize| {
                (TAU * (fx * dx * (point % columns) as f64 + fy * dy * (point / columns) as f64) + 0.4).sin()
            };
            let heights: Vec<f64> = (0..rows * columns).map(wave).collect();
            let map = HeightMap::new(heights, columns, dx, dy, true).unwrap();
            let found = Directions::new(&map).direction_deg(map.heights_um());
            let true_deg = fy.atan2(fx).to_degrees();
            assert!(off(found, true_deg) < 1.0, "{around} {along}: {found} instead of {true_deg}");
        }
    }

    /// Of lays that cross, the one with the larger power per angle; with errors added and taken away, as of the sums.
    #[test]
    fn errors_are_added_to_spectra_as_to_heights() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let grid = (60, 110, 0.01, 0.01);
        let weak = lay(grid, 110.0, 9.0, 0.0, &mut random);
        let heights: Vec<f64> =
            lay(grid, 33.0, 9.0, 0.0, &mut random).iter().zip(weak).map(|(one, other)| one + 0.8 * other).collect();
        let errors: Vec<f64> = (0..heights.len()).map(|_| 6.0 * (random.random::<f64>() - 0.5)).collect();
        for closed in [false, true] {
            let map = HeightMap::new(heights.clone(), grid.1, grid.2, grid.3, closed).unwrap();
            let directions = Directions::new(&map);
            assert!(closed || off(directions.direction_deg(&heights), 33.0) < 1.0);
            let both = directions.both_deg(&directions.spectra(&heights), &errors);
            for (sign, found) in [1.0, -1.0].into_iter().zip(both) {
                let sum: Vec<f64> = heights.iter().zip(&errors).map(|(height, error)| height + sign * error).collect();
                assert!(off(found, directions.direction_deg(&sum)) < 1e-9);
            }
        }
    }

    #[test]
    fn a_flat_map_has_none() {
        let map = HeightMap::new(vec![0.0; 40], 8, 1.0, 1.0, true).unwrap();
        assert!(Directions::new(&map).direction_deg(map.heights_um()).is_nan());
    }
}
