//! Candidates of the loop: what each promises, and joint refits with those that promise most.

use std::collections::BTreeMap;

use super::{
    Fit, Model, Remainder, Setting,
    evidence::Evidence,
    fit::{Refit, first_step, refit},
    judgement::independent,
    search::Tracing,
};
use runout_numerics::{least_squares::dot, threads};

/// Candidates of which a joint refit is tried, and the least share of the best linear gain that they must promise.
const SHORTLIST: (usize, f64) = (6, 0.2);
/// Candidates whose gains differ by less than this share to first order have one signature.
const SAME_SIGNATURE: f64 = 1e-6;
/// Effects of single parts on that list at most.
const PARTS_LISTED: usize = 2;

impl<M: Model> Tracing<'_, M> {
    /// A joint refit with one of `count` candidates, which promises to lower χ² by `gain`, and the evidence for it; nothing where the promise
    /// is not worth a refit, or where the effect cannot be what the fit makes of it.
    pub(super) fn trial(
        &self,
        current: &Refit<M::Fit>,
        [effect, count]: [usize; 2],
        start: Option<&Vec<f64>>,
        gain: f64,
    ) -> Option<(usize, Refit<Remainder>, Evidence)> {
        let (before, parameters) = (current.fit.remainder(), self.model.effects()[effect].parameters.len());
        let evidence = |after: f64| {
            self.evidence(effect, before.chi2(), after, before, before.dof.saturating_sub(parameters), count)
        };
        if evidence(before.chi2() - gain).p_value > 0.05 {
            return None;
        }
        let mut settings = current.settings.clone();
        settings.push(Setting { effect, values: start.cloned().unwrap_or(vec![0.0; parameters]) });
        // Where even the first step leads to what an effect cannot be, so does the rest; many fits of absurd values take long.
        if start.is_none() {
            let step = first_step(&current.fit, &settings[self.settings.known.len()..]);
            let values: Vec<f64> = step[step.len() - parameters..].iter().map(|step| -step).collect();
            if !self.model.is_possible(effect, &values) {
                return None;
            }
        }
        let trial = refit(self.model, settings, self.settings.known.len()).ok()?;
        let evidence = evidence(trial.chi2);
        (!trial.ends_at_bound).then(|| (effect, trial.remainder_only(), evidence))
    }

    /// Does the same with each of some candidates, at once where a fit leaves processors free.
    pub(super) fn side_by_side<I: Sync, T: Send>(&self, items: &[I], work: impl Fn(&I) -> T + Sync) -> Vec<T> {
        threads::spread(items, if self.model.is_spread() { usize::MAX } else { 2 }, work)
    }

    /// Candidates with what each lowers χ² by, to first order or from where its fit starts, the most first.
    pub(super) fn ranked(
        &self,
        current: &Refit<M::Fit>,
        candidates: &[usize],
        basis: &[Vec<f64>],
        starts: &BTreeMap<usize, Vec<f64>>,
    ) -> Vec<(usize, f64)> {
        let before = current.fit.remainder();
        let mut ranked = self.side_by_side(candidates, |effect| {
            if self.model.effects()[*effect].parameters.is_empty() {
                return (*effect, before.chi2() - self.with(current, *effect, Vec::new()));
            }
            let columns = independent(current.fit.signature(*effect), basis);
            let linear: f64 = columns.iter().map(|column| dot(column, &before.residual).powi(2)).sum();
            let started = starts.get(effect).map(|values| before.chi2() - self.with(current, *effect, values.clone()));
            (*effect, linear.max(started.unwrap_or(linear)))
        });
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        ranked
    }

    /// Of ranked candidates, those of which a joint refit is tried: the best, and those that explain most beside correlated errors; and
    /// the others.
    pub(super) fn listed(&self, ranked: Vec<(usize, f64)>, beside: &[usize]) -> [Vec<(usize, f64)>; 2] {
        let promising = ranked.first().map_or(0.0, |(_, gain)| SHORTLIST.1 * gain);
        // Effects of single parts are many and alike: they do not crowd out the others.
        let parts: Vec<usize> = (0..self.model.effects().len()).flat_map(|whole| self.model.parts(whole)).collect();
        let (mut part_places, mut places, mut last) = (PARTS_LISTED, SHORTLIST.0, f64::INFINITY);
        let (listed, others) = ranked.into_iter().partition(|(effect, gain)| {
            let is_part = parts.contains(effect) || self.model.is_one_of_many(*effect);
            if is_part && part_places == 0 {
                return false;
            }
            part_places -= usize::from(is_part);
            // Effects of one signature share a place: only their fits differ.
            let takes_place = *gain < last * (1.0 - SAME_SIGNATURE);
            let has_place = (places > 0 || !takes_place) && *gain >= promising;
            if has_place && takes_place {
                (places, last) = (places - 1, *gain);
            }
            has_place || beside.contains(effect)
        });
        [listed, others]
    }

    /// χ² with an effect at some values; infinite where it cannot be applied.
    fn with(&self, current: &Refit<M::Fit>, effect: usize, values: Vec<f64>) -> f64 {
        let mut settings = current.settings.clone();
        settings.push(Setting { effect, values });
        self.model.fit(&settings).map_or(f64::INFINITY, |fit| fit.remainder().chi2())
    }
}
