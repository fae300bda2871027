//! A standard's value by its symbol.

/// One value of a profile's or a surface's texture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// The standard's symbol.
    pub symbol: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Clause of the standard.
    pub clause: &'static str,
    /// The number; NaN where the profile or surface does not have it.
    pub value: f64,
}

impl Parameter {
    /// By symbol, unit, clause and value.
    #[must_use]
    pub const fn new(symbol: &'static str, unit: &'static str, clause: &'static str, value: f64) -> Self {
        Self { symbol, unit, clause, value }
    }
}
