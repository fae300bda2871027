//! Values that may come, before there are any: limits are checked against them.

/// One of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KnownValue {
    /// The standard's symbol, or a short name.
    pub symbol: String,
    /// Its unit as it is printed.
    pub unit: &'static str,
    /// What it is referred to.
    pub referred: Referred,
}

/// What a value is referred to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Referred {
    /// The reference circles that are asked for.
    Circles,
    /// Their lines.
    Lines,
    /// Their cylinders.
    Cylinders,
    /// The centres of polar plots that are asked for.
    Centres,
    /// The centre of the polar chart.
    Chart,
    /// Something else, or nothing.
    Other,
}

impl KnownValue {
    /// A value of a symbol, in a unit.
    #[must_use]
    pub fn new(symbol: impl Into<String>, unit: &'static str, referred: Referred) -> Self {
        Self { symbol: symbol.into(), unit, referred }
    }
}
