//! Narrow holes of a map, bridged: hills and dales on both sides of one are what they are without it.

use std::{borrow::Cow, f64::consts::SQRT_2};

use super::HeightMap;

/// Points from a measured one, along rows, columns and diagonals, up to which a hole is bridged: it is then narrower than five points.
const NARROW: isize = 2;
/// Steps of the conjugate gradients, at most, and the share of the residual that ends them.
const MOST_STEPS: usize = 500;
const ACCURACY: f64 = 1e-9;

/// A map with its narrow holes bridged, and how many points of it are.
pub(super) struct Bridged<'a> {
    pub(super) map: Cow<'a, HeightMap<'a>>,
    pub(super) points: usize,
}

/// Bridges the narrow holes of a map with mean 0 by the surface of least curvature, Σ z_xx² + 2 z_xy² + z_yy² by second differences (Briggs,
/// Geophysics 39, 1974). It goes on with the slopes around, so that a ridge or a groove is not cut in two by a hole, as the mean of the
/// neighbours would do. Wide holes stay.
pub(super) fn bridged<'a>(centred: &'a HeightMap<'a>) -> Bridged<'a> {
    let grid = Grid { map: centred };
    let holes = grid.narrow_holes();
    if holes.is_empty() {
        return Bridged { map: Cow::Borrowed(centred), points: 0 };
    }
    let mut heights = centred.heights_um().to_vec();
    for (hole, height) in holes.iter().zip(grid.least_curvature(&holes)) {
        heights[*hole] = height;
    }
    Bridged { map: Cow::Owned(centred.with(heights)), points: holes.len() }
}

struct Grid<'a> {
    map: &'a HeightMap<'a>,
}

/// A second difference that holds bridged points: these, by their number, with their weights, and what the measured points add.
struct Bend {
    bridged: Vec<(usize, f64)>,
    measured: f64,
}

