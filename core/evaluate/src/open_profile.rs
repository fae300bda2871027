//! Straightness and texture of an open profile.

use super::{Evaluate, Group, Label, NumberFound, texture::no_interval};
use crate::Value;
use crate::evaluable::OpenProfile;
use runout_draws::{OpenErrors, seed};
use runout_numerics::stretches::covered;
use runout_standards::{
    roundness::Reference,
    straightness::Straightness,
    texture::{self, Kind, Settings},
};

/// Points that a profile needs for texture.
const FEWEST: usize = 7;
/// Places of Rq, and of Rsk and Rku, in [`texture::PARAMETERS`].
const RQ: usize = 1;
const SHAPE: [usize; 2] = [2, 3];
/// Share of the errors in the square of Rq up to which intervals of Rsk and Rku of a line cover the true value; at 3 %, 90 %
/// (`intervals_of_open_texture_by_noise`, a step beside weak waves).
const SHAPE_SHOWN: f64 = 0.01;
/// Why there is none beyond.
const HIDDEN: &str = "errors are more than 1 % of the square of Rq: they hide how the weak waves of a line lie to each other, on which it depends";

/// Its values, and what they are not.
pub(super) fn values(profile: &OpenProfile, evaluate: &Evaluate) -> (Vec<Value>, Vec<String>) {
    let (mut values, mut remarks) = (Vec::new(), Vec::new());
    if evaluate.has(Group::Straightness) {
        values.extend(straightness(profile, &evaluate.references));
    }
    if evaluate.has(Group::Texture) {
        let kinds: Vec<Kind> = evaluate
            .texture
            .profiles
            .iter()
            .copied()
            .filter(|kind| *kind == Kind::P || evaluate.lambda_c_mm.is_some())
            .collect();
        let points = profile.deviation_um.iter().filter(|value| value.is_finite()).count();
        if points >= FEWEST {
            for kind in kinds {
                values.extend(texture(profile, kind, evaluate));
                let settings = settings(profile, kind, evaluate);
                let said = texture::over_gaps(&profile.z_mm, &profile.deviation_um, &settings);
                remarks.extend(said.map(|said| format!("{} profile of {}: {said}", kind.letter(), profile.of)));
            }
        } else if !kinds.is_empty() {
            remarks.push(format!("texture needs {FEWEST} points or more, found {points}"));
        }
    }
    (values, remarks)
}

/// STRt about the lines that are asked for; STRp, STRv and STRq about LSLI.
fn straightness(profile: &OpenProfile, references: &[Reference]) -> Vec<Value> {
    let look = |deviation_um: &[f64], values: &mut Vec<f64>| {
        let found = Straightness::of(&profile.z_mm, deviation_um);
        values.extend([found.strt_lsli_um, found.strp_um, found.strv_um, found.strq_um, found.strt_mzli_um]);
    };
    let label = |symbol: &'static str, what: &str, line: &str| {
        Label::new(symbol, "µm", format!("ISO 12780-1:2011, {what} straightness deviation"), line)
    };
    let all = [
        (Reference::LeastSquares, label("STRt", "peak-to-valley", "LSLI")),
        (Reference::LeastSquares, label("STRp", "peak-to-reference", "LSLI")),
        (Reference::LeastSquares, label("STRv", "reference-to-valley", "LSLI")),
        (Reference::LeastSquares, label("STRq", "root mean square", "LSLI")),
        (Reference::MinimumZone, label("STRt", "peak-to-valley", "MZLI")),
    ];
    let errors = profile.errors.as_ref().map_err(String::as_str);
    let found = found(&profile.deviation_um, errors, seed(&["straightness", &profile.of]), look);
    let asked = all.into_iter().zip(found).filter(|((reference, _), _)| references.contains(reference));
    asked.filter_map(|((_, label), found)| labelled(label, found, "none", profile)).collect()
}

fn length_mm(profile: &OpenProfile) -> f64 {
    let ends = [profile.z_mm.first(), profile.z_mm.last()].map(|z| z.copied().unwrap_or(0.0));
    ends[1] - ends[0]
}

