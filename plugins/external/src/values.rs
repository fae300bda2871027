//! The table `values` of an answer, and which values are declared before a run.

use std::sync::{Mutex, PoisonError};

use runout_core::{
    fault::{Fault, known_names},
    summary::Value,
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{answer::Answer, tables::Table};

/// Name of the table.
pub(crate) const VALUES: &str = "values";
const COLUMNS: [&str; 6] = ["symbol", "of", "value", "std", "unit", "about"];

/// A value that may come.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Symbol {
    /// Its short name, as `[[limit]]` names it.
    pub symbol: String,
    /// Its unit; empty for a number without one.
    #[serde(default)]
    pub unit: String,
}

/// Symbols and units that last as long as the process.
pub(crate) type Symbols = Vec<(&'static str, &'static str)>;

/// Checks symbols.
///
/// # Errors
/// When one is empty or there twice.
pub(crate) fn declared(symbols: &[Symbol]) -> Result<Symbols, Fault> {
    for (index, one) in symbols.iter().enumerate() {
        if one.symbol.is_empty() || symbols[..index].iter().any(|other| other.symbol == one.symbol) {
            let problem = format!("symbols must differ and not be empty, found `{}`", one.symbol);
            return Err(Fault::at("symbols", problem));
        }
    }
    Ok(symbols.iter().map(|one| (lasting(&one.symbol), lasting(&one.unit))).collect())
}

/// The values of an answer; where some are declared, no others.
///
/// # Errors
/// What is wrong with them, in words that go on from "the program".
pub(crate) fn values(answer: &Answer, declared: &[(&'static str, &'static str)]) -> Result<Vec<Value>, String> {
    let table = Table::decode(answer.table(VALUES).ok_or("gave no table `values`")?, &COLUMNS)?;
    let [symbol, of] = ["symbol", "of"].map(|name| table.texts(name));
    let symbol = table.needed("symbol", symbol)?;
    let value = table.needed("value", table.numbers("value"))?;
    let unit = table.needed("unit", table.texts("unit"))?;
    let (of, std, about) = (of?, table.numbers("std")?, table.texts("about")?);
    let mut values: Vec<Value> = Vec::new();
    for row in 0..table.count() {
        let text = |column: &Option<Vec<Option<String>>>| column.as_ref().and_then(|column| column[row].clone());
        let Some(symbol) = symbol[row].as_deref().filter(|symbol| !symbol.is_empty()) else {
            return Err(format!("gave row {} of `values` without a symbol", row + 1));
        };
        let unit = unit[row].as_deref().unwrap_or("");
        match declared.iter().find(|(known, _)| *known == symbol) {
            Some((_, known)) if *known != unit => {
                return Err(format!("gave {symbol} in `{unit}`: `symbols` declares `{known}`"));
            }
            None if !declared.is_empty() => {
                let known = known_names(symbol, declared.iter().map(|(symbol, _)| *symbol));
                return Err(format!("gave {symbol}, which `symbols` does not declare: {known}"));
            }
            _ => {}
        }
        let std = std.as_ref().and_then(|std| std[row]);
        if std.is_some_and(|std| std < 0.0) {
            return Err(format!("gave {symbol} with a `std` below 0"));
        }
        let [number, deviation] = [value[row], std].map(|number| number.unwrap_or(f64::NAN));
        let about = text(&about).unwrap_or_else(|| "by an external plugin".into());
        let mut found = Value::new(symbol, number, deviation, unit, &about);
        found.of = text(&of);
        if values.iter().any(|known| known.symbol == found.symbol && known.of == found.of) {
            return Err(format!("gave {symbol} {} twice", found.of.unwrap_or_default()));
        }
        if std.is_none() {
            found.no_uncertainty = Some("the plugin gives no `std`".into());
        }
        values.push(found);
    }
    Ok(values)
}

/// A text that lasts as long as the process, as names of plugins, columns and symbols do; kept once, however often it is asked for.
#[must_use]
pub fn lasting(text: &str) -> &'static str {
    static KNOWN: Mutex<Vec<&'static str>> = Mutex::new(Vec::new());
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(text) = known.iter().find(|known| **known == text) {
        return text;
    }
    let text: &'static str = Box::leak(text.into());
    known.push(text);
    text
}
