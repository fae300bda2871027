//! Find, trace, add, report: until noise is left, or nothing earns its place.

use std::collections::BTreeMap;

use super::{
    Effect, Fit, Model, Remainder, Setting,
    confounded::{choices, nearest},
    diagnosis::{Added, BiasPerUnit, Blind, Diagnosis, Estimated, Level, Moved, Refused, Step, Verdict},
    evidence::{Evidence, agreement},
    fit::{INDEPENDENT, Refit, refit},
};
use runout_error::Result;
use runout_numerics::least_squares::{dot, norm, orthonormal};

/// Chance of noise doing as much, corrected for the number of candidates, below which an effect is believed.
const P_LIMIT: f64 = 1e-3;
/// "Very strong" evidence (Kass, Raftery, J. Am. Stat. Assoc. 90 (1995) 773).
const BIC_LIMIT: f64 = -10.0;
/// Candidates whose joint refits differ by less than this, in BIC, cannot be told apart.
const SAME_BIC: f64 = 10.0;
/// Refits whose BIC differs by less than this share are equal up to rounding.
const SAME: f64 = 1e-9;
/// Candidates of which a joint refit is tried, and the least share of the best linear gain that they must promise.
const SHORTLIST: (usize, f64) = (6, 0.2);
/// Effects of single parts on that list at most.
const PARTS_LISTED: usize = 2;
/// χ² per degree of freedom up to which noise is all that is left: covariances are estimates themselves.
const FLOOR_CHI2: f64 = 1.5;
/// Where something stays unexplained, an effect is believed only if it takes away this share of what was: a stranger lets
/// the least bad effect take a part.
const OWN_SHARE: f64 = 0.8;
/// An effect that is this many times its tolerance is unusual. No size is refused; but where something stays unexplained, what is left,
/// as a size of the same effect, must not be larger than it may be beside an effect of this size.
const UNUSUAL: f64 = 100.0;
/// Chance of independent data agreeing as well on an effect that is not there, above which it is refused.
const AGREEMENT: f64 = 0.01;
/// The same for groups of points whose noise is not known: each of them is held out once, which tests an effect as well.
const GROUP_AGREEMENT: f64 = 0.05;
/// Held-out data must improve by more than this share of their squares (half of it in rms), so that rounding is no improvement.
const HELD_OUT_GAIN: f64 = 1e-3;
/// Their unweighted rms may rise by this share where χ² falls: noise that is common to the readings dominates it, and the product
/// of that noise with a small effect has either sign.
const HELD_OUT_RISE: f64 = 0.01;
/// A parameter this many standard uncertainties from 0 is needed: no refit without it is tried.
const CERTAIN: f64 = 10.0;
/// An effect of its usual size that would show with less than this many standard deviations is not seen.
pub(super) const VISIBLE: f64 = 3.0;

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
}

