//! The few values that a result opens with.

use std::collections::BTreeSet;

use super::MOST_KEY_VALUES;
use crate::summary::{PlacedValue, Summary, Value};
use runout_closed_loop::diagnosis::Diagnosis;
use runout_evaluate::{ValueId, key_symbols};
use runout_numerics::number::in_small_unit;

/// Up to so many sections or parts have a row of their own; more are gathered into lowest, median and highest.
const MOST_PARTS: usize = 4;

/// A value that a result opens with; of several stations or parts lowest, median and highest.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct KeyValue {
    /// "RONt", "pretravel_mean".
    pub symbol: String,
    /// "LSCI, Gaussian 50 UPR"; without a filter's name it is unfiltered.
    pub basis: String,
    /// "section a", "8 sections"; empty of the whole.
    pub of: String,
    /// The unit that the numbers are in: nm where µm would be mostly zeros.
    pub unit: String,
    /// One number, or the lowest, the median and the highest of several. The median of an even count is the lower one of the two in the
    /// middle, so that its ± is its own.
    pub numbers: Vec<Number>,
    /// The number before the closed loop, where there is one number.
    pub before: Option<f64>,
    /// Whether the data refute one of the numbers that it is of.
    pub is_refuted: bool,
    /// Orders that it lacks.
    pub lost_orders: Vec<usize>,
    /// What it is, with standard and clause.
    pub about: String,
    /// Why no uncertainty is stated.
    pub no_uncertainty: Option<String>,
}

/// A number with what is known of it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Number {
    /// The number.
    pub value: f64,
    /// Its own standard uncertainty.
    pub std: Option<f64>,
    /// Where the truth lies with 95 % probability.
    pub interval_95: Option<[f64; 2]>,
}

impl KeyValue {
    /// "RONt LSCI, section a": symbol, basis and what it is of.
    #[must_use]
    pub fn name(&self) -> String {
        let symbol = [self.symbol.as_str(), &self.basis].into_iter().filter(|word| !word.is_empty());
        let symbol = symbol.collect::<Vec<_>>().join(" ");
        if self.of.is_empty() { symbol } else { format!("{symbol}, {}", self.of) }
    }
}

impl Number {
    /// Whether it lies outside its own interval, which noise does to extremes.
    #[must_use]
    pub fn is_outside(&self) -> bool {
        self.interval_95.is_some_and(|[low, high]| !(low..=high).contains(&self.value))
    }

    fn of(value: &Value) -> Self {
        Self { value: value.value, std: value.std(), interval_95: value.interval_95() }
    }

    fn scaled(self, factor: f64) -> Self {
        Self {
            value: factor * self.value,
            std: self.std.map(|std| factor * std),
            interval_95: self.interval_95.map(|ends| ends.map(|end| factor * end)),
        }
    }
}

/// The key values: those that the domain names, then the standards'.
pub(super) fn key_values(summary: &Summary, diagnosis: Option<&Diagnosis>) -> Vec<KeyValue> {
    let all: Vec<PlacedValue> = summary.all_values().into_iter().filter(|one| one.value.value.is_finite()).collect();
    let mut symbols: Vec<&str> = Vec::new();
    for value in summary.values.iter().filter(|value| value.is_key) {
        if !symbols.contains(&&*value.symbol) {
            symbols.push(&value.symbol);
        }
    }
    for symbol in key_symbols(&all.iter().map(|one| &*one.value.symbol).collect::<Vec<_>>()) {
        if !symbols.contains(&symbol) {
            symbols.push(symbol);
        }
    }
    let mut rows = Vec::new();
    for symbol in symbols {
        let mut of_symbol = all.iter().filter(|one| one.value.symbol == symbol).peekable();
        // Of several references and filters the first: what is least filtered about the usual reference.
        let Some(first) = of_symbol.peek().copied() else { continue };
        let basis = |one: &PlacedValue| (one.value.reference.clone(), one.value.filter.clone());
        let alike: Vec<&PlacedValue> = of_symbol.filter(|one| basis(one) == basis(first)).collect();
        let mut parts: Vec<Option<&str>> = Vec::new();
        for one in &alike {
            if !parts.contains(&one.section) {
                parts.push(one.section);
            }
        }
        if parts.len() > MOST_PARTS {
            let word = if alike.iter().all(|one| one.value.of.is_none()) { "sections" } else { "parts" };
            rows.push(row(format!("{} {word}", parts.len()), &alike, diagnosis));
        } else {
            for part in parts {
                let of_part: Vec<&PlacedValue> = alike.iter().filter(|one| one.section == part).copied().collect();
                rows.push(row(of_part.first().and_then(|one| one.part()).unwrap_or_default(), &of_part, diagnosis));
            }
        }
    }
    rows.into_iter().flatten().take(MOST_KEY_VALUES).collect()
}

/// One row of numbers that are gathered.
fn row(of: String, ones: &[&PlacedValue], diagnosis: Option<&Diagnosis>) -> Option<KeyValue> {
    let mut numbers: Vec<Number> = ones.iter().map(|one| Number::of(one.value)).collect();
    numbers.sort_by(|a, b| a.value.total_cmp(&b.value));
    let largest = numbers.iter().map(|number| number.value.abs()).fold(0.0, f64::max);
    let first = ones.first()?;
    let (factor, unit) = in_small_unit(largest, &first.value.unit);
    let shown = match numbers[..] {
        [] => return None,
        [only] => vec![only],
        [low, .., high] => vec![low, numbers[(numbers.len() - 1) / 2], high],
    };
    let lost: BTreeSet<usize> = ones.iter().flat_map(|one| one.value.lost_orders.iter().copied()).collect();
    Some(KeyValue {
        symbol: first.value.symbol.clone(),
        basis: basis(&first.id()),
        of,
        unit: unit.to_owned(),
        before: (numbers.len() == 1).then(|| before(first, diagnosis)).flatten().map(|before| factor * before),
        numbers: shown.into_iter().map(|number| number.scaled(factor)).collect(),
        is_refuted: ones.iter().any(|one| one.value.refuted_by.is_some()),
        lost_orders: lost.into_iter().collect(),
        about: first.value.source.clone(),
        no_uncertainty: first.value.no_uncertainty.clone(),
    })
}

/// References that say nothing, since there is no other one: of texture, and of the spread over the turns.
const ONLY: [&str; 2] = ["mean line", "turns at one angle"];

/// "LSCI, Gaussian 50 UPR": what it is referred to, and its filter.
fn basis(id: &ValueId) -> String {
    let reference = id.reference.filter(|reference| !ONLY.contains(reference));
    // "LSCY of centred sections" is the same reference of other sections.
    let reference = reference.and_then(|reference| reference.split(" of ").next());
    let filter = id.filter.filter(|filter| *filter != "none");
    reference.into_iter().chain(filter).collect::<Vec<_>>().join(", ")
}

/// The value before the loop changed it.
fn before(one: &PlacedValue, diagnosis: Option<&Diagnosis>) -> Option<f64> {
    let id = one.id();
    let moved = diagnosis?.moved.iter().find(|moved| {
        let of = ValueId {
            symbol: &moved.value,
            reference: moved.reference.as_deref(),
            filter: moved.filter.as_deref(),
            of: moved.section.as_deref(),
            ..id
        };
        of == id
    })?;
    (moved.before.is_finite()).then_some(moved.before)
}
