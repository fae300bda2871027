//! A model whose declared part and effects are all linear: measured points and terms.

mod fit;
#[cfg(test)]
mod tests;

use std::{ops::Range, sync::Arc};

use super::{Effect, Model, Remainder, Setting, diagnosis::Unexplained};
pub use fit::LinearFit;
use runout_consistency::{Kind, Structure};
use runout_error::{Error, ErrorKind, Result};
use runout_numerics::least_squares::{Basis, dot};

/// What was measured.
#[derive(Debug, Clone, Default)]
pub struct Observations {
    /// One value a point.
    pub values: Vec<f64>,
    /// Their unit.
    pub unit: String,
    /// Standard uncertainty of each, where it is known from elsewhere.
    pub std: Option<f64>,
    /// Degrees of freedom that it is known from; nothing where it is stated.
    pub std_dof: Option<f64>,
    /// The group of each point (an index into `groups`): groups are left out of the fit one after the other and predicted.
    pub group: Vec<usize>,
    /// The groups' names.
    pub groups: Vec<String>,
    /// What else is declared of the readings: order, partitions. Where the noise is not known, the groups are [blocks](Kind::Blocks) of it.
    pub structure: Structure,
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
pub struct HeldOut {
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
    structure: Arc<Structure>,
    unseen: Vec<HeldOut>,
    /// What is not among the points, since nothing explains it.
    set_aside: Vec<Unexplained>,
    /// Effects that are declared with their values: never refitted.
    known: Vec<usize>,
    /// The last effect of each list, by id, and what ends the list.
    ends: Vec<(String, String)>,
    /// Ids of the effects that may be added; all without it.
    chosen: Option<Vec<String>>,
    /// Points by which held-out predictions are judged; all without it.
    judged: Option<Range<usize>>,
    /// What measurement separates effects of a confounded set.
    distinguished_by: Option<String>,
    /// Effects that were looked for at several places, and how many.
    tried: Vec<(usize, usize)>,
}

impl LinearTerms {
    /// A model of `observations`.
    ///
    /// # Errors
    /// When columns and observations are not of one length, a number is not finite, or the points do not
    /// distinguish the declared parameters.
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
        let mut structure = std::mem::take(&mut observations.structure).sorted(&places);
        if observations.std.is_none() && structure.of_kind(Kind::Blocks).next().is_none() {
            // Where the noise is not known, neither is how far neighbouring points depend on each other: groups have to agree.
            structure =
                structure.divided("groups", Kind::Blocks, observations.group.clone(), observations.groups.clone());
        }
        let basis = Basis::of(declared.iter().map(|known| known.column.clone()).collect());
        if basis.dependent() {
            let names: Vec<&str> = declared.iter().map(|known| known.name.as_str()).collect();
            let problem = format!("{count} points do not determine {}", names.join(", "));
            return Err(refuse(problem).of(ErrorKind::InsufficientData));
        }
        let effects = terms.iter().map(|term| term.effect.clone()).collect();
        let (unseen, known, ends) = (Vec::new(), Vec::new(), Vec::new());
        let (chosen, judged, distinguished_by) = (None, None, None);
        Ok(Self(Arc::new(Data {
            observations,
            declared,
            basis,
            effects,
            terms,
            members,
            places,
            structure: Arc::new(structure),
            unseen,
            set_aside: Vec::new(),
            known,
            ends,
            chosen,
            judged,
            distinguished_by,
            tried: Vec::new(),
        })))
    }

    /// Adds an effect that is known by what it does to the readings: of each parameter a step, and the models of the readings with half of it
    /// taken away and added.
    ///
    /// # Errors
    /// When these models have other observations.
    pub fn adding(mut self, effect: Effect, steps: &[(f64, [Self; 2])]) -> Result<Self> {
        let data = Arc::make_mut(&mut self.0);
        let alike = |other: &Self| other.0.places == data.places && other.0.unseen.len() == data.unseen.len();
        if !steps.iter().flat_map(|(_, models)| models).all(alike) {
            let problem = "a thousandth of its usual size decides which readings are used";
            return Err(Error::new("fit", effect.name(), problem).of(ErrorKind::UnsuitableData));
        }
        let column = |step: f64, [less, more]: [&Vec<f64>; 2]| -> Vec<f64> {
            more.iter().zip(less).map(|(more, less)| (more - less) / step).collect()
        };
        let columns = |of: &dyn Fn(&Self) -> &Vec<f64>| -> Vec<Vec<f64>> {
            steps.iter().map(|(step, [less, more])| column(*step, [of(less), of(more)])).collect()
        };
        let added = columns(&|model| &model.0.observations.values);
        for (place, unseen) in data.unseen.iter_mut().enumerate() {
            unseen.terms.push(columns(&|model| &model.0.unseen[place].values));
        }
        data.effects.push(effect.clone());
        data.terms.push(Term { effect, columns: added, rank: 0 });
        Ok(self)
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
    pub fn predicting(mut self, unseen: Vec<HeldOut>) -> Self {
        Arc::make_mut(&mut self.0).unseen = unseen;
        self
    }

    /// Says what is not among the points: each diagnosis lists it as not explained.
    #[must_use]
    pub fn setting_aside(mut self, found: Vec<Unexplained>) -> Self {
        Arc::make_mut(&mut self.0).set_aside = found;
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
    pub fn distinguished_by(mut self, measurement: &str) -> Self {
        Arc::make_mut(&mut self.0).distinguished_by = Some(measurement.to_owned());
        self
    }

    /// Says at how many places (times, time constants) an effect was looked for before its columns were made ([`super::Fit::tried`]).
    #[must_use]
    pub fn looked_for(mut self, effect: usize, places: usize) -> Self {
        Arc::make_mut(&mut self.0).tried.push((effect, places));
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
            structure: Arc::clone(&data.structure),
            dof,
            unit: unit.clone(),
        };
        let coefficients = data.basis.coefficients(&left);
        Ok(LinearFit::new(Arc::clone(data), applied.to_vec(), coefficients, joint, remainder, &residual))
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
