//! Products of matrices by order with readings by order.

use runout_core::Complex64;

use crate::solve::apply;

/// Matrix (`[row][column]`) times each order's readings, into a harmonic array of the same shape.
pub(crate) fn project(
    matrices: &[Vec<Complex64>],
    harmonics: &[Complex64],
    count: usize,
    mut take: impl FnMut(usize, &[Complex64]),
) {
    for (index, matrix) in matrices.iter().enumerate() {
        let order = index + 1;
        take(order, &apply(matrix, &harmonics[order * count..(order + 1) * count]));
    }
}

/// Matrix (`[row][column]`) times each order's readings, where some readings are 0 at all orders: an effect does not change them.
pub(crate) fn project_some(
    matrices: &[Vec<Complex64>],
    harmonics: &[Complex64],
    count: usize,
    mut take: impl FnMut(Complex64),
) {
    let changes =
        |reading: &usize| harmonics.iter().skip(*reading).step_by(count).any(|value| *value != Complex64::ZERO);
    let changed: Vec<usize> = (0..count).filter(changes).collect();
    for (matrix, readings) in matrices.iter().zip(harmonics.chunks_exact(count).skip(1)) {
        let is_changed = changed.iter().any(|reading| readings[*reading] != Complex64::ZERO);
        let changed = if is_changed { &changed[..] } else { &[] };
        for row in matrix.chunks_exact(count) {
            take(changed.iter().map(|reading| row[*reading] * readings[*reading]).sum());
        }
    }
}