impl Default for Settings {
    fn default() -> Self {
        Self { effects: None, known: Vec::new(), left_out: Vec::new(), max_added: 6 }
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

/// An effect that was believed, with everything that it cannot be told from.
#[derive(Clone)]
pub(super) struct Found {
    /// The best one first.
    pub members: Vec<usize>,
    /// Values of each member as if it were all of it.
    pub alone: Vec<Vec<f64>>,
    /// Values and standard uncertainties as if the best one were all of it.
    pub values: Vec<f64>,
    pub std: Vec<f64>,
    pub evidence: Evidence,
    pub before: Remainder,
    pub after: Remainder,
}

/// Runs the loop.
///
/// # Errors
/// When the declared model cannot be fitted.
pub fn diagnose<M: Model>(model: &M, settings: &Settings) -> Result<Closed<M::Fit>> {
    let declared = model.fit(&settings.known)?;
    let before = model.whole().fit(&settings.known)?;
    let mut tracing = Tracing { model, settings, found: Vec::new(), refused: Vec::new() };
    let mut current = tracing.refit_found(model, &[])?;
    if let Some(corrected) = tracing.find_mistakes(&current)? {
        current = corrected;
    }
    let most = tracing.found.len() + settings.max_added;
    while tracing.found.len() < most {
        let Some(found) = tracing.next(&current) else { break };
        tracing.found.push(found);
        current = tracing.refit_found(model, &current.settings)?;
        if let Some(start) = tracing.split_common(&current) {
            current = tracing.refit_found(model, &start)?;
            if tracing.drop_insignificant_parts(&current) {
                current = tracing.refit_found(model, &current.settings)?;
            }
        }
        current = tracing.choose_best(model, current);
        if let Some(last) = tracing.found.last_mut() {
            last.after = current.fit.remainder().clone();
        }
    }
    while let Some((index, without)) = tracing.superseded(model, &current) {
        let found = tracing.found.remove(index);
        tracing.refuse(found.members[0], "what it explained is explained by effects that were found after it".into());
        current = without;
    }
    if !at_the_floor(current.fit.remainder()) && tracing.drop_the_least_bad() {
        current = tracing.refit_found(model, &current.settings)?;
    }
    if above_chance(current.fit.remainder()) && tracing.drop_partial(current.fit.remainder()) {
        current = tracing.refit_found(model, &current.settings)?;
    }
    let held_out = [declared.remainder().clone(), current.fit.remainder().clone()];
    let current = tracing.refit_found(model.whole(), &current.settings)?;
    let (current, others) = tracing.combinations(model.whole(), current, SAME_BIC);
    let left = at_the_floor(current.fit.remainder());
    let verdict = verdict(current.fit.remainder(), tracing.found.is_empty());
    tracing.settle(&current);
    let applied = current.settings.clone();
    let after = mixed(current, others, &before, settings.known.len());
    let mut unexplained = after.far_worse();
    if !left {
        unexplained.extend(after.unexplained());
    }
    let warnings = tracing.ended_by_limits();
    let diagnosis = Diagnosis {
        verdict,
        before: level(before.remainder(), &held_out[0]),
        added: tracing.found.iter().map(|found| added(found, model, &after, &applied)).collect(),
        after: level(after.remainder(), &held_out[1]),
        nothing_separated: false,
        moved: moved(&before, &after),
        unexplained,
        blind_to: blind(model.effects(), &tracing.considered(), &after),
        refused: tracing.refused,
        lost_orders: None,
        truth: None,
        warnings,
        outputs: Vec::new(),
    };
    Ok(Closed { diagnosis, before, after, settings: applied })
}

pub(super) struct Tracing<'a, M> {
    pub model: &'a M,
    pub settings: &'a Settings,
    pub found: Vec<Found>,
    pub refused: Vec<Refused>,
}

impl<M: Model> Tracing<'_, M> {
    /// Effects that may be added: chosen, not declared.
    fn considered(&self) -> Vec<usize> {
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

    fn active(&self, effect: usize) -> bool {
        self.found.iter().any(|found| found.members.contains(&effect))
    }

    /// All effects found, jointly, each confounded set by its first member: while the data do not decide between the
    /// members, each of them leaves the same residual.
    pub(super) fn refit_found(&self, model: &M, start: &[Setting]) -> Result<Refit<M::Fit>> {
        self.refit_chosen(model, start, &vec![0; self.found.len()])
    }

    /// The same with another member of each set.
    fn refit_chosen(&self, model: &M, start: &[Setting], choice: &[usize]) -> Result<Refit<M::Fit>> {
        let mut settings = self.settings.known.clone();
        for (found, member) in self.found.iter().zip(choice) {
            let (effect, alone) = (found.members[*member], &found.alone[*member]);
            let known = start.iter().find(|setting| setting.effect == effect);
            let values = known.map_or_else(|| alone.clone(), |at| at.values.clone());
            settings.push(Setting { effect, values });
        }
        refit(model, settings, self.settings.known.len())
    }

    /// The best refit over all combinations of members, of which `current` is the first, and the others that are at most so
    /// much worse in χ², in units of what is left. Members that are in none of these leave their sets; those of the best
    /// combination come first.
    fn combinations(&mut self, model: &M, current: Refit<M::Fit>, worse: f64) -> (Refit<M::Fit>, Vec<Refit<M::Fit>>) {
        let sizes: Vec<usize> = self.found.iter().map(|found| found.members.len()).collect();
        let mut choices = choices(&sizes).into_iter();
        let start = current.settings.clone();
        let mut best = (choices.next().unwrap_or_default(), current);
        let mut others = Vec::new();
        for choice in choices {
            // A combination that cannot be fitted does not explain the data.
            let Ok(refit) = self.refit_chosen(model, &start, &choice) else { continue };
            let free = &refit.settings[self.settings.known.len()..];
            if free.iter().any(|setting| !model.is_possible(setting.effect, &setting.values)) {
                continue;
            }
            let mut other = (choice, refit);
            // Of those that are equal up to rounding, the one that the model names first.
            if other.1.chi2 < best.1.chi2 * (1.0 - SAME) {
                std::mem::swap(&mut best, &mut other);
            }
            others.push(other);
        }
        let most = best.1.chi2 + worse * unit(best.1.fit.remainder());
        // χ² does not decide which of two copies is the original.
        let copies = |choice: &[usize]| {
            let differing =
                self.found.iter().zip(choice.iter().zip(&best.0)).filter(|(_, (member, best))| member != best);
            differing
                .into_iter()
                .all(|(found, (member, best))| same_finding(model, found.members[*member], found.members[*best]))
        };
        others.retain(|(choice, refit)| refit.chi2 <= most || copies(choice));
        for (index, found) in self.found.iter_mut().enumerate() {
            let mut kept: Vec<usize> = Vec::new();
            for choice in std::iter::once(&best.0).chain(others.iter().map(|(choice, _)| choice)) {
                if !kept.contains(&choice[index]) {
                    kept.push(choice[index]);
                }
            }
            found.members = kept.iter().map(|member| found.members[*member]).collect();
            found.alone = kept.iter().map(|member| found.alone[*member].clone()).collect();
        }
        (best.1, others.into_iter().map(|(_, refit)| refit).collect())
    }

    /// Of each set, the member first that explains the data best beside all other effects.
    fn choose_best(&mut self, model: &M, current: Refit<M::Fit>) -> Refit<M::Fit> {
        if self.found.len() < 2 || self.found.iter().all(|found| found.members.len() == 1) {
            return current;
        }
        self.combinations(model, current, f64::INFINITY).0
    }

    /// An effect that was found first and explains nothing beside those that were found later.
    fn superseded(&self, model: &M, current: &Refit<M::Fit>) -> Option<(usize, Refit<M::Fit>)> {
        let remainder = current.fit.remainder();
        let free = &current.settings[self.settings.known.len()..];
        let mut first = 0;
        for (index, setting) in free.iter().enumerate() {
            let places = first..first + setting.values.len();
            first = places.end;
            let certain = places.zip(&setting.values).any(|(place, value)| {
                value * value > CERTAIN * CERTAIN * unit(remainder) * current.covariance[place][place]
            });
            if self.found.len() < 2 || certain || setting.values.is_empty() {
                continue;
            }
            let without = current.settings.iter().filter(|other| other.effect != setting.effect).cloned().collect();
            let Ok(without) = refit(model, without, self.settings.known.len()) else { continue };
            let (count, known) = (self.considered().len(), remainder.noise_is_known());
            let evidence = Evidence::new(without.chi2, current.chi2, setting.values.len(), remainder.dof, count, known);
            if evidence.p_value > P_LIMIT || evidence.delta_bic > BIC_LIMIT {
                return Some((index, without));
            }
        }
        None
    }

    /// The effect of the lowest rank that earns its place, if any does.
    pub(super) fn next(&mut self, current: &Refit<M::Fit>) -> Option<Found> {
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

    /// The effect that the data ask for most, if it earns its place among `count` that were looked at.
    fn best(&mut self, current: &Refit<M::Fit>, candidates: &[usize], count: usize) -> Option<Found> {
        let before = current.fit.remainder().clone();
        let fixed = self.settings.known.len();
        let active: Vec<Vec<f64>> =
            current.settings[fixed..].iter().flat_map(|setting| current.fit.signature(setting.effect)).collect();
        let basis = orthonormal(active, &[], INDEPENDENT);
        let starts: BTreeMap<usize, Vec<f64>> = candidates
            .iter()
            .filter_map(|effect| Some((*effect, self.model.start(*effect, &current.settings)?)))
            .collect();
        let mut ranked: Vec<(usize, f64)> = candidates
            .iter()
            .map(|effect| {
                if self.model.effects()[*effect].parameters.is_empty() {
                    return (*effect, before.chi2() - self.with(current, *effect, Vec::new()));
                }
                let columns = independent(current.fit.signature(*effect), &basis);
                let linear: f64 = columns.iter().map(|column| dot(column, &before.residual).powi(2)).sum();
                let started =
                    starts.get(effect).map(|values| before.chi2() - self.with(current, *effect, values.clone()));
                (*effect, linear.max(started.unwrap_or(linear)))
            })
            .collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        let promising = ranked.first().map_or(0.0, |(_, gain)| SHORTLIST.1 * gain);
        let mut trials: Vec<(usize, Refit<M::Fit>, Evidence)> = Vec::new();
        // Effects of single parts are many and alike: they do not crowd out the others.
        let parts: Vec<usize> = (0..self.model.effects().len()).flat_map(|whole| self.model.parts(whole)).collect();
        let mut part_places = PARTS_LISTED;
        ranked.retain(|(effect, _)| {
            let listed = !parts.contains(effect) || part_places > 0;
            part_places -= usize::from(listed && parts.contains(effect));
            listed
        });
        for (effect, gain) in ranked.into_iter().take(SHORTLIST.0).filter(|(_, gain)| *gain >= promising) {
            let parameters = self.model.effects()[effect].parameters.len();
            let evidence = |after: f64| {
                let dof = before.dof.saturating_sub(parameters);
                Evidence::new(before.chi2(), after, parameters.max(1), dof, count, before.noise_is_known())
            };
            // What promises nothing to first order is not worth a refit.
            if evidence(before.chi2() - gain).p_value > 0.05 {
                continue;
            }
            let mut settings = current.settings.clone();
            settings.push(Setting { effect, values: starts.get(&effect).cloned().unwrap_or(vec![0.0; parameters]) });
            let Ok(trial) = refit(self.model, settings, fixed) else { continue };
            if trial.settings.last().is_some_and(|last| !self.model.is_possible(effect, &last.values)) {
                continue;
            }
            let evidence = evidence(trial.chi2);
            trials.push((effect, trial, evidence));
        }
        let best = trials.iter().map(|(_, _, evidence)| evidence.delta_bic).fold(f64::INFINITY, f64::min);
        // Of those that are equal up to rounding, the one that the model names first.
        let place = |bic: f64| if bic - best <= SAME * best.abs() { best } else { bic };
        trials.sort_by(|a, b| place(a.2.delta_bic).total_cmp(&place(b.2.delta_bic)).then(a.0.cmp(&b.0)));
        let mut trials = trials.into_iter();
        let (effect, trial, evidence) = trials.next()?;
        let after = trial.fit.remainder().clone();
        let columns = independent(current.fit.signature(effect), &basis);
        let (stretches, lowered) = (before.stretches.len(), before.chi2() - trial.chi2);
        let each = -lowered / stretches.max(1) as f64;
        let agreed = if before.noise_is_known() { AGREEMENT } else { GROUP_AGREEMENT };
        let chance = agreement(&columns, &before.residual, &before.stretches);
        let reason = if evidence.p_value > P_LIMIT || evidence.delta_bic > BIC_LIMIT {
            Some(weak(&evidence))
        } else if stretches > 1 && !above_chance(&before) && before.noise_is_known() && each > BIC_LIMIT {
            // Noise may be all that is left, and in each part it is not known better because there are more parts.
            Some(format!(
                "it would explain too little of each of {stretches} parts of the data: Δχ² {each:.1}, above {BIC_LIMIT}"
            ))
        } else if lowered <= before.disturbed_chi2 {
            Some(disturbed(lowered, before.disturbed_chi2))
        } else if raises_held_out(&before, &after, self.model.is_seen_besides(effect)) {
            Some(no_gain(&before, &after))
        } else {
            chance.filter(|chance| *chance > agreed).map(|chance| {
                format!("{stretches} independent parts of the data do not agree on it: p {chance:.3}, above {agreed}")
            })
        };
        if let Some(reason) = reason {
            self.refuse(effect, reason);
            return None;
        }
        let named = &self.model.effects()[effect];
        self.refused.retain(|refused| !is(refused, named));
        let unit = unit(&after);
        let count = self.model.effects()[effect].parameters.len();
        let first = trial.covariance.len() - count;
        let std = (first..first + count).map(|index| (trial.covariance[index][index] * unit).sqrt()).collect();
        let values = trial.settings.last().map(|setting| setting.values.clone()).unwrap_or_default();
        // BIC counts in units of what each trial leaves; the best one's unit is common to all.
        let alike = trials.filter(|(_, other, evidence)| {
            let difference = (other.chi2 - trial.chi2) / unit.max(f64::MIN_POSITIVE);
            difference < SAME_BIC
                && evidence.delta_bic - best < SAME_BIC.max(0.02 * best.abs())
                && overlap(&before.residual, [&after.residual, &other.fit.remainder().residual]) > OVERLAP
        });
        let mut members = vec![effect];
        let mut alone = vec![values.clone()];
        for (other, refit, _) in alike {
            members.push(other);
            alone.push(refit.settings.last().map(|setting| setting.values.clone()).unwrap_or_default());
        }
        Some(Found { members, alone, values, std, evidence, before, after })
    }

    /// Keeps the last reason for which an effect was refused.
    fn refuse(&mut self, effect: usize, reason: String) {
        let named = &self.model.effects()[effect];
        self.refused.retain(|refused| !is(refused, named));
        self.refused.push(Refused { effect: named.id.clone(), targets: named.targets.clone(), reason });
    }

    /// χ² with an effect at some values; infinite where it cannot be applied.
    fn with(&self, current: &Refit<M::Fit>, effect: usize, values: Vec<f64>) -> f64 {
        let mut settings = current.settings.clone();
        settings.push(Setting { effect, values });
        self.model.fit(&settings).map_or(f64::INFINITY, |fit| fit.remainder().chi2())
    }

    /// Limits that ended the search while the data may hold more.
    fn ended_by_limits(&self) -> Vec<String> {
        let of_lists = |found: &Found| {
            let effect = found.members[0];
            let limit = self.model.last_of_list(effect)?;
            Some(format!(
                "`{}` was added, the last of its list ({limit}): the data may hold more",
                self.model.effects()[effect].id
            ))
        };
        let mut said: Vec<String> = self.found.iter().filter_map(of_lists).collect();
        if self.found.len() >= self.settings.max_added {
            said.push(format!(
                "{} effects were added, the most that are allowed: the data may hold more",
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
            found.std = places.map(|place| (last.covariance[place][place] * unit).sqrt()).collect();
            position += setting.values.len();
        }
    }

    /// Takes back the effects that took only a part of what something unknown does. Says whether there were any.
    fn drop_the_least_bad(&mut self) -> bool {
        let effects = self.model.effects();
        self.keep(|found| excess(&found.after) <= may_leave(effects, found))
    }

    /// Takes back the effects beside which what is left in the end is no small part, though it may be noise: a small stranger
    /// lets the least bad effect take a part, a small effect leaves nothing.
    fn drop_partial(&mut self, last: &Remainder) -> bool {
        let (effects, left) = (self.model.effects(), excess(last));
        self.keep(|found| left <= may_leave(effects, found))
    }

    /// Takes back the others. Says whether there were any.
    fn keep(&mut self, is_kept: impl Fn(&Found) -> bool) -> bool {
        let (kept, dropped): (Vec<Found>, Vec<Found>) = std::mem::take(&mut self.found).into_iter().partition(is_kept);
        for found in &dropped {
            let reason = format!(
                "it takes away a part only (χ² per degree of freedom {:.2} → {:.2}, not below {:.2}) of something that stays \
                 unexplained",
                found.before.chi2_per_dof(),
                found.after.chi2_per_dof(),
                1.0 + may_leave(self.model.effects(), found)
            );
            self.refuse(found.members[0], reason);
        }
        self.found = kept;
        !dropped.is_empty()
    }
}

/// Variance of a residual's degree of freedom, by which covariances are scaled: noise that is known is at least that.
fn unit(remainder: &Remainder) -> f64 {
    let unit = remainder.chi2_per_dof();
    if remainder.noise_is_known() { unit.max(1.0) } else { unit }
}

/// One fit for all equivalent ones: their mixture whose results are nearest to those of the declared model. Whichever of them
/// is true, the mixture is not farther from it than the declared model is, at any size of the effects ([`nearest`]).
fn mixed<F: Fit>(best: Refit<F>, others: Vec<Refit<F>>, before: &F, fixed: usize) -> F {
    let widened = |refit: Refit<F>| {
        let Refit { settings, mut fit, covariance, .. } = refit;
        let unit = unit(fit.remainder());
        let effects: Vec<usize> = settings[fixed..].iter().map(|setting| setting.effect).collect();
        let scaled = |row: &Vec<f64>| row.iter().map(|entry| entry * unit).collect();
        fit.widen(&effects, &covariance.iter().map(scaled).collect::<Vec<Vec<f64>>>());
        fit
    };
    let mut mixture = widened(best);
    if others.is_empty() {
        return mixture;
    }
    let others: Vec<F> = others.into_iter().map(widened).collect();
    let results: Vec<Vec<f64>> = std::iter::once(&mixture).chain(&others).map(Fit::results).collect();
    mixture.mix(&nearest(&before.results(), &results), others);
    mixture
}

fn is(refused: &Refused, effect: &Effect) -> bool {
    refused.effect == effect.id && refused.targets == effect.targets
}

/// Whether two mistakes are one finding (two signals are copies), of which the data do not decide the direction.
pub(super) fn same_finding<M: Model>(model: &M, one: usize, other: usize) -> bool {
    let [one, other] = [one, other].map(|effect| &model.effects()[effect]);
    let in_any_order = one.targets.iter().all(|target| other.targets.contains(target));
    one.id == other.id && one.targets.len() == 2 && other.targets.len() == 2 && in_any_order
}

/// χ² per degree of freedom above what noise leaves, up to which an effect is believed though something stays unexplained.
fn may_leave(effects: &[Effect], found: &Found) -> f64 {
    let parameters = &effects[found.members[0]].parameters;
    let sizes = found.values.iter().zip(parameters).map(|(value, known)| value.abs() / known.tolerance);
    let unusual = sizes.fold(UNUSUAL, f64::max) / UNUSUAL;
    (1.0 - OWN_SHARE) / (unusual * unusual) * excess(&found.before)
}

/// χ² per degree of freedom above what noise leaves.
fn excess(remainder: &Remainder) -> f64 {
    (remainder.chi2_per_dof() - 1.0).max(0.0)
}

/// What chance may make of χ² per degree of freedom: its variance is 2/dof.
fn chance(remainder: &Remainder) -> f64 {
    1.0 + 3.0 * (2.0 / remainder.dof.max(1) as f64).sqrt()
}

/// Whether noise may be all that is left.
fn at_the_floor(remainder: &Remainder) -> bool {
    !remainder.noise_is_known() || remainder.chi2_per_dof() <= FLOOR_CHI2.max(chance(remainder))
}

/// Whether more is left than chance makes of noise whose covariance is known well.
fn above_chance(remainder: &Remainder) -> bool {
    remainder.noise_is_known() && remainder.chi2_per_dof() > chance(remainder)
}

/// Evidence that is too weak, with the limit that it misses.
fn weak(evidence: &Evidence) -> String {
    let Evidence { p_value, delta_bic } = evidence;
    let [p_limit, bic_limit] = [
        if *p_value > P_LIMIT { format!(", above {P_LIMIT:e}") } else { String::new() },
        if *delta_bic > BIC_LIMIT { format!(", above {BIC_LIMIT}") } else { String::new() },
    ];
    format!("its evidence is weak: p {p_value:.2e}{p_limit}; ΔBIC {delta_bic:.1}{bic_limit}")
}

/// An effect that explains no more than known disturbances may.
fn disturbed(found: f64, expected: f64) -> String {
    format!(
        "lost orders carry as much into the data: it lowers χ² by {found:.1}, and {expected:.1} is expected from them"
    )
}

/// What becomes of the held-out error with an effect that does not improve it enough.
fn no_gain(before: &Remainder, after: &Remainder) -> String {
    let known = before.noise_is_known() && worse(before.held_out_chi2, after.held_out_chi2);
    let of = |remainder: &Remainder| if known { remainder.held_out_chi2 } else { remainder.held_out_rms };
    let [from, to] = [before, after].map(of);
    // As many decimals as show a change by the limit.
    let decimals = (4.0 - from.abs().log10().floor()).clamp(0.0, 12.0) as usize;
    let (name, unit) =
        if known { ("χ² ", String::new()) } else { ("", format!(" {}", before.unit.replace("um", "µm"))) };
    let change = format!("{name}{from:.decimals$} → {to:.decimals$}{unit}");
    if of(after) < of(before) {
        let least = 100.0 * HELD_OUT_GAIN * if known { 1.0 } else { 0.5 };
        format!("it lowers the error of held-out data too little: {change}: less than {least} %")
    } else {
        format!("it does not lower the error of held-out data: {change}")
    }
}

/// Whether an effect does not lower the error of held-out data: their χ², or their rms, which no weight changes, beyond what
/// chance makes of it. Data that the rms does not count may show the effect besides: then χ² decides.
fn raises_held_out(before: &Remainder, after: &Remainder, is_seen_besides: bool) -> bool {
    let rises = after.held_out_rms > before.held_out_rms * (1.0 + HELD_OUT_RISE) && !is_seen_besides;
    worse(before.held_out_chi2, after.held_out_chi2) || rises
}

pub(super) fn worse(before: f64, after: f64) -> bool {
    before.is_finite() && after.is_finite() && after > before * (1.0 - HELD_OUT_GAIN)
}

/// Cosine of the angle between what two models take away from a residual.
fn overlap(before: &[f64], after: [&Vec<f64>; 2]) -> f64 {
    let taken = after.map(|after| before.iter().zip(after).map(|(before, after)| before - after).collect::<Vec<f64>>());
    let [one, other] = &taken;
    dot(one, other) / (norm(one) * norm(other)).max(f64::MIN_POSITIVE)
}

/// Two effects that explain as much of the same thing take away vectors that point one way at least so far.
const OVERLAP: f64 = 0.7;

/// A candidate that differs by less than this from what is applied already, relative, is another description of it.
const DIFFERENT: f64 = 0.02;

/// The columns of a candidate beside those applied; none where it is another description of them.
fn independent(columns: Vec<Vec<f64>>, basis: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let whole: f64 = columns.iter().map(|column| dot(column, column)).sum();
    let outside =
        |column: &Vec<f64>| dot(column, column) - basis.iter().map(|base| dot(base, column).powi(2)).sum::<f64>();
    if columns.iter().map(outside).sum::<f64>() < DIFFERENT * DIFFERENT * whole {
        return Vec::new();
    }
    orthonormal(columns, basis, INDEPENDENT)
}

fn known(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// What is left in the end, in one word. Without a noise level known from elsewhere, or without a residual, nothing says that noise
/// only is left.
fn verdict(left: &Remainder, nothing_added: bool) -> Verdict {
    match (left.noise_is_known() && left.dof > 0, at_the_floor(left), nothing_added) {
        (true, false, _) => Verdict::Unexplained,
        (true, true, true) => Verdict::AtNoiseFloor,
        (true, true, false) => Verdict::Explained,
        (false, _, true) => Verdict::NothingFound,
        (false, _, false) => Verdict::Improved,
    }
}

/// `held_out` is what a fit without the held-out data leaves of them.
fn level(remainder: &Remainder, held_out: &Remainder) -> Level {
    Level {
        residual_rms_um: known(remainder.rms).unwrap_or(0.0),
        degrees_of_freedom: remainder.dof,
        noise_floor_um: known(remainder.noise_floor),
        chi2_per_dof: (remainder.noise_is_known() && remainder.dof > 0).then(|| remainder.chi2_per_dof()),
        held_out_rms_um: known(held_out.held_out_rms),
        held_out_expected_rms_um: known(held_out.held_out_expected_rms),
        unit: (remainder.unit != "um").then(|| remainder.unit.clone()),
        orders: None,
    }
}

fn added<M: Model>(found: &Found, model: &M, fit: &M::Fit, applied: &[Setting]) -> Added {
    let effects = model.effects();
    let named = &effects[found.members[0]];
    let confounded = found.members.len() > 1;
    let parameters = named.parameters.iter().zip(&found.values).zip(&found.std).map(|((parameter, value), std)| {
        // The value of one member is conditional on a choice that the data do not make.
        let std = if confounded { None } else { known(*std) };
        Estimated { name: parameter.name.clone(), value: *value, std, unit: parameter.unit.clone() }
    });
    Added {
        effect: named.id.clone(),
        targets: named.targets.clone(),
        confounded_with: found.members[1..].iter().map(|member| effects[*member].name()).collect(),
        told_apart_by: if confounded { fit.told_apart_by(&found.members) } else { None },
        parameters: model.present(found.members[0], parameters.collect()),
        // The data do not decide which member of a set it is: no key is right.
        change: Some(model.changes(found.members[0], applied).join("\n"))
            .filter(|change| found.members.len() == 1 && !change.is_empty()),
        residual_rms_um: Step { before: known(found.before.rms), after: known(found.after.rms) },
        held_out_rms_um: Step { before: known(found.before.held_out_rms), after: known(found.after.held_out_rms) },
        held_out_expected_rms_um: known(found.after.held_out_expected_rms),
        delta_bic: found.evidence.delta_bic,
        p_value: found.evidence.p_value,
    }
}

fn moved(before: &impl Fit, after: &impl Fit) -> Vec<Moved> {
    let values = before.values().into_iter().zip(after.values());
    let moved = values.map(|(before, after)| Moved {
        value: after.value,
        section: after.section,
        before: before.number,
        after: after.number,
        std: known(after.std),
        unit: after.unit,
        reference: None,
        filter: None,
        lost_orders: Vec::new(),
    });
    moved.collect()
}

/// Effects of which the usual size would not show.
pub(super) fn blind(effects: &[Effect], considered: &[usize], fit: &impl Fit) -> Vec<Blind> {
    // Where the noise is not known from elsewhere, it is at most what the fit leaves.
    let known = fit.remainder().noise_is_known();
    let noise = if known { 1.0 } else { fit.remainder().chi2_per_dof().sqrt() };
    let unseen = |index: &&usize| {
        let tolerances = effects[**index].parameters.iter().map(|parameter| parameter.tolerance);
        let columns = fit.signature(**index);
        columns.iter().zip(tolerances).all(|(column, tolerance)| norm(column) * tolerance <= VISIBLE * noise)
    };
    let report = |index: &usize| {
        let largest = fit.bias(*index).into_iter().max_by(|a, b| a.value.total_cmp(&b.value))?;
        Some(Blind {
            effect: effects[*index].id.clone(),
            targets: effects[*index].targets.clone(),
            bias_per_unit: BiasPerUnit { value: largest.value, unit: largest.unit, on: largest.on },
        })
    };
    let mut found: Vec<Blind> = Vec::new();
    for blind in considered.iter().filter(unseen).filter_map(report) {
        // The same effect at several orders is one.
        match found.iter_mut().find(|known| known.effect == blind.effect && known.targets == blind.targets) {
            Some(known) if known.bias_per_unit.value >= blind.bias_per_unit.value => {}
            Some(known) => *known = blind,
            None => found.push(blind),
        }
    }
    found
}
