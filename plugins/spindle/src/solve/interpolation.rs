//! Lagrange interpolation in periodic tables, at one angle and at several.

#![allow(clippy::inline_always, reason = "see runout_core::numerics::lanes")]

use std::f64::consts::TAU;

/// Points of the Lagrange interpolation: at fourfold oversampling, orders up to a quarter of the samples a turn are
/// interpolated to 1e-6 of their amplitude.
pub(super) const POINTS: usize = 8;
/// Samples that are worked on at once.
pub(super) const LANES: usize = 8;

/// [`interpolate`] at several angles.
#[inline(always)]
pub(super) fn interpolated(table: &[f64], angles_rad: &[f64; LANES]) -> [f64; LANES] {
    let length = table.len();
    let mut position = [0.0; LANES];
    for (position, angle_rad) in position.iter_mut().zip(angles_rad) {
        let turns = angle_rad / TAU;
        *position = (turns - turns.floor()) * length as f64;
    }
    let base = position.map(|position| position as usize);
    let mut from_first = [0.0; LANES];
    for lane in 0..LANES {
        from_first[lane] = position[lane] - base[lane] as f64 + (POINTS / 2 - 1) as f64;
    }
    let mut weights = [[0.0; LANES]; POINTS];
    let mut product = [1.0; LANES];
    for (point, weight) in weights.iter_mut().enumerate() {
        for lane in 0..LANES {
            weight[lane] = LAGRANGE_WEIGHTS[point] * product[lane];
            product[lane] *= from_first[lane] - point as f64;
        }
    }
    product = [1.0; LANES];
    for (point, weight) in weights.iter_mut().enumerate().rev() {
        for lane in 0..LANES {
            weight[lane] *= product[lane];
            product[lane] *= from_first[lane] - point as f64;
        }
    }
    let mut sums = [0.0; LANES];
    for (lane, (sum, base)) in sums.iter_mut().zip(base).enumerate() {
        let own: [f64; POINTS] = std::array::from_fn(|point| weights[point][lane]);
        *sum = weighted(table, base + length - (POINTS / 2 - 1), &own);
    }
    sums
}

/// Lagrange interpolation in a periodic table.
pub(crate) fn interpolate(table: &[f64], angle_rad: f64) -> f64 {
    let (first, weights) = weights_at(table.len(), angle_rad);
    weighted(table, first, &weights)
}

/// Sum over the points of a periodic table from one on, which may be one turn beyond its end.
#[inline(always)]
pub(super) fn weighted(table: &[f64], first: usize, weights: &[f64; POINTS]) -> f64 {
    let first = if first >= table.len() { first - table.len() } else { first };
    match table.get(first..first + POINTS) {
        Some(points) => points.iter().zip(weights).map(|(point, weight)| point * weight).sum(),
        None => weights.iter().enumerate().map(|(point, weight)| weight * table[(first + point) % table.len()]).sum(),
    }
}

/// The first of the points of a periodic table that an angle lies between, which may be beyond its end, and the weights of
/// all of them.
#[inline(always)]
pub(super) fn weights_at(length: usize, angle_rad: f64) -> (usize, [f64; POINTS]) {
    // Casts truncate; without SSE4.1 `floor` is a call, and this is the innermost loop.
    let turns = angle_rad / TAU;
    let beyond_whole = turns - (turns as i64) as f64;
    let position = (if beyond_whole < 0.0 { beyond_whole + 1.0 } else { beyond_whole }) * length as f64;
    let base = position as usize;
    let from_first = position - base as f64 + (POINTS / 2 - 1) as f64;
    // Each weight has the product of the distances to all points before and after its own.
    let mut weights = LAGRANGE_WEIGHTS;
    let mut before = 1.0;
    for (point, weight) in weights.iter_mut().enumerate() {
        *weight *= before;
        before *= from_first - point as f64;
    }
    let mut after = 1.0;
    for (point, weight) in weights.iter_mut().enumerate().rev() {
        *weight *= after;
        after *= from_first - point as f64;
    }
    (base + length - (POINTS / 2 - 1), weights)
}

/// 1/Π(i − j) of eight equally spaced points.
const LAGRANGE_WEIGHTS: [f64; POINTS] =
    [-1.0 / 5040.0, 1.0 / 720.0, -1.0 / 240.0, 1.0 / 144.0, -1.0 / 144.0, 1.0 / 240.0, -1.0 / 720.0, 1.0 / 5040.0];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolation_of_a_harmonic() {
        let samples = 2048;
        let table: Vec<f64> =
            (0..samples).map(|index| (60.0 * TAU * f64::from(index) / f64::from(samples)).cos()).collect();
        for angle in [0.0, 0.001, 1.0, -2.5, 6.2] {
            // (60·2π/2048)⁸ times the largest of the node polynomial over 8!: about 1e-9.
            assert!((interpolate(&table, angle) - (60.0 * angle).cos()).abs() < 1e-8);
        }
    }
}
