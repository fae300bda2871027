//! Which effects the readings ask for: likelihoods with the covariance estimated anew without and with each.
//!
//! A covariance that was estimated without an effect has taken a part of it for field. Evidence with this covariance held would be
//! wrong by any amount, so it only lists what is tried.

use nalgebra::{Cholesky, DMatrix, DVector};
use runout_core::numerics::statistics::f_tail;

use crate::{
    campaign::Campaign,
    correlation::Family,
    effects::{Candidate, Jump},
    families::{Likely, most_likely},
    joint::Data,
    likelihood::{Criterion, Estimate, Prior, estimate},
    solve::{estimated_from, independent},
    terms::Term,
};

/// Chance of noise doing as much, corrected for the number of candidates, below which an effect is believed.
const P_LIMIT: f64 = 1e-3;
/// "Very strong" evidence (Kass, Raftery, J. Am. Stat. Assoc. 90 (1995) 773).
const BIC_LIMIT: f64 = -10.0;
/// Effects and jumps that are tried in each round.
const TRIED: [usize; 2] = [8, 4];
/// Candidates whose criteria differ by less are not distinguished, where one leaves nothing for the other.
const SAME_BIC: f64 = 10.0;
/// Share of its gain that is left of a candidate beside another one with which it is confounded, at most.
const LEFT: f64 = 0.15;
/// Jumps that are listed at once.
const AT_ONCE: usize = 40;
/// Jumps at most.
const MOST_JUMPS: usize = 4;
/// What a column adds beside others, as a share of its own square, to be more than rounding.
const OWN: f64 = 1e-9;

/// Evidence for columns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gain {
    /// 2ΔlnL.
    pub likelihood: f64,
    /// Change of the Bayesian information criterion.
    pub bic: f64,
    /// Chance, times the number of candidates.
    pub p: f64,
}

/// Something found: a candidate or a jump, with what it is not distinguished from.
#[derive(Debug, Clone)]
pub(crate) struct Found {
    /// Indices of candidates, the best first; of the jump alone.
    pub members: Vec<usize>,
    /// Whether it is a jump.
    pub jump: bool,
    /// Its evidence when it was found.
    pub gain: Gain,
}

/// A refusal.
#[derive(Debug, Clone)]
pub(crate) struct Doubt {
    /// The candidate.
    pub candidate: usize,
    /// Why.
    pub reason: String,
}

/// The search.
pub(crate) struct Tracing<'a> {
    campaign: &'a Campaign,
    candidates: &'a [Candidate],
    jumps: &'a [Jump],
    declared: Vec<Term>,
    some: Option<Vec<usize>>,
    prior: Prior,
    families: &'a [Family],
    /// Covariances that are given, and not estimated.
    fixed: bool,
    /// Candidates that may be added.
    allowed: Vec<bool>,
    /// What was refused last.
    pub doubts: Vec<Doubt>,
}

/// A state of the search.
#[derive(Clone)]
struct State {
    found: Vec<Found>,
    /// Of each component.
    families: Vec<Family>,
    estimate: Estimate,
}

impl<'a> Tracing<'a> {
    /// A search beside declared columns. `None` where no covariance can be estimated.
    #[must_use]
    pub(crate) fn new(
        campaign: &'a Campaign,
        declared: Vec<Term>,
        candidates: &'a [Candidate],
        jumps: &'a [Jump],
        families: &'a [Family],
        given: Option<&Prior>,
        allowed: Vec<bool>,
    ) -> Self {
        let some = estimated_from(campaign);
        let data = campaign.data(&declared, some.as_deref());
        let prior = given.cloned().unwrap_or_else(|| crate::solve::prior(campaign, &data));
        let fixed = given.is_some();
        let doubts = Vec::new();
        Self { campaign, candidates, jumps, declared, some, prior, families, fixed, allowed, doubts }
    }

    /// Looks for at most so many effects.
    pub(crate) fn run(&mut self, most: usize) -> Option<Vec<Found>> {
        let start = self.start()?;
        let with_jumps = self.follow(start.clone(), most, true);
        if !with_jumps.found.iter().any(|found| found.jump) {
            return Some(with_jumps.found);
        }
        // A jump may stand for several effects that no single one of them betrays.
        let effects = self.follow(start, most, false);
        let total = |state: &State| {
            let parameters: usize = state.found.iter().map(|found| self.terms_of(found).len()).sum();
            parameters as f64 * self.count().ln() - 2.0 * state.estimate.ln_likelihood
        };
        // An unknown place counts as three more numbers each.
        let jumps = with_jumps.found.iter().filter(|found| found.jump).count() as f64;
        let better = total(&with_jumps) + 3.0 * jumps * self.count().ln() < total(&effects);
        Some(if better { with_jumps.found } else { effects.found })
    }

