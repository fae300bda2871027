//! Small complex least squares by column-pivoted Householder QR, and which unknowns the columns make observable.

use crate::Complex64;

/// A x ≈ b for a small dense A, factored once: A·S·Π = Q·R with columns scaled to norm 1 (S) and pivoted (Π).
///
/// Golub, Van Loan, *Matrix Computations*, 4th ed., algorithm 5.4.1 (QR with column pivoting); where the rank is less
/// than the number of columns, [`operator`](Self::operator) gives the basic solution: unknowns beyond the rank are 0.
#[derive(Debug, Clone)]
pub struct PivotedQr {
    rows: usize,
    cols: usize,
    /// R above the diagonal, reflectors below, `[row][col]`.
    factors: Vec<Complex64>,
    /// Leading entry and coefficient of each reflector I − τ v vᴴ.
    reflectors: Vec<(Complex64, f64)>,
    pivots: Vec<usize>,
    scale: Vec<f64>,
    rank: usize,
}

impl PivotedQr {
    /// Factors `matrix`, `[row][col]`. A column that adds less than `tolerance` (relative, after scaling) to the span
    /// of the others does not count towards the rank.
    ///
    /// # Panics
    /// When `matrix` does not hold `rows`·`cols` entries, or `cols` is 0.
    #[must_use]
    pub fn new(rows: usize, cols: usize, matrix: &[Complex64], tolerance: f64) -> Self {
        let mut factors = matrix.to_vec();
        let norm = |factors: &[Complex64], col: usize, from: usize| -> f64 {
            (from..rows).map(|row| factors[row * cols + col].norm_sqr()).sum::<f64>().sqrt()
        };
        let scale: Vec<f64> = (0..cols)
            .map(|col| match norm(&factors, col, 0) {
                0.0 => 1.0,
                norm => norm.recip(),
            })
            .collect();
        for row in factors.chunks_exact_mut(cols) {
            row.iter_mut().zip(&scale).for_each(|(entry, scale)| *entry *= *scale);
        }
        let mut pivots: Vec<usize> = (0..cols).collect();
        let mut reflectors = Vec::with_capacity(cols.min(rows));
        let mut rank = 0;
        for step in 0..rows.min(cols) {
            let (best, length) = (step..cols)
                .map(|col| (col, norm(&factors, col, step)))
                .fold((step, -1.0), |best, found| if found.1 > best.1 { found } else { best });
            // All columns had norm 1, so `length` is already relative.
            if length <= tolerance {
                break;
            }
            rank += 1;
            if best != step {
                pivots.swap(step, best);
                (0..rows).for_each(|row| factors.swap(row * cols + step, row * cols + best));
            }
            let head = factors[step * cols + step];
            let phase = if head.norm() > 0.0 { head / head.norm() } else { Complex64::ONE };
            let diagonal = -phase * length;
            let lead = head - diagonal;
            // ‖v‖² with v = (lead, rest): |lead|² + length² − |head|².
            let square = lead.norm_sqr() + (length * length - head.norm_sqr()).max(0.0);
            let tau = 2.0 / square;
            for col in step + 1..cols {
                let mut dot = lead.conj() * factors[step * cols + col];
                for row in step + 1..rows {
                    dot += factors[row * cols + step].conj() * factors[row * cols + col];
                }
                let dot = dot * tau;
                factors[step * cols + col] -= lead * dot;
                for row in step + 1..rows {
                    let reflector = factors[row * cols + step];
                    factors[row * cols + col] -= reflector * dot;
                }
            }
            factors[step * cols + step] = diagonal;
            reflectors.push((lead, tau));
        }
        Self { rows, cols, factors, reflectors, pivots, scale, rank }
    }

