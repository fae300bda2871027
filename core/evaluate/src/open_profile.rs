//! Straightness and texture of an open profile.

use super::{
    Evaluate, Found, Group, Label,
    texture::{found, sensitivity},
};
use crate::Value;
use crate::evaluable::OpenProfile;
use runout_draws::seed;
use runout_numerics::stretches::covered;
use runout_standards::{
    drawn::{Drawn, Sensitivity, share_in_words},
    roundness::Reference,
    straightness::Straightness,
    texture::{self, Kind, Settings},
};

/// Points that all draws look at together, about: a long profile has fewer draws.
const POINTS_DRAWN: usize = 2_000_000;
/// Pairs of draws: a profile is drawn from one seed, so that the standard deviation of few draws would be off alike in all recordings.
const PAIRS: std::ops::RangeInclusive<usize> = 16..=128;
/// Points that a profile needs for texture.
const FEWEST: usize = 7;
/// Place of Rq in [`texture::PARAMETERS`], and of STRq among the values of straightness.
const RQ: usize = 1;
const STRQ: usize = 3;

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
    let look = |deviation_um: &[f64]| {
        let found = Straightness::of(&profile.z_mm, deviation_um);
        vec![found.strt_lsli_um, found.strp_um, found.strv_um, found.strq_um, found.strt_mzli_um]
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
    let measured = look(&profile.deviation_um);
    let drawn = drawn(profile, "straightness", look);
    let mut values = Vec::new();
    for (index, ((reference, label), value)) in all.into_iter().zip(measured).enumerate() {
        let sensitivity = if index == STRQ { Sensitivity::Mean } else { Sensitivity::Extreme };
        if references.contains(&reference) {
            let found = with_reason(&drawn, index, value, Ok(sensitivity));
            values.extend(labelled(label, found, "none", profile));
        }
    }
    values
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
    let look = |deviation_um: &[f64]| texture::along(&profile.z_mm, deviation_um, &settings).values().to_vec();
    let drawn = drawn(profile, kind.material_ratio_symbol(), look).map(|drawn| drawn.behind_filter(RQ));
    let mut values = Vec::new();
    for (index, value) in look(&profile.deviation_um).into_iter().enumerate() {
        let (symbol, unit, clause) = kind.parameters()[index];
        let label = Label::new(symbol, unit, format!("ISO 21920-2:2021, {clause}"), "mean line");
        let found = with_reason(&drawn, index, value, sensitivity(index));
        values.extend(labelled(label, found, &filter.name, profile));
    }
    values
}

/// Draws about a profile; or why there are none.
fn drawn(profile: &OpenProfile, what: &str, look: impl Fn(&[f64]) -> Vec<f64>) -> Result<Drawn, String> {
    let errors = profile.errors.as_ref().map_err(Clone::clone)?;
    let points = profile.deviation_um.len();
    let pairs = (POINTS_DRAWN / (2 * points).max(1)).clamp(*PAIRS.start(), *PAIRS.end());
    let drawn = errors.drawn(&profile.deviation_um, pairs, seed(&[what, &profile.of]), look);
    drawn.ok_or_else(|| "its errors are not known at every position".to_owned())
}

fn with_reason(
    drawn: &Result<Drawn, String>,
    index: usize,
    value: f64,
    sensitivity: Result<Sensitivity, &str>,
) -> Found {
    let reason = match (drawn, sensitivity) {
        (Ok(drawn), Ok(sensitivity)) if drawn.share() > largest_share(sensitivity) => {
            share_in_words(drawn.share()) + "; of an open profile no interval has 95 % coverage then"
        }
        (Ok(drawn), sensitivity) => {
            let found = found(Some(drawn), index, value, sensitivity);
            return if sensitivity == Ok(Sensitivity::Extreme) { with_uncertain_shift(found) } else { found };
        }
        (Err(reason), _) => reason.clone(),
    };
    Found { no_uncertainty: Some(reason), ..Found::of(value, None) }
}

/// An extreme with what is not known of the shift that errors give it: short waves of a line that noise hides decide which point is
/// the extreme, so that the shift is known no better than to its own size. A shift above the standard uncertainty leaves no interval.
fn with_uncertain_shift(mut found: Found) -> Found {
    let Some(known) = &mut found.uncertainty else { return found };
    let [low, high] = known.interval_95;
    let middle = 0.5 * (low + high);
    let shift = found.value - middle;
    if shift.abs() > known.std {
        let share = shift.abs() / known.std;
        found.uncertainty = None;
        found.no_uncertainty = Some(format!(
            "errors shift it by {share:.1} standard uncertainties; of an open profile no interval has 95 % coverage then"
        ));
        return found;
    }
    let std = known.std.hypot(shift);
    if std > 0.0 {
        let half = 0.5 * (high - low) * std / known.std;
        known.interval_95 = [(middle - half).max(0.0), middle + half];
        known.std = std;
    }
    found
}

/// Share of the errors in the variance of an open profile above which a value has no interval: a line has fewer places than a turn, which
/// show less of what is noise. By simulation, `intervals_of_straightness_by_noise` and `intervals_of_open_texture_by_noise`.
fn largest_share(sensitivity: Sensitivity) -> f64 {
    match sensitivity {
        Sensitivity::Mean => 0.05,
        Sensitivity::Extreme => 0.0005,
    }
}

/// A number under its label; nothing where the profile does not have that value. A line has no undulations per revolution.
fn labelled(label: Label, found: Found, filter: &str, profile: &OpenProfile) -> Option<Value> {
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
