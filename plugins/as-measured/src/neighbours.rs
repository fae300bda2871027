//! Points that are unlike their neighbours.

use runout_core::numerics::statistics::{median, median_absolute_deviation};

/// Neighbours on each side that a point is compared with.
const REACH: usize = 2;
/// Fewest neighbours that say something.
const FEWEST: usize = 3;

/// Of each height on a grid, whether it is further than so many median absolute deviations from the median of its neighbours: up to two rows and
/// columns away; of a profile (one row) up to twice as many points along it.
pub(crate) fn outliers(heights: &[f64], columns: usize, mads: f64) -> Vec<bool> {
    let rows = heights.len() / columns.max(1);
    let across = if rows == 1 { 2 * REACH } else { REACH };
    let mut beside = Vec::with_capacity((2 * REACH + 1) * (2 * across + 1));
    let mut differences = vec![f64::NAN; heights.len()];
    for row in 0..rows {
        for column in 0..columns {
            let place = row * columns + column;
            if !heights[place].is_finite() {
                continue;
            }
            beside.clear();
            for near in row.saturating_sub(REACH)..(row + REACH + 1).min(rows) {
                let line = &heights[near * columns..(near + 1) * columns];
                let near_columns = column.saturating_sub(across)..(column + across + 1).min(columns);
                beside.extend(
                    near_columns
                        .filter(|other| near != row || *other != column)
                        .map(|other| line[other])
                        .filter(|height| height.is_finite()),
                );
            }
            if beside.len() >= FEWEST {
                differences[place] = heights[place] - median(beside.iter().copied());
            }
        }
    }
    let known: Vec<f64> = differences.iter().copied().filter(|difference| difference.is_finite()).collect();
    if known.is_empty() {
        return vec![false; heights.len()];
    }
    let (middle, width) = (median(known.iter().copied()), median_absolute_deviation(&known));
    differences.iter().map(|difference| width > 0.0 && (difference - middle).abs() > mads * width).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spikes_are_outliers_and_texture_is_none() {
        let texture = |place: usize| (0.7 * place as f64).sin() + 0.3 * (2.9 * (place / 30) as f64).cos();
        let mut heights: Vec<f64> = (0..900).map(texture).collect();
        assert!(!outliers(&heights, 30, 8.0).contains(&true));
        heights[310] += 20.0;
        heights[311] += 20.0;
        heights[5] = f64::NAN;
        let found = outliers(&heights, 30, 8.0);
        assert_eq!(found.iter().filter(|is_one| **is_one).count(), 2);
        assert!(found[310] && found[311]);
        assert!(!outliers(&[1.0; 12], 4, 5.0).contains(&true));
    }
}
