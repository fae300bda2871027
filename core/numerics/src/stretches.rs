//! Stretches of a line on which something was measured, and the gaps between them.

use std::ops::Range;

/// Times the usual step beside it from which on a step is a gap: one point may be missing.
const GAP: f64 = 2.5;
/// Steps beside one that the usual step is taken from.
const BESIDE: usize = 12;

/// Ascending positions without gaps, by index. A gap is a step longer than `least` and than 2.5 times the usual step there: the second largest of
/// the eight others that are nearest. So positions may be denser here than there, and lie in clusters of up to four.
///
/// ```
/// use runout_numerics::stretches::stretches;
///
/// let positions: Vec<f64> = (0..20).chain(50..60).map(|place| 0.1 * f64::from(place)).collect();
/// assert_eq!(stretches(&positions, 0.0), [0..20, 20..30]);
/// assert_eq!(stretches(&positions, 5.0), [0..30]);
/// ```
#[must_use]
pub fn stretches(positions: &[f64], least: f64) -> Vec<Range<usize>> {
    let steps: Vec<f64> = positions.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let is_gap = |place: &usize| steps[*place] > least && steps[*place] > GAP * usual(&steps, *place);
    let ends = (0..steps.len()).filter(is_gap).map(|place| place + 1).chain([positions.len()]);
    let mut start = 0;
    ends.map(|end| std::mem::replace(&mut start, end)..end).filter(|stretch| !stretch.is_empty()).collect()
}

/// Share of the extent of ascending positions that is in no gap; 1 of fewer than two.
#[must_use]
pub fn covered(positions: &[f64]) -> f64 {
    let [first, .., last] = positions else { return 1.0 };
    let gaps = stretches(positions, 0.0);
    let gaps = gaps.windows(2).map(|pair| positions[pair[1].start] - positions[pair[0].end - 1]);
    if last > first { 1.0 - gaps.sum::<f64>() / (last - first) } else { 1.0 }
}

/// The second largest of the steps nearest to one; infinite where there are not two.
fn usual(steps: &[f64], place: usize) -> f64 {
    let first = place.saturating_sub(BESIDE / 2).min(steps.len().saturating_sub(BESIDE + 1));
    let near = (first..(first + BESIDE + 1).min(steps.len())).filter(|other| *other != place);
    let (mut largest, mut second) = (f64::NAN, f64::NAN);
    for other in near {
        let step = steps[other];
        if largest.is_nan() || step > largest {
            (largest, second) = (step, largest);
        } else if second.is_nan() || step > second {
            second = step;
        }
    }
    if second.is_nan() { f64::INFINITY } else { second }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(positions: &[f64]) -> Vec<Range<usize>> {
        stretches(positions, 0.0)
    }

    fn once(range: Range<usize>) -> Vec<Range<usize>> {
        std::iter::once(range).collect()
    }

    #[test]
    fn gaps_are_what_is_long_beside_its_neighbours() {
        let even: Vec<f64> = (0..50).map(f64::from).collect();
        assert_eq!(of(&even), once(0..50));
        let without = |missing: Range<usize>| -> Vec<f64> {
            even.iter()
                .enumerate()
                .filter(|(place, _)| !missing.contains(place))
                .map(|(_, position)| *position)
                .collect()
        };
        assert_eq!(of(&without(20..21)), once(0..49), "one point may be missing");
        assert_eq!(of(&without(20..23)), [0..20, 20..47]);
        assert_eq!(of(&without(1..8)), [0..1, 1..43], "a first point may be alone");
        assert!((covered(&without(20..30)) - (1.0 - 11.0 / 49.0)).abs() < 1e-12);
        assert!((covered(&even) - 1.0).abs() < 1e-12 && (covered(&[3.0]) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn uneven_positions_have_none() {
        // Denser towards the ends, twice as dense in one half, in clusters of four, and by a fixed recipe.
        let cosine: Vec<f64> = (0..40).map(|place| -(f64::from(place) * std::f64::consts::PI / 39.0).cos()).collect();
        let halves: Vec<f64> =
            (0..40).map(f64::from).chain((40..100).map(|place| 40.0 + 9.0 * f64::from(place - 40))).collect();
        let clusters: Vec<f64> = (0..80).map(|place| f64::from(place / 4) + 0.01 * f64::from(place % 4)).collect();
        let uneven: Vec<f64> =
            (0..80).map(|place| f64::from(place) + 0.4 * f64::from(place * 31 % 7) / 3.0 - 0.4).collect();
        for positions in [cosine, halves, clusters, uneven] {
            assert_eq!(of(&positions), once(0..positions.len()), "{positions:?}");
        }
        assert_eq!((of(&[]), of(&[1.0]), of(&[1.0, 9.0])), (vec![], vec![0..1], vec![0..2]));
        assert_eq!(of(&[0.0, 1.0, 2.0, 50.0, 51.0, 52.0]), [0..3, 3..6]);
    }
}
