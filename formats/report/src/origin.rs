//! Where the numbers came from: turns that were left out, warnings, provenance.

use maud::{Markup, html};
use runout_core::{stage::About, summary::Summary};

/// Turns that were left out, one row a capture.
pub(crate) fn turns(summary: &Summary) -> Markup {
    let captures =
        || summary.stations.iter().flat_map(|station| station.captures.iter().map(move |one| (station, one)));
    let rejected: usize = captures().map(|(_, capture)| capture.rejected.len()).sum();
    let touched = || captures().filter(|(_, capture)| !capture.rejected.is_empty());
    html! {
        @if captures().next().is_some() {
            section #turns {
                h2 { "Turns" }
                @if rejected == 0 { p { "No turn was rejected." } }
                @else {
                    details {
                        summary { (rejected) " rejected turns, each with its reason" }
                        div.scroll tabindex="0" role="region" aria-label="Rejected turns" {
                            table {
                                thead { tr { th { "station" } th { "setup" } th.number { "used" } th.number { "recorded" } th { "rejected" } } }
                                tbody {
                                    @for (station, capture) in touched() {
                                        tr {
                                            td { bdi { (station.station) } }
                                            td { bdi { (capture.setup) } }
                                            td.number { (capture.turns_used) }
                                            td.number { (capture.turns_recorded) }
                                            td { @for turn in &capture.rejected { div { "turn " (turn.turn) ": " bdi { (turn.reason) } } } }
                                        }
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Notes: what the layout cannot separate, what the result is made of. The warnings are on the first screen.
pub(crate) fn notes(summary: &Summary) -> Markup {
    html! {
        @if !summary.notes.is_empty() {
            section #notes {
                h2 { "Notes" }
                ul {
                    @for note in &summary.notes { li { bdi { (note) } } }
                }
            }
        }
    }
}

/// Inputs with checksums, configuration, version.
pub(crate) fn provenance(summary: &Summary, about: &About) -> Markup {
    let provenance = &summary.provenance;
    html! {
        section #provenance {
            details {
                summary { h2 { "Provenance" } }
                dl.facts {
                    div { dt { "Program" } dd { (provenance.program) } }
                    @if !about.convention.is_empty() { div { dt { "Signs and references" } dd { (about.convention) } } }
                }
                @if !provenance.inputs.is_empty() {
                    div.scroll tabindex="0" role="region" aria-label="Inputs" {
                        table {
                            thead { tr { th { "input" } th.number { "bytes" } th { "BLAKE3" } } }
                            tbody {
                                @for input in &provenance.inputs {
                                    tr { td { bdi { (input.path) } } td.number { (input.bytes) } td { code { (input.blake3) } } }
                                }
                            }
                        }
                    }
                }
                h3 { "Configuration" }
                pre tabindex="0" { (provenance.configuration) }
            }
        }
    }
}
