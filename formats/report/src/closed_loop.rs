//! The closed loop: residual before and after, effect by effect, what moved, and what to change in the rig.

use maud::{Markup, html};
use runout_core::{
    closed_loop::diagnosis::{Added, Diagnosis, Estimated, Level, Moved, Unexplained},
    numerics::number::{significant, with_std},
};

use crate::symbol;

/// Values that moved and are listed.
const MOST_MOVED: usize = 40;

/// The section of a diagnosis.
pub(crate) fn section(diagnosis: &Diagnosis) -> Markup {
    let unit = symbol(diagnosis.before.unit.as_deref().unwrap_or("um"));
    html! {
        section #closed-loop {
            h2 { "Closed loop" }
            @if diagnosis.after.degrees_of_freedom > 0 && !diagnosis.nothing_separated { (steps(diagnosis, &unit)) }
            @if !diagnosis.added.is_empty() { (added(&diagnosis.added)) }
            @let changes: Vec<&str> = diagnosis.added.iter().filter_map(|one| one.change.as_deref()).collect();
            @if !changes.is_empty() {
                h3 { "What to change in the rig" }
                pre tabindex="0" { (changes.join("\n")) }
            }
            @if !diagnosis.moved.is_empty() { (moved(&diagnosis.moved)) }
            @if !diagnosis.unexplained.is_empty() { (unexplained(&diagnosis.unexplained, &unit)) }
            @if !diagnosis.refused.is_empty() {
                details {
                    summary { "Effects that looked likely and were refused" }
                    ul {
                        @for one in &diagnosis.refused {
                            li { (one.effect) " " bdi { (one.targets.join(", ")) } ": " (one.reason) }
                        }
                    }
                }
            }
            @if !diagnosis.blind_to.is_empty() && !diagnosis.nothing_separated {
                details {
                    summary { "Effects that these data cannot show" }
                    ul {
                        @for one in &diagnosis.blind_to {
                            li {
                                (one.effect) " " bdi { (one.targets.join(", ")) } ": moves " (one.bias_per_unit.on) " by "
                                (significant(one.bias_per_unit.value, 2)) " " (symbol(&one.bias_per_unit.unit)) " rms"
                            }
                        }
                    }
                }
            }
        }
    }
}

/// The residual, step by step, as bars of one scale.
fn steps(diagnosis: &Diagnosis, unit: &str) -> Markup {
    let mut rows = vec![("as declared".to_owned(), Some(diagnosis.before.residual_rms_um), "before")];
    rows.extend(
        diagnosis.added.iter().map(|one| (format!("with {}", one.members()), one.residual_rms_um.after, "after")),
    );
    if let Some(floor) = diagnosis.after.noise_floor_um {
        rows.push(("expected from noise".into(), Some(floor), "floor"));
    }
    let largest = rows.iter().filter_map(|(_, value, _)| *value).fold(0.0, f64::max);
    let share = |value: Option<f64>| if largest > 0.0 { value.unwrap_or(0.0) / largest } else { 0.0 };
    let of = |value: fn(&Level) -> Option<f64>| [value(&diagnosis.before), value(&diagnosis.after)];
    let truth = diagnosis.truth.as_ref().map(|truth| truth.form_rms_error_um);
    let levels = [
        ("residual of the fit, rms", of(|level| Some(level.residual_rms_um)), unit),
        ("χ² per degree of freedom", of(|level| level.chi2_per_dof), ""),
        ("residual on held-out data, rms", of(|level| level.held_out_rms_um), unit),
        ("expected from noise, rms", of(|level| level.held_out_expected_rms_um), unit),
        ("true error of form, rms", truth.map_or([None; 2], |step| [step.before, step.after]), "µm"),
    ];
    html! {
        h3 { "Residual of the fit, effect by effect" }
        table.steps {
            thead { tr { th { "model" } th.number { "rms / " (unit) } th { "" } } }
            tbody {
                @for (name, value, class) in &rows {
                    tr {
                        td { bdi { (name) } }
                        td.number { (shown(*value)) }
                        td {
                            svg.bar viewBox="0 0 220 14" preserveAspectRatio="none" aria-hidden="true" {
                                rect.(class) x="0" y="2" width=(format!("{:.1}", (220.0 * share(*value)).max(1.0))) height="10" {}
                            }
                        }
                    }
                }
            }
        }
        h3 { "Before and after" }
        table {
            thead { tr { th { "" } th.number { "as declared" } th.number { "final model" } } }
            tbody {
                @for (name, [before, after], unit) in levels {
                    @if before.is_some() || after.is_some() {
                        tr { td { (name) @if !unit.is_empty() { " / " (unit) } } td.number { (shown(before)) } td.number { (shown(after)) } }
                    }
                }
            }
        }
    }
}

