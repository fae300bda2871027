//! What a measurement could show of each effect, before it is made: the loop's own measures on a model of predicted data.

use schemars::JsonSchema;
use serde::Serialize;

use super::{
    Bias, Effect, Fit, LookedAt, Model, Remainder, Setting,
    diagnosis::{BiasPerUnit, Blind},
    fit::INDEPENDENT,
    judgement::named_from,
    report::{VISIBLE, blind},
};
use runout_error::Result;
use runout_numerics::least_squares::{dot, norm, orthonormal};

/// What a measurement could show of each effect.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct Foresight {
    /// The measurement that the figures are valid for, in words.
    pub assuming: String,
    /// Effects of which the usual size would show.
    pub visible: Vec<Visible>,
    /// Effects of which it would not.
    pub blind_to: Vec<NotVisible>,
    /// Sets of visible effects, "effect target", that look the same: of their usual size, what one leaves of another is
    /// below what would show.
    pub confounded: Vec<Vec<String>>,
}

/// An effect that would show.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Visible {
    /// Its id.
    pub effect: String,
    /// Where it acts.
    pub targets: Vec<String>,
    /// One entry a parameter; none where the effect is there or not.
    pub parameters: Vec<VisibleFrom>,
}

/// From which size on a parameter shows.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct VisibleFrom {
    /// The parameter.
    pub name: String,
    /// The size from which the loop names it in most measurements of data like these: six standard deviations of the noise, and nine with 6000 data. With
    /// other phases of form and motion it may be half or twice as much.
    pub visible_from: f64,
    /// The size that could usually be expected.
    pub tolerance: f64,
    /// Their unit.
    pub unit: String,
}

/// An effect that would not show.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct NotVisible {
    /// The effect, and the most that one unit of it does.
    #[serde(flatten)]
    pub blind: Blind,
    /// What one unit of it does to each result; one entry a result and parameter.
    pub bias: Vec<BiasPerUnit>,
}

/// "effect target"; of two targets "effect target target".
#[must_use]
pub fn name(effect: &str, targets: &[String]) -> String {
    std::iter::once(effect).chain(targets.iter().map(String::as_str)).collect::<Vec<_>>().join(" ")
}

impl Effect {
    /// "effect target".
    #[must_use]
    pub fn name(&self) -> String {
        name(&self.id, &self.targets)
    }
}

impl Foresight {
    /// "effect target" of everything blind.
    pub fn blind_names(&self) -> impl Iterator<Item = String> {
        self.blind_to.iter().map(|unseen| name(&unseen.blind.effect, &unseen.blind.targets))
    }
}

/// What a model's data, with the noise that they declare, could show of each of its effects.
///
/// # Errors
/// When the model cannot be fitted.
pub fn foresee<M: Model>(model: &M) -> Result<Foresight> {
    let effects = model.effects();
    let fit = Kept::new(model.fit(&[])?, effects.len());
    let named = named_from(fit.remainder().residual.len());
    let all: Vec<usize> = (0..effects.len()).filter(|effect| !model.is_mistake(*effect)).collect();
    let mut blind_to: Vec<NotVisible> = Vec::new();
    for blind in blind(effects, &all, &fit) {
        let same = |effect: &Effect| effect.id == blind.effect && effect.targets == blind.targets;
        let bias = all.iter().filter(|index| same(&effects[**index])).flat_map(|index| fit.bias(*index));
        let mut worst: Vec<BiasPerUnit> = Vec::new();
        for bias in bias {
            match worst.iter_mut().find(|known| known.on == bias.on && known.unit == bias.unit) {
                Some(known) => known.value = known.value.max(bias.value),
                None => worst.push(BiasPerUnit { value: bias.value, unit: bias.unit, on: bias.on }),
            }
        }
        blind_to.push(NotVisible { blind, bias: worst });
    }
    let mut foresight = Foresight { blind_to, ..Foresight::default() };
    let unseen: Vec<String> = foresight.blind_names().collect();
    let mut columns: Vec<Columns> = Vec::new();
    for index in all {
        let effect = &effects[index];
        if unseen.contains(&effect.name()) {
            continue;
        }
        if effect.parameters.is_empty() {
            // There or not: what it changes, whichever of both the data are of.
            let with = model.fit(&[Setting { effect: index, values: Vec::new() }])?;
            if (with.remainder().chi2() - fit.remainder().chi2()).abs().sqrt() >= VISIBLE {
                foresight.see(effect, Vec::new());
            }
            continue;
        }
        let found = Columns::new(effect, fit.signature(index));
        let parameters = effect.parameters.iter().zip(&found.sized).map(|(parameter, column)| VisibleFrom {
            name: parameter.name.clone(),
            visible_from: named * parameter.tolerance / norm(column),
            tolerance: parameter.tolerance,
            unit: parameter.unit.clone(),
        });
        foresight.see(effect, parameters.collect());
        columns.push(found);
    }
    foresight.confounded = confounded(&columns);
    Ok(foresight)
}

