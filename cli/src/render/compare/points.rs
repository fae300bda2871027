//! Several separators on the same measured points, for people.

use runout_core::pipeline::compare::{Comparison, ValueComparison};

use super::{super::number::with_std, Page, Table, normalised, significant};

/// Adds what was compared.
pub(crate) fn page(mut page: Page, comparison: &Comparison) -> Page {
    let names: Vec<&str> = comparison.methods.iter().map(|method| method.method.as_str()).collect();
    page.line(format_args!("{}, compared with {}", names[1..].join(", "), comparison.reference));
    page.headed_table("Values (± is the standard uncertainty)", &values(comparison, &names));
    let differences = differences(comparison);
    if !differences.is_empty() {
        page.headed_table(format_args!("Differences from {}", comparison.reference), &differences);
        if comparison.values.iter().flat_map(|value| &value.differences).any(|one| one.e_n.is_some()) {
            page.line("  E_n = |difference| / (2 √(u² + u²)), with both standard uncertainties u as of independent results: the methods");
            page.line(
                "  share readings, so that scatter alone keeps it below 1; more is an error of one of the two models",
            );
        }
    }
    let columns = columns(comparison);
    if !columns.is_empty() {
        page.headed_table(format_args!("Tables, row by row: differences from {}", comparison.reference), &columns);
    }
    let refused: Vec<String> =
        comparison.refused.iter().map(|refusal| format!("{}: {}", refusal.method, refusal.reason)).collect();
    page.bullets("Refused", &refused);
    page.warnings("Warnings and notes", &super::notes(comparison));
    page
}

fn name(value: &ValueComparison) -> String {
    let of = value.of.as_ref().map(|of| format!(" {of}")).unwrap_or_default();
    let unit = value.unit.replace("um", "µm").replace("urad", "µrad").replace("deg", "°");
    let unit = if unit.is_empty() { unit } else { format!(", {unit}") };
    let referred = [&value.reference, &value.filter].into_iter().flatten().map(String::as_str);
    let referred = referred.filter(|name| *name != "none").fold(String::new(), |all, name| all + ", " + name);
    format!("{}{of}{referred}{unit}", value.symbol)
}

/// Values that more than one method gives.
fn values(comparison: &Comparison, names: &[&str]) -> Table {
    let mut table = Table::new(1, std::iter::once("").chain(names.iter().copied()));
    for value in comparison.values.iter().filter(|value| value.values.len() > 1) {
        let by = |method: &&str| {
            let found = value.values.iter().find(|one| one.method == *method);
            found.map_or_else(String::new, |one| {
                one.value.map_or_else(|| "lost".to_owned(), |number| with_std(number, one.std))
            })
        };
        table.row(std::iter::once(name(value)).chain(names.iter().map(by)));
    }
    table
}

fn differences(comparison: &Comparison) -> Table {
    let mut table = Table::new(2, ["", "method", "difference", "E_n", "std over that of the reference"]);
    for value in &comparison.values {
        let mut label = name(value);
        for one in &value.differences {
            table.row([
                std::mem::take(&mut label),
                one.method.clone(),
                significant(one.difference, 3),
                one.e_n.map_or_else(String::new, normalised),
                one.std_ratio.map_or_else(String::new, |ratio| significant(ratio, 3)),
            ]);
        }
    }
    table
}

fn columns(comparison: &Comparison) -> Table {
    let header =
        ["table", "column", "method", "rows", "rms", "largest", "E_n ≤ 1", "worst E_n", "std over reference's"];
    let mut table = Table::new(3, header);
    for column in &comparison.columns {
        for one in &column.differences {
            table.row([
                column.table.clone(),
                column.column.clone(),
                one.method.clone(),
                one.rows.to_string(),
                significant(one.rms, 3),
                significant(one.largest, 3),
                one.share_within.map_or_else(String::new, |share| format!("{:.0} %", 100.0 * share)),
                one.worst_e_n.map_or_else(String::new, normalised),
                one.std_ratio.map_or_else(String::new, |ratio| significant(ratio, 3)),
            ]);
        }
    }
    table
}
