//! Which effects the readings ask for: likelihoods with the covariance estimated anew without and with each.
//!
//! A covariance that was estimated without an effect has taken a part of it for field. Evidence with this covariance held would be
//! wrong by any amount, so it only lists what is tried.

mod searched;

use runout_core::numerics::statistics::f_tail;
use searched::{Sums, aliases};

use crate::{
    campaign::Campaign,
    correlation::Family,
    effects::{Candidate, Jump},
    families::{Likely, most_likely},
    joint::Data,
    likelihood::{Criterion, Estimate, Prior, estimate},
    shapes::Shape,
    solve::{estimated_from, independent},
    terms::Term,
};

/// Chance of noise doing as much, corrected for the number of candidates, below which an effect is accepted.
const P_LIMIT: f64 = 1e-3;
/// "Very strong" evidence (Kass, Raftery, J. Am. Stat. Assoc. 90 (1995) 773).
const BIC_LIMIT: f64 = -10.0;
/// Effects and jumps that are tried in each round.
const TRIED: [usize; 2] = [8, 4];
/// Candidates whose criteria differ by less are not distinguished, where one leaves nothing for the other.
pub(crate) const SAME_BIC: f64 = 10.0;
/// Share of its gain that is left of a candidate beside another one with which it is confounded, at most.
const LEFT: f64 = 0.15;
/// What is said of a jump that a step of the tracker explains as well.
const IN_TIME_OR_SPACE: &str =
    "or the tracker moved at that time: readings in another order of the places distinguish them";
/// What is said of a step of the tracker that a steady drift explains as well.
const STEP_OR_DRIFT: &str = "or the readings drift: passes in another order of the places distinguish them";
/// Jumps at most.
const MOST_JUMPS: usize = 4;

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
pub(crate) struct TracedEffect {
    /// Indices of candidates, the best first; of the jump alone.
    pub members: Vec<usize>,
    /// Whether it is a jump.
    pub jump: bool,
    /// Why it is not added, though the readings ask for it.
    pub undecided: Option<String>,
    /// Its evidence when it was found.
    pub gain: Gain,
}

impl TracedEffect {
    /// Whether it is added to the model.
    pub(crate) fn is_added(&self) -> bool {
        !self.jump && self.undecided.is_none()
    }
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
    pub campaign: &'a Campaign,
    /// Those that were given, and behind them those whose shape was refined.
    pub candidates: Vec<Candidate>,
    jumps: &'a [Jump],
    declared: Vec<Term>,
    some: Option<Vec<usize>>,
    prior: Prior,
    families: &'a [Family],
    /// Covariances that are given, and not estimated.
    fixed: bool,
    /// Whether each that was given may be added.
    pub allowed: Vec<bool>,
    /// What was refused last.
    pub doubts: Vec<Doubt>,
}

/// A state of the search.
#[derive(Clone)]
pub(crate) struct State {
    pub found: Vec<TracedEffect>,
    /// Of each component.
    families: Vec<Family>,
    pub estimate: Estimate,
}

