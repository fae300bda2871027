//! Deviations about a centre that errors do not move.

use super::Values;
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
        Self { deviations, squares, highest, lowest }
    }

    /// Values of the deviations themselves.
    #[must_use]
    pub fn about(&self) -> Values {
        Course::of(self.deviations.iter().copied()).into()
    }

    /// Values of the deviations with errors added at these points, where the ends lie; RONq is NaN.
    #[must_use]
    pub fn values_at(&self, points: &[usize], errors: &[f64]) -> Values {
        let disturbed = points.iter().zip(errors).map(|(point, error)| self.deviations[*point] + error);
        let Course { low, high, .. } = Course::of(disturbed);
        Course { low, high, squares: f64::NAN, points: self.deviations.len() }.into()
    }

    /// Values of the deviations with errors added.
    #[must_use]
    pub fn values(&self, drawn: &DrawnErrors) -> Values {
        let all = &self.deviations[..];
        let high = self.highest.highest(drawn.largest_um(), |point| all[point] + drawn.at(point));
        let low = self.lowest.highest(drawn.largest_um(), |point| -(all[point] + drawn.at(point)));
        let [errors, others] = drawn.parts();
        let course = if let (Some((high, _)), Some((low, _))) = (high, low) {
            let crossed = product(all, errors) + product(&all[errors.len()..], others);
            let squares = self.squares + 2.0 * crossed + drawn.squares_um2();
            Course { low: -low, high, squares, points: all.len() }
        } else {
            let (first, rest) = all.split_at(errors.len());
            Course::with_errors(first, errors).and(Course::with_errors(rest, others))
        };
        course.into()
    }
}
