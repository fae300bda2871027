//! Crests between the angles at which a profile is known: each highest and lowest of three neighbours is moved to the top of the parabola
//! through them. At six angles a wave, what is left of a crest's error is at most 2.6 % of the wave (1 % in the
//! mean), where its highest point is up to 13 % below it.

#![allow(clippy::inline_always, reason = "see runout_numerics::lanes")]

use super::{Angles, Points};
use runout_draws::DrawnErrors;
use runout_numerics::lanes::{NullaryFnOnce, vectorised};

/// By how much, in parts of the largest of some errors, they change a crest more than a height: within half a step, the weights of the three heights
/// in a parabola are 1.25 together, without sign. A crest exceeds its highest point by an eighth of the step to one beside it at most, half of this.
pub(super) const LIFT: f64 = 0.25;

/// A height at the top of the parabola through it and its neighbours, where it is no lower (no higher) than both, and how far aside that is in
/// steps; else itself.
pub(super) fn crest([before, here, after]: [f64; 3]) -> (f64, f64) {
    let (ahead, behind) = (here - after, here - before);
    let (bend, rise) = (ahead + behind, behind - ahead);
    // Comparisons with NaN are false: at a gap's end there is no parabola.
    if ahead * behind >= 0.0 && bend != 0.0 {
        (here + rise * rise / (8.0 * bend), 0.5 * rise / bend)
    } else {
        (here, 0.0)
    }
}

/// The height of [`crest`].
pub(super) fn lifted(heights: [f64; 3]) -> f64 {
    crest(heights).0
}

/// Heights of a turn on equal angles to which errors are added, again and again.
#[derive(Debug, Clone)]
pub struct Heights<'a> {
    undisturbed: &'a [f64],
    /// What a crest may exceed its highest point by, without errors.
    rise: f64,
}

/// Heights and errors, with what is found on the way.
#[derive(Debug, Clone, Default)]
pub struct Sum {
    heights: Vec<f64>,
    /// The lowest and the highest of each [`CHUNK`], and its first place.
    ends: Vec<(usize, [f64; 2])>,
}

impl<'a> Heights<'a> {
    /// Of heights, of which missing ones are NaN.
    #[must_use]
    pub fn new(heights: &'a [f64]) -> Self {
        let next = heights.iter().cycle().skip(1);
        let steps = heights.iter().zip(next).map(|(here, next)| (next - here).abs());
        // A crest exceeds its highest point by an eighth of a step at most.
        Self { undisturbed: heights, rise: 0.5 * LIFT * steps.fold(0.0, f64::max) }
    }

    /// The lowest and the highest of them with crests between the angles, and the root mean square of them; NaN of nothing.
    #[must_use]
    pub fn undisturbed(&self) -> ([f64; 2], f64) {
        self.with(&DrawnErrors::new(&vec![0.0; self.undisturbed.len()]), &mut Sum::default())
    }

    /// The lowest and the highest of the heights with errors added and with crests between the angles, and the root mean square
    /// of them; NaN of nothing.
    #[must_use]
    pub fn with(&self, errors: &DrawnErrors, sum: &mut Sum) -> ([f64; 2], f64) {
        let count = self.undisturbed.len();
        sum.heights.resize(count, 0.0);
        sum.ends.clear();
        let mut squares = 0.0;
        let mut first = 0;
        for errors in errors.parts() {
            let places = first..first + errors.len();
            let (heights, of) = (&self.undisturbed[places.clone()], &mut sum.heights[places]);
            squares += vectorised(Adding { heights, errors, sum: of, first, ends: &mut sum.ends });
            first += errors.len();
        }
        let rise = self.rise + LIFT * errors.largest_um();
        let all = sum.ends.iter().map(|(_, ends)| ends);
        let [low, high] =
            all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], ends| [low.min(ends[0]), high.max(ends[1])]);
        let mut ends = if low > high { [f64::NAN; 2] } else { [low, high] };
        // What is far from both ends has no crest beyond them.
        let (above, below) = (high - rise, low + rise);
        let is_near = |[low, high]: [f64; 2]| high > above || low < below;
        let mut starts = sum.ends.iter().peekable();
        while let Some((start, of_chunk)) = starts.next() {
            let end = starts.peek().map_or(count, |(next, _)| *next);
            for place in if is_near(*of_chunk) { *start..end } else { 0..0 } {
                let height = sum.heights[place];
                if is_near([height; 2]) {
                    let crest = lifted(around(place, count).map(|place| sum.heights[place]));
                    ends = [ends[0].min(crest), ends[1].max(crest)];
                }
            }
        }
        (ends, (squares / count as f64).sqrt())
    }
}

/// Points whose ends are found together.
const CHUNK: usize = 64;

/// Fills `sum` with heights and errors, adds the ends of each chunk, and gives the sum of squares.
struct Adding<'a> {
    heights: &'a [f64],
    errors: &'a [f64],
    sum: &'a mut [f64],
    /// Place of the first.
    first: usize,
    ends: &'a mut Vec<(usize, [f64; 2])>,
}

/// Points that are added at once.
const LANES: usize = 16;

