//! Products of small complex matrices, and what a fit lets expect of its residual.

use runout_core::Complex64;

use super::readings::Spread;
use crate::systems::System;

/// Matrix (`[row][col]`) times vector.
pub fn apply(matrix: &[Complex64], vector: &[Complex64]) -> Vec<Complex64> {
    matrix.chunks_exact(vector.len()).map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum()).collect()
}

/// Product of two square matrices.
pub fn product(left: &[Complex64], right: &[Complex64], size: usize) -> Vec<Complex64> {
    let mut product = vec![Complex64::ZERO; size * size];
    for (row, target) in left.chunks_exact(size).zip(product.chunks_exact_mut(size)) {
        for (factor, source) in row.iter().zip(right.chunks_exact(size)) {
            target.iter_mut().zip(source).for_each(|(to, from)| *to += factor * from);
        }
    }
    product
}

/// I − A·P, `[reading][reading]`.
pub fn leftover(matrix: &[Complex64], operator: &[Complex64], count: usize) -> Vec<Complex64> {
    let width = operator.len() / count;
    let mut left = vec![Complex64::ZERO; count * count];
    for (row, (target, entries)) in left.chunks_exact_mut(count).zip(matrix.chunks_exact(width)).enumerate() {
        target[row] = Complex64::ONE;
        for (entry, source) in entries.iter().zip(operator.chunks_exact(count)) {
            target.iter_mut().zip(source).for_each(|(to, from)| *to -= entry * from);
        }
    }
    left
}

/// A·Bᴴ for A and B (`[row][reading]`), `[row of A][row of B]`.
pub fn times_adjoint(left: &[Complex64], right: &[Complex64], count: usize) -> Vec<Complex64> {
    let rows = left.chunks_exact(count);
    rows.flat_map(|row| right.chunks_exact(count).map(move |other| dot(other, row))).collect()
}

/// bᴴ·a.
fn dot(b: &[Complex64], a: &[Complex64]) -> Complex64 {
    a.iter().zip(b).map(|(a, b)| a * b.conj()).sum()
}

/// Mean of |residual|² where the readings' noise has the covariance Σ: the trace of (I − A·P)·Σ·(I − A·P)ᴴ. `passed` is P·Σ.
pub fn expected_squares(system: &System, operator: &[Complex64], spread: &Spread<'_>, passed: &[Complex64]) -> f64 {
    let count = system.matrix.len() / system.columns;
    // Cheaper than the product: tr Σ − 2 Re tr(PΣ·A) + tr(AᴴA·PΣPᴴ).
    let mut squares = spread.trace();
    for (unknown, row) in passed.chunks_exact(count).enumerate() {
        let column = || system.matrix.iter().skip(unknown).step_by(system.columns);
        squares -= 2.0 * row.iter().zip(column()).map(|(passed, entry)| (passed * entry).re).sum::<f64>();
        for (other, line) in operator.chunks_exact(count).enumerate() {
            let other = system.matrix.iter().skip(other).step_by(system.columns);
            let normal: Complex64 = other.zip(column()).map(|(other, entry)| other.conj() * entry).sum();
            squares += (normal * dot(line, row)).re;
        }
    }
    squares.max(0.0)
}

/// The same of the residual weighted by W, P being the least-squares operator of W·A: the trace of
/// W·(I − A·P)·Σ·(I − A·P)ᴴ·Wᴴ.
pub fn expected_weighted_squares(
    system: &System,
    weights: &[Complex64],
    spread: &Spread<'_>,
    passed: &[Complex64],
) -> f64 {
    let count = system.matrix.len() / system.columns;
    // W·A·P is the projector on the columns of W·A, times W, which leaves tr(WΣWᴴ) − Re tr(PΣ·WᴴW·A).
    let weighted = trace(weights, &spread.times(weights), count);
    let normal = weighted_normal(weights, &system.matrix, system.columns);
    let fitted: f64 = (passed.chunks_exact(count).enumerate())
        .flat_map(|(unknown, row)| row.iter().zip(normal.iter().skip(unknown).step_by(system.columns)))
        .map(|(passed, entry)| (passed * entry).re)
        .sum();
    (weighted - fitted).max(0.0)
}

/// The trace of A·Bᴴ for square A and B.
fn trace(b: &[Complex64], a: &[Complex64], count: usize) -> f64 {
    a.chunks_exact(count).zip(b.chunks_exact(count)).map(|(a, b)| dot(b, a).re).sum()
}

