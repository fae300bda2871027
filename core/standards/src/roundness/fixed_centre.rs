//! Deviations about a centre that errors do not move.

use super::{
    Values,
    crests::{LIFT, around, lifted},
};
use crate::{
    near::{Course, Ranked},
    uncertainty::DrawnErrors,
};
use runout_numerics::lanes::product;

/// Deviations about a centre to which errors are added that do not move it, again and again: of orders from 2 on about LSCI, of
/// any order about the centre of a polar chart.
#[derive(Debug, Clone)]
pub struct FixedCentre {
    deviations: Vec<f64>,
    squares: f64,
    /// The largest step from one angle to the next.
    step: f64,
    highest: Ranked,
    /// Of the deviations with the other sign.
    lowest: Ranked,
}

impl FixedCentre {
    /// About deviations in µm on equal angles, none of which is missing.
    #[must_use]
    pub fn new(deviations: Vec<f64>) -> Self {
        let highest = Ranked::new(deviations.iter().copied());
        let lowest = Ranked::new(deviations.iter().map(|deviation| -deviation));
        let squares = product(&deviations, &deviations);
        let next = deviations.iter().cycle().skip(1);
        let step = deviations.iter().zip(next).map(|(here, next)| (next - here).abs()).fold(0.0, f64::max);
        Self { deviations, squares, step, highest, lowest }
    }

    /// Values of the deviations themselves.
    #[must_use]
    pub fn about(&self) -> Values {
        Course::of(self.deviations.iter().copied()).into()
    }

    /// Values of the deviations with errors added.
    #[must_use]
    pub fn values(&self, drawn: &DrawnErrors) -> Values {
        let all = &self.deviations[..];
        let high = self.highest.highest(drawn.largest_um(), |point| all[point] + drawn.at(point));
        let low = self.lowest.highest(drawn.largest_um(), |point| -(all[point] + drawn.at(point)));
        let [errors, others] = drawn.parts();
        let course = if let (Some((high, _)), Some((low, _))) = (high, low) {
            Course { low: -low, high, squares: self.squares_with(drawn), points: all.len() }
        } else {
            let (first, rest) = all.split_at(errors.len());
            Course::with_errors(first, errors).and(Course::with_errors(rest, others))
        };
        course.into()
    }

    /// The same with [crests between the angles](super::crests), without RONq (NaN).
    #[must_use]
    pub(super) fn between(&self, drawn: &DrawnErrors) -> Values {
        let all = &self.deviations[..];
        let at = |point: usize| all[point] + drawn.at(point);
        let crest = |point: usize| lifted(around(point, all.len()).map(at));
        // A crest of the sum exceeds its highest point by an eighth of a step of the sum, which is up to twice the largest error longer.
        let rise = 0.5 * LIFT * (self.step + 2.0 * drawn.largest_um());
        let high = self.highest.highest(drawn.largest_um() + rise, crest);
        let low = self.lowest.highest(drawn.largest_um() + rise, |point| -crest(point));
        let [low, high] = if let (Some((high, _)), Some((low, _))) = (high, low) {
            [-low, high]
        } else {
            let [errors, others] = drawn.parts();
            let (first, rest) = all.split_at(errors.len());
            let ends = Course::with_errors(first, errors).and(Course::with_errors(rest, others));
            let (mut low, mut high) = (ends.low, ends.high);
            for (point, (deviation, error)) in all.iter().zip(drawn.iter()).enumerate() {
                let height = deviation + error;
                if height > ends.high - rise {
                    high = high.max(crest(point));
                }
                if height < ends.low + rise {
                    low = low.min(crest(point));
                }
            }
            [low, high]
        };
        Course { low, high, squares: f64::NAN, points: all.len() }.into()
    }

    /// Sum of squares of the deviations with errors added.
    fn squares_with(&self, drawn: &DrawnErrors) -> f64 {
        let [errors, others] = drawn.parts();
        let crossed = product(&self.deviations, errors) + product(&self.deviations[errors.len()..], others);
        self.squares + 2.0 * crossed + drawn.squares_um2()
    }
}