fn shown(value: Option<f64>) -> String {
    value.map_or_else(|| "unknown".into(), |value| significant(value, 3))
}

fn added(added: &[Added]) -> Markup {
    html! {
        h3 { "What the declared model lacks" }
        div.scroll tabindex="0" role="region" aria-label="Effects that were added" {
            table {
                thead {
                    tr { th { "effect" } th { "parameter ± std" } th.number { "held-out rms, before → after" } th.number { "ΔBIC" } }
                }
                tbody {
                    @for one in added {
                        tr {
                            td {
                                bdi { (one.members()) }
                                @if let Some(by) = &one.distinguished_by { br; small { "to decide: " (by) } }
                            }
                            td { @for one in &one.parameters { div { (parameter(one)) } } }
                            td.number { (shown(one.held_out_rms_um.before)) " → " (shown(one.held_out_rms_um.after)) }
                            td.number { (significant(one.delta_bic, 3)) }
                        }
                    }
                }
            }
        }
    }
}

fn parameter(one: &Estimated) -> String {
    let value = one.std.map_or_else(|| significant(one.value, 3), |std| with_std(one.value, Some(std)));
    format!("{} {value} {}", one.name, symbol(&one.unit)).trim_end().to_owned()
}

fn moved(moved: &[Moved]) -> Markup {
    html! {
        h3 { "What moved" }
        div.scroll tabindex="0" role="region" aria-label="Values before and after" {
            table {
                thead { tr { th { "value" } th { "section" } th.number { "as declared" } th.number { "final ± std" } th { "unit" } } }
                tbody {
                    @for one in moved.iter().take(MOST_MOVED) {
                        tr {
                            td {
                                bdi { (one.value) }
                                @if let (Some(reference), Some(filter)) = (&one.reference, &one.filter) { " " small { (reference) ", " (filter) } }
                            }
                            td { bdi { (one.section.as_deref().unwrap_or_default()) } }
                            td.number { (as_precise(one.before, one.std)) }
                            td.number { (with_std(one.after, one.std)) }
                            td { (symbol(&one.unit)) }
                        }
                    }
                }
            }
        }
        @if moved.len() > MOST_MOVED { p.note { (moved.len() - MOST_MOVED) " more values are in diagnosis.json." } }
    }
}

/// A number with the digits that the standard uncertainty of its neighbour gives a meaning to.
fn as_precise(number: f64, std: Option<f64>) -> String {
    let shown = with_std(number, std);
    shown.split_once(" ± ").map_or_else(|| shown.clone(), |(number, _)| number.to_owned())
}

fn unexplained(all: &[Unexplained], unit: &str) -> Markup {
    html! {
        h3 { "Residual that no known effect explains" }
        table {
            thead { tr { th { "sensor" } th { "setup" } th { "orders" } th { "where" } th.number { "rms / " (unit) } } }
            tbody {
                @for one in all {
                    tr {
                        td { bdi { (one.sensor.as_deref().unwrap_or("several")) } }
                        td { bdi { (one.setup.as_deref().unwrap_or("several")) } }
                        td { @if one.orders != [0, 0] { (one.orders[0]) @if one.orders[0] != one.orders[1] { " to " (one.orders[1]) } } }
                        td { (one.place) }
                        td.number { @if one.rms_um > 0.0 { (significant(one.rms_um, 3)) } }
                    }
                }
            }
        }
    }
}
