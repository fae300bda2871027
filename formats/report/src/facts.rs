//! What a result is, in few words: the verdict in one sentence, and facts of the part and the measurement.

use maud::{Markup, html};
use runout_core::{
    model::diagnosis::{Diagnosis, Verdict},
    rig::Rig,
    summary::{Decision, Summary},
    surface::Surface,
    table::number::{ranges, rounded_place, significant},
};

use crate::limits;

/// The verdict in one sentence, and its class in the style sheet.
pub(crate) fn verdict(summary: &Summary, diagnosis: Option<&Diagnosis>) -> (String, &'static str) {
    let found = diagnosis.map(|diagnosis| {
        let class = match diagnosis.verdict {
            // Effects between which the data do not decide leave the result open.
            Verdict::Explained if diagnosis.added.iter().any(|added| !added.confounded_with.is_empty()) => "open",
            Verdict::AtNoiseFloor | Verdict::Explained => "good",
            Verdict::Unexplained => "bad",
            Verdict::Improved | Verdict::NothingFound => "open",
        };
        (diagnosis.headline(), class)
    });
    let limits = limits_kept(summary);
    match (limits, found) {
        (Some((limits, class)), None) => (format!("{limits}."), class),
        (Some((limits, class)), Some((found, _))) => (format!("{limits}. {found}."), class),
        (None, Some((found, class))) => (format!("{found}."), class),
        (None, None) => without_limits(summary),
    }
}

/// What the residual and the warnings give, where nothing is to be decided.
fn without_limits(summary: &Summary) -> (String, &'static str) {
    let (refuted, values) = summary.refuted();
    if let Some((reason, _)) = refuted.first() {
        let count: usize = refuted.iter().map(|(_, count)| count).sum();
        return (format!("The data refute {count} of {values} values, marked by !: {reason}."), "bad");
    }
    let known = summary.stations.iter().filter(|station| station.chi2_per_dof.is_some()).count();
    let misfits = summary.misfits().count();
    let warnings = summary.findings().count();
    let warned = match warnings {
        0 => String::new(),
        1 => " One warning is below.".into(),
        count => format!(" {count} warnings are below."),
    };
    let (found, class) = match (misfits, known) {
        (0, 0) => (String::new(), "open"),
        (0, _) => (" The residual agrees with the measured noise.".into(), "open"),
        (count, all) => {
            let found = format!(
                " At {count} of {all} stations the residual is not what noise leaves; the declared rig may be wrong."
            );
            (found, "bad")
        }
    };
    (format!("No limit is set.{found}{warned}"), class)
}

fn limits_kept(summary: &Summary) -> Option<(String, &'static str)> {
    let named = |decision| -> Vec<String> {
        let limits = summary.limits.iter().filter(|limit| limit.decision == decision);
        limits.map(|limit| limits::shown(&limit.limit)).collect()
    };
    let (broken, undecided) = (named(Decision::DoesNotConform), named(Decision::Undecided));
    let all = summary.limits.len();
    match (broken.len(), undecided.len()) {
        _ if all == 0 => None,
        (0, 0) if all == 1 => Some(("The limit is kept".into(), "good")),
        (0, 0) => Some((format!("All {all} limits are kept"), "good")),
        (0, 1) if all == 1 => Some((format!("The limit is undecided: {}", undecided.join("; ")), "open")),
        (1, _) if all == 1 => Some((format!("The limit is broken: {}", broken.join("; ")), "bad")),
        (0, open) => Some((format!("{open} of {all} limits undecided: {}", undecided.join("; ")), "open")),
        (count, _) => Some((format!("{count} of {all} limits broken: {}", broken.join("; ")), "bad")),
    }
}

/// Facts of the part and the measurement.
pub(crate) fn list(summary: &Summary, rig: Option<&Rig>, surface: Option<&Surface>) -> Markup {
    let captures = || summary.stations.iter().flat_map(|station| &station.captures);
    let turns = [captures().map(|one| one.turns_used).sum::<usize>(), captures().map(|one| one.turns_recorded).sum()];
    let speeds: Vec<f64> = captures().filter_map(|capture| capture.speed_rpm).collect();
    let speed = (!speeds.is_empty()).then(|| speeds.iter().sum::<f64>() / speeds.len() as f64);
    let places =
        summary.stations.iter().flat_map(|station| &station.sections).map(|section| rounded_place(section.z_mm));
    let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)));
    let lost = &summary.lost_orders;
    let has_orders = rig.is_some() || !lost.form.is_empty() || !lost.motion.is_empty();
    html! {
        dl.facts {
            @if let Some(rig) = rig {
                (fact("Part radius", &format!("{} mm", rig.part_radius_mm)))
                (fact("Sensors, setups", &format!("{}, {}", rig.sensors.len(), rig.setups.len())))
            }
            @if !summary.stations.is_empty() {
                (fact(if rig.is_some() { "Stations" } else { "Sections" }, &summary.stations.len().to_string()))
            }
            @if high > low { (fact("Sections along z", &format!("{low} to {high} mm"))) }
            @if turns[1] > 0 { (fact("Turns used", &format!("{} of {}", turns[0], turns[1]))) }
            @if let Some(speed) = speed { (fact("Mean speed", &format!("{} rpm", significant(speed, 4)))) }
            @if let Some(surface) = surface {
                (fact("Surface", &format!("{} angles × {} rings", surface.angles, surface.z_mm.len())))
            }
            @if has_orders {
                (fact("Lost orders of form", &ranges(&lost.form)))
                (fact("Lost orders of motion", &ranges(&lost.motion)))
            }
            @for (quantity, orders) in &lost.others { (fact(&format!("Lost orders of {quantity}"), &ranges(orders))) }
        }
    }
}

fn fact(name: &str, value: &str) -> Markup {
    html! { div { dt { (name) } dd { bdi { (value) } } } }
}
