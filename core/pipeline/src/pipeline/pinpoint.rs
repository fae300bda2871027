//! The place of a mistake inside a table that was read without its places.
//!
//! What serde buffers before it knows what to make of it (an `enum` distinguished by a key) loses the places of its keys: an
//! error then points at the whole table. Its message still says which key or value it means.

use std::ops::Range;

use serde::de::Unexpected;
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

/// Where in `table` the key or the value stands that an error at `span` means; `None` where that is not certain.
pub(super) fn pinpoint(table: &DeTable, span: Option<&Range<usize>>, message: &str) -> Option<Range<usize>> {
    let mut within = Vec::new();
    match span {
        None => within.push(table),
        Some(span) => table.iter().for_each(|(_, value)| at(value, span, &mut within)),
    }
    let mut entries = Vec::new();
    for table in within {
        collect(table, 0, &mut entries);
    }
    if let Some(name) = quoted(message, "unknown field `") {
        return only(&entries, |entry| entry.key.as_ref().is_some_and(|(key, _)| *key == name))?
            .key
            .clone()
            .map(|(_, span)| span);
    }
    if let Some(name) = quoted(message, "unknown variant `") {
        return only(&entries, |entry| entry.value.as_str() == Some(name)).map(|entry| entry.span.clone());
    }
    let found = message.strip_prefix("invalid type: ").or_else(|| message.strip_prefix("invalid value: "))?;
    let found = found.rsplit_once(", expected ").map_or(found, |(found, _)| found);
    only(&entries, |entry| described(entry.value).is_some_and(|described| described == found))
        .map(|entry| entry.span.clone())
}

/// A key with its value, or an item of a list.
struct Entry<'a> {
    key: Option<(&'a str, Range<usize>)>,
    value: &'a DeValue<'a>,
    /// Tables around it.
    depth: usize,
    span: Range<usize>,
}

/// The one that is meant, where only one at its depth can be.
fn only<'a, 'e>(entries: &'e [Entry<'a>], meant: impl Fn(&Entry<'a>) -> bool) -> Option<&'e Entry<'a>> {
    let depth = entries.iter().filter(|entry| meant(entry)).map(|entry| entry.depth).min()?;
    let mut candidates = entries.iter().filter(|entry| entry.depth == depth && meant(entry));
    candidates.next().filter(|_| candidates.next().is_none())
}

/// The tables that stand at a place: all items of an array of tables, where an error has the array's place.
fn at<'a>(value: &'a Spanned<DeValue<'a>>, span: &Range<usize>, to: &mut Vec<&'a DeTable<'a>>) {
    let here = value.span() == *span;
    match value.get_ref() {
        DeValue::Table(table) if here => to.push(table),
        DeValue::Table(table) => table.iter().for_each(|(_, value)| at(value, span, to)),
        DeValue::Array(items) if here => to.extend(items.iter().filter_map(|item| item.get_ref().as_table())),
        DeValue::Array(items) => items.iter().for_each(|item| at(item, span, to)),
        _ => {}
    }
}

fn collect<'a>(table: &'a DeTable<'a>, depth: usize, to: &mut Vec<Entry<'a>>) {
    for (key, value) in table {
        // What has many lines is shown by its key.
        let span = if value.get_ref().is_table() || value.get_ref().is_array() { key.span() } else { value.span() };
        to.push(Entry { key: Some((key.get_ref(), key.span())), value: value.get_ref(), depth, span });
        inside(value.get_ref(), depth + 1, to);
    }
}

fn inside<'a>(value: &'a DeValue<'a>, depth: usize, to: &mut Vec<Entry<'a>>) {
    match value {
        DeValue::Table(table) => collect(table, depth, to),
        DeValue::Array(items) => {
            for item in items {
                to.push(Entry { key: None, value: item.get_ref(), depth, span: item.span() });
                inside(item.get_ref(), depth + 1, to);
            }
        }
        _ => {}
    }
}

fn quoted<'m>(message: &'m str, before: &str) -> Option<&'m str> {
    message.strip_prefix(before)?.split('`').next()
}

/// A value as serde's errors name it.
fn described(value: &DeValue) -> Option<String> {
    let described = match value {
        DeValue::String(text) => Unexpected::Str(text),
        DeValue::Integer(number) => Unexpected::Signed(i64::from_str_radix(number.as_str(), number.radix()).ok()?),
        DeValue::Float(number) => Unexpected::Float(number.as_str().parse().ok()?),
        DeValue::Boolean(flag) => Unexpected::Bool(*flag),
        DeValue::Array(_) => Unexpected::Seq,
        DeValue::Table(_) | DeValue::Datetime(_) => Unexpected::Map,
    };
    Some(described.to_string())
}
