//! Confounded sets: effects of which the data do not decide which one is present.
//!
//! The parameter values that fit the data equally well form a curved manifold. Each hypothesis "this member is all of it" is
//! a point on it, found by a full non-linear refit. The truth is taken to be one of these points, or a mixture of them.

use runout_numerics::least_squares::dot;

/// Most combinations of members that are refitted; beyond it, the sets are varied one at a time.
const MOST_CHOICES: usize = 16;
/// Exchanges of weight between two points before the search for the nearest point ends.
const MAX_EXCHANGES: usize = 500;
/// The search ends where an exchange brings the point nearer by less than this share of the squared distances.
const SETTLED: f64 = 1e-12;

/// One member of each set, for sets of these sizes: all combinations, the first members first.
pub(super) fn choices(sizes: &[usize]) -> Vec<Vec<usize>> {
    let first = vec![0; sizes.len()];
    let product = sizes.iter().try_fold(1_usize, |product, size| product.checked_mul(*size));
    if product.is_some_and(|product| product <= MOST_CHOICES) {
        let all = vec![Vec::with_capacity(sizes.len())];
        return sizes.iter().fold(all, |all, size| {
            let extended = |choice: Vec<usize>| (0..*size).map(move |member| [&choice[..], &[member]].concat());
            all.into_iter().flat_map(extended).collect()
        });
    }
    let other = |(set, size): (usize, &usize)| {
        let first = first.clone();
        (1..*size).map(move |member| {
            let mut choice = first.clone();
            choice[set] = member;
            choice
        })
    };
    std::iter::once(first.clone()).chain(sizes.iter().enumerate().flat_map(other)).collect()
}

/// Weights (each ≥ 0, sum 1) of the mixture of `points` that is nearest to `from`.
///
/// The mixture is the projection of `from` onto the convex hull of the points, so that for every point or mixture t of
/// them ‖nearest − t‖ ≤ ‖from − t‖: whichever hypothesis is true, the mixture is not farther from it than `from` is.
/// Entries that are not finite in any of them are left out; where none remain, the weights are equal.
pub(super) fn nearest(from: &[f64], points: &[Vec<f64>]) -> Vec<f64> {
    let count = points.len();
    let mut weights = vec![1.0 / count.max(1) as f64; count];
    if points.iter().any(|point| point.len() != from.len()) {
        return weights;
    }
    let known: Vec<usize> = (0..from.len())
        .filter(|index| from[*index].is_finite() && points.iter().all(|point| point[*index].is_finite()))
        .collect();
    let distances: Vec<Vec<f64>> =
        points.iter().map(|point| known.iter().map(|index| point[*index] - from[*index]).collect()).collect();
    let gram: Vec<Vec<f64>> = distances.iter().map(|a| distances.iter().map(|b| dot(a, b)).collect()).collect();
    let whole: f64 = (0..count).map(|index| gram[index][index]).sum();
    for _ in 0..MAX_EXCHANGES {
        // Half of the squared distance's gradient. Weight goes from where it is largest to where it is smallest.
        let slope: Vec<f64> = gram.iter().map(|row| dot(row, &weights)).collect();
        let by_slope = |a: &usize, b: &usize| slope[*a].total_cmp(&slope[*b]);
        let to = (0..count).min_by(by_slope);
        let off = (0..count).filter(|index| weights[*index] > 0.0).max_by(by_slope);
        let (Some(to), Some(off)) = (to, off) else { break };
        let steepness = slope[off] - slope[to];
        let apart = gram[to][to] + gram[off][off] - 2.0 * gram[to][off];
        let share = if apart > 0.0 { (steepness / apart).min(weights[off]) } else { 0.0 };
        if share * steepness <= SETTLED * whole {
            break;
        }
        weights[to] += share;
        weights[off] -= share;
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_combination_is_tried_while_they_are_few() {
        assert_eq!(choices(&[]), [Vec::<usize>::new()]);
        assert_eq!(choices(&[1, 2]), [[0, 0], [0, 1]]);
        assert_eq!(choices(&[2, 2]), [[0, 0], [0, 1], [1, 0], [1, 1]]);
        let many = choices(&[2, 3, 4]);
        assert_eq!(many.len(), 1 + 1 + 2 + 3);
        assert_eq!(many[0], [0, 0, 0]);
    }

    #[test]
    fn no_point_is_farther_from_the_nearest_mixture_than_from_where_it_started() {
        let norm = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        // A deterministic scatter of points, from far apart to nearly equal.
        let value = |seed: usize| ((seed * 7919 + 104_729) % 2003) as f64 / 1001.5 - 1.0;
        for seed in 0..200 {
            let (size, count) = (1 + seed % 5, 2 + seed % 4);
            let scale = 10_f64.powf(-((seed % 7) as f64));
            let points: Vec<Vec<f64>> = (0..count)
                .map(|point| (0..size).map(|entry| 1.0 + scale * value(seed + 31 * point + 7 * entry)).collect())
                .collect();
            let from: Vec<f64> = (0..size).map(|entry| 1.0 + value(3 * seed + 11 * entry + 5)).collect();
            let weights = nearest(&from, &points);
            assert!(weights.iter().all(|weight| *weight >= 0.0));
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-9);
            let mixture: Vec<f64> = (0..size)
                .map(|entry| points.iter().zip(&weights).map(|(point, weight)| weight * point[entry]).sum())
                .collect();
            for point in &points {
                assert!(norm(&mixture, point) <= norm(&from, point) * (1.0 + 1e-5), "{seed}: {weights:?}");
            }
        }
    }

    #[test]
    fn lost_entries_do_not_count() {
        let points = [vec![0.0, f64::NAN], vec![1.0, 5.0]];
        let weights = nearest(&[0.25, 0.0], &points);
        assert!((weights[0] - 0.75).abs() < 1e-9, "{weights:?}");
        assert_eq!(nearest(&[], &[vec![], vec![]]), [0.5, 0.5]);
    }
}
