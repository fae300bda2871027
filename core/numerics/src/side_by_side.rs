//! Small complex problems of one shape side by side: each step is done for eight of them, one a lane.

#![allow(clippy::inline_always, reason = "see crate::lanes")]

use super::lanes::Arithmetic;
use crate::Complex64;

/// Problems that are worked on side by side.
pub const TOGETHER: usize = 8;

/// A real number of each problem.
pub type Reals = [f64; TOGETHER];

/// A complex number of each problem.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Complexes {
    /// Real parts.
    pub re: Reals,
    /// Imaginary parts.
    pub im: Reals,
}

impl Complexes {
    /// 0 in every problem.
    pub const ZERO: Self = Self { re: [0.0; TOGETHER], im: [0.0; TOGETHER] };

    /// The number of each problem, by its lane.
    #[inline(always)]
    pub fn of(number: impl Fn(usize) -> Complex64) -> Self {
        let mut found = Self::ZERO;
        for lane in 0..TOGETHER {
            let number = number(lane);
            found.re[lane] = number.re;
            found.im[lane] = number.im;
        }
        found
    }

    /// The number of one problem.
    #[inline(always)]
    #[must_use]
    pub fn lane(&self, lane: usize) -> Complex64 {
        Complex64::new(self.re[lane], self.im[lane])
    }

    /// The conjugates.
    #[inline(always)]
    #[must_use]
    pub fn conj(mut self) -> Self {
        for im in &mut self.im {
            *im = -*im;
        }
        self
    }

    /// Times real numbers.
    #[inline(always)]
    #[must_use]
    pub fn scaled(mut self, factor: Reals) -> Self {
        for lane in 0..TOGETHER {
            self.re[lane] *= factor[lane];
        }
        for lane in 0..TOGETHER {
            self.im[lane] *= factor[lane];
        }
        self
    }

    /// self + a·b.
    #[inline(always)]
    #[must_use]
    pub fn plus<A: Arithmetic>(mut self, a: &Self, b: &Self) -> Self {
        for lane in 0..TOGETHER {
            self.re[lane] = A::mul_add(a.re[lane], b.re[lane], self.re[lane]);
        }
        for lane in 0..TOGETHER {
            self.re[lane] = A::mul_add(-a.im[lane], b.im[lane], self.re[lane]);
        }
        for lane in 0..TOGETHER {
            self.im[lane] = A::mul_add(a.re[lane], b.im[lane], self.im[lane]);
        }
        for lane in 0..TOGETHER {
            self.im[lane] = A::mul_add(a.im[lane], b.re[lane], self.im[lane]);
        }
        self
    }

    /// self + a*·b.
    #[inline(always)]
    #[must_use]
    pub fn plus_adjoint<A: Arithmetic>(mut self, a: &Self, b: &Self) -> Self {
        for lane in 0..TOGETHER {
            self.re[lane] = A::mul_add(a.re[lane], b.re[lane], self.re[lane]);
        }
        for lane in 0..TOGETHER {
            self.re[lane] = A::mul_add(a.im[lane], b.im[lane], self.re[lane]);
        }
        for lane in 0..TOGETHER {
            self.im[lane] = A::mul_add(a.re[lane], b.im[lane], self.im[lane]);
        }
        for lane in 0..TOGETHER {
            self.im[lane] = A::mul_add(-a.im[lane], b.re[lane], self.im[lane]);
        }
        self
    }

    /// self − a·b.
    #[inline(always)]
    #[must_use]
    pub fn minus<A: Arithmetic>(mut self, a: &Self, b: &Self) -> Self {
        for lane in 0..TOGETHER {
            self.re[lane] = A::mul_add(-a.re[lane], b.re[lane], self.re[lane]);
        }
        for lane in 0..TOGETHER {
            self.re[lane] = A::mul_add(a.im[lane], b.im[lane], self.re[lane]);
        }
        for lane in 0..TOGETHER {
            self.im[lane] = A::mul_add(-a.re[lane], b.im[lane], self.im[lane]);
        }
        for lane in 0..TOGETHER {
            self.im[lane] = A::mul_add(-a.im[lane], b.re[lane], self.im[lane]);
        }
        self
    }

    /// sum + Re a*·self.
    #[inline(always)]
    #[must_use]
    pub fn real_of_adjoint<A: Arithmetic>(&self, a: &Self, mut sum: Reals) -> Reals {
        for lane in 0..TOGETHER {
            sum[lane] = A::mul_add(a.re[lane], self.re[lane], sum[lane]);
        }
        for lane in 0..TOGETHER {
            sum[lane] = A::mul_add(a.im[lane], self.im[lane], sum[lane]);
        }
        sum
    }
}

