//! Values with their places: those of form and motion, and those of a domain of its own.

use runout_standards::Value;
use runout_table::number::ROUNDING;
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
    /// Where the truth lies with 95 % probability; absent where no interval is stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval_95: Option<[f64; 2]>,
    /// What it was referred to, where it is a standard's value of an open profile or a height map: "LSLI", "mean line".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<String>,
    /// The filter applied, as limits name it; absent as `reference` is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub filter: Option<String>,
    /// Why no uncertainty is stated of a standard's value; absent where one is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub no_uncertainty: Option<String>,
    /// What of its own data refutes it: then its uncertainty is widened to what is left unexplained, and no limit is kept by it;
    /// absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refuted_by: Option<String>,
}

impl NamedValue {
    /// A number under a name, with a unit; what is not finite is null, and so is an uncertainty that is rounding of arithmetic.
    #[must_use]
    pub fn new(symbol: &str, value: f64, std: f64, unit: &str, about: &str) -> Self {
        let known = |number: f64| number.is_finite().then_some(number);
        Self {
            symbol: symbol.into(),
            of: None,
            value: known(value),
            std: known(std).filter(|std| *std == 0.0 || *std > ROUNDING),
            unit: unit.into(),
            about: about.into(),
            interval_95: None,
            reference: None,
            filter: None,
            no_uncertainty: None,
            refuted_by: None,
        }
    }

    /// The same of one of several parts.
    #[must_use]
    pub fn of(self, of: impl Into<String>) -> Self {
        Self { of: Some(of.into()), ..self }
    }

    /// The same, refuted by what its own data say.
    #[must_use]
    pub fn refuted_by(self, by: Option<String>) -> Self {
        Self { refuted_by: by.or(self.refuted_by), ..self }
    }

    /// A standard's value of an open profile or a height map.
    pub(crate) fn standard(of: &str, value: &Value) -> Self {
        let known = value.uncertainty.as_ref();
        Self {
            symbol: value.symbol.clone(),
            of: Some(of.to_owned()),
            value: Some(value.value),
            std: known.map(|known| known.std),
            unit: value.unit.clone(),
            about: value.source.clone(),
            interval_95: known.map(|known| known.interval_95),
            reference: Some(value.reference.clone()),
            filter: Some(value.filter.clone()),
            no_uncertainty: value.no_uncertainty.clone(),
            refuted_by: value.refuted_by.clone(),
        }
    }

    /// Whether both are the same quantity: symbol, what it is of, reference and filter.
    #[must_use]
    pub fn is_same_quantity(&self, other: &Self) -> bool {
        let key = |one: &'_ Self| (one.symbol.clone(), one.of.clone(), one.reference.clone(), one.filter.clone());
        key(self) == key(other)
    }
}