    /// Readings that evidence counts.
    fn count(&self) -> f64 {
        let places = self.some.as_ref().map_or(self.campaign.places_mm.len(), Vec::len);
        (self.campaign.measured.len() * places) as f64
    }

    fn terms_of(&self, found: &Found) -> &[Term] {
        let first = found.members[0];
        if found.jump { &self.jumps[first].terms } else { &self.candidates[first].terms }
    }

    fn terms(&self, found: &[Found]) -> Vec<Term> {
        self.declared
            .iter()
            .copied()
            .chain(found.iter().flat_map(|found| self.terms_of(found).iter().copied()))
            .collect()
    }

    fn data(&self, terms: &[Term]) -> Data {
        self.campaign.data(terms, self.some.as_deref())
    }

    fn start(&self) -> Option<State> {
        let data = self.data(&self.declared);
        let Likely { families, estimate, .. } = most_likely(&data, &self.prior, self.families, Criterion::Full, None)?;
        Some(State { found: Vec::new(), families, estimate })
    }

    fn refit(&self, terms: &[Term], from: &State) -> Option<Estimate> {
        let data = self.data(terms);
        estimate(&data, &from.families, &self.prior, &from.estimate.parameters, Criterion::Full)
    }

    fn gain(&self, likelihood: f64, parameters: usize, candidates: usize) -> Gain {
        let count = parameters as f64;
        let p = f_tail(likelihood.max(0.0) / count, count, self.count());
        Gain { likelihood, bic: count * self.count().ln() - likelihood, p: (p * candidates as f64).min(1.0) }
    }

    fn follow(&mut self, mut state: State, most: usize, jumps: bool) -> State {
        loop {
            let effects = state.found.iter().filter(|found| !found.jump).count();
            let Some(next) = self.next(&state, effects < most, jumps) else { break };
            state = next;
            self.renew(&mut state);
        }
        while let Some(less) = self.superseded(&state) {
            state = less;
        }
        state
    }

    /// Takes the most likely families again.
    fn renew(&self, state: &mut State) {
        if self.fixed || self.families.len() < 2 {
            return;
        }
        let data = self.data(&self.terms(&state.found));
        let from = Some((state.families.as_slice(), &state.estimate.parameters));
        if let Some(likely) = most_likely(&data, &self.prior, self.families, Criterion::Full, from)
            && likely.estimate.ln_likelihood > state.estimate.ln_likelihood
        {
            (state.families, state.estimate) = (likely.families, likely.estimate);
        }
    }

    /// The state with the effect or jump that the readings ask for most, if any.
    fn next(&mut self, state: &State, effects: bool, jumps: bool) -> Option<State> {
        let used = |index: &usize, jump: bool| {
            state.found.iter().any(|found| found.jump == jump && found.members.contains(index))
        };
        let own: Vec<usize> =
            (0..self.candidates.len()).filter(|index| effects && self.allowed[*index] && !used(index, false)).collect();
        let fewer = state.found.iter().filter(|found| found.jump).count() < MOST_JUMPS;
        let steps: Vec<usize> = (0..self.jumps.len()).filter(|index| jumps && fewer && !used(index, true)).collect();
        let sums = Sums::of(self, state, &own, false);
        let effects_by_gain = own.iter().filter_map(|index| Some((*index, sums.gain(*index)?))).collect();
        // Products of all jumps with each other are not needed.
        let of_jumps = steps.chunks(AT_ONCE).flat_map(|some| {
            let sums = Sums::of(self, state, some, true);
            some.iter().filter_map(|index| Some((*index, sums.gain(*index)?))).collect::<Vec<_>>()
        });
        let jumps_by_gain: Vec<(usize, f64)> = of_jumps.collect();
        let list = |mut ranked: Vec<(usize, f64)>, most: usize| {
            ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
            ranked.truncate(most);
            ranked
        };
        let mut trials: Vec<(bool, usize, Gain, Estimate)> = Vec::new();
        for (jump, total, ranked, most) in
            [(false, own.len(), effects_by_gain, TRIED[0]), (true, steps.len(), jumps_by_gain, TRIED[1])]
        {
            for (index, _) in list(ranked, most) {
                let added = if jump { &self.jumps[index].terms } else { &self.candidates[index].terms };
                let terms: Vec<Term> = self.terms(&state.found).into_iter().chain(added.iter().copied()).collect();
                let Some(estimate) = self.refit(&terms, state) else { continue };
                let likelihood = 2.0 * (estimate.ln_likelihood - state.estimate.ln_likelihood);
                let gain = self.gain(likelihood, added.len(), total);
                trials.push((jump, index, gain, estimate));
            }
        }
        trials.sort_by(|a, b| a.2.bic.total_cmp(&b.2.bic));
        let (jump, index, gain, estimate) = trials.first()?.clone();
        if gain.p > P_LIMIT || gain.bic > BIC_LIMIT {
            if let Some((_, candidate, gain, _)) = trials.iter().find(|trial| !trial.0).filter(|_| effects) {
                let reason = format!(
                    "the likelihood does not ask for it: 2ΔlnL {:.1}, ΔBIC {:.1}, p {:.1e}",
                    gain.likelihood, gain.bic, gain.p
                );
                self.doubts = vec![Doubt { candidate: *candidate, reason }];
            }
            return None;
        }
        let mut members = vec![index];
        if !jump {
            let alike = trials.iter().skip(1).filter(|trial| !trial.0 && trial.2.bic - gain.bic < SAME_BIC);
            members.extend(alike.filter(|trial| sums.left(trial.1, index) < LEFT).map(|trial| trial.1));
        }
        let mut found = state.found.clone();
        found.push(Found { members, jump, gain });
        Some(State { found, families: state.families.clone(), estimate })
    }

