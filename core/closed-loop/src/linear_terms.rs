//! A model whose declared part and effects are all linear: measured points and terms.

#[cfg(test)]
mod tests;

use std::{ops::Range, sync::Arc};

use super::{
    Bias, Effect, Fit, Model, Outcome, Remainder, Setting,
    diagnosis::Unexplained,
    evidence::{Group, far_worse},
};
use runout_error::{Error, ErrorKind, Result};
use runout_numerics::{
    farthest,
    least_squares::{Basis, dot},
};

/// What was measured.
#[derive(Debug, Clone, Default)]
pub struct Observations {
    /// One value a point.
    pub values: Vec<f64>,
    /// Their unit.
    pub unit: String,
    /// Standard uncertainty of each, where it is known from elsewhere.
    pub std: Option<f64>,
    /// The group of each point (an index into `groups`): groups are left out of the fit one after the other and predicted.
    pub group: Vec<usize>,
    /// The groups' names.
    pub groups: Vec<String>,
}

/// A declared parameter, which is always fitted.
#[derive(Debug, Clone)]
pub struct Declared {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// What one unit of it adds to each observation.
    pub column: Vec<f64>,
}

/// An effect that may be missing.
#[derive(Debug, Clone)]
pub struct Term {
    /// What it is.
    pub effect: Effect,
    /// What one unit of each parameter adds to each observation, `[parameter][point]`.
    pub columns: Vec<Vec<f64>>,
    /// Terms of a lower rank are asked first ([`Model::rank`]).
    pub rank: usize,
}

/// Points that are never fitted, only predicted at the end.
#[derive(Debug, Clone)]
pub struct Unseen {
    /// What they are.
    pub name: String,
    /// One value a point.
    pub values: Vec<f64>,
    /// As in [`Declared`], `[parameter][point]`.
    pub declared: Vec<Vec<f64>>,
    /// As in [`Term`], `[term][parameter][point]`.
    pub terms: Vec<Vec<Vec<f64>>>,
}

/// Measured points y = B·b + Σ T·t + noise: declared parameters b, and terms of which each may be missing.
///
/// The fit is by orthogonal columns. A term's signature is its column outside the span of the declared ones.
#[derive(Debug, Clone)]
pub struct LinearTerms(Arc<Data>);

#[derive(Debug, Clone)]
struct Data {
    observations: Observations,
    declared: Vec<Declared>,
    basis: Basis,
    effects: Vec<Effect>,
    terms: Vec<Term>,
    /// Points of each group.
    members: Vec<Vec<usize>>,
    /// Where each observation was before they were put in the order of the groups.
    places: Vec<usize>,
    unseen: Vec<Unseen>,
    /// Effects that are declared with their values: never refitted.
    known: Vec<usize>,
    /// The last effect of each list, by id, and what ends the list.
    ends: Vec<(String, String)>,
    /// Ids of the effects that may be added; all without it.
    chosen: Option<Vec<String>>,
    /// Points by which held-out predictions are judged; all without it.
    judged: Option<Range<usize>>,
    /// What measurement separates effects of a confounded set.
    told_apart_by: Option<String>,
}

impl LinearTerms {
    /// A model of `observations`.
    ///
    /// # Errors
    /// When columns and observations are not of one length, a number is not finite, or the points cannot tell the declared
    /// parameters apart.
    pub fn new(mut observations: Observations, mut declared: Vec<Declared>, mut terms: Vec<Term>) -> Result<Self> {
        let refuse = |problem: String| Error::new("fit", "the points", problem);
        let count = observations.values.len();
        let columns = || declared.iter().map(|known| &known.column).chain(terms.iter().flat_map(|term| &term.columns));
        if observations.group.len() != count || columns().any(|column| column.len() != count) {
            return Err(refuse(format!("its {count} points have columns of another length")));
        }
        if columns().chain([&observations.values]).flatten().any(|value| !value.is_finite()) {
            return Err(refuse("a value is no finite number".into()));
        }
        let places = sort_by_group(&mut observations, &mut declared, &mut terms);
        let mut members = vec![Vec::new(); observations.groups.len()];
        for (point, group) in observations.group.iter().enumerate() {
            let group = members.get_mut(*group).ok_or_else(|| refuse(format!("there is no group {group}")))?;
            group.push(point);
        }
        let basis = Basis::of(declared.iter().map(|known| known.column.clone()).collect());
        if basis.dependent() {
            let names: Vec<&str> = declared.iter().map(|known| known.name.as_str()).collect();
            let problem = format!("{count} points do not determine {}", names.join(", "));
            return Err(refuse(problem).of(ErrorKind::InsufficientData));
        }
        let effects = terms.iter().map(|term| term.effect.clone()).collect();
        let (unseen, known, ends) = (Vec::new(), Vec::new(), Vec::new());
        let (chosen, judged, told_apart_by) = (None, None, None);
        Ok(Self(Arc::new(Data {
            observations,
            declared,
            basis,
            effects,
            terms,
            members,
            places,
            unseen,
            known,
            ends,
            chosen,
            judged,
            told_apart_by,
        })))
    }

