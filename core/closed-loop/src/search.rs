//! Find, trace, add, report: until only noise is left, or the evidence supports no further effect.
//!
//! Long because the search, its doubts and the end of the loop are one algorithm.

use std::collections::BTreeMap;

use super::{
    Effect, Fit, Model, Remainder, Setting,
    diagnosis::{Diagnosis, Refused, Unexplained, Verdict},
    evidence::Evidence,
    fit::{INDEPENDENT, Refit, refit},
    found::{Declaration, FoundEffect},
    judgement::{
        OVERLAP, above_chance, at_the_floor, independent, is, mixed, no_gain, noise_only, overlap, raises_held_out,
        too_little, unit,
    },
    keyed::Keyed,
    report::{added, blind, level, moved, verdict},
};
use runout_consistency::{Check, Test};
use runout_error::Result;
use runout_numerics::least_squares::orthonormal;

/// Candidates whose joint refits differ by less than this, in BIC, cannot be distinguished.
const SAME_BIC: f64 = 10.0;
/// Refits whose BIC differs by less than this share are equal up to rounding.
pub(super) const SAME: f64 = 1e-9;
/// Candidates that explain most beside correlated errors, which join that list.
const BESIDE_CORRELATED: usize = 4;
/// An effect of a small part of the data counts as so many candidates, which asks for about 18 more of χ²: the noise of a part is known
/// less well than that of all.
const OF_A_PART: usize = 10_000;
/// How a loop is to be run.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Ids of the effects to consider; all without it.
    pub effects: Option<Vec<String>>,
    /// Effects that are declared: applied with these values, and not fitted.
    pub known: Vec<Setting>,
    /// Effects that are not looked for: what would show them cannot be trusted.
    pub left_out: Vec<usize>,
    /// Most effects that may be added.
    pub max_added: usize,
    /// Whether effects stay that take away a part only of what stays unexplained: where that is still to be mended.
    pub keeps_parts: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { effects: None, known: Vec::new(), left_out: Vec::new(), max_added: 6, keeps_parts: false }
    }
}

/// A diagnosis, and the model's final fit.
pub struct Closed<F> {
    /// What was found.
    pub diagnosis: Diagnosis,
    /// The declared model's fit.
    pub before: F,
    /// The fit with the effects added.
    pub after: F,
    /// The effects that it has.
    pub settings: Vec<Setting>,
}

