//! A fit of linear terms: what it leaves, what it says of the declared parameters, and what else might be in the residual.

use std::{
    ops::Range,
    sync::{Arc, OnceLock},
};

use super::{Data, HeldOut, Observations, subtract};
use crate::{
    Bias, Effect, Fit, LookedAt, Remainder, Setting,
    diagnosis::Unexplained,
    evidence::{Group, far_worse},
};
use runout_consistency::{self as consistency, Check, Judgement, judge};
use runout_numerics::{
    farthest,
    least_squares::{Basis, dot},
};

/// A fit of [`LinearTerms`](super::LinearTerms).
#[derive(Debug, Clone)]
pub struct LinearFit {
    data: Arc<Data>,
    applied: Vec<Setting>,
    coefficients: Vec<f64>,
    /// Variance of each declared parameter that comes from not knowing the effects.
    doubt: Vec<f64>,
    remainder: Remainder,
    /// Everything that is fitted: the declared columns, then those of the applied effects that are not known.
    joint: Basis,
    /// Of each group of the observations, in the data's unit.
    groups: Vec<Group>,
    /// The tests of the fit, once they are asked for.
    judgement: OnceLock<Judgement>,
    /// Variances of the applied effects' parameters.
    variance: Vec<(usize, Vec<f64>)>,
}

impl LinearFit {
    /// `residual` is in the observations' unit, `joint` the span of the declared columns and of the applied effects'.
    pub(super) fn new(
        data: Arc<Data>,
        applied: Vec<Setting>,
        coefficients: Vec<f64>,
        joint: Basis,
        remainder: Remainder,
        residual: &[f64],
    ) -> Self {
        let groups = data.members.iter().map(|points| group(points, residual, &joint)).collect();
        let doubt = vec![0.0; coefficients.len()];
        let (variance, judgement) = (Vec::new(), OnceLock::new());
        Self { data, applied, coefficients, doubt, remainder, joint, groups, judgement, variance }
    }

    /// The tests of the fit on its own readings; factors are those of the declared parameters, then of the effects' that are not known.
    #[must_use]
    pub fn judgement(&self) -> &Judgement {
        self.judgement.get_or_init(|| {
            let names: Vec<String> = self.parameters().collect();
            let weights = self.joint.weights();
            let mut residual = self.residual();
            self.joint.remove_from(&mut residual);
            let Observations { std, std_dof, unit, .. } = &self.data.observations;
            let known_from = std_dof.unwrap_or(f64::INFINITY);
            let fit = consistency::LinearFit {
                residual: &residual,
                basis: self.joint.columns(),
                names: &names,
                weights: &weights,
                noise: std.map(|std| (std, known_from)),
                unit: &unit.replace("um", "µm"),
            };
            let mut judgement = judge(fit, &self.data.structure);
            if self.remainder.noise_is_known() {
                let dof = self.remainder.dof as f64;
                let left = consistency::linear::residual(self.remainder.chi2_per_dof(), dof, known_from);
                judgement.checks.insert(0, left);
            }
            judgement
        })
    }

    /// What the data say against all that the fit says; nothing where they agree with it.
    #[must_use]
    pub fn refuted_by(&self) -> Option<String> {
        consistency::refuted_by(&self.judgement().checks)
    }

