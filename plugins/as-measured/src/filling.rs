//! Voids that are filled, and how much of a value is uncertain by that.

use runout_core::{height_grid::HeightGrid, standards::areal};

/// How often the voids are moved to other places of the map.
const MOVES: usize = 16;
/// Share of the voids that must lie on measured heights after a move, so that it says something of them.
const MEASURED: f64 = 0.8;

/// Heights with the voids filled, and how many are: each gets the mean of the nearest heights along its row and its column, weighted by the inverse
/// distance. A void without any stays.
pub(crate) fn filled(grid: &HeightGrid) -> (Vec<f64>, usize) {
    let (rows, columns) = (grid.rows(), grid.columns);
    let heights = &grid.height_nm;
    let mut sums = vec![[0.0; 2]; heights.len()];
    let mut along = |count: usize, step: f64, place: &dyn Fn(usize) -> usize| {
        let mut last: Option<(usize, f64)> = None;
        let mut add = |from: usize, to: usize, index: usize, height: f64| {
            let weight = 1.0 / (step * from.abs_diff(to) as f64);
            sums[index][0] += weight * height;
            sums[index][1] += weight;
        };
        for index in (0..count).chain((0..count).rev()) {
            let here = place(index);
            if heights[here].is_finite() {
                last = Some((index, heights[here]));
            } else if let Some((from, height)) = last.filter(|(from, _)| *from != index) {
                add(from, index, here, height);
            }
        }
    };
    for row in 0..rows {
        along(columns, grid.step_x_mm, &|column| row * columns + column);
    }
    for column in 0..columns {
        along(rows, grid.step_y_mm, &|row| row * columns + column);
    }
    let mut count = 0;
    let all = heights.iter().zip(sums).map(|(height, [sum, weight])| {
        if height.is_finite() || weight <= 0.0 {
            return *height;
        }
        count += 1;
        sum / weight
    });
    (all.collect(), count)
}

/// Height parameters of a map whose voids are filled, and the standard uncertainty of each by the filling.
pub(crate) struct Uncertain {
    pub symbols: [&'static str; 7],
    pub units: [&'static str; 7],
    pub values: [f64; 7],
    pub std: [f64; 7],
}

fn values(grid: &HeightGrid, heights_nm: &[f64]) -> Option<[f64; 7]> {
    let map = HeightGrid { height_nm: heights_nm.to_vec(), ..grid.clone() }.height_map().ok()?;
    let found = areal::heights(&map);
    Some([1e3 * found.sq, 1e3 * found.sz, 1e3 * found.sa, 1e3 * found.sp, 1e3 * found.sv, found.ssk, found.sku])
}

/// The voids are moved, as a pattern, to other places of the map, where heights are known: filled there as here, they change the values, and the root mean
/// square change is the standard uncertainty by the filling. `None` where no move finds enough heights.
pub(crate) fn uncertain(grid: &HeightGrid, filled: &[f64]) -> Option<Uncertain> {
    let (rows, columns) = (grid.rows(), grid.columns);
    let voids: Vec<usize> = (0..grid.height_nm.len()).filter(|place| !grid.height_nm[*place].is_finite()).collect();
    let known = values(grid, filled)?;
    let (mut squares, mut moves) = ([0.0; 7], 0.0);
    for number in 1..=MOVES {
        // Steps of the golden section along both directions: no two moves are near each other.
        let part = |share: f64, count: usize| (share.fract() * count as f64) as usize;
        let (down, right) = (part(0.618_034 * number as f64, rows), part(0.754_878 * number as f64, columns));
        let mut moved = filled.to_vec();
        let mut measured = 0;
        for place in &voids {
            let there = (place / columns + down) % rows * columns + (place % columns + right) % columns;
            measured += usize::from(grid.height_nm[there].is_finite());
            moved[there] = f64::NAN;
        }
        if (measured as f64) < MEASURED * voids.len() as f64 {
            continue;
        }
        let (again, _) = self::filled(&HeightGrid { height_nm: moved, ..grid.clone() });
        let changed = values(grid, &again)?;
        for (square, (changed, known)) in squares.iter_mut().zip(changed.iter().zip(&known)) {
            *square += (changed - known).powi(2);
        }
        moves += 1.0;
    }
    (moves > 0.0).then(|| Uncertain {
        symbols: ["Sq", "Sz", "Sa", "Sp", "Sv", "Ssk", "Sku"],
        units: ["nm", "nm", "nm", "nm", "nm", "", ""],
        values: known,
        std: squares.map(|square| (square / moves).sqrt()),
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn grid(height: impl Fn(usize, usize) -> f64) -> HeightGrid {
        let height_nm = (0..40)
            .flat_map(|row| (0..50).map(move |column| (row, column)))
            .map(|(row, column)| height(row, column))
            .collect();
        let (origin_x_mm, origin_y_mm, std_nm) = (0.0, 0.0, None);
        HeightGrid { columns: 50, step_x_mm: 0.1, step_y_mm: 0.1, origin_x_mm, origin_y_mm, std_nm, height_nm }
    }

    #[test]
    fn a_plane_is_filled_exactly_inside() {
        let void = |row: usize, column: usize| (10..14).contains(&row) && (20..26).contains(&column);
        let holed =
            grid(|row, column| if void(row, column) { f64::NAN } else { 3.0 * row as f64 - 2.0 * column as f64 });
        let (found, count) = filled(&holed);
        assert_eq!(count, 24);
        // Along a row and along a column two heights at distances p and q interpolate a line exactly.
        for (index, height) in found.iter().enumerate() {
            assert!(
                (height - (3.0 * (index / 50) as f64 - 2.0 * (index % 50) as f64)).abs() < 1e-9,
                "{index}: {height}"
            );
        }
        let std = uncertain(&holed, &found).unwrap().std;
        assert!(std[0] < 1e-9 || std[0] < 0.5, "{std:?}");
    }

    /// The uncertainty by filling covers what filling does: 100 patterns on a rough surface whose heights under the voids are known.
    #[test]
    fn the_uncertainty_is_the_size_of_the_error() {
        let mut state = 7_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let (mut squares, mut stated) = (0.0, 0.0);
        for _ in 0..100 {
            let rough: Vec<f64> = (0..2000).map(|_| random() - 0.5).collect();
            let smooth = |row: usize, column: usize| {
                let near = (row.saturating_sub(1)..(row + 2).min(40)).flat_map(|row| {
                    (column.saturating_sub(1)..(column + 2).min(50)).map(move |column| row * 50 + column)
                });
                near.map(|place| rough[place]).sum::<f64>()
            };
            let whole = grid(smooth);
            let (top, left) = ((30.0 * random()) as usize, (40.0 * random()) as usize);
            let void = |row: usize, column: usize| (top..top + 8).contains(&row) && (left..left + 8).contains(&column);
            let holed = grid(|row, column| if void(row, column) { f64::NAN } else { smooth(row, column) });
            let (found, _) = filled(&holed);
            let said = uncertain(&holed, &found).unwrap();
            let truth = values(&whole, &whole.height_nm).unwrap();
            squares += (said.values[0] - truth[0]).powi(2);
            stated += said.std[0].powi(2);
        }
        // A root mean square of 100 errors has a relative deviation of 7 %; of the moves some more.
        let ratio = (stated / squares).sqrt();
        assert!((0.7..1.5).contains(&ratio), "{ratio}");
    }
}
