//! Crests between the angles at which a profile is known: each highest and lowest of three neighbours is moved to the top of the parabola
//! through them. At six angles a wave, what is left of a crest's error is at most 2.6 % of the wave (1 % in the
//! mean), where its highest point is up to 13 % below it.

#![allow(clippy::inline_always, reason = "see runout_numerics::lanes")]

use super::{Angles, Points, ends_um};
use runout_draws::DrawnErrors;
use runout_numerics::lanes::{NullaryFnOnce, load, vectorised};

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
        let squares = self.undisturbed.iter().map(|height| height * height).sum::<f64>();
        self.of(self.undisturbed, squares, 0.0)
    }

    /// The same with errors added.
    #[must_use]
    pub fn with(&self, errors: &DrawnErrors, sum: &mut Vec<f64>) -> ([f64; 2], f64) {
        sum.resize(self.undisturbed.len(), 0.0);
        let [first, others] = errors.parts();
        let (of_first, of_others) = sum.split_at_mut(first.len());
        let (heights, other_heights) = self.undisturbed.split_at(first.len());
        let squares = vectorised(Sums { heights, errors: first, sum: of_first })
            + vectorised(Sums { heights: other_heights, errors: others, sum: of_others });
        self.of(sum, squares, errors.largest_um())
    }

    fn of(&self, heights: &[f64], squares: f64, largest: f64) -> ([f64; 2], f64) {
        let (count, rise) = (heights.len(), self.rise + LIFT * largest);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for (chunk, first) in heights.chunks(CHUNK).zip((0..).step_by(CHUNK)) {
            let [lowest, highest] = ends_um(chunk);
            // What is far from both ends found so far has no crest beyond them.
            if highest > high - rise || lowest < low + rise {
                for (point, height) in chunk.iter().enumerate() {
                    if *height > high - rise || *height < low + rise {
                        let crest = lifted(around(first + point, count).map(|point| heights[point]));
                        (low, high) = (low.min(crest), high.max(crest));
                    }
                }
            }
        }
        let ends = if low > high { [f64::NAN; 2] } else { [low, high] };
        (ends, (squares / count as f64).sqrt())
    }
}

/// Points that are looked at together.
const CHUNK: usize = 64;

/// Fills `sum` with heights and errors, and gives its sum of squares.
struct Sums<'a> {
    heights: &'a [f64],
    errors: &'a [f64],
    sum: &'a mut [f64],
}

impl NullaryFnOnce for Sums<'_> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        const LANES: usize = 16;
        let Self { heights, errors, sum } = self;
        let mut squares = [0.0; LANES];
        let whole = sum.len() - sum.len() % LANES;
        for place in (0..whole).step_by(LANES) {
            let [heights, errors]: [[f64; LANES]; 2] = [load(heights, place), load(errors, place)];
            for (lane, sum) in sum[place..place + LANES].iter_mut().enumerate() {
                *sum = heights[lane] + errors[lane];
                squares[lane] += *sum * *sum;
            }
        }
        let rest = sum[whole..].iter_mut().zip(heights[whole..].iter().zip(&errors[whole..]));
        let rest = rest.map(|(sum, (height, error))| {
            *sum = height + error;
            *sum * *sum
        });
        rest.sum::<f64>() + squares.iter().sum::<f64>()
    }
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