    /// What was measured, in the order of the groups.
    #[must_use]
    pub fn observations(&self) -> &Observations {
        &self.0.observations
    }

    /// Where each observation was in what the model was made of.
    #[must_use]
    pub fn places(&self) -> &[usize] {
        &self.0.places
    }

    /// Adds points that are only predicted; each set gives a value "rms of …".
    #[must_use]
    pub fn predicting(mut self, unseen: Vec<Unseen>) -> Self {
        Arc::make_mut(&mut self.0).unseen = unseen;
        self
    }

    /// Says that an effect is the last of a list, and what ends the list ([`Model::last_of_list`]).
    #[must_use]
    pub fn ending_at(mut self, effect: impl Into<String>, limit: impl Into<String>) -> Self {
        Arc::make_mut(&mut self.0).ends.push((effect.into(), limit.into()));
        self
    }

    /// Judges held-out predictions by some of the points only: by those that count for the user.
    #[must_use]
    pub fn judged_by(mut self, points: Range<usize>) -> Self {
        Arc::make_mut(&mut self.0).judged = Some(points);
        self
    }

    /// Says what measurement separates effects that these points do not.
    #[must_use]
    pub fn told_apart_by(mut self, measurement: &str) -> Self {
        Arc::make_mut(&mut self.0).told_apart_by = Some(measurement.to_owned());
        self
    }

    /// Says which effects may be added, by their ids; all without it.
    #[must_use]
    pub fn considering(mut self, ids: Option<&[String]>) -> Self {
        Arc::make_mut(&mut self.0).chosen = ids.map(<[String]>::to_vec);
        self
    }

    /// Says which effects are declared with their values: they are no free parameters, also not of held-out predictions.
    #[must_use]
    pub fn with_known(mut self, known: &[Setting]) -> Self {
        Arc::make_mut(&mut self.0).known = known.iter().map(|setting| setting.effect).collect();
        self
    }
}

impl Model for LinearTerms {
    type Fit = LinearFit;

    fn effects(&self) -> &[Effect] {
        &self.0.effects
    }

    fn rank(&self, effect: usize) -> usize {
        self.0.terms.get(effect).map_or(0, |term| term.rank)
    }

    fn last_of_list(&self, effect: usize) -> Option<String> {
        let id = &self.0.effects.get(effect)?.id;
        self.0.ends.iter().find(|(last, _)| last == id).map(|(_, limit)| limit.clone())
    }

    fn fit(&self, applied: &[Setting]) -> Result<LinearFit> {
        let data = &self.0;
        let Observations { values, std, unit, .. } = &data.observations;
        let scale = std.unwrap_or(1.0);
        let left = data.less(applied);
        let mut residual = left.clone();
        data.basis.remove_from(&mut residual);
        let free = applied.iter().filter(|setting| !data.known.contains(&setting.effect));
        let free = free.filter_map(|setting| data.terms.get(setting.effect)).flat_map(|term| term.columns.clone());
        let joint = data.basis.extended(free.collect());
        let known: Vec<Setting> =
            applied.iter().filter(|setting| data.known.contains(&setting.effect)).cloned().collect();
        let mut held_out = joint.left_out(&data.less(&known), &data.members);
        if let Some(judged) = data.judged.as_ref().and_then(|judged| held_out.get(judged.clone())) {
            held_out = judged.to_vec();
        }
        let mean_square = |values: &[f64]| dot(values, values) / values.len().max(1) as f64;
        let dof = values.len().saturating_sub(joint.rank());
        let remainder = Remainder {
            rms: mean_square(&residual).sqrt(),
            noise_floor: std.map_or(f64::NAN, |std| std * (dof as f64 / values.len() as f64).sqrt()),
            held_out_rms: mean_square(&held_out).sqrt(),
            disturbed_chi2: 0.0,
            held_out_expected_rms: std.map_or(f64::NAN, |std| std * joint.left_out_gain(&data.members, values.len())),
            held_out_chi2: dot(&held_out, &held_out) / (scale * scale),
            residual: residual.iter().map(|value| value / scale).collect(),
            // Where the noise is not known, neither is how far neighbouring points depend on each other: groups have to agree.
            stretches: if std.is_some() { Vec::new() } else { data.members.iter().map(Vec::len).collect() },
            dof,
            unit: unit.clone(),
        };
        let coefficients = data.basis.coefficients(&left);
        let doubt = vec![0.0; coefficients.len()];
        let groups = data.members.iter().map(|points| group(points, &residual, &joint)).collect();
        Ok(LinearFit {
            groups,
            data: Arc::clone(data),
            applied: applied.to_vec(),
            coefficients,
            doubt,
            remainder,
            variance: vec![],
        })
    }
}