    /// Names of everything that is fitted.
    fn parameters(&self) -> impl Iterator<Item = String> + '_ {
        let declared = self.data.declared.iter().map(|declared| declared.name.clone());
        let effects = self.free().filter_map(|effect| self.data.effects.get(effect));
        declared.chain(effects.flat_map(|effect| {
            let name = effect.name();
            effect.parameters.iter().map(move |parameter| format!("{name} {}", parameter.name))
        }))
    }

    /// Applied effects that are fitted.
    fn free(&self) -> impl Iterator<Item = usize> + '_ {
        self.applied.iter().map(|setting| setting.effect).filter(|effect| !self.data.known.contains(effect))
    }

    /// Where the parameters of a fitted effect are among all that are fitted; nothing of a known one.
    fn places_of(&self, effect: usize) -> Range<usize> {
        let count = |effect: usize| self.data.effects.get(effect).map_or(0, |effect| effect.parameters.len());
        let before: usize = self.free().take_while(|other| *other != effect).map(count).sum();
        let first = self.data.declared.len() + before;
        first..first + if self.data.known.contains(&effect) { 0 } else { count(effect) }
    }

    /// Factors on the standard uncertainties of a fitted effect's parameters.
    fn factors_of(&self, effect: usize) -> &[f64] {
        self.judgement().factors.get(self.places_of(effect)).unwrap_or_default()
    }

    /// Where each observation was in what the model was made of.
    #[must_use]
    pub fn places(&self) -> &[usize] {
        &self.data.places
    }

    /// The span of everything that is fitted: of the declared parameters, then of the effects that are not known.
    #[must_use]
    pub fn basis(&self) -> &Basis {
        &self.joint
    }

    /// Declared parameters, in their order.
    #[must_use]
    pub fn declared(&self) -> &[f64] {
        &self.coefficients
    }

    /// Applied effects, each with its values and their variances (NaN before [`Fit::widen`]).
    pub fn effects(&self) -> impl Iterator<Item = (&Effect, &[f64], Vec<f64>)> + '_ {
        self.applied.iter().filter_map(|setting| {
            let known = self.variance.iter().find(|(effect, _)| *effect == setting.effect);
            let mut variance =
                known.map_or_else(|| vec![f64::NAN; setting.values.len()], |(_, variance)| variance.clone());
            if known.is_some() {
                let factors = self.factors_of(setting.effect);
                variance.iter_mut().zip(factors).for_each(|(variance, factor)| *variance *= factor * factor);
            }
            Some((self.data.effects.get(setting.effect)?, setting.values.as_slice(), variance))
        })
    }

    /// What the fit leaves of each observation, in their unit and in the order of the groups, as in
    /// [`LinearTerms::observations`](super::LinearTerms::observations).
    /// [`LinearTerms::places`](super::LinearTerms::places) gives where each was before.
    #[must_use]
    pub fn residual(&self) -> Vec<f64> {
        let scale = self.data.observations.std.unwrap_or(1.0);
        self.remainder.residual.iter().map(|value| value * scale).collect()
    }

    /// Whether an effect might have been added, and is not declared.
    #[must_use]
    pub fn considers(&self, id: &str) -> bool {
        let chosen = self.data.chosen.as_ref().is_none_or(|ids| ids.iter().any(|known| known == id));
        chosen && !self.knows(id)
    }

    /// Whether an effect is declared with its values.
    #[must_use]
    pub fn knows(&self, id: &str) -> bool {
        self.data.known.iter().any(|known| self.data.effects.get(*known).is_some_and(|effect| effect.id == id))
    }

    /// Root mean square of points never fitted less what the fit predicts of them.
    fn held_out_rms_of(&self, unseen: &HeldOut) -> f64 {
        let mut left = unseen.values.clone();
        subtract(&mut left, &unseen.declared, &self.coefficients);
        for setting in &self.applied {
            subtract(&mut left, unseen.terms.get(setting.effect).map_or(&[], Vec::as_slice), &setting.values);
        }
        (dot(&left, &left) / left.len() as f64).sqrt()
    }
}

impl Fit for LinearFit {
    fn remainder(&self) -> &Remainder {
        &self.remainder
    }

    fn signature(&self, effect: usize) -> Vec<Vec<f64>> {
        let scale = -self.data.observations.std.unwrap_or(1.0).recip();
        let mut columns = self.data.terms.get(effect).map_or_else(Vec::new, |term| term.columns.clone());
        for column in &mut columns {
            self.data.basis.remove_from(column);
            for entry in column {
                *entry *= scale;
            }
        }
        columns
    }

    fn declared_columns(&self) -> &[Vec<f64>] {
        self.data.basis.columns()
    }

    fn tried(&self, effect: usize) -> usize {
        self.data.tried.iter().find(|(known, _)| *known == effect).map_or(1, |(_, places)| (*places).max(1))
    }

    fn consistency(&self) -> Vec<Check> {
        self.judgement().checks.clone()
    }

