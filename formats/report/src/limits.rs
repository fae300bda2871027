//! Limits: each value with its 95 % interval beside the tolerance, decided by ISO 14253-1.

use maud::{Markup, html};
use runout_core::{
    answer::limit_text,
    numerics::number::significant,
    summary::{Decision, Limit, LimitSummary, LimitValue},
};

use crate::symbol;

/// Values of a limit that are shown unfolded.
const SHOWN: usize = 8;

/// One word for a decision, and its class in the style sheet.
pub(crate) fn word(decision: Decision) -> (&'static str, &'static str) {
    match decision {
        Decision::Conforms => ("kept", "good"),
        Decision::DoesNotConform => ("broken", "bad"),
        Decision::Undecided => ("undecided", "open"),
    }
}

/// The limits with what was found.
pub(crate) fn section(limits: &[LimitSummary]) -> Markup {
    html! {
        section #limits {
            h2 { "Limits" }
            @for limit in limits {
                @let (decision, class) = word(limit.decision);
                h3 { bdi { (limit_text(&limit.limit)) } " " span.badge.(class) { (decision) } }
                @let sorted = limit.by_risk();
                @if sorted.is_empty() { p { "No value has this name." } }
                @if !sorted.is_empty() { (table(&limit.limit, &sorted[..sorted.len().min(SHOWN)])) }
                @if sorted.len() > SHOWN {
                    details {
                        summary { (sorted.len() - SHOWN) " more values, farther from the limit" }
                        (table(&limit.limit, &sorted[SHOWN..]))
                    }
                }
            }
            p.note {
                "Kept: the whole 95 % interval keeps the limit. Broken: the whole interval lies beyond it. Undecided: neither is proven \
                 (ISO 14253-1)."
            }
        }
    }
}

/// A limit as a row: its name, the value nearest to breaking it, and the decision.
pub(crate) fn worst(limit: &LimitSummary) -> Markup {
    let (decision, class) = word(limit.decision);
    let deciding = limit.deciding();
    html! {
        tr {
            td {
                bdi { (limit_text(&limit.limit)) }
                @if let Some(order) = deciding.and_then(LimitValue::order) { ": order " (order) }
                @if let Some(missing) = deciding.and_then(|value| value.missing.as_ref()) { br; small { (missing) } }
            }
            td.number { @if let Some(value) = deciding { (digits(value.value, value)) } }
            td { @if let Some(value) = deciding.filter(|value| value.value.is_finite()) { (bar(&limit.limit, value, word(value.decision).1)) } }
            td { span.badge.(class) { (decision) } }
        }
    }
}

fn table(limit: &Limit, values: &[&LimitValue]) -> Markup {
    html! {
        div.scroll tabindex="0" role="region" aria-label=(format!("Values of {}", limit.name())) {
            table.limits {
                thead {
                    tr {
                        th { "where" } th { @if limit.orders.is_some() { "order, " } "reference, filter" } th.number { "value / " (symbol(&limit.unit)) }
                        th.number { "95 % interval" } th { "beside the tolerance" } th { "" }
                    }
                }
                tbody {
                    @for value in values {
                        @let (decision, class) = word(value.decision);
                        tr {
                            td { bdi { (value.place()) } }
                            td { (value.by()) }
                            td.number { (digits(value.value, value)) }
                            td.number {
                                @if let Some([low, high]) = value.interval_95 { (digits(low, value)) " … " (digits(high, value)) }
                                @else { "unknown" }
                            }
                            td { @if value.value.is_finite() { (bar(limit, value, class)) } }
                            td {
                                span.badge.(class) { (decision) }
                                @if let Some(missing) = &value.missing { br; small { (missing) } }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// A number with the digits that the interval gives a meaning to.
fn digits(number: f64, value: &LimitValue) -> String {
    match value.interval_95 {
        Some([low, high]) if high > low => {
            let decimals = (1.0 - (0.25 * (high - low)).log10().floor()).clamp(0.0, 9.0) as usize;
            format!("{number:.decimals$}")
        }
        _ => significant(number, 5),
    }
}

/// The tolerance as a band, the interval as a bar, the value as a line.
fn bar(limit: &Limit, value: &LimitValue, class: &str) -> Markup {
    const WIDTH: f64 = 220.0;
    let [low, high] = value.interval_95.unwrap_or([value.value; 2]);
    let ends = value.ends(limit);
    let lower = ends[0].unwrap_or_else(|| low.min(0.0).min(ends[1].unwrap_or(0.0)));
    let upper = ends[1].unwrap_or_else(|| high.max(ends[0].unwrap_or(high)) * 1.2);
    let (from, to) = (lower.min(low), upper.max(high));
    let margin = 0.06 * (to - from).max(f64::MIN_POSITIVE);
    let (from, to) = (from - margin, to + margin);
    // A tenth of a pixel is enough.
    let x = |number: f64| ((10.0 * WIDTH * (number - from) / (to - from)).round() / 10.0).clamp(0.0, WIDTH);
    let width = |low: f64, high: f64, least: f64| format!("{:.1}", (x(high) - x(low)).max(least));
    html! {
        svg.bar viewBox="0 0 220 22" role="img" aria-label="value and 95 % interval beside the tolerance" {
            rect.tolerance x=(x(lower)) y="3" width=(width(lower, upper, 0.0)) height="16" {}
            @if ends[0].is_some() { line.end x1=(x(lower)) x2=(x(lower)) y1="1" y2="21" {} }
            @if ends[1].is_some() { line.end x1=(x(upper)) x2=(x(upper)) y1="1" y2="21" {} }
            rect.(class) x=(x(low)) y="8" width=(width(low, high, 2.0)) height="6" {}
            line.value x1=(x(value.value)) x2=(x(value.value)) y1="4" y2="18" {}
        }
    }
}
