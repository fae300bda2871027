//! Text and tables of what is no single result: a comparison, a plan, a batch.

use maud::{Markup, html};
use runout_core::stage::{Overview, Part, Section};

/// Every section under its heading.
pub(crate) fn sections(overview: &Overview) -> Markup {
    html! { @for section in &overview.sections { (part_of(section)) } }
}

fn part_of(section: &Section) -> Markup {
    html! {
        section {
            h2 { bdi { (section.heading) } }
            @for part in &section.parts { (content(part, &section.heading)) }
        }
    }
}

fn content(part: &Part, heading: &str) -> Markup {
    match part {
        Part::Lines(lines) => html! { p.lines { @for line in lines { bdi { (line) } "\n" } } },
        Part::List(lines) => html! { ul { @for line in lines { li { bdi { (line) } } } } },
        Part::Table { words, header, rows } => html! {
            div.scroll tabindex="0" role="region" aria-label=(heading) {
                table {
                    thead {
                        tr { @for (column, name) in header.iter().enumerate() { th.number[column >= *words] { (name) } } }
                    }
                    tbody {
                        @for row in rows {
                            tr { @for (column, text) in row.iter().enumerate() { td.number[column >= *words] { bdi { (text) } } } }
                        }
                    }
                }
            }
        },
    }
}
