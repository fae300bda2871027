//! Points of a map on equal cells.

use super::Point;

/// Heights on equal cells: the mean of the points in each, NaN where there is none.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Cells along the horizontal axis.
    pub x: Cells,
    /// Cells along the vertical axis.
    pub y: Cells,
    /// Heights, `[y][x]`.
    pub rows: Vec<Vec<f64>>,
}

impl Grid {
    /// Of points whose height is their third number; at most so many cells along the vertical and the horizontal axis.
    #[must_use]
    pub fn of(points: &[Point], most: [usize; 2]) -> Self {
        let x = Cells::of(points.iter().map(|point| point.x), most[1]);
        let y = Cells::of(points.iter().map(|point| point.y), most[0]);
        let mut sums = vec![vec![(0.0, 0_u32); x.count]; y.count];
        for point in points.iter().filter(|point| point.third.is_finite()) {
            let cell = &mut sums[y.index(point.y)][x.index(point.x)];
            cell.0 += point.third;
            cell.1 += 1;
        }
        let mean = |(sum, count): (f64, u32)| if count == 0 { f64::NAN } else { sum / f64::from(count) };
        let rows = sums.into_iter().map(|row| row.into_iter().map(mean).collect()).collect();
        Self { x, y, rows }
    }
}

/// Equal cells along an axis of a map.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells {
    /// Where the first cell begins.
    pub from: f64,
    /// Where the last cell ends.
    pub to: f64,
    /// How many there are, at least one.
    pub count: usize,
    /// How many different places the points have; with more of them than cells, a cell holds several.
    pub places: usize,
}

impl Cells {
    /// As many cells as there are places, or as can be seen.
    fn of(places: impl Iterator<Item = f64>, most: usize) -> Self {
        let mut places: Vec<f64> = places.collect();
        places.sort_unstable_by(f64::total_cmp);
        let [first, last] = [places.first(), places.last()].map(|place| place.copied().unwrap_or_default());
        // Places that agree to a millionth of the range are one.
        places.dedup_by(|a, b| (*a - *b).abs() <= 1e-6 * (last - first));
        let half = 0.5 * (last - first) / (places.len().max(2) - 1) as f64;
        let half = if half > 0.0 { half } else { 0.5 };
        Self { from: first - half, to: last + half, count: places.len().clamp(1, most), places: places.len() }
    }

    fn index(&self, place: f64) -> usize {
        let share = (place - self.from) / (self.to - self.from);
        ((share * self.count as f64) as usize).min(self.count - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_of_a_map_are_as_many_as_the_grid_has() {
        let cells = Cells::of((0..50).map(|step| 0.1 * f64::from(step)).chain([0.1]), 320);
        assert_eq!(cells.count, 50);
        assert_eq!([0.0, 2.0, 4.9].map(|place| cells.index(place)), [0, 20, 49]);
        assert_eq!(Cells::of([3.0, 3.0].into_iter(), 320).count, 1);
        for (most, count) in [(50, 50), (49, 49)] {
            let cells = Cells::of((0..50).map(f64::from), most);
            assert_eq!((cells.count, cells.places), (count, 50));
        }
    }
}
