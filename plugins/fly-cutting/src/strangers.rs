//! The residual in single places: scratches, pits, dust. No effect of the library is local.

use runout_core::{height_grid::GridPlaces, numerics::least_squares::dot};

use crate::heights::Heights;

/// Chance of noise being taken for an unmodelled disturbance anywhere on the map, about.
const CHANCE: f64 = 1e-3;
/// Sides of the tiles in which the residual is summed, in points.
const TILES: [usize; 2] = [4, 16];
/// Above this share of the map, the residual is not local.
const LOCAL: f64 = 0.15;
/// Neighbours that are taken with an unmodelled disturbance, in points.
const MARGIN: usize = 2;
/// Standard deviation of normal noise over its median absolute deviation.
const NORMAL: f64 = 1.4826;

/// A place where more is left than noise.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stranger {
    pub x_mm: [f64; 2],
    pub y_mm: [f64; 2],
    pub points: usize,
    /// The residual farthest from 0, in nm.
    pub farthest_nm: f64,
    pub rms_nm: f64,
}

/// Unmodelled disturbances, the largest first, and the points that they take.
#[derive(Debug, Clone, Default)]
pub(crate) struct Strangers {
    pub all: Vec<Stranger>,
    pub taken: Vec<bool>,
}

/// Looks for them in the residual of all points, in nm.
pub(crate) fn find(heights: &Heights, grid: &GridPlaces, residual_nm: &[f64]) -> Strangers {
    let noise_nm = heights.std_nm.unwrap_or(0.0).max(spread(residual_nm.to_vec()));
    let count = residual_nm.len() as f64;
    if noise_nm <= 0.0 {
        return Strangers::default();
    }
    // Two tails of the normal distribution, to first order.
    let limit = (2.0 * (count / CHANCE).ln()).sqrt();
    let mut map =
        Map { grid, left: vec![f64::NAN; grid.rows * grid.columns], flagged: vec![false; grid.rows * grid.columns] };
    for (node, left) in grid.node.iter().zip(residual_nm) {
        map.left[*node as usize] = left / noise_nm;
        map.flagged[*node as usize] = left.abs() > limit * noise_nm;
    }
    for side in TILES {
        map.flag_tiles(side, limit);
    }
    let flagged = map.flagged.iter().filter(|flag| **flag).count() as f64;
    if flagged == 0.0 || flagged > LOCAL * count {
        return Strangers::default();
    }
    let core = map.flagged.clone();
    for _ in 0..MARGIN {
        map.grow();
    }
    let mut all: Vec<Stranger> =
        map.connected().into_iter().filter_map(|nodes| map.stranger(&nodes, &core, noise_nm)).collect();
    all.sort_by(|one, other| (other.rms_nm * other.points as f64).total_cmp(&(one.rms_nm * one.points as f64)));
    let taken = grid.node.iter().map(|node| map.flagged[*node as usize]).collect();
    Strangers { all, taken }
}

/// Standard deviation of normal noise with this median absolute value.
fn spread(mut values: Vec<f64>) -> f64 {
    values.iter_mut().for_each(|value| *value = value.abs());
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { NORMAL * *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

struct Map<'a> {
    grid: &'a GridPlaces,
    /// In standard deviations; NaN where there is no point.
    left: Vec<f64>,
    flagged: Vec<bool>,
}

impl Map<'_> {
    /// Flags tiles whose mean or mean square is no noise. A residual that is correlated from point to point has wide means all over
    /// the map, which are then the measure.
    fn flag_tiles(&mut self, side: usize, limit: f64) {
        let across = self.grid.columns.div_ceil(side);
        let mut tiles: Vec<Vec<usize>> = vec![Vec::new(); across * self.grid.rows.div_ceil(side)];
        for (node, left) in self.left.iter().enumerate() {
            if left.is_finite() && !self.flagged[node] {
                let [row, column] = [node / self.grid.columns, node % self.grid.columns];
                tiles[row / side * across + column / side].push(node);
            }
        }
        tiles.retain(|nodes| 2 * nodes.len() >= side * side);
        let sizes = |nodes: &Vec<usize>| {
            let values: Vec<f64> = nodes.iter().map(|node| self.left[*node]).collect();
            let count = values.len() as f64;
            let mean = values.iter().sum::<f64>() / count.sqrt();
            // A mean square as a normal deviate (Wilson, Hilferty, Proc. Natl. Acad. Sci. 17 (1931) 684).
            let narrow = 2.0 / (9.0 * count);
            let square = ((dot(&values, &values) / count).cbrt() - (1.0 - narrow)) / narrow.sqrt();
            [mean, square]
        };
        let found: Vec<[f64; 2]> = tiles.iter().map(sizes).collect();
        let widest = [0, 1].map(|which| spread(found.iter().map(|sizes| sizes[which]).collect()).max(1.0));
        for (nodes, [mean, square]) in tiles.iter().zip(&found) {
            if mean.abs() > limit * widest[0] || *square > limit * widest[1] {
                nodes.iter().for_each(|node| self.flagged[*node] = true);
            }
        }
    }

    fn neighbours(&self, node: usize) -> impl Iterator<Item = usize> + use<> {
        let (rows, columns) = (self.grid.rows, self.grid.columns);
        let [row, column] = [node / columns, node % columns];
        let rows = row.saturating_sub(1)..(row + 2).min(rows);
        rows.flat_map(move |row| {
            (column.saturating_sub(1)..(column + 2).min(columns)).map(move |column| row * columns + column)
        })
    }

    fn grow(&mut self) {
        let before: Vec<usize> = (0..self.flagged.len()).filter(|node| self.flagged[*node]).collect();
        for node in before {
            for neighbour in self.neighbours(node) {
                self.flagged[neighbour] = true;
            }
        }
    }

    /// Nodes that were flagged, in groups that touch.
    fn connected(&self) -> Vec<Vec<usize>> {
        let mut open = self.flagged.clone();
        let mut groups = Vec::new();
        for start in 0..open.len() {
            if !open[start] {
                continue;
            }
            open[start] = false;
            let mut group = vec![start];
            let mut next = 0;
            while let Some(node) = group.get(next).copied() {
                next += 1;
                for neighbour in self.neighbours(node) {
                    if open[neighbour] {
                        open[neighbour] = false;
                        group.push(neighbour);
                    }
                }
            }
            groups.push(group);
        }
        groups
    }

    fn stranger(&self, nodes: &[usize], core: &[bool], noise_nm: f64) -> Option<Stranger> {
        let inside: Vec<usize> =
            nodes.iter().copied().filter(|node| core[*node] && self.left[*node].is_finite()).collect();
        let left: Vec<f64> = inside.iter().map(|node| noise_nm * self.left[*node]).collect();
        let farthest_nm = left.iter().copied().max_by(|one, other| one.abs().total_cmp(&other.abs()))?;
        let extent = |of: fn(usize, usize) -> usize, origin: f64, step: f64| {
            let places = || inside.iter().map(|node| of(*node, self.grid.columns));
            [places().min(), places().max()].map(|place| origin + step * place.unwrap_or_default() as f64)
        };
        let [x0, y0] = self.grid.origin_mm;
        Some(Stranger {
            x_mm: extent(|node, columns| node % columns, x0, self.grid.step_x_mm),
            y_mm: extent(|node, columns| node / columns, y0, self.grid.step_y_mm),
            points: inside.len(),
            farthest_nm,
            rms_nm: (dot(&left, &left) / left.len().max(1) as f64).sqrt(),
        })
    }
}
