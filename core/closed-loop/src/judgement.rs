//! Whether what was found is accepted: measures of a remainder and of what an effect takes away.

use super::{
    Effect, Fit, Model, Remainder,
    confounded::nearest,
    diagnosis::Refused,
    evidence::Evidence,
    fit::{INDEPENDENT, Refit},
    found::FoundEffect,
};
use runout_consistency::{Check, Test};
use runout_numerics::least_squares::{dot, norm, orthonormal};

/// Chance of noise doing as much, corrected for the number of candidates, below which an effect is accepted.
pub(super) const P_LIMIT: f64 = 1e-3;
/// "Very strong" evidence (Kass, Raftery, J. Am. Stat. Assoc. 90 (1995) 773).
pub(super) const BIC_LIMIT: f64 = -10.0;
/// χ² per degree of freedom up to which noise is all that is left: covariances are estimates themselves.
const FLOOR_CHI2: f64 = 1.5;
/// Where something stays unexplained, an effect is accepted only if it removes this share of the excess: the least bad effect explains
/// a part of an unmodelled disturbance.
const OWN_SHARE: f64 = 0.8;
/// An effect that is this many times its tolerance is unusual. No size is refused; but where something stays unexplained, the residual,
/// as a size of the same effect, must not be larger than it may be beside an effect of this size.
const UNUSUAL: f64 = 100.0;
/// Held-out data must improve by more than this share of their squares (half of it in rms), so that rounding is no improvement.
const HELD_OUT_GAIN: f64 = 1e-3;
/// Their unweighted rms may rise by this share where χ² falls: noise that is common to the readings dominates it, and the product
/// of that noise with a small effect has either sign.
const HELD_OUT_RISE: f64 = 0.01;

/// Standard deviations by which a size is above a limit in nine of ten measurements.
const NINE_OF_TEN: f64 = 1.3;
/// χ² that the evidence asks of an effect, about: by BIC and by chance, among a hundred candidates.
const EVIDENT: f64 = 20.0;
/// Share of the turns that are held out.
const HELD_OUT: f64 = 0.2;

/// Standard deviations of the noise of so many data from which an effect whose signature is that foreseen is named in nine of ten measurements: its evidence
/// is sufficient, and it lowers the χ² of held-out data by the share that is asked for. A signature depends on the part: of parts drawn at random, every
/// second one has it named.
pub(super) fn named_from(data: usize) -> f64 {
    let held_out = NINE_OF_TEN + NINE_OF_TEN.mul_add(NINE_OF_TEN, HELD_OUT_GAIN * data as f64).sqrt();
    (EVIDENT.sqrt() + NINE_OF_TEN).max(held_out / HELD_OUT.sqrt())
}

/// Variance of a residual's degree of freedom, by which covariances are scaled: noise that is known is at least that.
pub(super) fn unit(remainder: &Remainder) -> f64 {
    let unit = remainder.chi2_per_dof();
    if remainder.noise_is_known() { unit.max(1.0) } else { unit }
}

/// One fit for all equivalent ones: their mixture whose results are nearest to those of the declared model. Whichever of them
/// is true, the mixture is not farther from it than the declared model is, at any size of the effects ([`nearest`]).
pub(super) fn mixed<F: Fit>(best: Refit<F>, others: Vec<Refit<F>>, before: &F, fixed: usize) -> F {
    let widened = |refit: Refit<F>| {
        let Refit { settings, mut fit, covariance, .. } = refit;
        let unit = unit(fit.remainder());
        let effects: Vec<usize> = settings[fixed..].iter().map(|setting| setting.effect).collect();
        let scaled = |row: &Vec<f64>| row.iter().map(|entry| entry * unit).collect();
        fit.widen(&effects, &covariance.iter().map(scaled).collect::<Vec<Vec<f64>>>());
        fit
    };
    let mut mixture = widened(best);
    if others.is_empty() {
        return mixture;
    }
    let others: Vec<F> = others.into_iter().map(widened).collect();
    let results: Vec<Vec<f64>> = std::iter::once(&mixture).chain(&others).map(Fit::results).collect();
    mixture.mix(&nearest(&before.results(), &results), others);
    mixture
}

pub(super) fn is(refused: &Refused, effect: &Effect) -> bool {
    refused.effect == effect.id && refused.targets == effect.targets
}

/// Whether two mistakes are one finding (two signals are copies), of which the data do not decide the direction.
pub(super) fn same_finding<M: Model>(model: &M, one: usize, other: usize) -> bool {
    let [one, other] = [one, other].map(|effect| &model.effects()[effect]);
    let in_any_order = one.targets.iter().all(|target| other.targets.contains(target));
    one.id == other.id && one.targets.len() == 2 && other.targets.len() == 2 && in_any_order
}

/// χ² per degree of freedom above what noise leaves, up to which an effect is accepted though something stays unexplained.
pub(super) fn may_leave<M: Model>(model: &M, found: &FoundEffect) -> f64 {
    let unusual = model.size(found.members[0], &found.values).max(UNUSUAL) / UNUSUAL;
    (1.0 - OWN_SHARE) / (unusual * unusual) * excess(&found.before)
}

/// χ² per degree of freedom above what noise leaves.
pub(super) fn excess(remainder: &Remainder) -> f64 {
    (remainder.chi2_per_dof() - 1.0).max(0.0)
}

