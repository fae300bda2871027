//! The interval of a value, by how far values of draws measured again miss those of the draws themselves.

use crate::{
    section::FORMS,
    uncertainty::{NORMAL_95, Uncertainty},
};

/// Share of the draws below and above: the forms are not exact, so that less is left out than 2.5 %.
const TAIL: f64 = 0.02;

/// Values of the draws of one form, and by how much those measured again miss them.
#[derive(Debug, Clone)]
pub(crate) struct Sides {
    missed: Vec<f64>,
    again: Vec<f64>,
    lowest: f64,
}

impl Default for Sides {
    fn default() -> Self {
        Self { missed: Vec::new(), again: Vec::new(), lowest: f64::INFINITY }
    }
}

impl Sides {
    pub(crate) fn add(&mut self, truth: f64, again: f64) {
        self.missed.push(again - truth);
        self.again.push(again);
        self.lowest = self.lowest.min(truth).min(again);
    }

    /// What is missed in the lowest, in half, and in the highest of all draws.
    fn quantiles(&mut self) -> Option<[f64; 3]> {
        let is_known = !self.missed.is_empty() && self.missed.iter().all(|missed| missed.is_finite());
        is_known.then(|| {
            self.missed.sort_by(f64::total_cmp);
            [TAIL, 0.5, 1.0 - TAIL].map(|share| at(&self.missed, share))
        })
    }

    /// The highest value of the draws measured again.
    fn highest(&mut self) -> f64 {
        self.again.sort_by(f64::total_cmp);
        at(&self.again, 1.0 - TAIL)
    }
}

/// Value at a share of sorted ones.
fn at(sorted: &[f64], share: f64) -> f64 {
    let count = sorted.len();
    let place = (share * (count as f64 + 1.0) - 1.0).clamp(0.0, (count - 1) as f64);
    let below = place.floor() as usize;
    let next = sorted[(below + 1).min(count - 1)];
    sorted[below] + place.fract() * (next - sorted[below])
}

/// What is known of one value.
#[derive(Debug, Clone, PartialEq)]
pub struct Interval {
    /// The value of what was found, on the angles of the draws.
    pub found: f64,
    /// What is known of its error; nothing where it is no number in every draw.
    pub uncertainty: Option<Uncertainty>,
    /// By how much noise raises it in the mean.
    pub share_of_noise: f64,
}

impl Interval {
    /// Where the data refute the noise as too large, the truth may be as large as what was found with all of that noise.
    pub(crate) fn of(found: f64, processed: f64, mut sides: [Sides; FORMS], refutes_noise: bool) -> Self {
        let lowest = sides.iter().map(|sides| sides.lowest).fold(f64::INFINITY, f64::min);
        let draws = sides.iter().map(|sides| sides.missed.len()).sum();
        let missed: Vec<[f64; 3]> = sides.iter_mut().filter_map(Sides::quantiles).collect();
        if missed.len() < FORMS || !(found.is_finite() && processed.is_finite()) {
            return Self { found, uncertainty: None, share_of_noise: f64::NAN };
        }
        let floor = if lowest >= 0.0 { 0.0 } else { f64::NEG_INFINITY };
        let least = missed.iter().map(|of| of[0]).fold(f64::INFINITY, f64::min);
        let most = missed.iter().map(|of| of[2]).fold(f64::NEG_INFINITY, f64::max);
        let mut high = processed - least;
        if refutes_noise {
            high = sides.iter_mut().map(Sides::highest).fold(high, f64::max);
        }
        let interval_95 = [processed - most, high].map(|end| end.max(floor));
        let std = (interval_95[1] - interval_95[0]) / (2.0 * NORMAL_95);
        let share_of_noise = found - processed + missed.iter().map(|of| of[1]).sum::<f64>() / FORMS as f64;
        Self { found, uncertainty: Some(Uncertainty::new(std, interval_95, draws)), share_of_noise }
    }

    /// By how much noise has raised it, where that is more than its standard uncertainty.
    #[must_use]
    pub fn raised_by_noise(&self) -> Option<f64> {
        let std = self.uncertainty.as_ref()?.std;
        (self.share_of_noise > std).then_some(self.share_of_noise)
    }

    /// What is known of the same value found as `value`, on more angles.
    #[must_use]
    pub fn at(&self, value: f64) -> Option<Uncertainty> {
        self.uncertainty.clone().map(|known| {
            let may_be_nothing = known.interval_95[0] == 0.0;
            let mut known = known.moved(value - self.found);
            if may_be_nothing {
                known.interval_95[0] = 0.0;
            }
            known
        })
    }
}