impl Data {
    /// The observations less what applied effects add to them.
    fn less(&self, applied: &[Setting]) -> Vec<f64> {
        let mut left = self.observations.values.clone();
        for setting in applied {
            let columns = self.terms.get(setting.effect).map_or(&[][..], |term| &term.columns);
            subtract(&mut left, columns, &setting.values);
        }
        left
    }

    /// How the declared parameters change with each parameter of an effect, `[parameter][declared]`.
    fn leverage(&self, effect: usize) -> Vec<Vec<f64>> {
        let columns = self.terms.get(effect).map_or(&[][..], |term| &term.columns);
        let of = |column: &Vec<f64>| self.basis.coefficients(column).iter().map(|value| -value).collect();
        columns.iter().map(of).collect()
    }
}

fn mean(weights: &[f64], values: impl Iterator<Item = f64>) -> f64 {
    weights.iter().zip(values).map(|(weight, value)| weight * value).sum()
}

/// Puts points of one group next to each other: groups are independent stretches of the residual. Gives where each was.
fn sort_by_group(observations: &mut Observations, declared: &mut [Declared], terms: &mut [Term]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..observations.group.len()).collect();
    order.sort_by_key(|point| observations.group[*point]);
    let columns = declared.iter_mut().map(|known| &mut known.column);
    let columns = columns.chain(terms.iter_mut().flat_map(|term| &mut term.columns));
    for column in columns.chain([&mut observations.values]) {
        *column = order.iter().map(|point| column[*point]).collect();
    }
    observations.group.sort_unstable();
    order
}

fn subtract(from: &mut [f64], columns: &[Vec<f64>], values: &[f64]) {
    for (column, value) in columns.iter().zip(values) {
        from.iter_mut().zip(column).for_each(|(entry, column)| *entry -= value * column);
    }
}

/// What is left of a group of points, of which those are free that are not needed to fit them: n − tr Q_gᵀQ_g. The residual of the
/// fit without the group would be large beside a bad group, too.
fn group(points: &[usize], residual: &[f64], joint: &Basis) -> Group {
    let squares = points.iter().map(|point| residual[*point].powi(2)).sum();
    Group { squares, freedom: (points.len() as f64 - joint.weight(points)).max(0.0) }
}

/// A fit of [`LinearTerms`].
#[derive(Debug, Clone)]
pub struct LinearFit {
    data: Arc<Data>,
    applied: Vec<Setting>,
    coefficients: Vec<f64>,
    /// Variance of each declared parameter that comes from not knowing the effects.
    doubt: Vec<f64>,
    remainder: Remainder,
    /// Of each group of the observations, in the data's unit.
    groups: Vec<Group>,
    /// Variances of the applied effects' parameters.
    variance: Vec<(usize, Vec<f64>)>,
}

impl LinearFit {
    /// Declared parameters, in their order.
    #[must_use]
    pub fn declared(&self) -> &[f64] {
        &self.coefficients
    }

    /// Applied effects, each with its values and their variances (NaN before [`Fit::widen`]).
    pub fn effects(&self) -> impl Iterator<Item = (&Effect, &[f64], Vec<f64>)> + '_ {
        self.applied.iter().filter_map(|setting| {
            let known = self.variance.iter().find(|(effect, _)| *effect == setting.effect);
            let variance = known.map_or_else(|| vec![f64::NAN; setting.values.len()], |(_, variance)| variance.clone());
            Some((self.data.effects.get(setting.effect)?, setting.values.as_slice(), variance))
        })
    }

    /// What the fit leaves of each observation, in their unit and order.
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
    fn unseen_rms(&self, unseen: &Unseen) -> f64 {
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

    fn values(&self) -> Vec<Outcome> {
        let std = self.data.observations.std;
        let level = self.remainder.chi2_per_dof();
        let noise = std.map_or(level, |std| std * std * level.max(1.0));
        let unit_variance = self.data.basis.unit_variance();
        let declared = self.data.declared.iter().zip(&self.coefficients).zip(unit_variance.iter().zip(&self.doubt));
        let declared = declared.map(|((declared, number), (variance, doubt))| Outcome {
            value: declared.name.clone(),
            section: None,
            number: *number,
            std: (noise * variance + doubt).sqrt(),
            unit: declared.unit.clone(),
        });
        let unseen = self.data.unseen.iter().map(|unseen| Outcome {
            value: format!("rms of {}, never fitted", unseen.name),
            section: None,
            number: self.unseen_rms(unseen),
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
                sensor: None,
                setup: None,
                orders: [0, 0],
                rms_um,
                place: format!("{name}: {:.1} times the median of {} groups", rms_um / median, all.len()),
            }
        };
        far_worse(&self.groups).into_iter().map(report).collect()
    }

    fn told_apart_by(&self, _effects: &[usize]) -> Option<String> {
        self.data.told_apart_by.clone()
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
            sensor: None,
            setup: None,
            orders: [0, 0],
            rms_um: excess.max(0.0).sqrt(),
            place: format!("most of it at {name} ({:.0} % of the squares)", share(sum)),
        };
        worst.map(report).into_iter().collect()
    }
}
