//! Find, trace, add, report: until noise is left, or nothing earns its place.

use super::{
    Effect, Fit, Model, Parameter, Remainder, Setting,
    confounded::ConfoundedSet,
    diagnosis::{Added, BiasPerUnit, Blind, Diagnosis, Estimated, Level, Moved, Refused, Step, Verdict},
    evidence::{Evidence, agreement},
    fit::{Prior, Refit, dot, norm, refit},
};
use crate::Result;

/// Chance of noise doing as much, corrected for the number of candidates, below which an effect is believed.
const P_LIMIT: f64 = 1e-3;
/// "Very strong" evidence (Kass, Raftery, J. Am. Stat. Assoc. 90 (1995) 773).
const BIC_LIMIT: f64 = -10.0;
/// Candidates whose joint refits differ by less than this, in BIC, cannot be told apart.
const SAME_BIC: f64 = 10.0;
/// Candidates of which a joint refit is tried, and the least share of the best linear gain that they must promise.
const SHORTLIST: (usize, f64) = (6, 0.2);
/// χ² per degree of freedom up to which noise is all that is left: covariances are estimates themselves.
const FLOOR_CHI2: f64 = 1.5;
/// Where something stays unexplained, an effect is believed only if it takes away this share of what was: a stranger lets
/// the least bad effect take a part.
const OWN_SHARE: f64 = 0.8;
/// Chance of independent data agreeing as well on an effect that is not there, above which it is refused.
const AGREEMENT: f64 = 0.01;
/// Held-out data must improve by more than this share, so that rounding is no improvement.
const HELD_OUT_GAIN: f64 = 1e-3;
/// No effect is this many times larger than its tolerance.
const MOST: f64 = 100.0;
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
}

/// An effect that was believed, with everything that it cannot be told from.
pub(super) struct Found {
    /// The best one first.
    pub members: Vec<usize>,
    /// Values of each member as if it were all of it.
    pub alone: Vec<Vec<f64>>,
    /// What else was applied, at its best values beside it.
    others: Vec<Setting>,
    /// Values and standard uncertainties as if the best one were all of it.
    values: Vec<f64>,
    std: Vec<f64>,
    evidence: Evidence,
    before: Remainder,
    after: Remainder,
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
    while tracing.found.len() < settings.max_added {
        let Some(found) = tracing.next(&current) else { break };
        let start = found.others.clone();
        tracing.found.push(found);
        current = tracing.refit_found(model, &start)?;
        if let Some(last) = tracing.found.last_mut() {
            last.after = current.fit.remainder().clone();
        }
    }
    if !at_the_floor(current.fit.remainder()) && tracing.drop_the_least_bad() {
        current = tracing.refit_found(model, &current.settings)?;
    }
    if above_chance(current.fit.remainder()) && tracing.drop_partial(current.fit.remainder()) {
        current = tracing.refit_found(model, &current.settings)?;
    }
    let held_out = [declared.remainder().held_out_rms, current.fit.remainder().held_out_rms];
    let current = tracing.refit_found(model.whole(), &current.settings)?;
    let left = at_the_floor(current.fit.remainder());
    let verdict = match (left, tracing.found.is_empty()) {
        (false, _) => Verdict::Unexplained,
        (true, true) => Verdict::AtNoiseFloor,
        (true, false) => Verdict::Explained,
    };
    tracing.settle(&current);
    let mut after = current.fit;
    let members: Vec<usize> = current.settings[settings.known.len()..].iter().map(|setting| setting.effect).collect();
    let unit = after.remainder().chi2_per_dof();
    let unit = if after.remainder().noise_is_known() { unit.max(1.0) } else { unit };
    let covariance: Vec<Vec<f64>> =
        current.covariance.iter().map(|row| row.iter().map(|entry| entry * unit).collect()).collect();
    after.widen(&members, &covariance);
    let diagnosis = Diagnosis {
        verdict,
        before: level(before.remainder(), held_out[0]),
        added: tracing.found.iter().map(|found| added(found, model, &after)).collect(),
        after: level(after.remainder(), held_out[1]),
        moved: moved(&before, &after),
        unexplained: if left { Vec::new() } else { after.unexplained() },
        blind_to: blind(model.effects(), &tracing.considered(), &after),
        refused: tracing.refused,
        lost_orders: None,
        truth: None,
        warnings: Vec::new(),
    };
    Ok(Closed { diagnosis, before, after })
}

struct Tracing<'a, M> {
    model: &'a M,
    settings: &'a Settings,
    found: Vec<Found>,
    refused: Vec<Refused>,
}

