//! The least-squares cylinder by Gauss and Newton.

use super::{Points, columns::Axis};
use runout_numerics::chebyshev::inverse;

const MOST_STEPS: usize = 100;

/// LSCY: the axis and radius deviation with the least Σ (distance − radius)² (Shakarji, *J. Res. NIST* 103 (1998) 633).
///
/// Each step solves the normal equations of dᵢ + gᵢ·s − r with the exact deviations and their derivatives at the present
/// axis; a step that does not lessen the sum is halved.
pub(super) fn axis(points: &Points) -> Option<(Axis, f64)> {
    let mut axis = Axis::default();
    let (mut best, mut step, mut scale, mut deviation) = (f64::INFINITY, Axis::default(), f64::INFINITY, f64::NAN);
    for _ in 0..MOST_STEPS {
        let sums = points.held.squares(&points.frame(&axis));
        // Row by row from the diagonal on.
        let sum = |i: usize, j: usize| sums[i * 6 - i * (i + 1) / 2 + j];
        let normal: [[f64; 5]; 5] =
            std::array::from_fn(|i| std::array::from_fn(|j| if i <= j { sum(i, j) } else { sum(j, i) }));
        let right: [f64; 5] = std::array::from_fn(|i| sum(i, 5));
        let mut squares = sum(5, 5);
        squares -= right[4] * right[4] / normal[4][4];
        // 1e-9: a sum of squares is flat where it is least; what rounds there is no reason to go back.
        if squares > best * (1.0 + 1e-9) {
            step = step.map(|step| 0.5 * step);
            (0..4).for_each(|k| axis[k] -= step[k]);
        } else {
            best = squares;
            let solution = inverse(normal)?.map(|row| row.iter().zip(right).map(|(a, b)| a * b).sum::<f64>());
            step.copy_from_slice(&solution[..4]);
            deviation = solution[4];
            (0..4).for_each(|k| axis[k] += step[k]);
        }
        let length = step.iter().map(|step| step * step).sum::<f64>().sqrt();
        // What is left shrinks as this step did, or as the neglected curvature lets it; below rounding it is done.
        let shrinks = (length / scale).max(points.span_um / points.radius_um).min(1.0);
        if length * shrinks <= 0.1 * points.tolerance() {
            break;
        }
        scale = length;
    }
    axis.iter().all(|axis| axis.is_finite()).then_some((axis, deviation))
}