/// The inverse of the lower Cholesky factor of Hermitian matrices (`[row][col]`, the lower triangle is read), into the lower
/// triangle of `inverse`; false where one of them is not positive definite.
#[inline(always)]
#[must_use]
pub fn inverse_of_cholesky<A: Arithmetic>(size: usize, matrix: &mut [Complexes], inverse: &mut [Complexes]) -> bool {
    let mut positive = true;
    for col in 0..size {
        for row in col..size {
            let mut value = matrix[row * size + col];
            for inner in 0..col {
                value = value.minus::<A>(&matrix[row * size + inner], &matrix[col * size + inner].conj());
            }
            matrix[row * size + col] = value;
        }
        let mut scale = matrix[col * size + col].re;
        for scale in &mut scale {
            positive &= *scale > 0.0 && scale.is_finite();
            *scale = scale.sqrt().recip();
        }
        // The diagonal is not needed, its inverse is.
        for row in col + 1..size {
            matrix[row * size + col] = matrix[row * size + col].scaled(scale);
        }
        inverse[col * size + col] = Complexes { re: scale, im: [0.0; TOGETHER] };
    }
    for col in 0..size {
        for row in col + 1..size {
            let mut sum = Complexes::ZERO;
            for inner in col..row {
                sum = sum.minus::<A>(&matrix[row * size + inner], &inverse[inner * size + col]);
            }
            inverse[row * size + col] = sum.scaled(inverse[row * size + row].re);
        }
    }
    positive
}

/// Least squares by orthonormal columns: A·S = Q·R, S making columns of norm 1.
///
/// Gram and Schmidt's way, each column twice, which leaves Q orthogonal to rounding where A is not nearly deficient (shown for
/// the classical process by L. Giraud, J. Langou, M. Rozložník, J. van den Eshof, Numer. Math. 101, 2005; here shares are
/// taken out one after the other, which errs less).
pub struct Orthonormal {
    rows: usize,
    cols: usize,
    /// `[col][row]`.
    q: Vec<Complexes>,
    /// R⁻¹ on and above the diagonal, `[row][col]`.
    inverse: Vec<Complexes>,
    /// R above the diagonal, `[row][col]`.
    r: Vec<Complexes>,
    scale: Vec<Reals>,
}

impl Orthonormal {
    /// Room for matrices of this shape.
    #[must_use]
    pub fn new(rows: usize, cols: usize) -> Self {
        let square = vec![Complexes::ZERO; cols * cols];
        Self {
            rows,
            cols,
            q: vec![Complexes::ZERO; cols * rows],
            inverse: square.clone(),
            r: square,
            scale: vec![[0.0; TOGETHER]; cols],
        }
    }

    /// Takes matrices apart, `[row][col]`; returns which are known to have full rank: ‖R⁻¹‖ and with it the distance of the
    /// columns from being dependent is within `bound`.
    #[inline(always)]
    pub fn factor<A: Arithmetic>(&mut self, matrix: &[Complexes], bound: f64) -> [bool; TOGETHER] {
        let Self { rows, cols, q, inverse, r, scale } = self;
        let (rows, cols) = (*rows, *cols);
        for col in 0..cols {
            let (before, column) = q.split_at_mut(col * rows);
            let column = &mut column[..rows];
            for (row, entry) in column.iter_mut().enumerate() {
                *entry = matrix[row * cols + col];
            }
            scale[col] = to_unit::<A>(column);
            for known in 0..col {
                r[known * cols + col] = Complexes::ZERO;
            }
            for _ in 0..2 {
                for (known, unit) in before.chunks_exact(rows).enumerate() {
                    let mut share = Complexes::ZERO;
                    for (unit, entry) in unit.iter().zip(&*column) {
                        share = share.plus_adjoint::<A>(unit, entry);
                    }
                    for (unit, entry) in unit.iter().zip(&mut *column) {
                        *entry = entry.minus::<A>(unit, &share);
                    }
                    let sum = &mut r[known * cols + col];
                    for lane in 0..TOGETHER {
                        sum.re[lane] += share.re[lane];
                    }
                    for lane in 0..TOGETHER {
                        sum.im[lane] += share.im[lane];
                    }
                }
            }
            // R⁻¹ has 1/R on its diagonal.
            inverse[col * cols + col] = Complexes { re: to_unit::<A>(column), im: [0.0; TOGETHER] };
        }
        let mut squares = [0.0; TOGETHER];
        for col in 0..cols {
            for row in (0..=col).rev() {
                let mut sum = Complexes::ZERO;
                for inner in row + 1..=col {
                    sum = sum.minus::<A>(&r[row * cols + inner], &inverse[inner * cols + col]);
                }
                if row < col {
                    inverse[row * cols + col] = sum.scaled(inverse[row * cols + row].re);
                }
                let entry = inverse[row * cols + col];
                squares = entry.real_of_adjoint::<A>(&entry, squares);
            }
        }
        squares.map(|square| square < bound * bound)
    }

    /// S·R⁻¹·Qᴴ, `[col][row]`: from right sides to the unknowns.
    #[inline(always)]
    pub fn operator<A: Arithmetic>(&self, operator: &mut [Complexes]) {
        let Self { rows, cols, q, inverse, scale, .. } = self;
        for (unknown, target) in operator.chunks_exact_mut(*rows).enumerate() {
            for (row, target) in target.iter_mut().enumerate() {
                let mut sum = Complexes::ZERO;
                for col in unknown..*cols {
                    sum = sum.plus_adjoint::<A>(&q[col * rows + row], &inverse[unknown * cols + col]);
                }
                *target = sum.scaled(scale[unknown]);
            }
        }
    }
}