impl<'a> Tracing<'a> {
    /// A search beside declared columns. `None` where no covariance can be estimated.
    #[must_use]
    pub(crate) fn new(
        campaign: &'a Campaign,
        declared: Vec<Term>,
        candidates: Vec<Candidate>,
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
    pub(crate) fn run(&mut self, most: usize) -> Option<Vec<TracedEffect>> {
        let start = self.start()?;
        let with_jumps = self.follow(start.clone(), most, true);
        if !with_jumps.found.iter().any(|found| found.jump) {
            return Some(with_jumps.found);
        }
        // A jump may stand for several effects that no single one of them betrays.
        let effects = self.follow(start, most, false);
        let total = |state: &State| {
            let parameters: usize = state.found.iter().map(|found| self.parameters(found.members[0], found.jump)).sum();
            parameters as f64 * self.count().ln() - 2.0 * state.estimate.ln_likelihood
        };
        // An unknown place counts as three more numbers each.
        let jumps = with_jumps.found.iter().filter(|found| found.jump).count() as f64;
        let better = total(&with_jumps) + 3.0 * jumps * self.count().ln() < total(&effects);
        let is_step = |found: &TracedEffect| matches!(self.candidates[found.members[0]].shape, Shape::From(_));
        let same = with_jumps.found.iter().any(|found| found.jump && found.undecided.is_some());
        let better = better || (same && effects.found.iter().any(is_step));
        Some(if better { with_jumps.found } else { effects.found })
    }

    /// Readings that evidence counts.
    fn count(&self) -> f64 {
        let places = self.some.as_ref().map_or(self.campaign.places_mm.len(), Vec::len);
        (self.campaign.measured.len() * places) as f64
    }

    fn terms_of(&self, found: &TracedEffect) -> &[Term] {
        self.columns(found.members[0], found.jump)
    }

    pub(crate) fn terms(&self, found: &[TracedEffect]) -> Vec<Term> {
        self.declared
            .iter()
            .copied()
            .chain(found.iter().flat_map(|found| self.terms_of(found).iter().copied()))
            .collect()
    }

    pub(crate) fn data(&self, terms: &[Term]) -> Data {
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
        let own: Vec<usize> = (0..self.allowed.len())
            .filter(|index| effects && self.allowed[*index] && !self.is_searched(*index) && !used(index, false))
            .collect();
        let fewer = state.found.iter().filter(|found| found.jump).count() < MOST_JUMPS;
        let steps: Vec<usize> = (0..self.jumps.len()).filter(|index| jumps && fewer && !used(index, true)).collect();
        let (searched, total) = if effects { self.best_of_searched(state) } else { (Vec::new(), 0) };
        let refined = self.candidates.len()..self.candidates.len() + searched.len();
        let alike: Vec<Vec<f64>> = searched.iter().map(|one| one.alike_mm.clone()).collect();
        self.candidates.extend(searched.into_iter().map(|one| one.candidate));
        let by_gain = |all: &[usize], jump: bool| {
            let gains = self.gains(state, all.iter().map(|index| self.columns(*index, jump)));
            all.iter().zip(gains).filter_map(|(index, gain)| Some((*index, gain?))).collect::<Vec<(usize, f64)>>()
        };
        let list = |mut ranked: Vec<(usize, f64)>, most: usize| {
            ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
            ranked.truncate(most);
            ranked
        };
        let mut trials: Vec<(bool, usize, Gain, Estimate)> = Vec::new();
        for (jump, total, ranked) in [
            (false, own.len(), list(by_gain(&own, false), TRIED[0])),
            (false, total, refined.clone().map(|index| (index, 0.0)).collect()),
            (true, steps.len(), list(by_gain(&steps, true), TRIED[1])),
        ] {
            for (index, _) in ranked {
                let added = self.columns(index, jump);
                let terms: Vec<Term> = self.terms(&state.found).into_iter().chain(added.iter().copied()).collect();
                let Some(estimate) = self.refit(&terms, state) else { continue };
                let likelihood = 2.0 * (estimate.ln_likelihood - state.estimate.ln_likelihood);
                let gain = self.gain(likelihood, self.parameters(index, jump), total);
                trials.push((jump, index, gain, estimate));
            }
        }
        trials.sort_by(|a, b| a.2.bic.total_cmp(&b.2.bic));
        let (mut jump, mut index, mut gain, mut estimate) = trials.first()?.clone();
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
        let mut undecided =
            (!jump && refined.contains(&index)).then(|| aliases(&alike[index - refined.start])).flatten();
        // In one pass over the places, a step in time may be one in space.
        let is_step = |trial: &(bool, usize, Gain, Estimate)| {
            !trial.0 && matches!(self.candidates[trial.1].shape, Shape::From(_))
        };
        let near = |trial: &&(bool, usize, Gain, Estimate)| trial.2.bic - gain.bic < SAME_BIC;
        let of_space = trials.iter().filter(near).find(|trial| trial.0);
        if let Some(of_space) = of_space.filter(|_| jump || is_step(&trials[0]))
            && trials.iter().filter(near).any(is_step)
        {
            undecided = Some(IN_TIME_OR_SPACE.into());
            (jump, index, gain, estimate) = of_space.clone();
        }
        if undecided.is_none() && !jump && matches!(self.candidates[index].shape, Shape::From(_)) {
            undecided = self.drifts_as_well(state, gain).then(|| STEP_OR_DRIFT.into());
        }
        let mut members = vec![index];
        if !jump {
            let own = self.candidates[index].effect;
            let alike = trials.iter().filter(|trial| {
                !trial.0 && self.candidates[trial.1].effect != own && trial.2.bic - gain.bic < SAME_BIC
            });
            let left = |other: usize| Sums::of(self, state, [self.columns(other, false), self.columns(index, false)]);
            members.extend(alike.map(|trial| trial.1).filter(|other| left(*other).left(0, 1) < LEFT));
            // The simplest member stands for the set: polynomials of unlike orders are alike at few places, and far apart between them.
            let order = |member: usize| match self.candidates[member].shape {
                Shape::None => Some(0),
                Shape::Order(order) => Some(order),
                Shape::Period { .. } | Shape::From(_) => None,
            };
            let simplest = (0..members.len()).filter_map(|place| Some((order(members[place])?, place))).min();
            if let Some((_, place)) = simplest.filter(|_| order(index).is_some()) {
                members.swap(0, place);
                let chosen = trials.iter().find(|trial| !trial.0 && trial.1 == members[0]);
                if let Some((_, _, of_chosen, fitted)) = chosen {
                    (gain, estimate) = (*of_chosen, fitted.clone());
                }
            }
        }
        let mut found = state.found.clone();
        found.push(TracedEffect { members, jump, undecided, gain });
        Some(State { found, families: state.families.clone(), estimate })
    }

    /// Whether a steady drift of all components explains as much as a step of the tracker: in two passes of one order, what the readings do within a pass
    /// may be the machine.
    fn drifts_as_well(&self, state: &State, step: Gain) -> bool {
        let known = self.terms(&state.found);
        let drifts = self.campaign.measured.iter().map(|axis| Term::Drift(*axis));
        let drifts: Vec<Term> = drifts.filter(|drift| !known.contains(drift)).collect();
        let Some(estimate) = self.refit(&[known, drifts.clone()].concat(), state) else { return false };
        let likelihood = 2.0 * (estimate.ln_likelihood - state.estimate.ln_likelihood);
        !drifts.is_empty() && self.gain(likelihood, drifts.len(), 1).bic - step.bic < SAME_BIC
    }

    pub(crate) fn is_searched(&self, candidate: usize) -> bool {
        self.candidates[candidate].shape.is_searched()
    }

    pub(crate) fn columns(&self, index: usize, jump: bool) -> &[Term] {
        if jump { &self.jumps[index].terms } else { &self.candidates[index].terms }
    }

    /// Numbers that are estimated of a candidate: a shape that was looked for is one.
    fn parameters(&self, index: usize, jump: bool) -> usize {
        self.columns(index, jump).len() + usize::from(!jump && self.is_searched(index))
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
            let gain = self.gain(likelihood, self.parameters(removed.members[0], removed.jump), total);
            if gain.p > P_LIMIT || gain.bic > BIC_LIMIT {
                return Some(State { found, families: state.families.clone(), estimate });
            }
        }
        None
    }
}

/// Whether places determine an effect's columns beside declared ones.
#[must_use]
pub(crate) fn is_observable(campaign: &Campaign, declared: &[Term], terms: &[Term]) -> bool {
    let all: Vec<Term> = declared.iter().chain(terms).copied().collect();
    independent(campaign, &all).1.iter().all(|lost| !terms.contains(lost))
}
