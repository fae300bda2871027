//! Confounded sets side by side: which members explain the data best together.

use super::{
    Fit, Model,
    confounded::choices,
    fit::{Refit, refit},
    judgement::{same_finding, unit},
    search::{SAME, Tracing},
};

/// Rounds of refits from elsewhere, at most: one effect after the other finds its place.
const ROUNDS: usize = 3;

impl<M: Model> Tracing<'_, M> {
    /// The best refit over all combinations of members, of which `current` is the first, and the others that are at most so
    /// much worse in χ², in units of the residual. Members that are in none of these leave their sets; those of the best
    /// combination come first.
    pub(super) fn combinations(
        &mut self,
        model: &M,
        current: Refit<M::Fit>,
        worse: f64,
    ) -> (Refit<M::Fit>, Vec<Refit<M::Fit>>) {
        let sizes: Vec<usize> = self.found.iter().map(|found| found.members.len()).collect();
        let mut choices = choices(&sizes).into_iter();
        let start = current.settings.clone();
        let mut best = (choices.next().unwrap_or_default(), current);
        let mut others = Vec::new();
        for choice in choices {
            // A combination that cannot be fitted does not explain the data.
            let Ok(refit) = self.refit_chosen(model, &start, &choice) else { continue };
            if refit.ends_at_bound {
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
    pub(super) fn choose_best(&mut self, model: &M, current: Refit<M::Fit>) -> Refit<M::Fit> {
        if self.found.len() < 2 || self.found.iter().all(|found| found.members.len() == 1) {
            return current;
        }
        self.combinations(model, current, f64::INFINITY).0
    }

    /// The best of `current` and of refits from [elsewhere](Model::elsewhere): an effect may have made up for one that was found after it.
    pub(super) fn elsewhere(&self, model: &M, current: Refit<M::Fit>) -> Refit<M::Fit> {
        let (known, mut best) = (self.settings.known.len(), current);
        for _ in 0..if self.found.len() < 2 { 0 } else { ROUNDS } {
            let starts = model.elsewhere(&best.fit, &best.settings, known).into_iter();
            let others = starts.filter_map(|start| refit(model, start, known).ok());
            let least = others
                .filter(|other| !other.ends_at_bound && other.chi2 < best.chi2 * (1.0 - SAME))
                .min_by(|one, other| one.chi2.total_cmp(&other.chi2));
            let Some(least) = least else { break };
            best = least;
        }
        best
    }
}