/// Runs the loop.
///
/// # Errors
/// When the declared model cannot be fitted.
pub fn diagnose<M: Model>(model: &M, settings: &Settings) -> Result<Closed<M::Fit>> {
    // Of a fit that is not needed any more, only the remainder is kept: a fit of many stations is large.
    let declared = model.fit(&settings.known)?.remainder().clone();
    let mut tracing = Tracing { model, settings, found: Vec::new(), refused: Vec::new() };
    let mut current = tracing.refit_found(model, &[])?;
    let mut first = None;
    match tracing.find_mistakes(&current)? {
        Declaration::Sound => {}
        Declaration::Beside(effect) => first = Some(*effect),
        Declaration::Corrected(corrected) => current = corrected,
    }
    let most = tracing.found.len() + settings.max_added;
    while tracing.found.len() < most {
        let Some(found) = first.take().or_else(|| tracing.next(&current)) else { break };
        tracing.found.push(found);
        current = tracing.refit_found(model, &current.settings)?;
        if let Some(start) = tracing.split_common(&current) {
            current = tracing.refit_found(model, &start)?;
            if tracing.drop_insignificant_parts(&current) {
                current = tracing.refit_found(model, &current.settings)?;
            }
        }
        current = tracing.choose_best(model, current);
        current = tracing.elsewhere(model, current);
        if let Some(last) = tracing.found.last_mut() {
            last.after = current.fit.remainder().clone();
        }
    }
    while let Some((index, without)) = tracing.superseded(model, &current) {
        let found = tracing.found.remove(index);
        tracing.refuse(found.members[0], "what it explained is explained by effects that were found after it".into());
        current = without;
    }
    let drops_parts = !settings.keeps_parts;
    if drops_parts && !at_the_floor(current.fit.remainder()) && tracing.drop_the_least_bad() {
        current = tracing.refit_found(model, &current.settings)?;
    }
    if drops_parts && above_chance(current.fit.remainder()) && tracing.drop_partial(current.fit.remainder()) {
        current = tracing.refit_found(model, &current.settings)?;
    }
    let held_out = [declared, current.fit.remainder().clone()];
    let not_chosen = tracing.not_chosen(&current);
    let found = current.settings.clone();
    drop(current);
    let before = model.whole().fit(&settings.known)?;
    let current = tracing.refit_found(model.whole(), &found)?;
    let (current, others) = tracing.combinations(model.whole(), current, SAME_BIC);
    let consistency = current.fit.consistency();
    let left = noise_only(current.fit.remainder(), &consistency);
    let verdict = match &not_chosen {
        Some(_) => Verdict::Unexplained,
        None => verdict(current.fit.remainder(), &consistency, tracing.found.is_empty()),
    };
    tracing.settle(&current);
    let applied = current.settings.clone();
    let after = mixed(current, others, &before, settings.known.len());
    let mut unexplained: Vec<Unexplained> = not_chosen.into_iter().collect();
    unexplained.extend(after.far_worse());
    if !left {
        unexplained.extend(after.unexplained());
    }
    // A residual is said by where it comes from, where that shows.
    let placed = !unexplained.is_empty();
    let said = |check: &&Check| check.bars_verdict() && !(placed && check.test == Test::Residual);
    unexplained.extend(consistency.iter().filter(said).map(Unexplained::from));
    let warnings = tracing.ended_by_limits();
    let diagnosis = Diagnosis {
        verdict,
        before: level(before.remainder(), &held_out[0]),
        added: tracing.found.iter().map(|found| added(found, model, &after, &applied)).collect(),
        after: level(after.remainder(), &held_out[1]),
        nothing_separated: false,
        moved: moved(&before, &after),
        unexplained,
        consistency,
        blind_to: blind(model.effects(), &tracing.considered(), &after),
        refused: tracing.refused,
        lost_orders: None,
        truth: None,
        warnings,
        notes: Vec::new(),
        outputs: Vec::new(),
    };
    Ok(Closed { diagnosis, before, after, settings: applied })
}

pub(super) struct Tracing<'a, M> {
    pub model: &'a M,
    pub settings: &'a Settings,
    pub found: Vec<FoundEffect>,
    pub refused: Vec<Refused>,
}

