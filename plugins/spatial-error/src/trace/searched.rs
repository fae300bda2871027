//! What candidates gain to first order, and the best of those that are searched along a line of shapes.

use nalgebra::{Cholesky, DMatrix, DVector};
use runout_core::numerics::golden_section::maximum;

use crate::{
    effects::{Candidate, Missing, measured, missing},
    shapes::{Shape, frequency_step, times_near},
    terms::Term,
};

use super::{SAME_BIC, State, Tracing};

/// Candidates whose gain is computed at once: products of all with each other are not needed.
const AT_ONCE: usize = 40;
/// Share of the best gain from which the gain at another period is refined, and periods that are named as alike.
const NEAR_BEST: f64 = 0.5;
const MOST_ALIKE: usize = 4;
/// Share of a step of the frequency to which a period is refined.
const REFINED: f64 = 1e-3;
/// What a column adds beside others, as a share of its own square, to be more than rounding.
const OWN: f64 = 1e-9;

/// An effect at its best shape, and periods that fit alike, all of them.
pub(crate) struct Searched {
    pub candidate: Candidate,
    pub alike_mm: Vec<f64>,
}

/// Periods that fit alike, in words.
pub(crate) fn aliases(alike_mm: &[f64]) -> Option<String> {
    let named: Vec<String> = alike_mm.iter().take(MOST_ALIKE).map(|mm| format!("{mm:.2}")).collect();
    let more = alike_mm.len().saturating_sub(MOST_ALIKE);
    let more = if more > 0 { format!(" and {more} shorter ones") } else { String::new() };
    (!named.is_empty()).then(|| {
        format!(
            "periods of {} mm{more} fit alike: take places at uneven distances, or declare the period in `pitch_mm`",
            named.join(", ")
        )
    })
}

impl Tracing<'_> {
    /// What columns would gain to first order; `None` where they are in the span of what is fitted.
    pub(crate) fn gains<'b>(&self, state: &State, all: impl Iterator<Item = &'b [Term]>) -> Vec<Option<f64>> {
        let all: Vec<&[Term]> = all.collect();
        let of = |some: &[&[Term]]| {
            let sums = Sums::of(self, state, some.iter().copied());
            (0..some.len()).map(move |place| sums.gain(place)).collect::<Vec<_>>()
        };
        all.chunks(AT_ONCE).flat_map(of).collect()
    }

    /// The best shape of each effect that is searched along a line, refined, and how many shapes were tried.
    pub(crate) fn best_of_searched(&self, state: &State) -> (Vec<Searched>, usize) {
        let mut all: Vec<usize> =
            (0..self.allowed.len()).filter(|index| self.allowed[*index] && self.is_searched(*index)).collect();
        let total = all.len();
        let effect = |index: usize| self.candidates[index].effect;
        // Columns of one shape leave much of another one, so that the rest would be found again beside it.
        let used =
            |index: usize| state.found.iter().any(|found| !found.jump && effect(found.members[0]) == effect(index));
        all.retain(|index| !used(*index));
        let of_effect = |some: &[usize]| {
            let gains = self.gains(state, some.iter().map(|index| self.columns(*index, false)));
            let gains: Vec<f64> = gains.into_iter().map(|gain| gain.unwrap_or(0.0)).collect();
            let best = (0..gains.len()).max_by(|one, other| gains[*one].total_cmp(&gains[*other]))?;
            let (candidate, gain) = self.refined(state, some[best])?;
            let is_peak = |place: &usize| {
                let beside = [place.wrapping_sub(1), place + 1].map(|other| gains.get(other).copied().unwrap_or(0.0));
                *place != best && gains[*place] > NEAR_BEST * gain && beside.iter().all(|other| gains[*place] >= *other)
            };
            let periodic = matches!(candidate.shape, Shape::Period { .. });
            let peaks = (0..gains.len()).filter(|place| periodic && is_peak(place));
            let refined = peaks.filter_map(|place| self.refined(state, some[place]));
            let alike_mm = refined.filter(|(_, other)| gain - other < SAME_BIC);
            let mut alike_mm: Vec<f64> = alike_mm.filter_map(|(other, _)| other.shape.value()).collect();
            if !alike_mm.is_empty() {
                alike_mm.extend(candidate.shape.value());
                alike_mm.sort_by(|one, other| other.total_cmp(one));
            }
            Some(Searched { candidate, alike_mm })
        };
        (all.chunk_by(|one, other| effect(*one) == effect(*other)).filter_map(of_effect).collect(), total)
    }

    /// A candidate with its shape at the most likely place nearby, and what it gains to first order.
    fn refined(&self, state: &State, index: usize) -> Option<(Candidate, f64)> {
        let candidate = &self.candidates[index];
        let kind = missing()[candidate.effect];
        let with =
            |shape: Shape| Candidate { shape, terms: measured(self.campaign, kind.terms(shape)), ..candidate.clone() };
        let gain = |shape: Shape| {
            let terms = with(shape).terms;
            self.gains(state, std::iter::once(terms.as_slice())).into_iter().flatten().next().unwrap_or(0.0)
        };
        let shape = match (candidate.shape, kind) {
            (Shape::Period { mm, declared }, Missing::Pitch(axis)) => {
                let step = frequency_step(self.campaign, axis);
                let at = |frequency: f64| Shape::Period { mm: 1.0 / frequency, declared };
                at(maximum(1.0 / mm - step, 1.0 / mm + step, REFINED * step, |frequency| gain(at(frequency))))
            }
            (Shape::From(time), _) => {
                let near = times_near(self.campaign, time).into_iter().map(Shape::From);
                near.max_by(|one, other| gain(*one).total_cmp(&gain(*other)))?
            }
            (other, _) => other,
        };
        Some((with(shape), gain(shape)))
    }
}

