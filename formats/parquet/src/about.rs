//! What a file says about itself: enough to know what its numbers are.

use runout_core::{provenance::Provenance, stage::Completed, table::TableSpec};
use serde_json::json;

/// Keys and values for a table's metadata; lists are JSON.
pub(crate) fn entries(table: &TableSpec, result: &Completed) -> Vec<(String, String)> {
    let summary = result.summary;
    let mut entries = of_program(&summary.title, &summary.provenance, &result.about.convention, &summary.warnings);
    entries.push(named("about", table.about.clone()));
    entries.push(named("effects", json!(summary.effects).to_string()));
    entries.extend(result.about.notes.iter().map(|(key, value)| named(key, value.clone())));
    entries
}

/// What a file of any result says.
pub(crate) fn of_program(
    title: &str,
    provenance: &Provenance,
    convention: &str,
    warnings: &[String],
) -> Vec<(String, String)> {
    vec![
        named("title", title.to_owned()),
        named("program", provenance.program.clone()),
        named("configuration", provenance.configuration.clone()),
        named("inputs", json!(provenance.inputs).to_string()),
        named("convention", convention.to_owned()),
        named("warnings", json!(warnings).to_string()),
    ]
}

fn named(key: &str, value: String) -> (String, String) {
    (format!("runout.{key}"), value)
}
