//! Values of measured points.

use runout_core::summary::Value;

use super::{described, label, mark, unit};
use crate::render::{
    answer::OUTSIDE,
    number::{significant, with_std},
    page::Page,
    table::Table,
};

/// Digits of a value without a standard uncertainty.
const DIGITS: usize = 4;

/// Values that are columns, at most; more are rows.
const MOST_COLUMNS: usize = 8;

/// Values that several things have (a part and a slide) side by side, then the others, one below the other.
pub(super) fn section(page: &mut Page, values: &[Value]) {
    let mut things: Vec<&str> = Vec::new();
    for thing in values.iter().filter_map(|value| value.of.as_deref()) {
        if !things.contains(&thing) {
            things.push(thing);
        }
    }
    // Values of one quantity are side by side: symbol, reference and filter.
    let same = |one: &Value, other: &Value| {
        (&one.symbol, &one.reference, &one.filter) == (&other.symbol, &other.reference, &other.filter)
    };
    let shared = |value: &&Value| value.of.is_some() && values.iter().filter(|other| same(other, value)).count() > 1;
    let mut symbols: Vec<&Value> = Vec::new();
    for value in values.iter().filter(shared) {
        if symbols.iter().all(|known| !same(known, value)) {
            symbols.push(value);
        }
    }
    let of = |thing: &str, like: &Value| {
        let found = values.iter().find(|value| value.of.as_deref() == Some(thing) && same(value, like));
        found.map_or_else(String::new, number)
    };
    if symbols.len() > MOST_COLUMNS {
        let mut table = Table::new(1, std::iter::once("").chain(things.iter().copied()));
        for value in symbols {
            table.row(std::iter::once(label(value)).chain(things.iter().map(|thing| of(thing, value))));
        }
        page.headed_table("Values", &table);
    } else if !symbols.is_empty() {
        let header = symbols.iter().map(|value| label(value));
        let mut table = Table::new(1, std::iter::once(String::new()).chain(header));
        for thing in things {
            table.row(std::iter::once(thing.to_owned()).chain(symbols.iter().map(|value| of(thing, value))));
        }
        page.headed_table("Values", &table);
    }
    let others = || values.iter().filter(|value| !shared(value));
    // What all values are referred to and filtered by is said once.
    let standard: Vec<&Value> = others().filter(|value| value.reference.is_some()).collect();
    let alike = |one: &Value, other: &Value| (&one.reference, &one.filter) == (&other.reference, &other.filter);
    let common = standard.first().filter(|first| standard.len() > 1 && standard.iter().all(|one| alike(one, first)));
    let mut table = Table::new(2, ["value", "of", "number ± std", "unit"]);
    for value in others() {
        let of = value.of.clone().unwrap_or_default();
        let name = if common.is_some() { value.symbol.clone() } else { described(&value.id()) };
        table.row([name, of, number(value), unit(&value.unit)]);
    }
    let about = common.map_or_else(String::new, |first| format!(": {}", basis(first)));
    page.headed_table(format_args!("Values of the whole{about}"), &table);
    page.detail("what the values are", |page| definitions(page, values));
}

/// What each symbol is, with standard and clause: each text once, behind all symbols that it is of.
fn definitions(page: &mut Page, values: &[Value]) {
    let mut said: Vec<(&str, Vec<&str>)> = Vec::new();
    for value in values {
        match said.iter_mut().find(|(about, _)| *about == value.source) {
            Some((_, symbols)) if symbols.contains(&&*value.symbol) => {}
            Some((_, symbols)) => symbols.push(&value.symbol),
            None => said.push((&value.source, vec![&value.symbol])),
        }
    }
    let lines: Vec<String> =
        said.into_iter().map(|(about, symbols)| format!("{}: {about}", symbols.join(", "))).collect();
    page.bullets("What the values are", &lines);
}

/// "LSLI, unfiltered": what a standard's value was referred to, and its filter.
fn basis(value: &Value) -> String {
    let name = described(&value.id());
    name.strip_prefix(&value.symbol).unwrap_or_default().trim_start_matches([',', ' ']).to_owned()
}

fn number(value: &Value) -> String {
    let number = match (value.number(), value.std()) {
        (Some(value), Some(std)) => with_std(value, Some(std)),
        (Some(value), None) => significant(value, DIGITS),
        (None, _) => "not known".into(),
    };
    let is_outside = value.interval_95().is_some_and(|[low, high]| !(low..=high).contains(&value.value));
    number + if is_outside { OUTSIDE } else { "" } + mark(value.refuted_by.as_ref())
}
