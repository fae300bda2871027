//! Points whose heights over a plane of few dimensions are asked for again and again.

#![allow(clippy::inline_always, reason = "see crate::lanes")]

use std::ops::Range;

use super::lanes::{NullaryFnOnce, load, vectorised};

/// Points that are evaluated together.
const LANES: usize = 8;
/// From so many points on, wide registers are worth a call.
const WIDE: usize = 32;

/// Points (f, w), each with the height h(s) = w − f·s over the place s in `D` dimensions.
///
/// Features lie in separate columns, so that all points are evaluated in vector registers. A level that is NaN is
/// a point that is not there: no range has it as its lowest or highest.
#[derive(Debug, Clone)]
pub struct Cloud<const D: usize> {
    features: [Vec<f64>; D],
    levels: Vec<f64>,
}

impl<const D: usize> Default for Cloud<D> {
    fn default() -> Self {
        Self { features: std::array::from_fn(|_| Vec::new()), levels: Vec::new() }
    }
}

impl<const D: usize> Cloud<D> {
    /// Number of points, those that are not there included.
    #[must_use]
    pub fn len(&self) -> usize {
        self.levels.len()
    }

    /// Whether there is no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.levels.is_empty()
    }

    /// Takes all points away and keeps the memory.
    pub fn clear(&mut self) {
        self.features.iter_mut().for_each(Vec::clear);
        self.levels.clear();
    }

    /// Makes room for more points.
    pub fn reserve(&mut self, more: usize) {
        self.features.iter_mut().for_each(|column| column.reserve(more));
        self.levels.reserve(more);
    }

    /// Takes away all points but the first.
    pub fn truncate(&mut self, count: usize) {
        self.features.iter_mut().for_each(|column| column.truncate(count));
        self.levels.truncate(count);
    }

    /// Adds a point.
    pub fn push(&mut self, features: [f64; D], level: f64) {
        self.features.iter_mut().zip(features).for_each(|(column, feature)| column.push(feature));
        self.levels.push(level);
    }

    /// The columns of features and that of levels, for those who fill them all at once.
    pub fn columns_mut(&mut self) -> (&mut [Vec<f64>; D], &mut Vec<f64>) {
        (&mut self.features, &mut self.levels)
    }

    /// Column `k` of the features.
    ///
    /// # Panics
    /// When `k` is not below `D`.
    #[must_use]
    pub fn column(&self, k: usize) -> &[f64] {
        &self.features[k]
    }

    /// The levels w.
    #[must_use]
    pub fn levels(&self) -> &[f64] {
        &self.levels
    }

    /// The features f of one point.
    ///
    /// # Panics
    /// When `point` is not below [`len`](Self::len).
    #[must_use]
    pub fn features(&self, point: usize) -> [f64; D] {
        std::array::from_fn(|k| self.features[k][point])
    }

    /// Height of one point over `place`.
    ///
    /// # Panics
    /// When `point` is not below [`len`](Self::len).
    #[must_use]
    pub fn height(&self, point: usize, place: &[f64; D]) -> f64 {
        (0..D).fold(self.levels[point], |height, k| height - self.features[k][point] * place[k])
    }

    /// f·s of one point over `place`: what its height lacks to its level.
    ///
    /// # Panics
    /// When `point` is not below [`len`](Self::len).
    #[must_use]
    pub fn level_under(&self, point: usize, place: &[f64; D]) -> f64 {
        (0..D).fold(0.0, |sum, k| sum + self.features[k][point] * place[k])
    }

    /// Lowest and highest height over `place` in a range of points; (∞, −∞) where none is there.
    ///
    /// # Panics
    /// When the range ends above [`len`](Self::len).
    #[must_use]
    pub fn extremes(&self, range: Range<usize>, place: &[f64; D]) -> (f64, f64) {
        let seen = self.seen(range, place);
        // Of few points, the choice of registers costs more than they save.
        if seen.levels.len() < WIDE { Extremes(seen).call() } else { vectorised(Extremes(seen)) }
    }

    /// Heights over `place` of the first points, as many as `heights` has.
    pub fn heights(&self, place: &[f64; D], heights: &mut [f64]) {
        heights.copy_from_slice(&self.levels[..heights.len()]);
        for (column, place) in self.features.iter().zip(place) {
            for (height, feature) in heights.iter_mut().zip(column) {
                *height -= feature * place;
            }
        }
    }

    /// The first point of a range at exactly this height, as [`extremes`](Self::extremes) gave it.
    ///
    /// # Panics
    /// When the range ends above [`len`](Self::len).
    #[must_use]
    #[allow(clippy::float_cmp, reason = "the same operations in the same order")]
    pub fn find(&self, range: Range<usize>, place: &[f64; D], height: f64) -> Option<usize> {
        let (from, mut found) = (range.start, None);
        let take = |point: usize| {
            found = Some(from + point);
            false
        };
        vectorised(Those { seen: self.seen(range, place), wanted: |own: f64| own == height, take });
        found
    }

    /// Fills `points` with those whose height over `place` is below `low` or above `high`, ascending.
    pub fn outside(&self, place: &[f64; D], [low, high]: [f64; 2], points: &mut Vec<usize>) {
        points.clear();
        let take = |point: usize| {
            points.push(point);
            true
        };
        let wanted = |height: f64| height < low || height > high;
        vectorised(Those { seen: self.seen(0..self.len(), place), wanted, take });
    }

    fn seen<'a>(&'a self, range: Range<usize>, place: &'a [f64; D]) -> PointsSeen<'a, D> {
        let features = std::array::from_fn(|k| &self.features[k][range.clone()]);
        PointsSeen { levels: &self.levels[range], features, place }
    }
}

