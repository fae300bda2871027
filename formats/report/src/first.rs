//! The first screen: verdict, key values, the figure that matters, warnings.

use maud::{Markup, html};
use runout_core::{
    answer::{Answer, Judgement, KeyValue, Number},
    numerics::number::{ranges, significant, with_std},
    summary::{LimitSummary, Summary},
};

use crate::{limits, symbol};

/// Warnings that are shown unfolded.
const SHOWN: usize = 4;

/// The class of a judgement in the style sheet.
pub(crate) fn class(judgement: Judgement) -> &'static str {
    match judgement {
        Judgement::Good => "good",
        Judgement::Open => "open",
        Judgement::Bad => "bad",
    }
}

/// Key values, the loop and the limits; beside them `figure`, the one to look at first.
pub(crate) fn screen(answer: &Answer, summary: &Summary, figure: Option<Markup>) -> Markup {
    let (contradictions, more) = answer.named_contradictions();
    html! {
        div.first {
            div {
                @for reason in contradictions { p.doubt { "! " bdi { (reason) } } }
                @if more > 0 { p.doubt { "! " (more) " more: see the consistency of the data" } }
                @if !answer.steps.is_empty() {
                    section.steps aria-label="Closed loop" { @for step in &answer.steps { p { bdi { (step) } } } }
                }
                @if !answer.key_values.is_empty() { (key_values(&answer.key_values)) }
                @if !summary.limits.is_empty() { (limit_bars(&summary.limits)) }
                (warnings(answer, summary))
            }
            @if let Some(figure) = figure { (figure) }
        }
    }
}

fn key_values(values: &[KeyValue]) -> Markup {
    let several = values.iter().any(|value| value.numbers.len() > 1);
    let has_before = values.iter().any(|value| value.before.is_some());
    html! {
        section #key {
            h2 { "Key values" }
            div.scroll tabindex="0" role="region" aria-label="Key values" {
                table.key {
                    thead {
                        tr {
                            th { "value" } th { "unit" }
                            @if has_before { th.number { "before" } }
                            @if several { th.number { "lowest" } th.number { "median" } th.number { "highest" } }
                            @else { th.number { "value ± std" } }
                        }
                    }
                    tbody {
                        @for value in values {
                            tr {
                                td {
                                    strong { bdi { (value.symbol) } }
                                    @if !value.basis.is_empty() { " " small { (value.basis) } }
                                    @if !value.of.is_empty() { ", " bdi { (value.of) } }
                                    @if !value.lost_orders.is_empty() { br; small { "without orders " (ranges(&value.lost_orders)) } }
                                }
                                td { (symbol(&value.unit)) }
                                @if has_before { td.number { (value.before.map_or_else(String::new, |before| as_precise(before, value.numbers.first()))) } }
                                @if several && value.numbers.len() == 1 { td.number {} }
                                @for one in &value.numbers { td.number { (number(one, value.is_refuted)) } }
                                @if several && value.numbers.len() == 1 { td.number {} }
                            }
                        }
                    }
                }
            }
            @if values.iter().any(|value| value.is_refuted) {
                p.note { "! The data contradict the ±: no limit is proven by it." }
            }
            @if values.iter().flat_map(|value| &value.numbers).any(Number::is_outside) {
                p.note { "^ Outside its own 95 % interval: noise raises an extreme." }
            }
        }
    }
}

/// A number with its own standard uncertainty, and with its marks.
fn number(one: &Number, is_refuted: bool) -> Markup {
    let shown = one.std.map_or_else(|| significant(one.value, 4), |std| with_std(one.value, Some(std)));
    let (value, std) = shown.split_once(" ± ").map_or((shown.as_str(), None), |(value, std)| (value, Some(std)));
    html! {
        (value)
        @if let Some(std) = std { span.std { " ± " (std) } }
        @if one.is_outside() { " ^" }
        @if is_refuted { span.doubt { " !" } }
    }
}

fn as_precise(number: f64, beside: Option<&Number>) -> String {
    let Some(std) = beside.and_then(|beside| beside.std) else { return significant(number, 4) };
    let shown = with_std(number, Some(std));
    shown.split_once(" ± ").map_or_else(|| shown.clone(), |(number, _)| number.to_owned())
}

/// Each limit with the value nearest to breaking it.
fn limit_bars(limits: &[LimitSummary]) -> Markup {
    html! {
        section aria-label="Limits" {
            table.key {
                tbody { @for limit in limits { (limits::worst(limit)) } }
            }
        }
    }
}

fn warnings(answer: &Answer, summary: &Summary) -> Markup {
    let found: Vec<&String> = summary.findings().filter(|warning| !answer.says(warning)).collect();
    html! {
        @if !found.is_empty() {
            section #findings {
                h2 { "Warnings" }
                ul { @for warning in found.iter().take(SHOWN) { li.warning { bdi { (warning) } } } }
                @if found.len() > SHOWN {
                    details {
                        summary { (found.len() - SHOWN) " more warnings" }
                        ul { @for warning in &found[SHOWN..] { li.warning { bdi { (warning) } } } }
                    }
                }
            }
        }
    }
}
