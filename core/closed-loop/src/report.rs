//! What is reported of what was found.

use super::{
    Effect, Fit, Model, Remainder, Setting,
    diagnosis::{Added, BiasPerUnit, Blind, Estimated, Level, Moved, Step, Verdict},
    found::FoundEffect,
    judgement::noise_only,
};
use runout_consistency::Check;
use runout_numerics::least_squares::norm;

/// An effect of its usual size that would show with less than this many standard deviations is not seen.
pub(super) const VISIBLE: f64 = 3.0;

pub(super) fn known(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// The verdict on the final residual. Without a noise level known from elsewhere, or without a residual, nothing says that noise
/// only is left; and noise only is not left where a test of the data says so.
pub(super) fn verdict(left: &Remainder, consistency: &[Check], nothing_added: bool) -> Verdict {
    let consistent = noise_only(left, consistency);
    match (left.noise_is_known() && left.dof > 0, consistent, nothing_added) {
        (true, false, _) => Verdict::Unexplained,
        (true, true, true) => Verdict::AtNoiseFloor,
        (true, true, false) => Verdict::Explained,
        (false, _, true) => Verdict::NothingFound,
        (false, _, false) => Verdict::Improved,
    }
}

/// `held_out` is what a fit without the held-out data leaves of them.
pub(super) fn level(remainder: &Remainder, held_out: &Remainder) -> Level {
    Level {
        residual_rms_um: known(remainder.rms).unwrap_or(0.0),
        degrees_of_freedom: remainder.dof,
        noise_floor_um: known(remainder.noise_floor),
        chi2_per_dof: (remainder.noise_is_known() && remainder.dof > 0).then(|| remainder.chi2_per_dof()),
        held_out_rms_um: known(held_out.held_out_rms),
        held_out_expected_rms_um: known(held_out.held_out_expected_rms),
        unit: (remainder.unit != "um").then(|| remainder.unit.clone()),
        orders: None,
    }
}

pub(super) fn added<M: Model>(found: &FoundEffect, model: &M, fit: &M::Fit, applied: &[Setting]) -> Added {
    let effects = model.effects();
    let named = &effects[found.members[0]];
    let confounded = found.members.len() > 1;
    let parameters = named.parameters.iter().zip(&found.values).zip(&found.std).map(|((parameter, value), std)| {
        // The value of one member is conditional on a choice that the data do not make.
        let std = if confounded { None } else { known(*std) };
        Estimated { name: parameter.name.clone(), value: *value, std, unit: parameter.unit.clone() }
    });
    Added {
        effect: named.id.clone(),
        targets: named.targets.clone(),
        confounded_with: found.members[1..].iter().map(|member| effects[*member].name()).collect(),
        distinguished_by: if confounded { fit.distinguished_by(&found.members) } else { None },
        parameters: model.present(found.members[0], parameters.collect()),
        // The data do not decide which member of a set it is: no key is right.
        change: Some(model.changes(found.members[0], applied).join("\n"))
            .filter(|change| found.members.len() == 1 && !change.is_empty()),
        residual_rms_um: Step { before: known(found.before.rms), after: known(found.after.rms) },
        held_out_rms_um: Step { before: known(found.before.held_out_rms), after: known(found.after.held_out_rms) },
        held_out_expected_rms_um: known(found.after.held_out_expected_rms),
        delta_bic: found.evidence.delta_bic,
        p_value: found.evidence.p_value,
    }
}

pub(super) fn moved(before: &impl Fit, after: &impl Fit) -> Vec<Moved> {
    let values = before.values().into_iter().zip(after.values());
    let moved = values.map(|(before, after)| Moved {
        value: after.value,
        section: after.section,
        before: before.number,
        after: after.number,
        std: known(after.std),
        unit: after.unit,
        reference: None,
        filter: None,
        lost_orders: Vec::new(),
    });
    moved.collect()
}

/// Effects of which the usual size would not show.
pub(super) fn blind(effects: &[Effect], considered: &[usize], fit: &impl Fit) -> Vec<Blind> {
    // Where the noise is not known from elsewhere, it is at most what the fit leaves.
    let known = fit.remainder().noise_is_known();
    let noise = if known { 1.0 } else { fit.remainder().chi2_per_dof().sqrt() };
    let unseen = |index: &&usize| {
        let tolerances = effects[**index].parameters.iter().map(|parameter| parameter.tolerance);
        let columns = fit.signature(**index);
        columns.iter().zip(tolerances).all(|(column, tolerance)| norm(column) * tolerance <= VISIBLE * noise)
    };
    let report = |index: &usize| {
        let largest = fit.bias(*index).into_iter().max_by(|a, b| a.value.total_cmp(&b.value))?;
        Some(Blind {
            effect: effects[*index].id.clone(),
            targets: effects[*index].targets.clone(),
            bias_per_unit: BiasPerUnit { value: largest.value, unit: largest.unit, on: largest.on },
        })
    };
    let mut found: Vec<Blind> = Vec::new();
    for blind in considered.iter().filter(unseen).filter_map(report) {
        // The same effect at several orders is one.
        match found.iter_mut().find(|known| known.effect == blind.effect && known.targets == blind.targets) {
            Some(known) if known.bias_per_unit.value >= blind.bias_per_unit.value => {}
            Some(known) => *known = blind,
            None => found.push(blind),
        }
    }
    found
}