    /// The state without what is explained by what was found after it.
    fn superseded(&self, state: &State) -> Option<State> {
        if state.found.len() < 2 {
            return None;
        }
        for index in 0..state.found.len() - 1 {
            let mut found = state.found.clone();
            let removed = found.remove(index);
            let Some(estimate) = self.refit(&self.terms(&found), state) else { continue };
            let likelihood = 2.0 * (state.estimate.ln_likelihood - estimate.ln_likelihood);
            let total = if removed.jump { self.jumps.len() } else { self.candidates.len() };
            let gain = self.gain(likelihood, self.terms_of(&removed).len(), total);
            if gain.p > P_LIMIT || gain.bic > BIC_LIMIT {
                return Some(State { found, families: state.families.clone(), estimate });
            }
        }
        None
    }
}

/// Normal equations of all candidates beside what is fitted, with the covariance held: what each would gain to first order.
struct Sums {
    /// The columns of each.
    places: Vec<(usize, std::ops::Range<usize>)>,
    /// Products of the columns outside the span of what is fitted.
    normal: DMatrix<f64>,
    right: DVector<f64>,
    whole: DVector<f64>,
}

impl Sums {
    fn of(tracing: &Tracing, state: &State, all: &[usize], jump: bool) -> Self {
        let base = tracing.terms(&state.found);
        let mut terms = base.clone();
        let mut places = Vec::new();
        for index in all {
            let added = if jump { &tracing.jumps[*index].terms } else { &tracing.candidates[*index].terms };
            places.push((*index, terms.len() - base.len()..terms.len() - base.len() + added.len()));
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

    fn range(&self, index: usize) -> Option<std::ops::Range<usize>> {
        self.places.iter().find(|(known, _)| *known == index).map(|(_, range)| range.clone())
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

    fn gain(&self, index: usize) -> Option<f64> {
        self.quadratic(&self.range(index)?.collect::<Vec<_>>())
    }

    /// Share of a candidate's gain that another one leaves.
    fn left(&self, index: usize, other: usize) -> f64 {
        let (Some(own), Some(others)) = (self.range(index), self.range(other)) else { return 1.0 };
        let both: Vec<usize> = others.clone().chain(own.clone()).collect();
        let alone = self.quadratic(&own.collect::<Vec<_>>());
        // Columns that are the same leave nothing.
        match (self.quadratic(&both), self.quadratic(&others.collect::<Vec<_>>()), alone) {
            (Some(both), Some(others), Some(alone)) if alone > 0.0 => (both - others).max(0.0) / alone,
            _ => 0.0,
        }
    }
}

/// Whether places determine an effect's columns beside declared ones.
#[must_use]
pub(crate) fn is_observable(campaign: &Campaign, declared: &[Term], terms: &[Term]) -> bool {
    let all: Vec<Term> = declared.iter().chain(terms).copied().collect();
    independent(campaign, &all).1.iter().all(|lost| !terms.contains(lost))
}