impl NullaryFnOnce for Adding<'_> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        let Self { heights, errors, sum, first, ends } = self;
        let mut squares = [0.0; LANES];
        let (heights, last_heights) = heights.as_chunks::<CHUNK>();
        let (errors, last_errors) = errors.as_chunks::<CHUNK>();
        let (sum, last_sum) = sum.as_chunks_mut::<CHUNK>();
        for (chunk, ((heights, errors), sum)) in heights.iter().zip(errors).zip(sum).enumerate() {
            let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
            let lanes = heights.as_chunks::<LANES>().0.iter().zip(errors.as_chunks::<LANES>().0);
            for ((heights, errors), sum) in lanes.zip(sum.as_chunks_mut::<LANES>().0) {
                // A loop for each: of all together the compiler makes no vectors.
                let mut both = [0.0; LANES];
                for lane in 0..LANES {
                    both[lane] = heights[lane] + errors[lane];
                }
                for lane in 0..LANES {
                    squares[lane] += both[lane] * both[lane];
                }
                for lane in 0..LANES {
                    low[lane] = lower(low[lane], both[lane]);
                }
                for lane in 0..LANES {
                    high[lane] = higher(high[lane], both[lane]);
                }
                *sum = both;
            }
            for half in [8, 4, 2, 1] {
                for lane in 0..half {
                    low[lane] = lower(low[lane], low[lane + half]);
                    high[lane] = higher(high[lane], high[lane + half]);
                }
            }
            ends.push((first + CHUNK * chunk, [low[0], high[0]]));
        }
        let mut of_last = [f64::INFINITY, f64::NEG_INFINITY];
        let mut squares = squares.iter().sum::<f64>();
        for (sum, (height, error)) in last_sum.iter_mut().zip(last_heights.iter().zip(last_errors)) {
            *sum = height + error;
            squares += *sum * *sum;
            of_last = [of_last[0].min(*sum), of_last[1].max(*sum)];
        }
        if !last_sum.is_empty() {
            ends.push((first + CHUNK * heights.len(), of_last));
        }
        squares
    }
}

/// The lower of two; the first where the second is no number.
#[inline(always)]
fn lower(one: f64, other: f64) -> f64 {
    if other < one { other } else { one }
}

/// The higher of two; the first where the second is no number.
#[inline(always)]
fn higher(one: f64, other: f64) -> f64 {
    if other > one { other } else { one }
}

/// Heights with their crests, and how far aside of its angle each is, in rad.
#[derive(Debug, Clone, Default)]
pub(super) struct Crests {
    pub heights: Vec<f64>,
    aside: Vec<f64>,
    angles: Angles,
}

impl Crests {
    /// Of heights and the neighbours of each, steps of so many rad apart.
    pub(crate) fn set(&mut self, heights: impl Iterator<Item = [f64; 3]>, step_rad: f64) {
        self.heights.clear();
        self.aside.clear();
        for heights in heights {
            let (height, aside) = crest(heights);
            self.heights.push(height);
            self.aside.push(step_rad * aside);
        }
    }

    /// Of all heights of a turn.
    pub(crate) fn set_all(&mut self, heights: &[f64]) {
        let count = heights.len();
        let each = (0..count).map(|index| around(index, count).map(|index| heights[index]));
        self.set(each, std::f64::consts::TAU / count as f64);
    }

    /// Puts them among points, at their angles beside these.
    pub(crate) fn set_profile(&mut self, angles: &Angles, points: &mut Points, radius_mm: f64) {
        self.angles.set_aside(angles, &self.aside);
        points.set_profile(&self.angles, &self.heights, radius_mm);
    }
}

/// An angle's number between those of its neighbours.
pub(super) fn around(index: usize, count: usize) -> [usize; 3] {
    [if index == 0 { count - 1 } else { index - 1 }, index, if index + 1 == count { 0 } else { index + 1 }]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// At six angles a wave, wherever they lie beside its crests.
    #[test]
    fn a_crest_between_angles_is_that_of_the_wave() {
        for step in 0..20 {
            let wave: Vec<f64> =
                (0..6).map(|index| (TAU * (f64::from(index) + 0.05 * f64::from(step)) / 6.0).cos()).collect();
            let mut all = Crests::default();
            all.set_all(&wave);
            let (low, high) =
                all.heights.iter().fold((0.0_f64, 0.0_f64), |(low, high), value| (low.min(*value), high.max(*value)));
            assert!((high - 1.0).abs() < 0.027 && (low + 1.0).abs() < 0.027, "{step}: {low} {high}");
        }
        let gap = [1.0, 2.0, f64::NAN, 3.0];
        let mut all = Crests::default();
        all.set_all(&gap);
        assert!((all.heights[1] - 2.0).abs() < 1e-15 && all.heights[2].is_nan());
        // A parabola's top is where it is, also as an angle.
        all.set_all(&[0.0, 0.91, 0.99, 0.0]);
        all.set_profile(&Angles::equal(4), &mut Points::default(), 1.0);
        let (sin, cos) = all.angles.sin_cos().nth(2).unwrap_or_default();
        let aside = crest([0.91, 0.99, 0.0]).1 * TAU / 4.0;
        assert!(aside < -0.1 && (sin.atan2(cos).rem_euclid(TAU) - (TAU / 2.0 + aside)).abs() < 0.05);
    }
}