/// WᴴW·A, `[reading][unknown]`.
fn weighted_normal(weights: &[Complex64], matrix: &[Complex64], columns: usize) -> Vec<Complex64> {
    let count = matrix.len() / columns;
    let mut normal = vec![Complex64::ZERO; matrix.len()];
    for (row, weighted) in weights.chunks_exact(count).zip(weigh(weights, matrix, columns).chunks_exact(columns)) {
        for (entry, target) in row.iter().zip(normal.chunks_exact_mut(columns)) {
            if *entry != Complex64::ZERO {
                target.iter_mut().zip(weighted).for_each(|(to, from)| *to += entry.conj() * from);
            }
        }
    }
    normal
}

/// W·A, `[reading][unknown]`; most of W is 0, as setups are independent.
pub fn weigh(weights: &[Complex64], matrix: &[Complex64], columns: usize) -> Vec<Complex64> {
    let count = matrix.len() / columns;
    let mut weighted = vec![Complex64::ZERO; matrix.len()];
    for (row, target) in weights.chunks_exact(count).zip(weighted.chunks_exact_mut(columns)) {
        for (entry, source) in row.iter().zip(matrix.chunks_exact(columns)) {
            if *entry != Complex64::ZERO {
                target.iter_mut().zip(source).for_each(|(to, from)| *to += entry * from);
            }
        }
    }
    weighted
}

#[cfg(test)]
mod tests {
    use runout_core::numerics::least_squares::{PivotedQr, cholesky, invert_lower};

    use super::*;

    const COUNT: usize = 6;
    const COLUMNS: usize = 3;
    const SENSORS: usize = 3;

    fn some(count: usize, phase: f64) -> Vec<Complex64> {
        (0..count)
            .map(|index| Complex64::from_polar(1.0 + (index as f64 + phase).sin(), index as f64 * phase))
            .collect()
    }

    /// A covariance: M·Mᴴ and a little more on the diagonal.
    fn covariance(phase: f64) -> Vec<Complex64> {
        let half = some(SENSORS * SENSORS, phase);
        let mut covariance = times_adjoint(&half, &half, SENSORS);
        covariance.iter_mut().step_by(SENSORS + 1).for_each(|entry| *entry += 0.5);
        covariance
    }

    /// The trace of M·Σ·Mᴴ, written out.
    fn squares(matrix: &[Complex64], spread: &Spread<'_>) -> f64 {
        trace(matrix, &spread.times(matrix), COUNT)
    }

    #[test]
    fn expected_squares_are_those_of_what_is_left() {
        let blocks = [covariance(0.7), covariance(1.9)];
        let spread = Spread::new(SENSORS, &blocks, 0);
        let mut weights = vec![Complex64::ZERO; COUNT * COUNT];
        for (setup, block) in [covariance(2.3), covariance(0.2)].iter().enumerate() {
            let Some(factor) = cholesky(SENSORS, block) else { panic!("it is positive definite") };
            for (row, entries) in invert_lower(SENSORS, &factor).chunks_exact(SENSORS).enumerate() {
                let start = (setup * SENSORS + row) * COUNT + setup * SENSORS;
                weights[start..start + SENSORS].copy_from_slice(entries);
            }
        }
        let mut matrix = some(COUNT * COLUMNS, 1.3);
        for deficient in [false, true] {
            if deficient {
                for row in matrix.chunks_exact_mut(COLUMNS) {
                    row[2] = row[0] - 2.0 * row[1];
                }
            }
            let system = System { columns: COLUMNS, matrix: matrix.clone(), observable: vec![true; COLUMNS] };
            let weighted = weigh(&weights, &matrix, COLUMNS);
            let qr = PivotedQr::new(COUNT, COLUMNS, &weighted, 1e-9);
            assert_eq!(qr.rank(), if deficient { 2 } else { 3 });
            let operator = qr.operator(Some(&weights));
            let left = leftover(&matrix, &operator, COUNT);
            let (found, expected) =
                (expected_squares(&system, &operator, &spread, &spread.times(&operator)), squares(&left, &spread));
            assert!((found / expected - 1.0).abs() < 1e-10, "{found} {expected}");
            let found = expected_weighted_squares(&system, &weights, &spread, &spread.times(&operator));
            let expected = squares(&product(&weights, &left, COUNT), &spread);
            assert!((found / expected - 1.0).abs() < 1e-10, "{found} {expected}");
        }
    }
}