impl<M: Model> Tracing<'_, M> {
    /// Effects that may be added: chosen, not declared.
    pub(super) fn considered(&self) -> Vec<usize> {
        let chosen = |effect: &Effect| self.settings.effects.as_ref().is_none_or(|ids| ids.contains(&effect.id));
        let declared = |index: usize| self.settings.known.iter().any(|known| known.effect == index);
        // Where a part has its own, so has every part, or none.
        let in_parts = |index: usize| self.model.parts(index).iter().any(|part| self.active(*part));
        let left_out =
            |index: usize| self.settings.left_out.contains(&index) || self.model.is_mistake(index) || in_parts(index);
        let wanted = |index: usize| !declared(index) && !left_out(index);
        let effects = self.model.effects().iter().enumerate();
        effects.filter(|(index, effect)| chosen(effect) && wanted(*index)).map(|(index, _)| index).collect()
    }

    /// What an effect explains that was not to be looked for, where the evidence supports it: what was found beside it is not what it is taken for.
    fn not_chosen(&self, current: &Refit<M::Fit>) -> Option<Unexplained> {
        self.settings.effects.as_ref()?;
        let left_out = self.considered().into_iter().chain(self.settings.left_out.iter().copied()).collect();
        let settings = Settings { effects: None, left_out, ..self.settings.clone() };
        let mut others =
            Tracing { model: self.model, settings: &settings, found: self.found.clone(), refused: Vec::new() };
        let FoundEffect { members, before, after, .. } = others.next(current)?;
        let name = self.model.effects()[members[0]].name();
        Some(Unexplained {
            station: None,
            sensor: None,
            setup: None,
            orders: [0, 0],
            rms_um: (before.rms.powi(2) - after.rms.powi(2)).max(0.0).sqrt(),
            place: format!("{name} explains it, which is none of the chosen `effects`"),
        })
    }

    fn active(&self, effect: usize) -> bool {
        self.found.iter().any(|found| found.members.contains(&effect))
    }

    /// All effects found, jointly, each confounded set by its first member: while the data do not decide between the
    /// members, each of them leaves the same residual.
    pub(super) fn refit_found(&self, model: &M, start: &[Setting]) -> Result<Refit<M::Fit>> {
        self.refit_chosen(model, start, &vec![0; self.found.len()])
    }

    /// Refits all effects found, jointly, with the chosen member of each confounded set.
    pub(super) fn refit_chosen(&self, model: &M, start: &[Setting], choice: &[usize]) -> Result<Refit<M::Fit>> {
        let mut settings = self.settings.known.clone();
        for (found, member) in self.found.iter().zip(choice) {
            let (effect, alone) = (found.members[*member], &found.alone[*member]);
            let known = start.iter().find(|setting| setting.effect == effect);
            let values = known.map_or_else(|| alone.clone(), |at| at.values.clone());
            settings.push(Setting { effect, values });
        }
        refit(model, settings, self.settings.known.len())
    }

    /// The effect of the lowest rank that the evidence supports, if any.
    pub(super) fn next(&mut self, current: &Refit<M::Fit>) -> Option<FoundEffect> {
        let candidates: Vec<usize> = self.considered().into_iter().filter(|effect| !self.active(*effect)).collect();
        let mut ranks: Vec<usize> = candidates.iter().map(|effect| self.model.rank(*effect)).collect();
        ranks.sort_unstable();
        ranks.dedup();
        for rank in ranks {
            let of_rank: Vec<usize> =
                candidates.iter().copied().filter(|effect| self.model.rank(*effect) == rank).collect();
            if let Some(found) = self.best(current, &of_rank, candidates.len()) {
                return Some(found);
            }
        }
        None
    }

    /// The effect with the strongest evidence, if it is sufficient among `count` candidates.
    fn best(&mut self, current: &Refit<M::Fit>, candidates: &[usize], count: usize) -> Option<FoundEffect> {
        let before = current.fit.remainder().clone();
        let fixed = self.settings.known.len();
        let active: Vec<Vec<f64>> =
            current.settings[fixed..].iter().flat_map(|setting| current.fit.signature(setting.effect)).collect();
        let basis = orthonormal(active, &[], INDEPENDENT);
        let starts = self.side_by_side(candidates, |effect| self.model.start(*effect, &current.fit, &current.settings));
        let starts = candidates.iter().zip(starts).filter_map(|(effect, start)| Some((*effect, start?)));
        let starts: BTreeMap<usize, Vec<f64>> = starts.collect();
        let ranked = self.ranked(current, candidates, &basis, &starts);
        let try_out = |tracing: &Self, effect: usize, gain: f64| {
            tracing.trial(current, [effect, count], starts.get(&effect), gain)
        };
        let keyed = Keyed::of(&current.fit, &basis);
        let mut beside: Vec<(usize, f64)> = ranked
            .iter()
            .filter_map(|(effect, _)| {
                let columns = || independent(current.fit.signature(*effect), &basis);
                Some((*effect, keyed.explained(columns)?))
            })
            .collect();
        beside.sort_by(|a, b| b.1.total_cmp(&a.1));
        let beside: Vec<usize> = beside.into_iter().take(BESIDE_CORRELATED).map(|(effect, _)| effect).collect();
        let [listed, unlisted] = self.listed(ranked, &beside);
        let trials = self.side_by_side(&listed, |(effect, gain)| try_out(self, *effect, *gain));
        let mut trials: Vec<(usize, Refit<Remainder>, Evidence)> = trials.into_iter().flatten().collect();
        let best = trials.iter().map(|(_, _, evidence)| evidence.delta_bic).fold(f64::INFINITY, f64::min);
        // Of those that are equal up to rounding, the one that the model names first.
        let place = |bic: f64| if bic - best <= SAME * best.abs() { best } else { bic };
        trials.sort_by(|a, b| place(a.2.delta_bic).total_cmp(&place(b.2.delta_bic)).then(a.0.cmp(&b.0)));
        // Beside correlated errors, the one that explains most beside them.
        let explained: BTreeMap<usize, f64> = trials
            .iter()
            .filter_map(|(effect, trial, _)| {
                Some((*effect, keyed.explained(|| self.taken(*effect, current, &trial.fit, &basis))?))
            })
            .collect();
        let beside = |effect: usize| explained.get(&effect).copied().unwrap_or(0.0);
        trials.sort_by(|a, b| beside(b.0).total_cmp(&beside(a.0)));
        let mut believed = None;
        while believed.is_none() && !trials.is_empty() {
            let (effect, trial, evidence) = trials.remove(0);
            let found = trial.settings.last().map_or(&[][..], |last| &last.values);
            let taken = self.taken(effect, current, &trial.fit, &basis);
            let keys = keyed.keys(effect, [found, &trial.fit.residual], &taken, count);
            // Each key has its own limit; the chance that is stated is the largest.
            let stated = Evidence { p_value: evidence.p_value.max(keys.p), ..evidence };
            let too_little = too_little([&before, &trial.fit], &evidence);
            // Where one explains too little, so do the others; what held-out data, correlated errors or blocks refuse says nothing of them.
            let ends = too_little.is_some() && keys.refused.is_none();
            let raises = || raises_held_out(&before, &trial.fit, self.model.is_seen_besides(effect));
            // Errors that depended on each other by what this one takes away say nothing against it.
            let refused = keys.refused.filter(|_| too_little.is_some() || !self.explains_all(&trial));
            let doubt = too_little.or(refused).or_else(|| raises().then(|| no_gain(&before, &trial.fit)));
            match doubt {
                Some(reason) => self.refuse(effect, reason),
                None => believed = Some((effect, trial, stated)),
            }
            if ends {
                return None;
            }
        }
        let (effect, trial, evidence) = believed?;
        let (after, chosen) = (trial.fit.clone(), evidence.delta_bic);
        let named = &self.model.effects()[effect];
        self.refused.retain(|refused| !is(refused, named));
        let unit = unit(&after);
        let count = self.model.effects()[effect].parameters.len();
        let first = trial.covariance.len() - count;
        let std = (first..first + count).map(|index| (trial.covariance[index][index] * unit).sqrt()).collect();
        let values = trial.settings.last().map(|setting| setting.values.clone()).unwrap_or_default();
        // Whatever explains as much of what this one takes away may be it, though others came first on the list.
        let taken = OVERLAP * OVERLAP * (before.chi2() - after.chi2());
        let as_much = unlisted.into_iter().filter(|(_, gain)| *gain > taken);
        trials.extend(as_much.filter_map(|(effect, gain)| try_out(self, effect, gain)));
        // BIC counts in units of what each trial leaves; the best one's unit is common to all.
        let alike = trials.into_iter().filter(|(place, other, _)| {
            let difference = (other.chi2 - trial.chi2) / unit.max(f64::MIN_POSITIVE);
            let more = self.model.effects()[*place].parameters.len() as f64 - count as f64;
            let by_bic = more * (after.dof.max(1) as f64).ln() + difference;
            difference < SAME_BIC
                && by_bic < SAME_BIC.max(0.02 * chosen.abs())
                && overlap(&before.residual, [&after.residual, &other.fit.residual]) > OVERLAP
        });
        let mut members = vec![effect];
        let mut alone = vec![values.clone()];
        for (other, refit, _) in alike {
            members.push(other);
            alone.push(refit.settings.last().map(|setting| setting.values.clone()).unwrap_or_default());
        }
        Some(FoundEffect { members, alone, values, std, evidence, before, after })
    }

    /// Whether nothing but known noise is left, also by the tests of whether errors depend on each other.
    fn explains_all(&self, trial: &Refit<Remainder>) -> bool {
        let is_noise = |fit: M::Fit| at_the_floor(fit.remainder()) && noise_only(fit.remainder(), &fit.consistency());
        trial.fit.noise_is_known() && at_the_floor(&trial.fit) && self.model.fit(&trial.settings).is_ok_and(is_noise)
    }

    /// What an effect takes away: the direction in which its fit changed the residual, and its signature where it has more parameters. Of an
    /// effect that acts in proportion to its size these span the signature; of another, the first alone is what it does at its size. Where an
    /// effect moves readings, that direction holds the change of their errors, and the signature alone counts.
    fn taken(&self, effect: usize, current: &Refit<M::Fit>, after: &Remainder, basis: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let before = &current.fit.remainder().residual;
        let taken: Vec<f64> = before.iter().zip(&after.residual).map(|(before, after)| before - after).collect();
        let taken = (!current.fit.moves_readings(effect)).then_some(taken);
        let columns = taken.into_iter().chain(current.fit.signature(effect)).collect();
        let mut columns = orthonormal(columns, basis, INDEPENDENT);
        columns.truncate(self.model.effects()[effect].parameters.len());
        columns
    }

    /// Evidence for an effect, of χ² without and with it, by what is known of the noise.
    pub(super) fn evidence(
        &self,
        effect: usize,
        without: f64,
        with: f64,
        remainder: &Remainder,
        dof: usize,
        count: usize,
    ) -> Evidence {
        let parameters = self.model.effects()[effect].parameters.len().max(1);
        let count = if self.model.is_one_of_many(effect) { count.saturating_mul(OF_A_PART) } else { count };
        if remainder.noise_is_known() && self.model.is_seen_besides(effect) {
            return Evidence::seen_besides(without, with, parameters, dof, count);
        }
        Evidence::new(without, with, parameters, dof, count, remainder.noise_is_known())
    }

    /// Keeps the last reason for which an effect was refused.
    pub(super) fn refuse(&mut self, effect: usize, reason: String) {
        let named = &self.model.effects()[effect];
        self.refused.retain(|refused| !is(refused, named));
        self.refused.push(Refused { effect: named.id.clone(), targets: named.targets.clone(), reason });
    }

    /// Limits that ended the search while the data may contain more.
    fn ended_by_limits(&self) -> Vec<String> {
        let of_lists = |found: &FoundEffect| {
            let effect = found.members[0];
            let limit = self.model.last_of_list(effect)?;
            Some(format!(
                "`{}` was added, the last of its list ({limit}): the data may contain more",
                self.model.effects()[effect].id
            ))
        };
        let mut said: Vec<String> = self.found.iter().filter_map(of_lists).collect();
        if self.found.len() >= self.settings.max_added {
            said.push(format!(
                "{} effects were added, the most that are allowed: the data may contain more",
                self.found.len()
            ));
        }
        said
    }

    /// Takes values and uncertainties of the effects from the final fit.
    fn settle(&mut self, last: &Refit<M::Fit>) {
        let unit = unit(last.fit.remainder());
        let mut position = 0;
        for (found, setting) in self.found.iter_mut().zip(&last.settings[self.settings.known.len()..]) {
            found.values.clone_from(&setting.values);
            let places = position..position + setting.values.len();
            let tested = last.fit.tested_std(setting.effect).into_iter().map(Some).chain(std::iter::repeat(None));
            let by_size = places.map(|place| (last.covariance[place][place] * unit).sqrt());
            found.std = by_size.zip(tested).map(|(std, tested)| tested.map_or(std, |tested| std.max(tested))).collect();
            position += setting.values.len();
        }
    }
}
