//! Keys of effects on the readings that a fit's structure is of.

use super::{Fit, fit::INDEPENDENT};
use runout_consistency::{
    Partition, Structure,
    blocks::agreement,
    keys::{Keys, keys},
    order::OrderModels,
};
use runout_numerics::least_squares::{dot, orthonormal};

/// Share of an effect's squares from which the readings of the tests show it.
const SHOWN: f64 = 0.1;

/// What is fitted and the residual, on the readings that the structure is of.
pub(super) struct Keyed<'a, F> {
    fit: &'a F,
    /// The effects found already, in the residual's own coordinates.
    found: &'a [Vec<f64>],
    residual: Vec<f64>,
    fixed: Vec<Vec<f64>>,
    models: Option<OrderModels>,
}

impl<'a, F: Fit> Keyed<'a, F> {
    /// Of a fit in which effects are found already, whose signatures span `found`.
    pub(super) fn of(fit: &'a F, found: &'a [Vec<f64>]) -> Self {
        let declared = fit.declared_columns();
        let active = orthonormal(found.iter().map(|column| fit.tested(column)).collect(), declared, INDEPENDENT);
        let fixed: Vec<Vec<f64>> = declared.iter().cloned().chain(active).collect();
        let mut residual = fit.tested(&fit.remainder().residual);
        for column in &fixed {
            let share = dot(column, &residual);
            residual.iter_mut().zip(column).for_each(|(entry, column)| *entry -= share * column);
        }
        let order = fit.remainder().structure.order.as_ref();
        let models = order.and_then(|order| OrderModels::of(order, &residual, &fixed));
        Self { fit, found, residual, fixed, models }
    }

    fn structure(&self) -> &Structure {
        &self.fit.remainder().structure
    }

    /// χ² that columns, in the residual's coordinates, explain beside correlated errors; `None` where errors are independent.
    pub(super) fn explained(&self, columns: impl FnOnce() -> Vec<Vec<f64>>) -> Option<f64> {
        let models = self.models.as_ref().filter(|models| models.is_correlated())?;
        let tested: Vec<Vec<f64>> = columns().iter().map(|column| self.fit.tested(column)).collect();
        Some(models.explained(&tested))
    }

    /// The keys of an effect whose fit has these values and leaves this; `columns` are orthonormal in the residual's coordinates.
    pub(super) fn keys(
        &self,
        effect: usize,
        [found, left]: [&[f64]; 2],
        columns: &[Vec<f64>],
        candidates: usize,
    ) -> Keys {
        let tested: Vec<Vec<f64>> = columns.iter().map(|column| self.fit.tested(column)).collect();
        let squares = |columns: &[Vec<f64>]| columns.iter().map(|column| dot(column, column)).sum::<f64>();
        let candidates = candidates.saturating_mul(self.fit.tried(effect).max(1));
        let is_shown = squares(&tested) * self.fit.averaged() > SHOWN * squares(columns);
        let keys = if let Some(blocks) = self.fit.blocks_of_entries().filter(|_| !is_shown) {
            self.by_entries(&blocks, columns, candidates)
        } else {
            let own = orthonormal(tested, &self.fixed, INDEPENDENT);
            keys(&own, candidates, &self.residual, &self.fixed, self.structure(), self.models.as_ref())
        };
        match self.fit.among_family(effect, found, left) {
            Some(p) => keys.beside_family(p),
            None => keys,
        }
    }

    fn by_entries(&self, blocks: &Partition, columns: &[Vec<f64>], candidates: usize) -> Keys {
        let agreed = agreement(columns, self.found, &self.fit.remainder().residual, &blocks.members());
        Keys::default().beside_blocks(blocks, agreed.map(|(p, ..)| p), candidates)
    }
}
