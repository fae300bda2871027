//! A plan, for people.

use super::{
    check, foresight,
    number::{same, significant, spread},
    page::Page,
    table::Table,
};
use crate::reports::plan::{Arrangement, Gain, Optimised, Report, Score, Suggested};

/// Lines of ten gains that a terminal shows before it takes orders together.
const LINES: usize = 20;

/// The text of a report.
#[must_use]
pub(crate) fn text(report: &Report) -> String {
    let mut page = page(report);
    if let Some(map) = &report.map {
        page.heading(format_args!("written: {}", map.display()));
    }
    page.into_text().trim_start().to_owned()
}

/// A report as lines and tables.
#[must_use]
pub(crate) fn page(report: &Report) -> Page {
    let mut page = Page::default();
    check::rig(&mut page, &report.rig);
    check::orders(&mut page, &report.separability);
    check::lost_orders(&mut page, &report.separability);
    check::noise_gain(&mut page, &report.separability);
    gains(&mut page, &report.noise_gain.form);
    suggestions(&mut page, &report.suggestions);
    foresight::visible(&mut page, &report.foresight);
    foresight::hidden(&mut page, &report.foresight);
    additions(&mut page, report);
    if let Some(optimised) = &report.optimised {
        angles(&mut page, optimised);
    }
    page.bullets("Notes", &report.notes);
    page
}

fn gains(page: &mut Page, gains: &[Gain]) {
    let heading = "Noise gain of form by order, the worst section";
    let observable: Vec<f64> = gains.iter().filter_map(|gain| gain.gain).collect();
    if let Some([lowest, _, highest]) = spread(observable.iter().copied())
        && observable.len() == gains.len()
        && same(lowest, highest)
    {
        page.heading(heading);
        page.line(format_args!("  {} at every order", significant(highest, 3)));
        return;
    }
    if observable.is_empty() {
        return;
    }
    let together = gains.len().div_ceil(10 * LINES).max(1);
    let mut header = vec!["order".to_owned()];
    header.extend((0..10).map(|column| format!("+{}", column * together)));
    let mut table = Table::new(0, header);
    for line in gains.chunks(10 * together) {
        let first = line.first().map(|gain| gain.order.to_string());
        let worst = |some: &[Gain]| match some.iter().try_fold(0.0, |worst: f64, gain| Some(worst.max(gain.gain?))) {
            Some(worst) => significant(worst, 3),
            None => "lost".into(),
        };
        table.row(first.into_iter().chain(line.chunks(together).map(worst)));
    }
    let each = if together > 1 { format!(" (the worst of {together} orders each)") } else { String::new() };
    page.headed_table(format_args!("{heading}{each}"), &table);
}

fn suggestions(page: &mut Page, suggestions: &[Suggested]) {
    let mut table = Table::new(1, ["", "lost form orders", "worst noise gain", "at order", "rms"]);
    if let Some(first) = suggestions.first() {
        table.row([vec!["as it is".into()], score(&first.before)].concat());
    }
    for suggestion in suggestions {
        table.row([vec![suggestion.text.clone()], score(&suggestion.after)].concat());
    }
    page.headed_table("What one addition does for form, best first", &table);
}

/// What would show more of the effects.
fn additions(page: &mut Page, report: &Report) {
    let mut lines = Vec::new();
    for suggestion in &report.suggestions {
        let mut does = Vec::new();
        if !suggestion.reveals.is_empty() {
            does.push(format!("shows {}", foresight::names(&suggestion.reveals)));
        }
        if !suggestion.distinguishes.is_empty() {
            does.push(format!("distinguishes {}", sets(&suggestion.distinguishes)));
        }
        if !does.is_empty() {
            lines.push(format!("{}: {}", suggestion.text, does.join("; ")));
        }
    }
    let left = &report.unresolved;
    if !left.blind_to.is_empty() {
        lines.push(format!("no single addition that was tried shows {}", foresight::names(&left.blind_to)));
    }
    if !left.confounded.is_empty() {
        lines.push(format!("no single addition that was tried distinguishes {}", sets(&left.confounded)));
    }
    page.bullets("What one addition does for the effects", &lines);
}

fn sets(sets: &[Vec<String>]) -> String {
    sets.iter().map(|set| foresight::names(set)).collect::<Vec<_>>().join("; ")
}

fn angles(page: &mut Page, optimised: &Optimised) {
    let tolerant = optimised.angle_tolerance_deg > 0.0;
    let tolerance =
        if tolerant { format!(", every sensor within ±{}°", optimised.angle_tolerance_deg) } else { String::new() };
    let ids = optimised.sensors.join(", ");
    let nominal = if tolerant { "as drawn" } else { "" };
    let mut table =
        Table::new(2, ["", &format!("{ids} (°)"), "lost form orders", "worst noise gain", "at order", "rms", nominal]);
    let mut row = |name: String, arrangement: &Arrangement| {
        let angles: Vec<String> = arrangement.angles_deg.iter().map(f64::to_string).collect();
        let wanted = if optimised.criterion == "rms" { arrangement.nominal.rms } else { arrangement.nominal.worst };
        let drawn = if tolerant { value(wanted) } else { String::new() };
        table.row([vec![name, angles.join(", ")], score(&arrangement.within_tolerance), vec![drawn]].concat());
    };
    let declared = if optimised.declared_keeps_clearance { "declared" } else { "declared, too near" };
    row(declared.into(), &optimised.declared);
    for (place, found) in (1..).zip(&optimised.found) {
        row(if place == 1 { "best found".into() } else { format!("alternative {}", place - 1) }, found);
    }
    page.headed_table(
        format_args!(
            "Angles with the lowest {} noise gain of form, {}° or more apart in a section{tolerance}",
            optimised.criterion, optimised.clearance_deg
        ),
        &table,
    );
    if optimised.found.is_empty() {
        page.line("  no angles were found that are better than the declared ones");
    }
}

/// Cells: lost orders, worst, at order, rms.
fn score(score: &Score) -> Vec<String> {
    let constant = score.worst.zip(score.rms).is_some_and(|(worst, rms)| same(worst, rms));
    let order =
        if constant { "all".into() } else { score.worst_order.map(|order| order.to_string()).unwrap_or_default() };
    vec![score.lost_form_orders.to_string(), value(score.worst), order, value(score.rms)]
}

fn value(gain: Option<f64>) -> String {
    gain.map_or_else(|| "-".into(), |gain| significant(gain, 3))
}