impl Grid<'_> {
    /// The point so many columns and rows from another; `None` beyond the map.
    fn beside(&self, point: usize, [across, along]: [isize; 2]) -> Option<usize> {
        let columns = self.map.columns();
        let row = (point / columns).checked_add_signed(along).filter(|row| *row < self.map.rows())?;
        let column = (point % columns).cast_signed() + across;
        let count = columns.cast_signed();
        let column = if self.map.closed() { column.rem_euclid(count) } else { column };
        (0..count).contains(&column).then(|| row * columns + column as usize)
    }

    fn is_missing(&self, point: usize) -> bool {
        !self.map.heights_um()[point].is_finite()
    }

    /// Missing points, but for those of holes that are wide somewhere.
    fn narrow_holes(&self) -> Vec<usize> {
        let missing: Vec<usize> = (0..self.map.heights_um().len()).filter(|point| self.is_missing(*point)).collect();
        let within = |distance: isize| {
            (-distance..=distance).flat_map(move |along| (-distance..=distance).map(move |across| [across, along]))
        };
        let deep =
            |point: usize| within(NARROW).filter_map(|by| self.beside(point, by)).all(|beside| self.is_missing(beside));
        let mut open: Vec<usize> = missing.iter().copied().filter(|point| deep(*point)).collect();
        let mut wide = vec![false; if open.is_empty() { 0 } else { self.map.heights_um().len() }];
        open.iter().for_each(|point| wide[*point] = true);
        while let Some(point) = open.pop() {
            for beside in within(1).filter_map(|by| self.beside(point, by)) {
                if self.is_missing(beside) && !std::mem::replace(&mut wide[beside], true) {
                    open.push(beside);
                }
            }
        }
        missing.into_iter().filter(|point| !wide.get(*point).is_some_and(|wide| *wide)).collect()
    }

    /// Second differences along rows, along columns and mixed, of which a bridged point is one.
    fn bends(&self, holes: &[usize]) -> Vec<Bend> {
        let (dx, dy) = (self.map.dx_mm(), self.map.dy_mm());
        let unit = dx.min(dy);
        let [across, along, mixed] = [(unit / dx).powi(2), (unit / dy).powi(2), SQRT_2 * unit * unit / (dx * dy)];
        let kinds: [Vec<([isize; 2], f64)>; 3] = [
            vec![([0, 0], across), ([1, 0], -2.0 * across), ([2, 0], across)],
            vec![([0, 0], along), ([0, 1], -2.0 * along), ([0, 2], along)],
            vec![([0, 0], mixed), ([1, 0], -mixed), ([0, 1], -mixed), ([1, 1], mixed)],
        ];
        let mut bends = Vec::new();
        for hole in holes {
            for kind in &kinds {
                for place in 0..kind.len() {
                    let [across, along] = kind[place].0;
                    let first = self.beside(*hole, [-across, -along]);
                    let bend = first.and_then(|first| self.bend(first, kind, place, holes));
                    bends.extend(bend);
                }
            }
        }
        bends
    }

    /// One second difference from its first point; `None` where it is not wholly on the map's known and bridged points, and where a bridged
    /// point before the one at `place` has it already.
    fn bend(&self, first: usize, kind: &[([isize; 2], f64)], place: usize, holes: &[usize]) -> Option<Bend> {
        let mut bend = Bend { bridged: Vec::new(), measured: 0.0 };
        for (index, (by, weight)) in kind.iter().enumerate() {
            let point = self.beside(first, *by)?;
            if self.is_missing(point) {
                if index < place {
                    return None;
                }
                bend.bridged.push((holes.binary_search(&point).ok()?, *weight));
            } else {
                bend.measured += weight * self.map.heights_um()[point];
            }
        }
        Some(bend)
    }

    /// Heights of bridged points with the least sum of squared second differences, by conjugate gradients on the normal equations
    /// (Hestenes and Stiefel 1952).
    fn least_curvature(&self, holes: &[usize]) -> Vec<f64> {
        let bends = self.bends(holes);
        let of = |heights: &[f64], bend: &Bend| -> f64 {
            bend.bridged.iter().map(|(hole, weight)| weight * heights[*hole]).sum()
        };
        let gradient = |residuals: &[f64]| {
            let mut gradient = vec![0.0; holes.len()];
            for (bend, residual) in bends.iter().zip(residuals) {
                bend.bridged.iter().for_each(|(hole, weight)| gradient[*hole] += weight * residual);
            }
            gradient
        };
        let square = |values: &[f64]| -> f64 { values.iter().map(|value| value * value).sum() };
        let mut heights = vec![0.0; holes.len()];
        let mut residuals: Vec<f64> = bends.iter().map(|bend| -bend.measured).collect();
        let mut downhill = gradient(&residuals);
        let mut direction = downhill.clone();
        let mut size = square(&downhill);
        let enough = ACCURACY * ACCURACY * size;
        for _ in 0..MOST_STEPS {
            let change: Vec<f64> = bends.iter().map(|bend| of(&direction, bend)).collect();
            let curvature = square(&change);
            if size <= enough || curvature <= 0.0 {
                break;
            }
            let step = size / curvature;
            heights.iter_mut().zip(&direction).for_each(|(height, direction)| *height += step * direction);
            residuals.iter_mut().zip(&change).for_each(|(residual, change)| *residual -= step * change);
            downhill = gradient(&residuals);
            let next = square(&downhill);
            direction.iter_mut().zip(&downhill).for_each(|(along, down)| *along = down + next / size * *along);
            size = next;
        }
        heights
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    /// A plane, whose curvature is none, is met exactly, at an edge, across the seam and in a scratch; of wide holes nothing is bridged.
    #[test]
    fn narrow_holes_of_a_plane_are_bridged_by_it() {
        let plane = |point: usize| 0.3 * (point / 30) as f64 - 4.0;
        let mut heights: Vec<f64> = (0..40 * 30).map(plane).collect();
        let holes = [0, 29, 30, 5 * 30 + 7, 5 * 30 + 8, 6 * 30 + 8, 39 * 30 + 15];
        let scratch = (10..31).flat_map(|row| [row * 30 + 20, row * 30 + 21]);
        let narrow: Vec<usize> = holes.into_iter().chain(scratch).collect();
        narrow.iter().for_each(|hole| heights[*hole] = f64::NAN);
        for row in 20..25 {
            heights[row * 30 + 3..row * 30 + 8].fill(f64::NAN);
        }
        for closed in [true, false] {
            let map = HeightMap::new(heights.clone(), 30, 0.01, 0.02, closed).unwrap();
            let found = bridged(&map);
            assert_eq!((found.points, found.map.missing()), (narrow.len(), 25));
            for hole in &narrow {
                assert!((found.map.heights_um()[*hole] - plane(*hole)).abs() < 1e-6, "{hole}");
            }
        }
    }
}