/// Makes columns of norm 1; gives the factor.
#[inline(always)]
fn to_unit<A: Arithmetic>(column: &mut [Complexes]) -> Reals {
    let mut squares = [0.0; TOGETHER];
    for entry in &*column {
        squares = entry.real_of_adjoint::<A>(entry, squares);
    }
    let factor = squares.map(|square| square.sqrt().recip());
    for entry in column {
        *entry = entry.scaled(factor);
    }
    factor
}

#[cfg(test)]
mod tests {
    use super::{
        super::{
            lanes::{Fused, Separate},
            least_squares::{PivotedQr, cholesky, invert_lower},
        },
        *,
    };

    /// Numbers that no two problems share.
    fn some(count: usize, phase: f64) -> Vec<Complexes> {
        let number = |index: usize, lane: usize| {
            // Squares, so that no column follows from others.
            let angle = ((index + 1) * (index + 1)) as f64 * (phase + 0.37 * lane as f64);
            Complex64::from_polar(1.0 + angle.sin(), 3.0 * angle)
        };
        (0..count).map(|index| Complexes::of(|lane| number(index, lane))).collect()
    }

    fn problem(numbers: &[Complexes], lane: usize) -> Vec<Complex64> {
        numbers.iter().map(|number| number.lane(lane)).collect()
    }

    fn covariances(size: usize) -> Vec<Complexes> {
        let half = some(size * size, 0.7);
        let mut matrix = vec![Complexes::ZERO; size * size];
        for row in 0..size {
            for col in 0..size {
                let entry = &mut matrix[row * size + col];
                for inner in 0..size {
                    *entry = entry.plus::<Separate>(&half[row * size + inner], &half[col * size + inner].conj());
                }
                entry.re.iter_mut().for_each(|re| *re += if row == col { 0.5 } else { 0.0 });
            }
        }
        matrix
    }

    #[test]
    fn factors_of_covariances_are_those_of_each_alone() {
        for size in [1, 2, 4, 7] {
            let matrix = covariances(size);
            let mut inverse = vec![Complexes::ZERO; size * size];
            assert!(inverse_of_cholesky::<Fused>(size, &mut matrix.clone(), &mut inverse));
            for lane in 0..TOGETHER {
                let alone = invert_lower(size, &cholesky(size, &problem(&matrix, lane)).unwrap());
                for (found, expected) in problem(&inverse, lane).iter().zip(&alone) {
                    // 1e-12: rounding times the condition of a few tens, squared.
                    assert!((found - expected).norm() < 1e-12 * (1.0 + expected.norm()), "{size}: {found} {expected}");
                }
            }
            for broken in [0.0, f64::NAN, -1.0] {
                let mut matrix = matrix.clone();
                matrix[size * size - 1].re[5] = broken;
                assert!(!inverse_of_cholesky::<Separate>(size, &mut matrix, &mut inverse));
            }
        }
    }

    #[test]
    fn operators_are_those_of_each_alone_and_deficient_matrices_are_marked() {
        for (rows, cols) in [(1, 1), (8, 3), (8, 8), (12, 5)] {
            let mut matrix = some(rows * cols, 1.1);
            // Columns of very different sizes.
            matrix.iter_mut().step_by(cols).for_each(|entry| *entry = entry.scaled([1e-6; TOGETHER]));
            let (deficient, empty, near) = (2, 4, 6);
            for row in matrix.chunks_exact_mut(cols) {
                let (last, first) = (cols - 1, row[0]);
                row[last].re[empty] = 0.0;
                row[last].im[empty] = 0.0;
                if cols > 1 {
                    row[last].re[deficient] = 2.0 * first.re[deficient];
                    row[last].im[deficient] = 2.0 * first.im[deficient];
                    row[last].re[near] = 1e6 * first.re[near] + 1e-5 * row[last].re[near];
                    row[last].im[near] = 1e6 * first.im[near] + 1e-5 * row[last].im[near];
                }
            }
            let mut orthonormal = Orthonormal::new(rows, cols);
            let full = orthonormal.factor::<Fused>(&matrix, 1e7);
            let mut operator = vec![Complexes::ZERO; cols * rows];
            orthonormal.operator::<Fused>(&mut operator);
            for lane in 0..TOGETHER {
                let full_rank = lane != empty && (lane != deficient || cols == 1);
                assert_eq!(full[lane], full_rank, "{rows} by {cols}, lane {lane}");
                if !full_rank {
                    continue;
                }
                let qr = PivotedQr::new(rows, cols, &problem(&matrix, lane), 1e-12);
                let (found, expected) = (problem(&operator, lane), qr.operator());
                let size = expected.iter().map(|entry| entry.norm()).fold(0.0, f64::max);
                // Rounding times the condition, which is about 1e5 where columns nearly depend on each other.
                let tolerance = if lane == near { 1e-9 } else { 1e-12 };
                for (found, expected) in found.iter().zip(&expected) {
                    assert!((found - expected).norm() < tolerance * size, "{lane}: {found} {expected}");
                }
            }
        }
    }
}
