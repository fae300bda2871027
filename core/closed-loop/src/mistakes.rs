//! Mistakes in the declaration: discrete, tried before any other effect, since nothing else can be judged beside them.

use super::{
    Fit, Model, Remainder, Setting,
    evidence::Evidence,
    fit::Refit,
    found::{Declaration, FoundEffect},
    judgement::{same_finding, worse},
    search::Tracing,
};
use runout_error::Result;

/// χ² per degree of freedom from which on the declaration itself is in doubt.
const SUSPICIOUS_CHI2: f64 = 10.0;
/// A mistake leaves less than this share of χ² per degree of freedom when it is corrected: the wrong correction of a sound
/// declaration makes it larger.
const LEFT: f64 = 0.1;
/// Where the noise is not known, a corrected mistake leaves less than this share of χ² per degree of freedom: nothing says how
/// large the residual may be.
const LEFT_OF_UNKNOWN: f64 = 0.01;
/// χ² per degree of freedom near the noise: the residual may be a small effect.
const NEAR_NOISE: f64 = 4.0;
/// Corrections whose χ² differ by less than this, in units of the residual, cannot be distinguished.
const SAME_CHI2: f64 = 10.0;

impl<M: Model> Tracing<'_, M> {
    /// Corrects the mistakes that the data prove, before anything else is looked for.
    pub(super) fn find_mistakes(&mut self, current: &Refit<M::Fit>) -> Result<Declaration<M::Fit>> {
        let before = current.fit.remainder();
        if before.noise_is_known() && before.chi2_per_dof() < SUSPICIOUS_CHI2 {
            return Ok(Declaration::Sound);
        }
        let suspected = self.model.suspected_mistakes(&current.settings);
        let wanted = |mistakes: &Vec<usize>| mistakes.iter().all(|mistake| self.may_be_added(*mistake));
        let tried: Vec<(Vec<usize>, Remainder)> = suspected
            .into_iter()
            .filter(wanted)
            .filter_map(|mistakes| {
                let left = self.with_mistakes(&current.settings, &mistakes).ok()?.remainder().clone();
                Some((mistakes, left))
            })
            .collect();
        // Of corrections that leave the same, that of fewer mistakes.
        let size =
            |(mistakes, left): &(Vec<usize>, Remainder)| left.chi2_per_dof() * (1.0 + 1e-3 * mistakes.len() as f64);
        let Some((mistakes, after)) = tried.iter().min_by(|a, b| size(a).total_cmp(&size(b))) else {
            return Ok(Declaration::Sound);
        };
        let share = if before.noise_is_known() { LEFT } else { LEFT_OF_UNKNOWN };
        if after.chi2_per_dof() > share * before.chi2_per_dof() || worse(before.held_out_chi2, after.held_out_chi2) {
            return Ok(Declaration::Sound);
        }
        // One effect may look like two mistakes: they lead to the noise, or at least farther than any single effect.
        if !after.noise_is_known() || after.chi2_per_dof() >= NEAR_NOISE {
            // What is refused beside a wrong declaration says nothing.
            let refused = self.refused.clone();
            let effect = self.next(current);
            let goes_farther = |effect: &FoundEffect| effect.after.chi2_per_dof() <= after.chi2_per_dof();
            if let Some(effect) = effect.filter(goes_farther) {
                return Ok(Declaration::Beside(Box::new(effect)));
            }
            self.refused = refused;
        }
        let unit = if after.noise_is_known() { after.chi2_per_dof().max(1.0) } else { after.chi2_per_dof() };
        let alike = |left: &Remainder| left.chi2() - after.chi2() < SAME_CHI2 * unit;
        for mistake in mistakes {
            let others = |others: &[usize]| {
                others.len() == mistakes.len()
                    && others.iter().filter(|other| !mistakes.contains(other)).count() == 1
                    && mistakes.iter().filter(|known| !others.contains(known)).eq([mistake])
            };
            let copy = |set: &[usize]| {
                let other = set.iter().find(|other| !mistakes.contains(other));
                other.is_some_and(|other| same_finding(self.model, *mistake, *other))
            };
            let instead = tried.iter().filter(|(set, left)| others(set) && (alike(left) || copy(set)));
            let instead = instead.filter_map(|(set, _)| set.iter().find(|other| !mistakes.contains(other)).copied());
            let members: Vec<usize> = std::iter::once(*mistake).chain(instead).collect();
            self.found.push(FoundEffect {
                alone: vec![Vec::new(); members.len()],
                members,
                values: Vec::new(),
                std: Vec::new(),
                evidence: Evidence::new(
                    before.chi2(),
                    after.chi2(),
                    1,
                    after.dof,
                    tried.len(),
                    before.noise_is_known(),
                ),
                before: before.clone(),
                after: after.clone(),
            });
        }
        self.refit_found(self.model, &[]).map(Declaration::Corrected)
    }

    /// Whether the user lets the loop add it.
    fn may_be_added(&self, mistake: usize) -> bool {
        let id = &self.model.effects()[mistake].id;
        self.settings.effects.as_ref().is_none_or(|ids| ids.contains(id))
            && self.settings.known.iter().all(|known| known.effect != mistake)
    }

    fn with_mistakes(&self, settings: &[Setting], mistakes: &[usize]) -> Result<M::Fit> {
        let corrected = mistakes.iter().map(|effect| Setting { effect: *effect, values: Vec::new() });
        self.model.fit(&settings.iter().cloned().chain(corrected).collect::<Vec<_>>())
    }
}
