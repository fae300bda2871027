//! Values with their places: those of form and motion, and those of a domain of its own.

use runout_standards::Value;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A value and where it belongs.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct PlacedValue<'a> {
    /// The station; none for a value of the whole part.
    pub station: Option<&'a str>,
    /// The section; none for a value of a station or the whole part.
    pub section: Option<&'a str>,
    /// Place of the section, or of the carriage, along the axis.
    pub z_mm: Option<f64>,
    /// The value.
    pub value: &'a Value,
}

/// A value of a result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub struct NamedValue {
    /// The standard's symbol, or a short name.
    pub symbol: String,
    /// What it is of, where the result has several: a part, a section, an axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub of: Option<String>,
    /// The number; null where it is not observable.
    pub value: Option<f64>,
    /// Its standard uncertainty; null where it is not known.
    pub std: Option<f64>,
    /// Its unit; empty for a number without one.
    pub unit: String,
    /// What it is, with standard and clause.
    pub about: String,
}

impl NamedValue {
    /// The same of one of several parts.
    #[must_use]
    pub fn of(self, of: impl Into<String>) -> Self {
        Self { of: Some(of.into()), ..self }
    }
}
