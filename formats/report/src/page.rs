//! The page as a whole: its head with the content security policy, and its sections in their order.

use base64::{Engine, prelude::BASE64_STANDARD};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use runout_core::{Error, Result, answer::Answer, rig::Rig, stage::Completed, table::panels::Panels};
use sha2::{Digest, Sha256};

use crate::{
    closed_loop, consistency,
    data::{self, Data, FigureData},
    facts, first, limits, origin, overview, rig,
    values::Columns,
};

/// Charts: see `assets/plotly/README.md`.
const CHARTS: &str = include_str!("../assets/plotly/plotly.min.js");
const CANVAS: &str = include_str!("../assets/canvas.js");
const PROGRAM: &str = concat!(include_str!("../assets/print.js"), include_str!("../assets/report.js"));
const DRAWING: &str = concat!(
    include_str!("../assets/draw.js"),
    include_str!("../assets/polar.js"),
    include_str!("../assets/vectors.js")
);
const STYLE: &str = include_str!("../assets/report.css");

/// The page of a result.
///
/// # Errors
/// Never in practice: its data can be written as JSON.
pub(crate) fn page(title: &str, figures: &[Panels], result: &Completed) -> Result<Markup> {
    let Completed { summary, about, surface, diagnosis, overview, .. } = *result;
    let title = if title.is_empty() { "Result" } else { title };
    let values = Columns::of(summary);
    let drawn = data::figures(figures);
    let surface_data = surface.map(data::surface);
    let declared = || rig::declared(&summary.provenance.configuration);
    let rig = overview.and_then(|overview| overview.rig.clone()).or_else(declared);
    let answer = overview.is_none().then(|| Answer::of(summary, diagnosis));
    let (verdict, class) = match (&answer, overview) {
        (Some(answer), _) => (answer.verdict.sentence.as_str(), first::class(answer.verdict.judgement)),
        (None, overview) => (overview.map_or("", |overview| overview.headline.as_str()), "plain"),
    };
    // The first figure is the one to look at first; the others follow below.
    let lead = usize::from(answer.is_some() && !drawn.is_empty());
    let body = html! {
        header {
            @if let Some(logo) = summary.head.logo.as_ref().filter(|logo| logo.starts_with("data:image/")) {
                img.logo src=(logo) alt="Logo";
            }
            h1 { bdi { (title) } }
            @let head = summary.head.entries();
            @if !head.is_empty() {
                dl.facts.head { @for (name, text) in &head { div { dt { bdi { (name) } } dd { bdi { (text) } } } } }
            }
            @if !verdict.is_empty() { p.verdict.(class) role="status" { bdi { (verdict) } } }
        }
        @if let Some(answer) = &answer { (first::screen(answer, summary, drawn.first().map(|figure| chart(0, figure)))) }
        @if let Some(rig) = rig.as_ref().filter(|_| overview.is_some()) { (rig_section(rig)) }
        @if drawn.len() > lead {
            section #figures {
                h2 { "Figures" }
                div.charts { @for (index, figure) in drawn.iter().enumerate().skip(lead) { (chart(index, figure)) } }
            }
        }
        @if let Some(map) = &surface_data {
            section #surface {
                h2 { "Surface" }
                @if let Some(note) = &map.note { p.note { (note) } }
                div.map data-map="surface" {}
            }
        }
        @if !summary.limits.is_empty() { (limits::section(&summary.limits)) }
        @if let Some(diagnosis) = diagnosis { (closed_loop::section(diagnosis)) }
        @if let Some(overview) = overview { (overview::sections(overview)) }
        @if values.count() > 0 { (table(values.count())) }
        (consistency::section(summary))
        (origin::turns(summary))
        (origin::notes(summary))
        @if overview.is_none() {
            @if let Some(facts) = facts::list(summary, rig.as_ref(), surface) {
                section #facts { h2 { "Part and measurement" } (facts) }
            }
            @if let Some(rig) = &rig { (rig_section(rig)) }
        }
        (origin::provenance(summary, about))
    };
    let data = Data { figures: drawn, surface: surface_data, values: &values };
    let json = serde_json::to_string(&data).map_err(|error| Error::caused("write", "the report's data", error))?;
    Ok(document(title, &body, &json))
}

fn rig_section(rig: &Rig) -> Markup {
    html! { section #rig { h2 { "Rig" } (rig::drawing(rig)) } }
}

fn chart(index: usize, figure: &FigureData) -> Markup {
    html! {
        figure.chart data-figure=(index) {
            figcaption { h3 { (figure.title) } }
            div.drawn {}
            @if let Some(note) = figure.note() { p.note { (note) } }
        }
    }
}

/// The frame of the values; the page's program fills in the rows.
fn table(count: usize) -> Markup {
    html! {
        section #values {
            h2 { "Values" }
            p.controls {
                label { "Filter " input #filter type="search" placeholder="RONt section a"; }
                button #copy type="button" { "Copy as CSV" }
                button #all type="button" hidden { "Show all" }
                span #shown role="status" { (count) " values" }
            }
            div.scroll tabindex="0" role="region" aria-label="Values" {
                table #rows {
                    thead {
                        tr {
                            th scope="col" { button type="button" data-key="place" { "where" } }
                            th scope="col" { button type="button" data-key="symbol" { "symbol" } }
                            th.number.several scope="col" { "lowest" }
                            th.number scope="col" { button type="button" data-key="value" { "value ± std" span.several { ", median" } } }
                            th.number.several scope="col" { "highest" }
                            th scope="col" { button type="button" data-key="unit" { "unit" } }
                            th.number scope="col" { "95 % interval" }
                            th scope="col" { button type="button" data-key="kind" { "of" } }
                            th scope="col" { button type="button" data-key="refers" { "reference, filter" } }
                            th scope="col" { "note" }
                        }
                    }
                    tbody {}
                }
            }
            p.note.hint { "A row of several stations or sections opens by a click." }
            p #left.note.paper {}
            p #standards.note.paper {}
            ol #footnotes.note {}
        }
    }
}

/// A whole document of a body and the data that its program draws.
fn document(title: &str, body: &Markup, json: &str) -> Markup {
    // Nothing in a text ends the element that the data are in.
    let json = json.replace('<', "\\u003c");
    let hashes: Vec<String> = [CANVAS, CHARTS, DRAWING, PROGRAM].map(hash).into();
    // The chart library sets styles of its elements: styles alone cannot fetch anything here.
    let policy = format!(
        "default-src 'none'; script-src {}; style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'",
        hashes.join(" ")
    );
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(policy);
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta name="generator" content="runout";
                link rel="icon" href="data:,";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                main { (body) }
                noscript { p { "Figures and the table of values need JavaScript." } }
                script #data type="application/json" { (PreEscaped(json)) }
                script { (PreEscaped(CANVAS)) }
                script { (PreEscaped(CHARTS)) }
                script { (PreEscaped(DRAWING)) }
                script { (PreEscaped(PROGRAM)) }
            }
        }
    }
}

/// A script's hash as a content security policy names it.
fn hash(script: &str) -> String {
    format!("'sha256-{}'", BASE64_STANDARD.encode(Sha256::digest(script.as_bytes())))
}