/// What chance may make of χ² per degree of freedom: its variance is 2/dof.
pub(super) fn chance(remainder: &Remainder) -> f64 {
    1.0 + 3.0 * (2.0 / remainder.dof.max(1) as f64).sqrt()
}

/// Whether noise may be all that is left in the end: by the tests of the residual where the domain has them, or else by its size.
pub(super) fn noise_only(remainder: &Remainder, consistency: &[Check]) -> bool {
    let tested = consistency.iter().any(|check| check.test == Test::Residual);
    (tested || at_the_floor(remainder)) && !consistency.iter().any(Check::bars_verdict)
}

/// Whether noise may be all that is left, while effects are looked for.
pub(super) fn at_the_floor(remainder: &Remainder) -> bool {
    !remainder.noise_is_known() || remainder.chi2_per_dof() <= FLOOR_CHI2.max(chance(remainder))
}

/// Whether more is left than chance makes of noise whose covariance is known well.
pub(super) fn above_chance(remainder: &Remainder) -> bool {
    remainder.noise_is_known() && remainder.chi2_per_dof() > chance(remainder)
}

/// Why an effect explains too little to be accepted, by the residual without and with it.
pub(super) fn too_little([before, after]: [&Remainder; 2], evidence: &Evidence) -> Option<String> {
    let lowered = before.chi2() - after.chi2();
    if evidence.p_value > P_LIMIT || evidence.delta_bic > BIC_LIMIT {
        Some(weak(evidence))
    } else if lowered <= before.disturbed_chi2 {
        Some(disturbed(lowered, before.disturbed_chi2))
    } else {
        None
    }
}

/// Evidence that is too weak, with the limit that it misses.
fn weak(evidence: &Evidence) -> String {
    let Evidence { p_value, delta_bic } = evidence;
    let [p_limit, bic_limit] = [
        if *p_value > P_LIMIT { format!(", above {P_LIMIT:e}") } else { String::new() },
        if *delta_bic > BIC_LIMIT { format!(", above {BIC_LIMIT}") } else { String::new() },
    ];
    format!("its evidence is weak: p {p_value:.2e}{p_limit}; ΔBIC {delta_bic:.1}{bic_limit}")
}

/// An effect that explains no more than known disturbances may.
fn disturbed(found: f64, expected: f64) -> String {
    format!(
        "lost orders carry as much into the data: it lowers χ² by {found:.1}, and {expected:.1} is expected from them"
    )
}

/// What becomes of the held-out error with an effect that does not improve it enough.
pub(super) fn no_gain(before: &Remainder, after: &Remainder) -> String {
    let known = before.noise_is_known() && worse(before.held_out_chi2, after.held_out_chi2);
    let of = |remainder: &Remainder| if known { remainder.held_out_chi2 } else { remainder.held_out_rms };
    let [from, to] = [before, after].map(of);
    // As many decimals as show a change by the limit.
    let decimals = (4.0 - from.abs().log10().floor()).clamp(0.0, 12.0) as usize;
    let (name, unit) =
        if known { ("χ² ", String::new()) } else { ("", format!(" {}", before.unit.replace("um", "µm"))) };
    let change = format!("{name}{from:.decimals$} → {to:.decimals$}{unit}");
    if of(after) < of(before) {
        let least = 100.0 * HELD_OUT_GAIN * if known { 1.0 } else { 0.5 };
        format!("it lowers the error of held-out data too little: {change}: less than {least} %")
    } else {
        format!("it does not lower the error of held-out data: {change}")
    }
}

/// Whether an effect does not lower the error of held-out data: their χ², or their rms, which no weight changes, beyond what
/// chance makes of it. Data that the rms does not count may show the effect besides: then χ² decides.
pub(super) fn raises_held_out(before: &Remainder, after: &Remainder, is_seen_besides: bool) -> bool {
    let rises = after.held_out_rms > before.held_out_rms * (1.0 + HELD_OUT_RISE) && !is_seen_besides;
    worse(before.held_out_chi2, after.held_out_chi2) || rises
}

pub(super) fn worse(before: f64, after: f64) -> bool {
    before.is_finite() && after.is_finite() && after > before * (1.0 - HELD_OUT_GAIN)
}

/// Cosine of the angle between what two models take away from a residual.
pub(super) fn overlap(before: &[f64], after: [&Vec<f64>; 2]) -> f64 {
    let taken = after.map(|after| before.iter().zip(after).map(|(before, after)| before - after).collect::<Vec<f64>>());
    let [one, other] = &taken;
    dot(one, other) / (norm(one) * norm(other)).max(f64::MIN_POSITIVE)
}

/// Two effects that explain as much of the same thing take away vectors that point one way at least so far.
pub(super) const OVERLAP: f64 = 0.7;

/// A candidate that differs by less than this from what is applied already, relative, is another description of it.
const DIFFERENT: f64 = 0.02;

/// The columns of a candidate beside those applied; none where it is another description of them.
pub(super) fn independent(columns: Vec<Vec<f64>>, basis: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let whole: f64 = columns.iter().map(|column| dot(column, column)).sum();
    let outside =
        |column: &Vec<f64>| dot(column, column) - basis.iter().map(|base| dot(base, column).powi(2)).sum::<f64>();
    if columns.iter().map(outside).sum::<f64>() < DIFFERENT * DIFFERENT * whole {
        return Vec::new();
    }
    orthonormal(columns, basis, INDEPENDENT)
}
