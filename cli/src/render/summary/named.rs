//! Values of measured points.

use runout_core::stage::NamedValue;

use super::unit;
use crate::render::{
    number::{significant, with_std},
    page::Page,
    table::Table,
};

/// Digits of a value without a standard uncertainty.
const DIGITS: usize = 4;

/// Values that several things have (a part and a slide) side by side, then the others, one below the other.
pub(super) fn section(page: &mut Page, values: &[NamedValue]) {
    let mut things: Vec<&str> = values.iter().filter_map(|value| value.of.as_deref()).collect();
    things.dedup();
    let shared = |value: &&NamedValue| {
        value.of.is_some() && values.iter().filter(|other| other.symbol == value.symbol).count() > 1
    };
    let mut symbols: Vec<&NamedValue> = Vec::new();
    for value in values.iter().filter(shared) {
        if symbols.iter().all(|known| known.symbol != value.symbol) {
            symbols.push(value);
        }
    }
    if !symbols.is_empty() {
        let header = symbols.iter().map(|value| format!("{} {}", value.symbol, unit(&value.unit)));
        let mut table = Table::new(1, std::iter::once(String::new()).chain(header));
        for thing in things {
            let of = |symbol: &str| {
                let found = values.iter().find(|value| value.of.as_deref() == Some(thing) && value.symbol == symbol);
                found.map_or_else(String::new, number)
            };
            table.row(std::iter::once(thing.to_owned()).chain(symbols.iter().map(|value| of(&value.symbol))));
        }
        page.headed_table("Values", &table);
        for value in symbols {
            page.line(format_args!("  {}: {}", value.symbol, value.about));
        }
    }
    let mut table = Table::new(2, ["value", "of", "number ± std", "unit", "what it is"]);
    for value in values.iter().filter(|value| !shared(value)) {
        let of = value.of.clone().unwrap_or_default();
        table.row([value.symbol.clone(), of, number(value), unit(&value.unit), value.about.clone()]);
    }
    page.headed_table("Values of the whole", &table);
}

fn number(value: &NamedValue) -> String {
    match (value.value, value.std) {
        (Some(value), Some(std)) => with_std(value, Some(std)),
        (Some(value), None) => significant(value, DIGITS),
        (None, _) => "not known".into(),
    }
}
