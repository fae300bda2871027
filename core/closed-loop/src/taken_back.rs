//! Effects that are withdrawn: what they explained is explained by others, or was only a part of something unknown.

use super::{
    Fit, Model, Remainder,
    fit::{Refit, refit},
    found::FoundEffect,
    judgement::{BIC_LIMIT, P_LIMIT, excess, may_leave, unit},
    search::Tracing,
};

/// A parameter this many standard uncertainties from 0 is needed: no refit without it is tried.
const CERTAIN: f64 = 10.0;

impl<M: Model> Tracing<'_, M> {
    /// An effect that was found first and explains nothing beside those that were found later.
    pub(super) fn superseded(&self, model: &M, current: &Refit<M::Fit>) -> Option<(usize, Refit<M::Fit>)> {
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
            let count = self.considered().len();
            let evidence = self.evidence(setting.effect, without.chi2, current.chi2, remainder, remainder.dof, count);
            if evidence.p_value > P_LIMIT || evidence.delta_bic > BIC_LIMIT {
                return Some((index, without));
            }
        }
        None
    }

    /// Withdraws the effects that took only a part of what something unknown does. Says whether there were any.
    pub(super) fn drop_the_least_bad(&mut self) -> bool {
        let model = self.model;
        self.keep(|found| seen_besides(model, found) || excess(&found.after) <= may_leave(model, found))
    }

    /// Withdraws the effects beside which the residual in the end is no small part, though it may be noise: the least bad effect explains
    /// a part of a small unmodelled disturbance; a small effect leaves nothing.
    pub(super) fn drop_partial(&mut self, last: &Remainder) -> bool {
        let (model, left) = (self.model, excess(last));
        self.keep(|found| seen_besides(model, found) || left <= may_leave(model, found))
    }

    /// Withdraws the others. Says whether there were any.
    fn keep(&mut self, is_kept: impl Fn(&FoundEffect) -> bool) -> bool {
        let (kept, dropped): (Vec<FoundEffect>, Vec<FoundEffect>) =
            std::mem::take(&mut self.found).into_iter().partition(is_kept);
        for found in &dropped {
            let reason = format!(
                "it takes away a part only (χ² per degree of freedom {:.2} → {:.2}, not below {:.2}) of something that stays \
                 unexplained",
                found.before.chi2_per_dof(),
                found.after.chi2_per_dof(),
                1.0 + may_leave(self.model, found)
            );
            self.refuse(found.members[0], reason);
        }
        self.found = kept;
        !dropped.is_empty()
    }
}

/// Whether other data show it: then it is no part of what stays unexplained.
fn seen_besides<M: Model>(model: &M, found: &FoundEffect) -> bool {
    model.is_seen_besides(found.members[0])
}
