//! Figures as a fragment of HTML: for notebooks and other pages.

use base64::{Engine, prelude::BASE64_STANDARD};
use maud::html;
use runout_core::{
    Result,
    table::{RecordBatch, TableSpec, panels::Panels},
};

use crate::draw;

/// The figures that tables declare, as one fragment of HTML.
///
/// Each figure with rows is a `<figure>` with one `<img>` whose source is an SVG in base64: no name in a table becomes part of the page,
/// and ids of several pictures do not collide. A figure has at most `panels` panels, spread evenly over all. A figure without rows is
/// left out; without any figure the fragment is empty.
///
/// # Errors
/// When a figure names a column that its table lacks.
pub fn fragment<'a>(
    tables: impl IntoIterator<Item = (&'a TableSpec, &'a [RecordBatch])>,
    panels: usize,
) -> Result<String> {
    let mut fragment = String::new();
    for (table, batches) in tables {
        for figure in &table.figures {
            let mut collected = Panels::new(table, figure, panels.max(1))?;
            batches.iter().for_each(|rows| collected.add(rows));
            let Some(scene) = draw::figure(&collected) else { continue };
            let source = format!("data:image/svg+xml;base64,{}", BASE64_STANDARD.encode(draw::svg(&scene)));
            let drawn = html! {
                figure { img src=(source) alt=(figure.title) style="max-width: 100%; background: #ffffff"; }
            };
            fragment.push_str(&drawn.into_string());
        }
    }
    Ok(fragment)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use runout_core::table::{ColumnSpec, Figure, Measure, counts, numbers, texts};

    use super::*;

    const HOSTILE: &str = "</text><script>alert(\"1\")</script>' & \u{5e9}";

    fn table() -> TableSpec {
        let columns = vec![
            ColumnSpec::name("station", "station"),
            ColumnSpec::count("order", "", "order"),
            ColumnSpec::number("form_um", "um", "form"),
        ];
        TableSpec::new("form", "form", columns)
            .figure(Figure::lines("form", HOSTILE, "order", [Measure::new("form_um")]).panels(["station"]))
    }

    #[test]
    fn names_are_no_elements_of_the_page_nor_of_the_picture() {
        let table = table();
        let rows = table.rows(vec![texts([HOSTILE; 3]), counts(0..3), numbers([0.0, 1.0, 0.5])]).unwrap();
        let fragment = fragment([(&table, &[rows][..])], 4).unwrap();
        assert_eq!(fragment.matches('<').count(), 3, "figure, img and the figure's end: {fragment}");
        let encoded = fragment.split_once("base64,").unwrap().1.split_once('"').unwrap().0;
        let svg = String::from_utf8(BASE64_STANDARD.decode(encoded).unwrap()).unwrap();
        assert!(svg.starts_with("<svg") && !svg.contains("<script"), "{svg}");
    }

    #[test]
    fn a_figure_without_rows_is_left_out() {
        let table = table();
        assert_eq!(fragment([(&table, &[][..])], 4).unwrap(), "");
    }

    #[test]
    fn a_figure_of_a_column_that_is_missing_is_an_error() {
        let mut table = table();
        table.columns.truncate(2);
        assert!(fragment([(&table, &[][..])], 4).unwrap_err().to_string().contains("has no column form_um"));
    }
}