impl<M: Model> Tracing<'_, M> {
    /// Effects that may be added: chosen, not declared.
    fn considered(&self) -> Vec<usize> {
        let chosen = |effect: &Effect| self.settings.effects.as_ref().is_none_or(|ids| ids.contains(&effect.id));
        let declared = |index: usize| self.settings.known.iter().any(|known| known.effect == index);
        let wanted = |index: usize| !declared(index) && !self.settings.left_out.contains(&index);
        let effects = self.model.effects().iter().enumerate();
        effects.filter(|(index, effect)| chosen(effect) && wanted(*index)).map(|(index, _)| index).collect()
    }

    fn active(&self, effect: usize) -> bool {
        self.found.iter().any(|found| found.members.contains(&effect))
    }

    /// All effects found, jointly. A confounded set enters as a whole: each member may be all of it, which is the size of
    /// its prior; what the data cannot decide then shows as a spread. The refit starts where the best member is all of it,
    /// which explains the data; from there the priors lead along what the data cannot decide.
    fn refit_found(&self, model: &M, start: &[Setting]) -> Result<Refit<M::Fit>> {
        let mut settings = self.settings.known.clone();
        for found in &self.found {
            for (place, (member, alone)) in found.members.iter().zip(&found.alone).enumerate() {
                let known = start.iter().find(|setting| setting.effect == *member);
                let share = if place == 0 { 1.0 } else { 0.0 };
                let values =
                    known.map_or_else(|| alone.iter().map(|value| value * share).collect(), |at| at.values.clone());
                settings.push(Setting { effect: *member, values });
            }
        }
        let fixed = self.settings.known.len();
        let held = self.found.iter().any(|found| found.members.len() > 1);
        let priors = if held { self.priors(model, &settings, &model.fit(&settings)?)? } else { Vec::new() };
        let first = refit(model, settings, fixed, &priors)?;
        if !held {
            return Ok(first);
        }
        // Results are not linear in all parameters: their distance is looked at once more from where the refit came to.
        let priors = self.priors(model, &first.settings, &first.fit)?;
        refit(model, first.settings, fixed, &priors)
    }

    /// The effect of the lowest rank that earns its place, if any does.
    fn next(&mut self, current: &Refit<M::Fit>) -> Option<Found> {
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
        let basis = orthonormal(active, &[]);
        let mut ranked: Vec<(usize, f64)> = candidates
            .iter()
            .map(|effect| {
                if self.model.effects()[*effect].parameters.is_empty() {
                    return (*effect, before.chi2() - self.with(current, *effect));
                }
                let columns = independent(current.fit.signature(*effect), &basis);
                (*effect, columns.iter().map(|column| dot(column, &before.residual).powi(2)).sum())
            })
            .collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        let promising = ranked.first().map_or(0.0, |(_, gain)| SHORTLIST.1 * gain);
        let held = self.priors(self.model, &current.settings, &current.fit).ok()?;
        let mut trials: Vec<(usize, Refit<M::Fit>, Evidence)> = Vec::new();
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
            settings.push(Setting { effect, values: vec![0.0; parameters] });
            let Ok(trial) = refit(self.model, settings, fixed, &held) else { continue };
            let evidence = evidence(trial.chi2);
            trials.push((effect, trial, evidence));
        }
        let best = trials.iter().map(|(_, _, evidence)| evidence.delta_bic).fold(f64::INFINITY, f64::min);
        trials.sort_by(|a, b| a.2.delta_bic.total_cmp(&b.2.delta_bic));
        let mut trials = trials.into_iter();
        let (effect, trial, evidence) = trials.next()?;
        let after = trial.fit.remainder().clone();
        let columns = independent(current.fit.signature(effect), &basis);
        let each = (trial.chi2 - before.chi2()) / before.stretches.len().max(1) as f64;
        let chance = agreement(&columns, &before.residual, &before.stretches);
        let reason = if evidence.p_value > P_LIMIT || evidence.delta_bic > BIC_LIMIT {
            Some(format!("its evidence is weak: p {:.2e}, ΔBIC {:.1}", evidence.p_value, evidence.delta_bic))
        } else if before.stretches.len() > 1 && !above_chance(&before) && before.noise_is_known() && each > BIC_LIMIT {
            // Noise may be all that is left, and in each part it is not known better because there are more parts.
            Some(format!(
                "it would explain too little of each of {} parts of the data: Δχ² {each:.1}",
                before.stretches.len()
            ))
        } else if worse(before.held_out_chi2, after.held_out_chi2) {
            let [from, to] = if before.noise_is_known() {
                [before.held_out_chi2, after.held_out_chi2].map(|chi2| format!("χ² {chi2:.1}"))
            } else {
                [before.held_out_rms, after.held_out_rms].map(|rms| format!("{rms:.4} {}", before.unit))
            };
            Some(format!("it does not lower the error of data left out of the fit: {from} → {to}"))
        } else if let Some(chance) = chance.filter(|chance| *chance > AGREEMENT) {
            let stretches = before.stretches.len();
            Some(format!("{stretches} independent parts of the data do not agree on it: p {chance:.2}"))
        } else if let Some((parameter, value)) = self.beyond_belief(effect, &trial) {
            Some(format!("it would have to be larger than can be: {} = {value:.3e} {}", parameter.name, parameter.unit))
        } else {
            None
        };
        if let Some(reason) = reason {
            self.refuse(effect, reason);
            return None;
        }
        let named = &self.model.effects()[effect];
        self.refused.retain(|refused| !is(refused, named));
        let unit = if after.noise_is_known() { after.chi2_per_dof().max(1.0) } else { after.chi2_per_dof() };
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
        let mut others = trial.settings;
        others.pop();
        Some(Found { members, alone, others, values, std, evidence, before, after })
    }

    /// A parameter of the last effect of a trial that is far larger than expected.
    fn beyond_belief(&self, effect: usize, trial: &Refit<M::Fit>) -> Option<(&Parameter, f64)> {
        let values = trial.settings.last().map(|setting| &setting.values)?;
        let mut parameters = self.model.effects()[effect].parameters.iter().zip(values);
        let (parameter, value) = parameters.find(|(known, value)| value.abs() > MOST * known.tolerance)?;
        Some((parameter, *value))
    }

    /// Holds each confounded set where the results move least, as far as the data do not decide. Form without the set, the
    /// truth, and everything that the data allow between: the nearest of these to form without it is never farther from
    /// the truth than that is (Pythagoras). Where results do not move, the members' own sizes decide.
    fn priors(&self, model: &M, settings: &[Setting], fit: &M::Fit) -> Result<Vec<Prior>> {
        let free = &settings[self.settings.known.len()..];
        let mut priors = Vec::new();
        let (mut first, mut setting) = (0, 0);
        for found in &self.found {
            let members = setting..setting + found.members.len();
            let count: usize = found.alone.iter().map(Vec::len).sum();
            if found.members.len() > 1 {
                let beside = free.iter().enumerate().filter(|(place, _)| !members.contains(place));
                let columns = beside.flat_map(|(_, other)| fit.signature(other.effect)).collect();
                let without = model.fit(&found.others)?.results();
                let set = ConfoundedSet::new(found, model.effects(), &free[members.clone()], fit, &without);
                priors.extend(set.priors(&orthonormal(columns, &[]), first));
            }
            (first, setting) = (first + count, members.end);
        }
        Ok(priors)
    }

    /// Keeps the last reason for which an effect was refused.
    fn refuse(&mut self, effect: usize, reason: String) {
        let named = &self.model.effects()[effect];
        self.refused.retain(|refused| !is(refused, named));
        let targets = named.target.iter().cloned().collect();
        self.refused.push(Refused { effect: named.id.clone(), targets, reason });
    }

    /// χ² with an effect that has no parameters; infinite where it cannot be applied.
    fn with(&self, current: &Refit<M::Fit>, effect: usize) -> f64 {
        let mut settings = current.settings.clone();
        settings.push(Setting { effect, values: Vec::new() });
        self.model.fit(&settings).map_or(f64::INFINITY, |fit| fit.remainder().chi2())
    }

    /// Takes values and uncertainties of effects that stand for themselves from the final fit.
    fn settle(&mut self, last: &Refit<M::Fit>) {
        let remainder = last.fit.remainder();
        let unit = remainder.chi2_per_dof();
        let unit = if remainder.noise_is_known() { unit.max(1.0) } else { unit };
        let mut settings = last.settings[self.settings.known.len()..].iter();
        let mut position = 0;
        for found in &mut self.found {
            let alone = found.members.len() == 1;
            for setting in settings.by_ref().take(found.members.len()) {
                if alone {
                    found.values.clone_from(&setting.values);
                    let places = position..position + setting.values.len();
                    found.std = places.map(|place| (last.covariance[place][place] * unit).sqrt()).collect();
                }
                position += setting.values.len();
            }
        }
    }

    /// Takes back the effects that took only a part of what something unknown does. Says whether there were any.
    fn drop_the_least_bad(&mut self) -> bool {
        self.keep(|found| excess(&found.after) <= (1.0 - OWN_SHARE) * excess(&found.before))
    }

    /// Takes back the effects beside which what is left in the end is no small part, though it may be noise: a small stranger
    /// lets the least bad effect take a part, a small effect leaves nothing.
    fn drop_partial(&mut self, last: &Remainder) -> bool {
        let left = excess(last);
        self.keep(|found| left <= (1.0 - OWN_SHARE) * excess(&found.before))
    }

    /// Takes back the others. Says whether there were any.
    fn keep(&mut self, is_kept: impl Fn(&Found) -> bool) -> bool {
        let (kept, dropped): (Vec<Found>, Vec<Found>) = std::mem::take(&mut self.found).into_iter().partition(is_kept);
        for found in &dropped {
            let reason = format!(
                "it takes away a part only (χ² per degree of freedom {:.2} → {:.2}) of something that stays unexplained",
                found.before.chi2_per_dof(),
                found.after.chi2_per_dof()
            );
            self.refuse(found.members[0], reason);
        }
        self.found = kept;
        !dropped.is_empty()
    }
}

