//! Eight orders side by side: their numbers in lanes, and products of their matrices.

#![allow(clippy::inline_always, reason = "see runout_core::numerics::lanes")]

use runout_core::{
    Complex64,
    numerics::{
        lanes::Arithmetic,
        side_by_side::{Complexes, TOGETHER},
    },
};

/// Orders with unknowns of one kind.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Orders {
    first: usize,
    count: usize,
}

impl Orders {
    /// All orders from 1: the first by itself, since its unknowns are its own.
    pub(crate) fn up_to(max_order: usize) -> impl Iterator<Item = Self> {
        let first = (max_order > 0).then_some(Self { first: 1, count: 1 });
        let others = (2..=max_order).step_by(TOGETHER);
        first.into_iter().chain(others.map(move |first| Self { first, count: TOGETHER.min(max_order + 1 - first) }))
    }

    /// The orders themselves, lane by lane.
    pub(crate) fn each(self) -> impl ExactSizeIterator<Item = usize> {
        self.first..self.first + self.count
    }

    /// The order in a lane; the last one also in lanes that are left over.
    #[inline(always)]
    pub(crate) fn of(self, lane: usize) -> usize {
        self.first + lane.min(self.count - 1)
    }

    /// What belongs to each order, lane by lane.
    #[inline(always)]
    pub(crate) fn map<T>(self, of_order: impl Fn(usize) -> T) -> [T; TOGETHER] {
        std::array::from_fn(|lane| of_order(self.of(lane)))
    }
}

/// Takes in the numbers of each lane.
#[inline(always)]
pub(crate) fn gather(lanes: [&[Complex64]; TOGETHER], numbers: &mut [Complexes]) {
    let lanes = lanes.map(|lane| &lane[..numbers.len()]);
    for (index, number) in numbers.iter_mut().enumerate() {
        *number = Complexes::of(|lane| lanes[lane][index]);
    }
}

/// The numbers of one lane.
pub(crate) fn lane(numbers: &[Complexes], lane: usize) -> Vec<Complex64> {
    numbers.iter().map(|number| number.lane(lane)).collect()
}

/// B·A for blocks B (`[setup][row][col]`, `size` rows each) and A, `[reading][column]`.
#[inline(always)]
pub(crate) fn blocks_times<A: Arithmetic>(
    size: usize,
    blocks: &[Complexes],
    matrix: &[Complexes],
    product: &mut [Complexes],
) {
    let columns = product.len() * size / blocks.len();
    let parts = matrix.chunks_exact(size * columns).zip(product.chunks_exact_mut(size * columns));
    for (block, (matrix, product)) in blocks.chunks_exact(size * size).zip(parts) {
        for (row, product) in block.chunks_exact(size).zip(product.chunks_exact_mut(columns)) {
            for (column, product) in product.iter_mut().enumerate() {
                let mut sum = Complexes::ZERO;
                for (entry, source) in row.iter().zip(matrix.chunks_exact(columns)) {
                    sum = sum.plus::<A>(entry, &source[column]);
                }
                *product = sum;
            }
        }
    }
}

/// Bᴴ·A, likewise.
#[inline(always)]
pub(crate) fn adjoint_blocks_times<A: Arithmetic>(
    size: usize,
    blocks: &[Complexes],
    matrix: &[Complexes],
    product: &mut [Complexes],
) {
    let columns = product.len() * size / blocks.len();
    let parts = matrix.chunks_exact(size * columns).zip(product.chunks_exact_mut(size * columns));
    for (block, (matrix, product)) in blocks.chunks_exact(size * size).zip(parts) {
        for (row, product) in product.chunks_exact_mut(columns).enumerate() {
            for (column, product) in product.iter_mut().enumerate() {
                let mut sum = Complexes::ZERO;
                for (entries, source) in block.chunks_exact(size).zip(matrix.chunks_exact(columns)) {
                    sum = sum.plus_adjoint::<A>(&entries[row], &source[column]);
                }
                *product = sum;
            }
        }
    }
}

/// M·B for M, `[row][reading]`, and blocks B.
#[inline(always)]
pub(crate) fn times_blocks<A: Arithmetic>(
    size: usize,
    rows: &[Complexes],
    blocks: &[Complexes],
    product: &mut [Complexes],
) {
    let readings = blocks.len() / size;
    for (row, product) in rows.chunks_exact(readings).zip(product.chunks_exact_mut(readings)) {
        let parts = row.chunks_exact(size).zip(product.chunks_exact_mut(size));
        for ((row, product), block) in parts.zip(blocks.chunks_exact(size * size)) {
            for (column, product) in product.iter_mut().enumerate() {
                let mut sum = Complexes::ZERO;
                for (entry, source) in row.iter().zip(block.chunks_exact(size)) {
                    sum = sum.plus::<A>(entry, &source[column]);
                }
                *product = sum;
            }
        }
    }
}
