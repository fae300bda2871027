//! The tests of a fit on the readings that its structure is of.

use super::{Effect, Fit, Setting};
use runout_consistency::{Action, Check, LinearFit, Test, check::widening, judge, order::OrderModels};
use runout_numerics::{
    least_squares::{Basis, dot},
    statistics::f_tail,
};

/// Entries from which their means say more than they do.
const NEIGHBOURS: f64 = 2.0;

/// What the tests say of a fit.
#[derive(Debug, Clone)]
pub struct Tested {
    /// All tests.
    pub checks: Vec<Check>,
    /// Models of the errors along the declared order, where they depend on each other; in the data's unit.
    pub models: Option<OrderModels>,
    /// Standard uncertainties of the parameters of fitted effects that the tests widen, by effect.
    std: Vec<(usize, Vec<f64>)>,
}

impl Tested {
    /// Tests a fit in which those in `free` of all `effects` are fitted; `scale` is the unit of its residual, in the `unit` of words.
    ///
    /// A parameter's standard uncertainty is that of a fit to the readings of the tests, with its factors: means over neighbours that
    /// scatter more than single entries let expect widen it.
    #[must_use]
    pub fn of<F: Fit>(fit: &F, free: &[&Setting], effects: &[Effect], scale: f64, unit: &str) -> Self {
        let remainder = fit.remainder();
        let mut residual: Vec<f64> = fit.tested(&remainder.residual).iter().map(|value| scale * value).collect();
        let declared = Basis::of(fit.declared_columns().to_vec());
        let columns = |setting: &&Setting| -> Vec<Vec<f64>> {
            let tested = |column: &Vec<f64>| fit.tested(column).iter().map(|value| scale * value).collect();
            fit.signature(setting.effect).iter().map(tested).collect()
        };
        let joint = declared.extended(free.iter().flat_map(columns).collect());
        let mut tested = Self { checks: Vec::new(), models: None, std: Vec::new() };
        let dof = residual.len().saturating_sub(joint.rank());
        if dof == 0 {
            return tested;
        }
        joint.remove_from(&mut residual);
        let weights: Vec<Vec<f64>> = joint.weights().split_off(declared.columns().len());
        let names = free.iter().filter_map(|setting| effects.get(setting.effect)).flat_map(|effect| {
            let name = effect.name();
            effect.parameters.iter().map(move |parameter| format!("{name} {}", parameter.name))
        });
        let names: Vec<String> = names.collect();
        let judged = LinearFit {
            residual: &residual,
            basis: joint.columns(),
            names: &names,
            weights: &weights,
            noise: remainder.noise_is_known().then_some((scale, f64::INFINITY)),
            unit,
        };
        let judgement = judge(judged, &remainder.structure);
        let order = remainder.structure.order.as_ref();
        tested.models = order
            .and_then(|order| OrderModels::of(order, &residual, joint.columns()))
            .filter(OrderModels::is_correlated);
        let variance = dot(&residual, &residual) / dof as f64;
        let single = remainder.chi2_per_dof() * scale * scale;
        let each = fit.averaged();
        let ratio = variance * each / single.max(f64::MIN_POSITIVE);
        let p = if each >= NEIGHBOURS { f_tail(ratio, dof as f64, remainder.dof.max(1) as f64) } else { 1.0 };
        let wider = p < widening(usize::MAX);
        let mut place = 0;
        for setting in free {
            let own = place..place + setting.values.len();
            place = own.end;
            let factors = judgement.factors.get(own.clone()).unwrap_or_default();
            if !wider && factors.iter().all(|factor| *factor <= 1.0) {
                continue;
            }
            let std = |(factor, weights): (&f64, &Vec<f64>)| factor * (variance * dot(weights, weights)).sqrt();
            let std = factors.iter().zip(weights.get(own).unwrap_or_default()).map(std).collect();
            tested.std.push((setting.effect, std));
        }
        tested.checks = judgement.checks;
        if each >= NEIGHBOURS && tested.models.is_none() {
            let factor = if wider { ratio.sqrt() } else { 1.0 };
            let check = Check::new(Test::Order, "neighbours", ratio, &[dof as f64, remainder.dof as f64], p);
            let mut check = check.widening(factor).finding(|| {
                format!(
                    "neighbouring readings depend on each other: means over {each:.0} of them scatter {:.1} times as far as independent ones would",
                    ratio.sqrt()
                )
            });
            if !check.finding.is_empty() {
                // Uncertainties hold it: it is said, and does not refute the values.
                check.did = Action::Widened;
            }
            tested.checks.push(check);
        }
        tested
    }

    /// Standard uncertainties of an effect's parameters where the tests widen them; nothing elsewhere.
    #[must_use]
    pub fn std(&self, effect: usize) -> Vec<f64> {
        self.std.iter().find(|(own, _)| *own == effect).map_or_else(Vec::new, |(_, std)| std.clone())
    }
}