/// Some points, seen from a place.
struct PointsSeen<'a, const D: usize> {
    levels: &'a [f64],
    features: [&'a [f64]; D],
    place: &'a [f64; D],
}

impl<const D: usize> PointsSeen<'_, D> {
    /// Points that fill whole lanes.
    #[inline(always)]
    fn whole(&self) -> usize {
        self.levels.len() - self.levels.len() % LANES
    }

    /// Heights of the points from `offset` on.
    #[inline(always)]
    fn heights(&self, offset: usize) -> [f64; LANES] {
        let mut heights: [f64; LANES] = load(self.levels, offset);
        for k in 0..D {
            let column: [f64; LANES] = load(self.features[k], offset);
            for lane in 0..LANES {
                heights[lane] -= column[lane] * self.place[k];
            }
        }
        heights
    }

    /// Heights of the points that do not fill lanes, the rest NaN.
    #[inline(always)]
    fn last_heights(&self) -> [f64; LANES] {
        let whole = self.whole();
        std::array::from_fn(|lane| if whole + lane < self.levels.len() { self.height(whole + lane) } else { f64::NAN })
    }

    #[inline(always)]
    fn height(&self, point: usize) -> f64 {
        (0..D).fold(self.levels[point], |height, k| height - self.features[k][point] * self.place[k])
    }
}

/// The lowest and the highest of some heights.
struct Extremes<'a, const D: usize>(PointsSeen<'a, D>);

impl<const D: usize> NullaryFnOnce for Extremes<'_, D> {
    type Output = (f64, f64);

    #[inline(always)]
    fn call(self) -> (f64, f64) {
        let Self(seen) = self;
        let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
        for offset in (0..seen.whole()).step_by(LANES) {
            let heights = seen.heights(offset);
            for lane in 0..LANES {
                // Comparisons with NaN are false: what is not there changes nothing.
                low[lane] = if heights[lane] < low[lane] { heights[lane] } else { low[lane] };
                high[lane] = if heights[lane] > high[lane] { heights[lane] } else { high[lane] };
            }
        }
        let mut found =
            (low.into_iter().fold(f64::INFINITY, f64::min), high.into_iter().fold(f64::NEG_INFINITY, f64::max));
        for point in seen.whole()..seen.levels.len() {
            let height = seen.height(point);
            found = (found.0.min(height), found.1.max(height));
        }
        found
    }
}

/// Takes the points whose heights are wanted, in their order, as long as `take` returns true.
struct Those<'a, const D: usize, W, T> {
    seen: PointsSeen<'a, D>,
    wanted: W,
    take: T,
}

impl<const D: usize, W: Fn(f64) -> bool, T: FnMut(usize) -> bool> NullaryFnOnce for Those<'_, D, W, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { seen, wanted, mut take } = self;
        // What is called in one place is inlined.
        for offset in (0..seen.levels.len()).step_by(LANES) {
            let heights = if offset < seen.whole() { seen.heights(offset) } else { seen.last_heights() };
            let mut are_wanted = [false; LANES];
            let mut some = false;
            for lane in 0..LANES {
                are_wanted[lane] = wanted(heights[lane]);
                some |= are_wanted[lane];
            }
            if some && (0..LANES).any(|lane| are_wanted[lane] && !take(offset + lane)) {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[allow(clippy::float_cmp, reason = "the same operations in the same order")]
    fn extremes_are_those_of_a_plain_loop() {
        let mut cloud = Cloud::<2>::default();
        for point in 0..61_u32 {
            let angle = f64::from(point) * 1.7;
            let level = if point % 7 == 3 { f64::NAN } else { (f64::from(point) * 0.9).sin() };
            cloud.push([angle.cos(), angle.sin()], level);
        }
        for range in [0..61, 3..4, 5..5, 8..40, 17..60] {
            let place = [0.3, -0.8];
            let heights = || range.clone().map(|point| cloud.height(point, &place)).filter(|height| !height.is_nan());
            let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
            assert_eq!(cloud.extremes(range.clone(), &place), (low, high), "{range:?}");
            let found = cloud.find(range.clone(), &place, high);
            assert_eq!(found.map(|point| cloud.height(point, &place)), heights().next().map(|_| high));
            assert!(found.is_none_or(|point| range.contains(&point)));
        }
        let (place, mut points) = ([0.3, -0.8], vec![7]);
        cloud.outside(&place, [-0.1, 0.2], &mut points);
        let is_outside = |point: &usize| !(-0.1..=0.2).contains(&cloud.height(*point, &place));
        let expected: Vec<usize> =
            (0..61).filter(|point| !cloud.levels()[*point].is_nan()).filter(is_outside).collect();
        assert_eq!(points, expected);
        assert!(points.iter().any(|point| *point < 56) && points.iter().any(|point| *point >= 56), "{points:?}");
    }
}