fn settings(profile: &OpenProfile, kind: Kind, evaluate: &Evaluate) -> Settings {
    Settings {
        lambda_s_mm: evaluate.lambda_s_mm,
        lambda_c_mm: evaluate.lambda_c_mm,
        lambda_f_mm: evaluate.texture.lambda_f_mm,
        ..evaluate.profile_settings(kind, length_mm(profile))
    }
}

/// ISO 21920-2's values of one profile.
fn texture(profile: &OpenProfile, kind: Kind, evaluate: &Evaluate) -> Vec<Value> {
    // Around a part a filter has orders, which a line has not: its name alone is of use.
    let turn_mm = length_mm(profile);
    let Some(filter) = evaluate.profile_filter(kind, turn_mm / std::f64::consts::TAU) else { return Vec::new() };
    let settings = settings(profile, kind, evaluate);
    let seed = seed(&[kind.material_ratio_symbol(), &profile.of]);
    let errors = profile.errors.as_ref().map_err(String::as_str);
    let found = texture_along(&profile.z_mm, &profile.deviation_um, errors, seed, &settings);
    let labels = kind
        .parameters()
        .iter()
        .map(|(symbol, unit, clause)| Label::new(symbol, unit, format!("ISO 21920-2:2021, {clause}"), "mean line"));
    labels.zip(found).filter_map(|(label, found)| labelled(label, found, &filter.name, profile)).collect()
}

/// Values of texture along a line, in the order of [`texture::PARAMETERS`].
pub(super) fn texture_along(
    z_mm: &[f64],
    profile_um: &[f64],
    errors: Result<&OpenErrors, &str>,
    seed: u64,
    settings: &Settings,
) -> Vec<NumberFound> {
    let look = |profile_um: &[f64], values: &mut Vec<f64>| {
        values.extend(texture::along(z_mm, profile_um, settings).values());
    };
    let mut found = found(profile_um, errors, seed, look);
    if let Ok(errors) = errors {
        let hides_shape = errors.mean_square_um2() > SHAPE_SHOWN * found[RQ].value.powi(2);
        for (index, found) in found.iter_mut().enumerate() {
            let reason = if SHAPE.contains(&index) && hides_shape { Some(HIDDEN) } else { no_interval(index) };
            if let Some(reason) = reason {
                *found = found.clone().without_uncertainty(reason);
            }
        }
    }
    found
}

/// Values of a profile, each with what is known of its error, or why nothing is.
fn found(
    profile_um: &[f64],
    errors: Result<&OpenErrors, &str>,
    seed: u64,
    look: impl Fn(&[f64], &mut Vec<f64>),
) -> Vec<NumberFound> {
    let mut measured = Vec::new();
    look(profile_um, &mut measured);
    let known = errors
        .and_then(|errors| errors.values(profile_um, seed, &look).ok_or("its errors are not known at every position"));
    let of = |(index, value): (usize, f64)| match &known {
        Ok(known) => NumberFound::of(value, known.get(index)).or_because(NOT_IN_ALL),
        Err(reason) => NumberFound::of(value, None).without_uncertainty(reason),
    };
    measured.into_iter().enumerate().map(of).collect()
}

/// Why a value has no uncertainty though the errors are known.
const NOT_IN_ALL: &str = "not every profile within the errors has this value";

/// A number under its label; nothing where the profile does not have that value. A line has no undulations per revolution.
fn labelled(label: Label, found: NumberFound, filter: &str, profile: &OpenProfile) -> Option<Value> {
    let there = profile.z_mm.iter().zip(&profile.deviation_um).filter(|(_, value)| value.is_finite());
    let there: Vec<f64> = there.map(|(z_mm, _)| *z_mm).collect();
    let share = there.len() as f64 / profile.deviation_um.len().max(1) as f64;
    found.value.is_finite().then(|| Value {
        filter: Some(filter.to_owned()),
        coverage: share.min(covered(&there)),
        uncertainty: found.uncertainty,
        no_uncertainty: found.no_uncertainty,
        ..label.of(found.value)
    })
}