fn is(refused: &Refused, effect: &Effect) -> bool {
    refused.effect == effect.id && refused.targets.iter().eq(&effect.target)
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

fn worse(before: f64, after: f64) -> bool {
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
    orthonormal(columns, basis)
}

/// Columns made orthonormal to a basis and to each other; dependent ones are left out.
pub(super) fn orthonormal(columns: Vec<Vec<f64>>, basis: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut made: Vec<Vec<f64>> = Vec::with_capacity(columns.len());
    for mut column in columns {
        let whole = norm(&column);
        for _ in 0..2 {
            for other in basis.iter().chain(&made) {
                let share = dot(other, &column);
                column.iter_mut().zip(other).for_each(|(entry, other)| *entry -= share * other);
            }
        }
        let left = norm(&column);
        if left > 1e-9 * whole {
            for entry in &mut column {
                *entry /= left;
            }
            made.push(column);
        }
    }
    made
}

fn known(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

fn level(remainder: &Remainder, held_out_rms: f64) -> Level {
    Level {
        residual_rms_um: remainder.rms,
        noise_floor_um: known(remainder.noise_floor),
        chi2_per_dof: remainder.noise_is_known().then(|| remainder.chi2_per_dof()),
        held_out_rms_um: known(held_out_rms),
        unit: (remainder.unit != "um").then(|| remainder.unit.clone()),
    }
}

fn added<M: Model>(found: &Found, model: &M, fit: &M::Fit) -> Added {
    let effects = model.effects();
    let named = &effects[found.members[0]];
    let with = |member: &usize| {
        let other = &effects[*member];
        other.target.as_ref().map_or_else(|| other.id.clone(), |target| format!("{} {target}", other.id))
    };
    let parameters = named.parameters.iter().zip(&found.values).zip(&found.std).map(|((parameter, value), std)| {
        Estimated { name: parameter.name.clone(), value: *value, std: *std, unit: parameter.unit.clone() }
    });
    Added {
        effect: named.id.clone(),
        targets: named.target.iter().cloned().collect(),
        confounded_with: found.members[1..].iter().map(with).collect(),
        told_apart_by: if found.members.len() > 1 { fit.told_apart_by(&found.members) } else { None },
        parameters: model.present(found.members[0], parameters.collect()),
        residual_rms_um: Step { before: known(found.before.rms), after: known(found.after.rms) },
        held_out_rms_um: Step { before: known(found.before.held_out_rms), after: known(found.after.held_out_rms) },
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
    });
    moved.collect()
}

/// Effects of which the usual size would not show.
pub(super) fn blind(effects: &[Effect], considered: &[usize], fit: &impl Fit) -> Vec<Blind> {
    if !fit.remainder().noise_is_known() {
        return Vec::new();
    }
    let unseen = |index: &&usize| {
        let tolerances = effects[**index].parameters.iter().map(|parameter| parameter.tolerance);
        let columns = fit.signature(**index);
        columns.iter().zip(tolerances).all(|(column, tolerance)| norm(column) * tolerance < VISIBLE)
    };
    let report = |index: &usize| {
        let largest = fit.bias(*index).into_iter().max_by(|a, b| a.value.total_cmp(&b.value))?;
        Some(Blind {
            effect: effects[*index].id.clone(),
            targets: effects[*index].target.iter().cloned().collect(),
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
