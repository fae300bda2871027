//! Deviations about a centre that errors do not move.

use std::cell::OnceCell;

use super::{
    Values,
    crests::{LIFT, around, lifted},
};
use crate::{
    near::{Course, Ranked},
    uncertainty::DrawnErrors,
};

/// Deviations about a centre to which errors are added that do not move it, again and again: of orders from 2 on about LSCI, of
/// any order about the centre of a polar chart.
#[derive(Debug, Clone)]
pub struct FixedCentre {
    deviations: Vec<f64>,
    /// What crests between the angles are sought by.
    ranks: OnceCell<Ranks>,
}

#[derive(Debug, Clone)]
struct Ranks {
    /// The largest step from one angle to the next.
    step: f64,
    highest: Ranked,
    /// Of the deviations with the other sign.
    lowest: Ranked,
}

impl Ranks {
    fn of(deviations: &[f64]) -> Self {
        let next = deviations.iter().cycle().skip(1);
        Self {
            step: deviations.iter().zip(next).map(|(here, next)| (next - here).abs()).fold(0.0, f64::max),
            highest: Ranked::new(deviations.iter().copied()),
            lowest: Ranked::new(deviations.iter().map(|deviation| -deviation)),
        }
    }
}

impl FixedCentre {
    /// About deviations in µm on equal angles, none of which is missing.
    #[must_use]
    pub fn new(deviations: Vec<f64>) -> Self {
        Self { deviations, ranks: OnceCell::new() }
    }

    /// Values of the deviations themselves.
    #[must_use]
    pub fn about(&self) -> Values {
        Course::of(self.deviations.iter().copied()).into()
    }

    /// Values of the deviations with errors added.
    #[must_use]
    pub fn values(&self, drawn: &DrawnErrors) -> Values {
        self.course(drawn).into()
    }

    /// The same with [crests between the angles](super::crests), without RONq (NaN).
    #[must_use]
    pub(super) fn between(&self, drawn: &DrawnErrors) -> Values {
        let all = &self.deviations[..];
        let Ranks { step, highest, lowest } = self.ranks.get_or_init(|| Ranks::of(all));
        let at = |point: usize| all[point] + drawn.at(point);
        let crest = |point: usize| lifted(around(point, all.len()).map(at));
        // A crest of the sum exceeds its highest point by an eighth of a step of the sum, which is up to twice the largest error longer.
        let rise = 0.5 * LIFT * (step + 2.0 * drawn.largest_um());
        let high = highest.highest(drawn.largest_um() + rise, crest);
        let low = lowest.highest(drawn.largest_um() + rise, |point| -crest(point));
        let [low, high] = if let (Some((high, _)), Some((low, _))) = (high, low) {
            [-low, high]
        } else {
            let ends = self.course(drawn);
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

    fn course(&self, drawn: &DrawnErrors) -> Course {
        Course::with_errors(&self.deviations, drawn.parts())
    }
}
