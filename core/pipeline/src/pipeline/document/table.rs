//! Tables that know their places: read into types, with faults that point into the text.

use runout_error::fault::{Fault, Place, Step, known_names};
use std::ops::Range;

use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use toml::{
    Spanned,
    de::{DeTable, DeValue, ValueDeserializer},
};

use super::meaning::of_missing;
use crate::pipeline::pinpoint::pinpoint;

/// A table whose every key and value knows its place.
pub type Table<'a> = Spanned<DeTable<'a>>;

/// Reads a table into a type; unknown keys and wrong types come back as faults with their place.
///
/// # Errors
/// When the table does not fit the type.
pub fn read<T: DeserializeOwned + JsonSchema>(table: &Table) -> Result<T, Fault> {
    read_besides(table, &[])
}

/// Reads a table into a type. The keys `besides` were in the table too: a misspelt key may have been meant for one of them.
///
/// # Errors
/// When the table does not fit the type.
pub fn read_besides<T: DeserializeOwned + JsonSchema>(table: &Table, besides: &[&str]) -> Result<T, Fault> {
    deserialized(table).map_err(|error| {
        let span = error.span().filter(|span| *span != table.span());
        let exact = pinpoint(table.get_ref(), span.as_ref(), error.message());
        let fault = explain(exact.or(span).unwrap_or_else(|| head(table.span())), error.message(), besides);
        let missing = error.message().strip_prefix("missing field `").and_then(|rest| rest.strip_suffix('`'));
        match missing.and_then(of_missing::<T>) {
            Some(meaning) => fault.help(meaning),
            None => fault,
        }
    })
}

fn deserialized<T: DeserializeOwned>(table: &Table) -> Result<T, toml::de::Error> {
    let value = Spanned::new(table.span(), DeValue::Table(table.get_ref().clone()));
    T::deserialize(ValueDeserializer::from(value))
}

/// Reads a table and checks it, with the places of the check's faults resolved.
///
/// # Errors
/// The first mistake.
pub fn checked<C: DeserializeOwned + JsonSchema, T>(
    table: &Table,
    check: impl FnOnce(C) -> Result<T, Fault>,
) -> Result<T, Fault> {
    check(read(table)?).map_err(|fault| resolve(fault, table))
}

/// A top-level table, where there is one.
///
/// # Errors
/// When the key holds something else.
pub fn table<'a>(root: &Table<'a>, key: &str) -> Result<Option<Table<'a>>, Fault> {
    match root.get_ref().get_key_value(key) {
        None => Ok(None),
        Some((name, value)) => match value.get_ref() {
            // The key is the better place to point at: the table's own span may be all its lines.
            DeValue::Table(table) => Ok(Some(Spanned::new(name.span(), table.clone()))),
            other => Err(Fault::span(value.span(), format!("expected a table `{key}`, found {}", other.type_str()))),
        },
    }
}

/// A top-level table that has to be there.
///
/// # Errors
/// When it is not.
pub(in crate::pipeline) fn required<'a>(root: &Table<'a>, key: &str) -> Result<Table<'a>, Fault> {
    table(root, key)?
        .ok_or_else(|| resolve(Fault::here(format!("missing key `{key}`")).help(format!("add a table [{key}]")), root))
}

/// Top-level tables of one name, in their order; none where there is none.
///
/// # Errors
/// When the key holds something else.
pub(in crate::pipeline) fn tables<'a>(root: &Table<'a>, key: &str) -> Result<Vec<Table<'a>>, Fault> {
    let Some(value) = root.get_ref().get(key) else { return Ok(Vec::new()) };
    let expected = |span, found: &str| Fault::span(span, format!("expected tables [[{key}]], found {found}"));
    match value.get_ref() {
        DeValue::Array(items) => items
            .iter()
            .map(|item| match item.get_ref() {
                DeValue::Table(table) => Ok(Spanned::new(item.span(), table.clone())),
                other => Err(expected(item.span(), other.type_str())),
            })
            .collect(),
        other => Err(expected(value.span(), other.type_str())),
    }
}

/// A table as a TOML text of its own.
///
/// # Errors
/// When a value cannot be written.
pub fn table_text(table: &Table) -> Result<String, Fault> {
    let table: toml::Table = deserialized(table).map_err(|error| Fault::here(error.to_string()))?;
    toml::to_string(&table).map_err(|error| Fault::here(error.to_string()))
}

/// A table's own span may cover many lines; its beginning is where a reader looks.
fn head(span: Range<usize>) -> Range<usize> {
    span.start..span.end.min(span.start + 1)
}

/// Adds near names to serde's "unknown field `x`, expected one of `a`, `b`".
fn explain(span: Range<usize>, message: &str, besides: &[&str]) -> Fault {
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    let noun = match message {
        _ if message.starts_with("unknown field") => "key",
        _ if message.starts_with("unknown variant") => "value",
        _ => return Fault::span(span, plain(message)),
    };
    match quoted.split_first() {
        Some((name, known)) => {
            let besides = besides.iter().filter(|_| noun == "key");
            let known = known.iter().chain(besides).copied();
            Fault::span(span, format!("unknown {noun} `{name}`")).help(known_names(name, known))
        }
        None => Fault::span(span, message),
    }
}

/// Serde's words without Rust's types.
fn plain(message: &str) -> String {
    let mismatch = message.strip_prefix("invalid type: ").or_else(|| message.strip_prefix("invalid value: "));
    let Some((found, expected)) = mismatch.and_then(|rest| rest.rsplit_once(", expected ")) else {
        return message.replace("missing field", "missing key");
    };
    let expected = match expected {
        "usize" | "u8" | "u16" | "u32" | "u64" => "a whole number from 0",
        "isize" | "i8" | "i16" | "i32" | "i64" => "a whole number",
        "f32" | "f64" => "a number",
        "a string" | "path string" => "a string",
        "a boolean" => "true or false",
        "a sequence" => "a list",
        other if other.starts_with("struct ") => "a table",
        other => other,
    };
    format!("expected {expected}, found {found}")
}

/// Resolves a fault's path against the table that was checked, so that it can travel on by itself.
#[must_use]
pub fn resolve(fault: Fault, table: &Table) -> Fault {
    match &fault.place {
        Place::Span(_) => fault,
        Place::Path(path) => Fault { place: Place::Span(locate(table.get_ref(), table.span(), path)), ..fault },
    }
}

/// The place of a path below a table, or of the deepest part of it that there is.
fn locate(table: &DeTable, span: Range<usize>, path: &[Step]) -> Range<usize> {
    let Some((Step::Key(key), rest)) = path.split_first() else { return head(span) };
    let Some((name, value)) = table.get_key_value(key.as_str()) else { return head(span) };
    match value.get_ref() {
        DeValue::Table(_) | DeValue::Array(_) if rest.is_empty() => name.span(),
        _ => descend(value, rest),
    }
}

fn descend(value: &Spanned<DeValue>, path: &[Step]) -> Range<usize> {
    match (value.get_ref(), path.split_first()) {
        (DeValue::Table(inner), Some(_)) => locate(inner, value.span(), path),
        (DeValue::Array(items), Some((Step::Index(index), rest))) => {
            items.get(*index).map_or_else(|| value.span(), |item| descend(item, rest))
        }
        (DeValue::Table(_), None) => head(value.span()),
        _ => value.span(),
    }
}
