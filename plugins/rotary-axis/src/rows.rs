//! The rows that the closed loop works with, and the shapes (time constants, times of steps) that explain most of them.

use runout_core::{closed_loop::Setting, numerics::least_squares::dot};

use crate::{
    effects::{CANDIDATES, Shapes},
    solve::Redundant,
};

/// The rows that the loop works with.
pub(crate) struct Rows {
    pub data: Redundant,
    /// In `data.effects`, the first column of each candidate.
    pub first: Vec<usize>,
    /// And that of the first shape tried, of each.
    pub tried: [usize; 6],
    /// And those of errors of the nest.
    pub nest: usize,
}

impl Rows {
    /// Shapes beside effects that were added: of one that was, its own; else the one that explains most of the residual.
    pub(crate) fn shapes(&self, from: Shapes, added: &[Setting], grids: &[Vec<f64>; 6]) -> Shapes {
        let mut next = from;
        for (own, candidate) in CANDIDATES.iter().enumerate() {
            let Some(place) = candidate.shape() else { continue };
            let fitted = added.iter().find(|setting| setting.effect == own);
            if let (Some([drift, change]), Some([low, .., high])) =
                (fitted.map(|setting| &setting.values[..]), grids[place].get(..))
            {
                let changed = next[place] + change / drift;
                next[place] = if changed.is_finite() { changed.clamp(*low, *high) } else { next[place] };
                continue;
            }
            let mut left = self.data.rows.clone();
            for setting in added.iter().filter(|setting| setting.effect != own) {
                for (column, value) in self.data.effects[self.first[setting.effect]..].iter().zip(&setting.values) {
                    left.iter_mut().zip(column).for_each(|(entry, column)| *entry -= value * column);
                }
            }
            remove(&self.data.declared, &mut left);
            let gain = |index: usize| {
                let mut column = self.data.effects[self.tried[place] + index].clone();
                remove(&self.data.declared, &mut column);
                let size = dot(&column, &column);
                if size > 0.0 { dot(&column, &left).powi(2) / size } else { 0.0 }
            };
            let best = (0..grids[place].len()).max_by(|a, b| gain(*a).total_cmp(&gain(*b)));
            next[place] = best.map_or(next[place], |index| grids[place][index]);
        }
        next
    }
}

fn remove(basis: &[Vec<f64>], from: &mut [f64]) {
    for column in basis {
        let share = dot(column, from);
        from.iter_mut().zip(column).for_each(|(entry, column)| *entry -= share * column);
    }
}