    fn tested_std(&self, effect: usize) -> Vec<f64> {
        let factors = self.factors_of(effect);
        if factors.iter().all(|factor| *factor <= 1.0) {
            return Vec::new();
        }
        let weights = self.joint.weights();
        let own = weights.get(self.places_of(effect)).unwrap_or_default();
        let mut residual = self.residual();
        self.joint.remove_from(&mut residual);
        let variance = dot(&residual, &residual) / self.remainder.dof.max(1) as f64;
        factors.iter().zip(own).map(|(factor, weights)| factor * (variance * dot(weights, weights)).sqrt()).collect()
    }

    fn bias(&self, effect: usize) -> Vec<Bias> {
        let parameters = self.data.effects.get(effect).map_or(&[][..], |effect| &effect.parameters);
        let leverage = self.data.leverage(effect).into_iter().zip(parameters);
        let biases = leverage.flat_map(|(changes, parameter)| {
            self.data.declared.iter().zip(changes).map(|(declared, change)| Bias {
                on: declared.name.clone(),
                value: change.abs(),
                unit: format!("{}/{}", declared.unit, parameter.unit),
            })
        });
        biases.collect()
    }

    fn values(&self) -> Vec<LookedAt> {
        let std = self.data.observations.std;
        let level = self.remainder.chi2_per_dof();
        let noise = std.map_or(level, |std| std * std * level.max(1.0));
        let unit_variance = self.data.basis.unit_variance();
        let left = level * std.map_or(1.0, |std| std * std);
        let factors = &self.judgement().factors;
        let declared = self.data.declared.iter().zip(&self.coefficients).zip(unit_variance.iter().zip(&self.doubt));
        let declared = declared.zip(factors).map(|(((declared, number), (variance, doubt)), factor)| LookedAt {
            value: declared.name.clone(),
            section: None,
            number: *number,
            std: (noise.max(factor * factor * left) * variance + doubt).sqrt(),
            unit: declared.unit.clone(),
        });
        let unseen = self.data.unseen.iter().map(|unseen| LookedAt {
            value: format!("rms of {}, never fitted", unseen.name),
            section: None,
            number: self.held_out_rms_of(unseen),
            std: f64::NAN,
            unit: self.remainder.unit.clone(),
        });
        declared.chain(unseen).collect()
    }

    fn widen(&mut self, effects: &[usize], covariance: &[Vec<f64>]) {
        let changes: Vec<Vec<f64>> = effects.iter().flat_map(|effect| self.data.leverage(*effect)).collect();
        for (index, doubt) in self.doubt.iter_mut().enumerate() {
            let row =
                |row: &Vec<f64>| -> f64 { row.iter().zip(&changes).map(|(entry, change)| entry * change[index]).sum() };
            *doubt = covariance.iter().zip(&changes).map(|(entries, change)| change[index] * row(entries)).sum();
        }
        let mut diagonal = covariance.iter().enumerate().filter_map(|(index, row)| row.get(index).copied());
        for effect in effects {
            let count = self.data.effects.get(*effect).map_or(0, |effect| effect.parameters.len());
            self.variance.push((*effect, diagonal.by_ref().take(count).collect()));
        }
    }

    /// The declared part at the points, in the observations' unit.
    fn results(&self) -> Vec<f64> {
        let mut part = vec![0.0; self.data.observations.values.len()];
        for (declared, coefficient) in self.data.declared.iter().zip(&self.coefficients) {
            part.iter_mut().zip(&declared.column).for_each(|(entry, column)| *entry += coefficient * column);
        }
        part
    }