    /// Number of independent columns.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// The operator P (`[col][row]`) with x = P·b the (basic) least-squares solution: S·Π·R⁻¹·Qᴴ.
    #[must_use]
    pub fn operator(&self) -> Vec<Complex64> {
        let (rows, cols) = (self.rows, self.cols);
        // The first rows of Qᴴ, each the adjoint of H₀·…·Hₛ·eₛ: later reflectors leave eₛ as it is.
        let mut work = vec![Complex64::ZERO; self.rank * rows];
        for (unit, column) in work.chunks_exact_mut(rows.max(1)).enumerate() {
            column[unit] = Complex64::ONE;
            for (step, (lead, tau)) in self.reflectors.iter().enumerate().take(unit + 1).rev() {
                let below = || self.factors[step..].iter().step_by(cols).skip(step + 1);
                let (head, rest) = column[step..].split_at_mut(1);
                let dot = lead.conj() * head[0] + below().zip(&*rest).map(|(v, q)| v.conj() * q).sum::<Complex64>();
                let dot = dot * *tau;
                head[0] -= lead * dot;
                rest.iter_mut().zip(below()).for_each(|(q, v)| *q -= v * dot);
            }
            for entry in column {
                *entry = entry.conj();
            }
        }
        let mut operator = vec![Complex64::ZERO; cols * rows];
        for row in (0..self.rank).rev() {
            let (above, below) = work.split_at_mut((row + 1) * rows);
            let solved = &mut above[row * rows..];
            for (col, other) in (row + 1..self.rank).zip(below.chunks_exact(rows)) {
                let factor = self.factors[row * cols + col];
                solved.iter_mut().zip(other).for_each(|(value, other)| *value -= factor * other);
            }
            let inverse = self.factors[row * cols + row].inv();
            for value in solved.iter_mut() {
                *value *= inverse;
            }
            let col = self.pivots[row];
            let target = &mut operator[col * rows..(col + 1) * rows];
            target.iter_mut().zip(solved).for_each(|(to, value)| *to = *value * self.scale[col]);
        }
        operator
    }

    /// Covariance (Rᴴ R)⁻¹ of the solution for unit, uncorrelated errors of the factored rows, `[col][col]`; meaningful
    /// for observable unknowns.
    #[must_use]
    pub fn covariance(&self) -> Vec<Complex64> {
        let cols = self.cols;
        let mut inverse = vec![Complex64::ZERO; self.rank * self.rank];
        let mut column = vec![Complex64::ZERO; self.rows.max(self.rank)];
        for unit in 0..self.rank {
            column.fill(Complex64::ZERO);
            column[unit] = Complex64::ONE;
            self.back_substitute(&mut column);
            for row in 0..self.rank {
                inverse[row * self.rank + unit] = column[row];
            }
        }
        let mut covariance = vec![Complex64::ZERO; cols * cols];
        for i in 0..self.rank {
            for j in 0..self.rank {
                let sum: Complex64 = (0..self.rank)
                    .map(|unit| inverse[i * self.rank + unit] * inverse[j * self.rank + unit].conj())
                    .sum();
                let (row, col) = (self.pivots[i], self.pivots[j]);
                covariance[row * cols + col] = sum * self.scale[row] * self.scale[col];
            }
        }
        covariance
    }

    /// Whether each unknown is the same in all least-squares solutions: its entries in the null space vanish (below
    /// `tolerance`, in scaled columns).
    #[must_use]
    pub fn observable(&self, tolerance: f64) -> Vec<bool> {
        let mut observable = vec![true; self.cols];
        let mut column = vec![Complex64::ZERO; self.rows.max(self.rank)];
        for free in self.rank..self.cols {
            observable[self.pivots[free]] = false;
            for row in 0..self.rank {
                column[row] = self.factors[row * self.cols + free];
            }
            self.back_substitute(&mut column);
            for row in 0..self.rank {
                if column[row].norm() > tolerance {
                    observable[self.pivots[row]] = false;
                }
            }
        }
        observable
    }

    fn back_substitute(&self, column: &mut [Complex64]) {
        for row in (0..self.rank).rev() {
            let mut value = column[row];
            for col in row + 1..self.rank {
                value -= self.factors[row * self.cols + col] * column[col];
            }
            column[row] = value / self.factors[row * self.cols + row];
        }
    }
}

/// Lower Cholesky factor L (`[row][col]`) of a Hermitian matrix, L·Lᴴ; `None` where it is not positive definite.
///
/// # Panics
/// When `matrix` holds fewer than `size`² entries.
#[must_use]
pub fn cholesky(size: usize, matrix: &[Complex64]) -> Option<Vec<Complex64>> {
    let mut lower = vec![Complex64::ZERO; size * size];
    for row in 0..size {
        for col in 0..=row {
            let mut value = matrix[row * size + col];
            for inner in 0..col {
                value -= lower[row * size + inner] * lower[col * size + inner].conj();
            }
            if row == col {
                if !(value.re > 0.0 && value.re.is_finite()) {
                    return None;
                }
                lower[row * size + row] = Complex64::from(value.re.sqrt());
            } else {
                lower[row * size + col] = value / lower[col * size + col].re;
            }
        }
    }
    Some(lower)
}

