//! Points whose heights over a plane of few dimensions are asked for again and again.

#![allow(clippy::inline_always, reason = "see crate::lanes")]

use std::ops::Range;

use super::lanes::{NullaryFnOnce, load, vectorised};

/// Points that are looked at together.
const LANES: usize = 8;
/// From so many points on, wide registers are worth a call.
const WIDE: usize = 32;

/// Points (f, w), each with the height h(s) = w − f·s over the place s in `D` dimensions.
///
/// Features lie in separate columns, so that a look at all points goes through vector registers. A level that is NaN is
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
        let levels = &self.levels[range.clone()];
        let features: [&[f64]; D] = std::array::from_fn(|k| &self.features[k][range.clone()]);
        let look = Extremes { levels, features, place };
        // Of few points, the choice of registers costs more than they save.
        if levels.len() < WIDE { look.call() } else { vectorised(look) }
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
    #[must_use]
    #[allow(clippy::float_cmp, reason = "the same operations in the same order")]
    pub fn find(&self, mut range: Range<usize>, place: &[f64; D], height: f64) -> Option<usize> {
        range.find(|point| self.height(*point, place) == height)
    }
}

/// A look at the heights of some points.
struct Extremes<'a, const D: usize> {
    levels: &'a [f64],
    features: [&'a [f64]; D],
    place: &'a [f64; D],
}

impl<const D: usize> NullaryFnOnce for Extremes<'_, D> {
    type Output = (f64, f64);

    #[inline(always)]
    fn call(self) -> (f64, f64) {
        let Self { levels, features, place } = self;
        let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
        let whole = levels.len() - levels.len() % LANES;
        for offset in (0..whole).step_by(LANES) {
            let mut heights: [f64; LANES] = load(levels, offset);
            for k in 0..D {
                let column: [f64; LANES] = load(features[k], offset);
                for lane in 0..LANES {
                    heights[lane] -= column[lane] * place[k];
                }
            }
            for lane in 0..LANES {
                // Comparisons with NaN are false: what is not there changes nothing.
                low[lane] = if heights[lane] < low[lane] { heights[lane] } else { low[lane] };
                high[lane] = if heights[lane] > high[lane] { heights[lane] } else { high[lane] };
            }
        }
        let mut found =
            (low.into_iter().fold(f64::INFINITY, f64::min), high.into_iter().fold(f64::NEG_INFINITY, f64::max));
        for point in whole..levels.len() {
            let height = (0..D).fold(levels[point], |height, k| height - features[k][point] * place[k]);
            found = (found.0.min(height), found.1.max(height));
        }
        found
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
        }
    }
}
