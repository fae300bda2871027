//! Products of small complex matrices, and what a fit lets expect of its residual.

use runout_core::Complex64;

use super::readings::Spread;
use crate::systems::System;

/// Matrix (`[row][col]`) times vector.
pub fn apply(matrix: &[Complex64], vector: &[Complex64]) -> Vec<Complex64> {
    matrix.chunks_exact(vector.len()).map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum()).collect()
}

/// A square matrix over the readings that is 0 from one setup to another.
#[derive(Debug, Clone)]
pub struct Blocks {
    size: usize,
    /// `[setup][sensor][sensor]`.
    entries: Vec<Complex64>,
}

impl Blocks {
    /// Of blocks with `size` rows each, `[setup][sensor][sensor]`.
    #[must_use]
    pub fn new(size: usize, entries: Vec<Complex64>) -> Self {
        Self { size, entries }
    }

    /// 1 on the diagonal.
    #[must_use]
    pub fn identity(size: usize, setups: usize) -> Self {
        let mut entries = vec![Complex64::ZERO; size * size * setups];
        for block in entries.chunks_exact_mut(size * size) {
            block.iter_mut().step_by(size + 1).for_each(|entry| *entry = Complex64::ONE);
        }
        Self { size, entries }
    }

    fn blocks(&self) -> impl ExactSizeIterator<Item = &[Complex64]> + Clone {
        self.entries.chunks_exact(self.size * self.size)
    }

    /// B·A for A, `[reading][column]`.
    #[must_use]
    pub fn times(&self, matrix: &[Complex64], columns: usize) -> Vec<Complex64> {
        let mut product = vec![Complex64::ZERO; matrix.len()];
        let length = self.size * columns;
        let parts = matrix.chunks_exact(length).zip(product.chunks_exact_mut(length));
        for (block, (source, target)) in self.blocks().zip(parts) {
            for (row, target) in block.chunks_exact(self.size).zip(target.chunks_exact_mut(columns)) {
                for (entry, source) in row.iter().zip(source.chunks_exact(columns)) {
                    target.iter_mut().zip(source).for_each(|(to, from)| *to += entry * from);
                }
            }
        }
        product
    }

    /// M·B for M, `[row][reading]`.
    #[must_use]
    pub fn after(&self, rows: &[Complex64]) -> Vec<Complex64> {
        times_blocks(rows, self.size, &self.blocks())
    }

    /// Each reading's column times a factor.
    #[must_use]
    pub fn with_columns_scaled(mut self, factor: impl Fn(usize) -> Complex64) -> Self {
        let size = self.size;
        for (setup, block) in self.entries.chunks_exact_mut(size * size).enumerate() {
            for row in block.chunks_exact_mut(size) {
                row.iter_mut().enumerate().for_each(|(index, entry)| *entry *= factor(setup * size + index));
            }
        }
        self
    }

    /// The trace of B·Σ·Bᴴ.
    fn trace_about(&self, spread: &Spread<'_>) -> f64 {
        let mut trace = 0.0;
        for (block, spread) in self.blocks().zip(spread.blocks()) {
            for row in block.chunks_exact(self.size) {
                for (entry, spread) in row.iter().zip(spread.chunks_exact(self.size)) {
                    trace += (entry * dot(row, spread)).re;
                }
            }
        }
        trace
    }
}

/// M·B for M (`[row][reading]`) and the blocks of B, each with `size` rows.
pub fn times_blocks<'a>(
    rows: &[Complex64],
    size: usize,
    blocks: &(impl ExactSizeIterator<Item = &'a [Complex64]> + Clone),
) -> Vec<Complex64> {
    let readings = size * blocks.len();
    let mut product = vec![Complex64::ZERO; rows.len()];
    for (row, target) in rows.chunks_exact(readings).zip(product.chunks_exact_mut(readings)) {
        let parts = row.chunks_exact(size).zip(target.chunks_exact_mut(size));
        for ((row, target), block) in parts.zip(blocks.clone()) {
            for (entry, source) in row.iter().zip(block.chunks_exact(size)) {
                target.iter_mut().zip(source).for_each(|(to, from)| *to += entry * from);
            }
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
    let mut product = Vec::with_capacity(left.len() / count * (right.len() / count));
    for row in left.chunks_exact(count) {
        product.extend(right.chunks_exact(count).map(|other| dot(other, row)));
    }
    product
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
pub fn expected_weighted_squares(system: &System, weights: &Blocks, spread: &Spread<'_>, passed: &[Complex64]) -> f64 {
    let count = system.matrix.len() / system.columns;
    // W·A·P is the projector on the columns of W·A, times W, which leaves tr(WΣWᴴ) − Re tr(PΣ·WᴴW·A).
    // That trace is the sum of W·A times the conjugate of W·(PΣ)ᴴ, entry by entry.
    let passed: Vec<Complex64> =
        (0..count).flat_map(|reading| passed.iter().skip(reading).step_by(count).map(Complex64::conj)).collect();
    let whitened = |matrix: &[Complex64]| weights.times(matrix, system.columns);
    let fitted = dot(&whitened(&passed), &whitened(&system.matrix)).re;
    (weights.trace_about(spread) - fitted).max(0.0)
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
        let passed = spread.times(matrix);
        passed.chunks_exact(COUNT).zip(matrix.chunks_exact(COUNT)).map(|(a, b)| dot(b, a).re).sum()
    }

    #[test]
    fn expected_squares_are_those_of_what_is_left() {
        let blocks = [covariance(0.7), covariance(1.9)];
        let spread = Spread::new(SENSORS, &blocks, 0);
        let whitening = |phase| {
            let Some(factor) = cholesky(SENSORS, &covariance(phase)) else { panic!("it is positive definite") };
            invert_lower(SENSORS, &factor)
        };
        let weights = Blocks::new(SENSORS, [whitening(2.3), whitening(0.2)].concat());
        let mut matrix = some(COUNT * COLUMNS, 1.3);
        for deficient in [false, true] {
            if deficient {
                for row in matrix.chunks_exact_mut(COLUMNS) {
                    row[2] = row[0] - 2.0 * row[1];
                }
            }
            let system = System { columns: COLUMNS, matrix: matrix.clone(), observable: vec![true; COLUMNS] };
            let qr = PivotedQr::new(COUNT, COLUMNS, &weights.times(&matrix, COLUMNS), 1e-9);
            assert_eq!(qr.rank(), if deficient { 2 } else { 3 });
            let operator = weights.after(&qr.operator());
            let left = leftover(&matrix, &operator, COUNT);
            let (found, expected) =
                (expected_squares(&system, &operator, &spread, &spread.times(&operator)), squares(&left, &spread));
            assert!((found / expected - 1.0).abs() < 1e-10, "{found} {expected}");
            let found = expected_weighted_squares(&system, &weights, &spread, &spread.times(&operator));
            let expected = squares(&weights.times(&left, COUNT), &spread);
            assert!((found / expected - 1.0).abs() < 1e-10, "{found} {expected}");
        }
    }
}