/// Inverse of a lower triangular matrix with a positive diagonal.
///
/// # Panics
/// When `lower` holds fewer than `size`² entries.
#[must_use]
pub fn invert_lower(size: usize, lower: &[Complex64]) -> Vec<Complex64> {
    let mut inverse = vec![Complex64::ZERO; size * size];
    for col in 0..size {
        inverse[col * size + col] = lower[col * size + col].inv();
        for row in col + 1..size {
            let sum: Complex64 = (col..row).map(|inner| lower[row * size + inner] * inverse[inner * size + col]).sum();
            inverse[row * size + col] = -sum / lower[row * size + row];
        }
    }
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }

    fn random(rows: usize, cols: usize, seed: &mut u64) -> Vec<Complex64> {
        (0..rows * cols).map(|_| Complex64::new(noise(seed), noise(seed))).collect()
    }

    fn times(rows: usize, inner: usize, cols: usize, a: &[Complex64], b: &[Complex64]) -> Vec<Complex64> {
        let entry = |row: usize, col: usize| (0..inner).map(|k| a[row * inner + k] * b[k * cols + col]).sum();
        (0..rows * cols).map(|index| entry(index / cols, index % cols)).collect()
    }

    #[test]
    fn the_operator_is_a_left_inverse_and_its_residual_is_orthogonal() {
        let mut seed = 7;
        let (rows, cols) = (8, 6);
        let matrix = random(rows, cols, &mut seed);
        let qr = PivotedQr::new(rows, cols, &matrix, 1e-12);
        let operator = qr.operator();
        let identity = times(cols, rows, cols, &operator, &matrix);
        for (index, entry) in identity.iter().enumerate() {
            let expected = if index % (cols + 1) == 0 { 1.0 } else { 0.0 };
            // 1e-13: rounding times the condition of a random 8×6 matrix.
            assert!((entry - expected).norm() < 1e-13, "{index}: {entry}");
        }
        // P Pᴴ = (Aᴴ A)⁻¹.
        let covariance = qr.covariance();
        for i in 0..cols {
            for j in 0..cols {
                let product: Complex64 =
                    (0..rows).map(|row| operator[i * rows + row] * operator[j * rows + row].conj()).sum();
                assert!((product - covariance[i * cols + j]).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn dependent_columns_are_not_observable() {
        let mut seed = 3;
        let (rows, cols) = (7, 4);
        let mut matrix = random(rows, cols, &mut seed);
        // Column 2 becomes a multiple of column 0: neither is observable; 1 and 3 are.
        for row in 0..rows {
            matrix[row * cols + 2] = matrix[row * cols] * Complex64::new(0.3, -1.2);
        }
        let qr = PivotedQr::new(rows, cols, &matrix, 1e-10);
        assert_eq!(qr.rank(), 3);
        assert_eq!(qr.observable(1e-8), [false, true, false, true]);
        let truth = random(cols, 1, &mut seed);
        let right = times(rows, cols, 1, &matrix, &truth);
        let found = times(cols, rows, 1, &qr.operator(), &right);
        assert!((found[1] - truth[1]).norm() < 1e-12 && (found[3] - truth[3]).norm() < 1e-12);
    }

    #[test]
    fn cholesky_and_its_inverse() {
        let mut seed = 11;
        let size = 4;
        let root = random(size, size, &mut seed);
        let matrix: Vec<Complex64> = (0..size * size)
            .map(|index| {
                let (i, j) = (index / size, index % size);
                (0..size).map(|k| root[i * size + k] * root[j * size + k].conj()).sum::<Complex64>()
                    + if i == j { 0.1 } else { 0.0 }
            })
            .collect();
        let lower = cholesky(size, &matrix).unwrap();
        let product = times(size, size, size, &invert_lower(size, &lower), &lower);
        for (index, entry) in product.iter().enumerate() {
            let expected = if index % (size + 1) == 0 { 1.0 } else { 0.0 };
            assert!((entry - expected).norm() < 1e-13);
        }
        assert!(cholesky(1, &[Complex64::from(-1.0)]).is_none());
    }
}