/// Normal equations of candidates beside what is fitted, with the covariance held: what each would gain to first order.
pub(crate) struct Sums {
    /// The columns of each.
    places: Vec<std::ops::Range<usize>>,
    /// Products of the columns outside the span of what is fitted.
    normal: DMatrix<f64>,
    right: DVector<f64>,
    whole: DVector<f64>,
}

impl Sums {
    pub(crate) fn of<'b>(tracing: &Tracing, state: &State, all: impl IntoIterator<Item = &'b [Term]>) -> Self {
        let base = tracing.terms(&state.found);
        let mut terms = base.clone();
        let mut places = Vec::new();
        for added in all {
            places.push(terms.len() - base.len()..terms.len() - base.len() + added.len());
            terms.extend(added);
        }
        let (normal, right) = state.estimate.joint.equations(&tracing.data(&terms));
        let (fitted, count) = (base.len(), terms.len() - base.len());
        let corner = normal.view((fitted, fitted), (count, count)).into_owned();
        let whole = corner.diagonal();
        let (mut outside, mut left) = (corner, right.rows(fitted, count).into_owned());
        if fitted > 0 {
            let across = normal.view((0, fitted), (fitted, count)).into_owned();
            let solved = &state.estimate.joint.trend_covariance * &across;
            outside -= across.transpose() * &solved;
            left -= solved.transpose() * right.rows(0, fitted);
        }
        Self { places, normal: outside, right: left, whole }
    }

    /// What columns gain beside others; `None` where they are in the span of what is fitted.
    fn quadratic(&self, columns: &[usize]) -> Option<f64> {
        let count = columns.len();
        let normal = DMatrix::from_fn(count, count, |row, column| self.normal[(columns[row], columns[column])]);
        if (0..count).any(|row| normal[(row, row)] <= OWN * self.whole[columns[row]]) {
            return None;
        }
        let right = DVector::from_fn(count, |row, _| self.right[columns[row]]);
        Some(Cholesky::new(normal)?.solve(&right).dot(&right))
    }

    fn gain(&self, place: usize) -> Option<f64> {
        self.quadratic(&self.places[place].clone().collect::<Vec<_>>())
    }

    /// Share of a candidate's gain that another one leaves.
    pub(crate) fn left(&self, place: usize, other: usize) -> f64 {
        let (own, others) = (self.places[place].clone(), self.places[other].clone());
        let both: Vec<usize> = others.clone().chain(own.clone()).collect();
        let alone = self.quadratic(&own.collect::<Vec<_>>());
        // Columns that are the same leave nothing.
        match (self.quadratic(&both), self.quadratic(&others.collect::<Vec<_>>()), alone) {
            (Some(both), Some(others), Some(alone)) if alone > 0.0 => (both - others).max(0.0) / alone,
            _ => 0.0,
        }
    }
}