    /// All is linear: the mixture is the fit with the weighted mean of all settings.
    fn mix(&mut self, weights: &[f64], others: Vec<Self>) {
        let all: Vec<Self> = std::iter::once(self.clone()).chain(others).collect();
        for (index, coefficient) in self.coefficients.iter_mut().enumerate() {
            *coefficient = mean(weights, all.iter().map(|one| one.coefficients[index]));
            let spread = farthest(*coefficient, all.iter().map(|one| one.coefficients[index]));
            let doubt = mean(weights, all.iter().map(|one| one.doubt[index]));
            self.doubt[index] = doubt + spread * spread;
        }
        for (index, entry) in self.remainder.residual.iter_mut().enumerate() {
            *entry = mean(weights, all.iter().map(|one| one.remainder.residual[index]));
        }
        let mut effects: Vec<usize> = all.iter().flat_map(|one| &one.applied).map(|setting| setting.effect).collect();
        effects.sort_unstable();
        effects.dedup();
        (self.applied, self.variance) = (Vec::new(), Vec::new());
        for effect in effects {
            let count = self.data.effects.get(effect).map_or(0, |effect| effect.parameters.len());
            let of = |one: &Self, index: usize| {
                let setting = one.applied.iter().find(|setting| setting.effect == effect);
                setting.and_then(|setting| setting.values.get(index)).copied().unwrap_or(0.0)
            };
            let variance_of = |one: &Self, index: usize| {
                let known = one.variance.iter().find(|(known, _)| *known == effect);
                known.and_then(|(_, variance)| variance.get(index)).copied().unwrap_or(0.0)
            };
            let each = |index: usize| all.iter().map(move |one| of(one, index));
            let values: Vec<f64> = (0..count).map(|index| mean(weights, each(index))).collect();
            let variance = values.iter().enumerate().map(|(index, value)| {
                let noise = mean(weights, all.iter().map(|one| variance_of(one, index)));
                noise + farthest(*value, each(index)).powi(2)
            });
            self.variance.push((effect, variance.collect()));
            self.applied.push(Setting { effect, values });
        }
    }

    fn far_worse(&self) -> Vec<Unexplained> {
        let rms = |points: &[usize]| {
            let squares: f64 = points.iter().map(|point| self.remainder.residual[*point].powi(2)).sum();
            (squares / points.len().max(1) as f64).sqrt() * self.data.observations.std.unwrap_or(1.0)
        };
        let mut all: Vec<f64> = self.data.members.iter().map(|points| rms(points)).collect();
        all.sort_by(f64::total_cmp);
        let median = all.get(all.len() / 2).copied().unwrap_or(f64::NAN);
        let report = |group: usize| {
            let rms_um = rms(&self.data.members[group]);
            let name = &self.data.observations.groups[group];
            Unexplained {
                station: None,
                sensor: None,
                setup: None,
                orders: [0, 0],
                rms_um,
                place: format!("{name}: {:.1} times the median of {} groups", rms_um / median, all.len()),
            }
        };
        self.data.set_aside.iter().cloned().chain(far_worse(&self.groups).into_iter().map(report)).collect()
    }

    fn distinguished_by(&self, _effects: &[usize]) -> Option<String> {
        self.data.distinguished_by.clone()
    }

    fn unexplained(&self) -> Vec<Unexplained> {
        let groups = self.data.members.iter().zip(&self.data.observations.groups);
        let of = |points: &Vec<usize>| -> f64 {
            points.iter().filter_map(|point| self.remainder.residual.get(*point)).map(|value| value * value).sum()
        };
        let share = |sum: f64| 100.0 * sum / self.remainder.chi2();
        let worst = groups.map(|(points, name)| (of(points), name)).max_by(|a, b| a.0.total_cmp(&b.0));
        let excess = self.remainder.rms.powi(2) - self.remainder.noise_floor.powi(2);
        let report = |(sum, name): (f64, &String)| Unexplained {
            station: None,
            sensor: None,
            setup: None,
            orders: [0, 0],
            rms_um: excess.max(0.0).sqrt(),
            place: format!("most of it at {name} ({:.0} % of the squares)", share(sum)),
        };
        worst.map(report).into_iter().collect()
    }
}

/// The residual of a group of points, of which those are free that are not needed to fit them: n − tr Q_gᵀQ_g. The residual of the
/// fit without the group would be large beside a bad group, too.
fn group(points: &[usize], residual: &[f64], joint: &Basis) -> Group {
    let squares = points.iter().map(|point| residual[*point].powi(2)).sum();
    Group { squares, freedom: (points.len() as f64 - joint.weight(points)).max(0.0) }
}

fn mean(weights: &[f64], values: impl Iterator<Item = f64>) -> f64 {
    weights.iter().zip(values).map(|(weight, value)| weight * value).sum()
}
