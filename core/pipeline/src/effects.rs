//! Effects that are registered: what the models of any domain may lack.

use std::{any::Any, sync::Arc};

use runout_closed_loop::{Effect, Parameter};
use runout_error::Result;

use crate::points::{Column, PointColumn, Points};

/// An effect of a pipeline's own in measured points: something that adds to their readings.
pub trait PointEffect: Send + Sync {
    /// Its id and its parameters: where all are 0, it adds nothing.
    fn effect(&self) -> Effect;

    /// The columns that it takes of the points.
    fn columns(&self) -> Vec<PointColumn>;

    /// What one unit of each parameter adds to readings, `[parameter]`: columns of the points by their names, in their units.
    ///
    /// # Errors
    /// When that is not known for these points.
    fn partials(&self, points: &Points) -> Result<Vec<Vec<Column>>>;
}

/// Every effect, whatever it acts on.
///
/// A domain says by a trait of its own what an effect can do to its models; the core keeps effects by that type, and gives
/// them back to the models that ask for it.
#[derive(Clone, Default)]
pub struct EffectCatalogue {
    entries: Vec<EffectEntry>,
}

/// A registered effect.
#[derive(Clone)]
pub struct EffectEntry {
    /// Its id, in kebab-case.
    pub name: &'static str,
    /// One line for lists.
    pub about: &'static str,
    /// What it is described by.
    pub parameters: Vec<Parameter>,
    effect: Arc<dyn Any + Send + Sync>,
}

impl EffectEntry {
    /// An effect of the domain whose effects are of type `E`, an [`Arc`] of its trait.
    #[must_use]
    pub fn new<E: Any + Send + Sync>(
        name: &'static str,
        about: &'static str,
        parameters: Vec<Parameter>,
        effect: E,
    ) -> Self {
        Self { name, about, parameters, effect: Arc::new(effect) }
    }

    /// Whether it is an effect of the domain whose effects are of type `E`.
    #[must_use]
    pub fn is<E: Any>(&self) -> bool {
        self.effect.is::<E>()
    }
}

impl EffectCatalogue {
    /// Adds an effect. Those of one name are one effect to people, at several orders for example.
    pub fn add(&mut self, effect: EffectEntry) {
        self.entries.push(effect);
    }

    /// The effects of a domain, in the order added.
    #[must_use]
    pub fn of<E: Any + Clone>(&self) -> Vec<E> {
        self.entries.iter().filter_map(|entry| entry.effect.downcast_ref::<E>().cloned()).collect()
    }

    /// The first effect of each name, in the order added.
    pub fn iter(&self) -> impl Iterator<Item = &EffectEntry> {
        let first =
            |index: usize, entry: &EffectEntry| self.entries[..index].iter().all(|known| known.name != entry.name);
        self.entries.iter().enumerate().filter(move |(index, entry)| first(*index, entry)).map(|(_, entry)| entry)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_domain_gets_its_own() {
        let mut catalogue = EffectCatalogue::default();
        for (name, order) in [("ripple", 1_u8), ("ripple", 2)] {
            catalogue.add(EffectEntry::new(name, "uneven speed", Vec::new(), order));
        }
        catalogue.add(EffectEntry::new("backlash", "of an axis", Vec::new(), "another type"));
        assert_eq!(catalogue.of::<u8>(), [1, 2]);
        assert_eq!(catalogue.of::<&str>(), ["another type"]);
        assert!(catalogue.of::<char>().is_empty());
        assert_eq!(catalogue.iter().map(|entry| entry.name).collect::<Vec<_>>(), ["ripple", "backlash"]);
    }
}
