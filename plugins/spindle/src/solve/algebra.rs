//! Products of small complex matrices.

use runout_core::{Complex64, separation::OrderResidual};

use crate::alterations::CrossTalk;

/// Matrix (`[row][col]`) times vector.
pub(crate) fn apply(matrix: &[Complex64], vector: &[Complex64]) -> Vec<Complex64> {
    matrix.chunks_exact(vector.len()).map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum()).collect()
}

/// A square matrix over the readings that is 0 from one setup to another.
#[derive(Debug, Clone)]
pub(crate) struct Blocks {
    size: usize,
    /// `[setup][sensor][sensor]`.
    entries: Vec<Complex64>,
}

impl Blocks {
    /// Of blocks with `size` rows each, `[setup][sensor][sensor]`.
    #[must_use]
    pub(crate) fn new(size: usize, entries: Vec<Complex64>) -> Self {
        Self { size, entries }
    }

    /// 1 on the diagonal.
    #[must_use]
    pub(crate) fn identity(size: usize, setups: usize) -> Self {
        let mut entries = vec![Complex64::ZERO; size * size * setups];
        for block in entries.chunks_exact_mut(size * size) {
            block.iter_mut().step_by(size + 1).for_each(|entry| *entry = Complex64::ONE);
        }
        Self { size, entries }
    }

    /// The conjugate in some setups.
    #[must_use]
    pub(crate) fn conjugate_in(mut self, is_in: impl Fn(usize) -> bool) -> Self {
        let blocks = self.entries.chunks_exact_mut(self.size * self.size).enumerate();
        for (_, block) in blocks.filter(|(setup, _)| is_in(*setup)) {
            block.iter_mut().for_each(|entry| *entry = entry.conj());
        }
        self
    }

    /// Rows of a block.
    #[must_use]
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// `[setup][sensor][sensor]`.
    #[must_use]
    pub(crate) fn entries(&self) -> &[Complex64] {
        &self.entries
    }

    fn blocks(&self) -> impl Iterator<Item = &[Complex64]> {
        self.entries.chunks_exact(self.size * self.size)
    }

    /// B·A for A, `[reading][column]`.
    #[must_use]
    pub(crate) fn times(&self, matrix: &[Complex64], columns: usize) -> Vec<Complex64> {
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
    pub(crate) fn after(&self, rows: &[Complex64]) -> Vec<Complex64> {
        let readings = self.entries.len() / self.size;
        let mut product = vec![Complex64::ZERO; rows.len()];
        for (row, target) in rows.chunks_exact(readings).zip(product.chunks_exact_mut(readings)) {
            let parts = row.chunks_exact(self.size).zip(target.chunks_exact_mut(self.size));
            for ((row, target), block) in parts.zip(self.blocks()) {
                for (entry, source) in row.iter().zip(block.chunks_exact(self.size)) {
                    target.iter_mut().zip(source).for_each(|(to, from)| *to += entry * from);
                }
            }
        }
        product
    }

    /// Each reading's column times a factor.
    #[must_use]
    pub(crate) fn with_columns_scaled(mut self, factor: impl Fn(usize) -> Complex64) -> Self {
        let size = self.size;
        for (setup, block) in self.entries.chunks_exact_mut(size * size).enumerate() {
            for row in block.chunks_exact_mut(size) {
                row.iter_mut().enumerate().for_each(|(index, entry)| *entry *= factor(setup * size + index));
            }
        }
        self
    }

    /// Each reading with shares of others of its setup: of a share of one in another, its own column has the other's.
    #[must_use]
    pub(crate) fn with_shares(mut self, shares: &[CrossTalk]) -> Self {
        for row in self.entries.chunks_exact_mut(self.size) {
            shares.iter().for_each(|CrossTalk { from, to, share }| row[*from] += *share * row[*to]);
        }
        self
    }
}

/// I − A·P, `[reading][reading]`.
pub(crate) fn leftover(matrix: &[Complex64], operator: &[Complex64], count: usize) -> Vec<Complex64> {
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
/// χ² per degree of freedom of all orders together; NaN where none is known.
pub(super) fn pooled(orders: &[OrderResidual]) -> f64 {
    let [squares, expected] =
        orders.iter().fold([0.0; 2], |[squares, expected], order| [squares + order.squares, expected + order.expected]);
    squares / expected
}