impl Foresight {
    /// Adds an effect. At several orders it is one effect, visible from where all of them are.
    fn see(&mut self, effect: &Effect, parameters: Vec<VisibleFrom>) {
        let known = self.visible.iter_mut().find(|known| known.effect == effect.id && known.targets == effect.targets);
        let Some(known) = known else {
            let targets = effect.targets.clone();
            self.visible.push(Visible { effect: effect.id.clone(), targets, parameters });
            return;
        };
        for (known, found) in known.parameters.iter_mut().zip(parameters) {
            known.visible_from = known.visible_from.max(found.visible_from);
        }
    }
}

/// A fit that works out each signature once.
struct Kept<F> {
    fit: F,
    signatures: Vec<Vec<Vec<f64>>>,
}

impl<F: Fit> Kept<F> {
    fn new(fit: F, effects: usize) -> Self {
        Self { signatures: (0..effects).map(|effect| fit.signature(effect)).collect(), fit }
    }
}

impl<F: Fit> Fit for Kept<F> {
    fn remainder(&self) -> &Remainder {
        self.fit.remainder()
    }

    fn signature(&self, effect: usize) -> Vec<Vec<f64>> {
        self.signatures[effect].clone()
    }

    fn bias(&self, effect: usize) -> Vec<Bias> {
        self.fit.bias(effect)
    }

    fn values(&self) -> Vec<LookedAt> {
        self.fit.values()
    }
}

/// What an effect of its usual size does to the residual, in standard deviations.
struct Columns {
    name: String,
    sized: Vec<Vec<f64>>,
    /// An orthonormal basis of the same.
    basis: Vec<Vec<f64>>,
}

impl Columns {
    fn new(effect: &Effect, mut signature: Vec<Vec<f64>>) -> Self {
        for (column, parameter) in signature.iter_mut().zip(&effect.parameters) {
            for entry in column.iter_mut() {
                *entry *= parameter.tolerance;
            }
        }
        Self { name: effect.name(), basis: orthonormal(signature.clone(), &[], INDEPENDENT), sized: signature }
    }

    /// Whether nothing of it would show once the other is fitted.
    fn hides_behind(&self, other: &Self) -> bool {
        self.sized.iter().all(|column| {
            let mut rest = column.clone();
            for base in &other.basis {
                let share = dot(base, column);
                rest.iter_mut().zip(base).for_each(|(rest, base)| *rest -= share * base);
            }
            norm(&rest) < VISIBLE
        })
    }
}

/// The largest sets of which every two hide behind each other.
fn confounded(columns: &[Columns]) -> Vec<Vec<String>> {
    let alike = |a: usize, b: usize| {
        let (a, b) = (&columns[a], &columns[b]);
        a.name != b.name && a.hides_behind(b) && b.hides_behind(a)
    };
    let mut sets: Vec<Vec<usize>> = Vec::new();
    for next in 0..columns.len() {
        let partners: Vec<usize> = (0..next).filter(|known| alike(*known, next)).collect();
        let mut found = vec![vec![next]];
        for set in &sets {
            let mut common: Vec<usize> = set.iter().copied().filter(|known| partners.contains(known)).collect();
            common.push(next);
            found.push(common);
        }
        sets.extend(found);
        keep_largest(&mut sets);
    }
    let mut named: Vec<Vec<String>> = Vec::new();
    for set in sets.iter().filter(|set| set.len() > 1) {
        named.push(set.iter().map(|index| columns[*index].name.clone()).collect());
    }
    keep_largest(&mut named);
    named
}

/// Leaves out sets that lie within another.
fn keep_largest<T: PartialEq>(sets: &mut Vec<Vec<T>>) {
    let within = |small: &[T], large: &[T]| small.iter().all(|entry| large.contains(entry));
    let mut index = 0;
    while index < sets.len() {
        let set = &sets[index];
        let covered = sets
            .iter()
            .enumerate()
            .any(|(place, other)| place != index && within(set, other) && (set.len() < other.len() || place < index));
        if covered {
            sets.remove(index);
        } else {
            index += 1;
        }
    }
}
