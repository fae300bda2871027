//! Values with their places: those of form and motion, and those of a domain of its own.

use std::fmt;

use runout_draws::{NORMAL_95, Uncertainty};
use runout_table::number::ROUNDING;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which value it is: the same number of another recording, or of the same one evaluated again, has the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ValueId<'a> {
    /// The standard's symbol.
    pub symbol: &'a str,
    /// What it was referred to, where it was referred to something.
    pub reference: Option<&'a str>,
    /// The filter applied, where one could be.
    pub filter: Option<&'a str>,
    /// Undulations per revolution, where it is of some.
    pub band_upr: [usize; 2],
    /// What it is of, where a result has several.
    pub of: Option<&'a str>,
}

impl fmt::Display for ValueId<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.symbol)?;
        if let Some(reference) = self.reference {
            write!(f, " about {reference}")?;
        }
        match self.filter {
            Some("none") | None => {}
            Some(filter) => write!(f, ", {filter}")?,
        }
        if let Some(of) = self.of {
            write!(f, " of {of}")?;
        }
        Ok(())
    }
}

/// One value of a section, of a station or of the whole part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Value {
    /// The standard's symbol.
    pub symbol: String,
    /// Its unit; empty for a number without one.
    pub unit: String,
    /// The number.
    pub value: f64,
    /// Standard and clause, or paper and equation.
    pub source: String,
    /// Undulations per revolution over which it was computed, both ends included; a filter's end is where half passes.
    pub band_upr: [usize; 2],
    /// Orders not observable with the layout, of which the filter passes a hundredth or more: they are not in the value.
    pub lost_orders: Vec<usize>,
    /// Undulations per revolution from which on a filter before the average passes less than half of the power, where the
    /// value's own filter passes a hundredth or more: what is above is not in the value; null where nothing is missing.
    #[serde(default)]
    pub weakened_above_upr: Option<f64>,
    /// Highest order that there is, where the value's own filter passes a thousandth or more of those above: they are not in
    /// the value; null where nothing is missing.
    #[serde(default)]
    pub absent_above_upr: Option<usize>,
    /// The filter applied.
    pub filter: String,
    /// What the profile was referred to.
    pub reference: String,
    /// Share of the profile or surface that was there; gaps are left out.
    pub coverage: f64,
    /// From the covariance of the separation; null where none is known.
    pub uncertainty: Option<Uncertainty>,
    /// Why no uncertainty is stated, where the errors are known and intervals by them do not hold; null otherwise.
    #[serde(default)]
    pub no_uncertainty: Option<String>,
    /// By how much noise has raised it, where that is more than its standard uncertainty; null otherwise. The interval is without it.
    #[serde(default)]
    pub raised_by_noise: Option<f64>,
    /// What of its own data refutes it: then its uncertainty is widened to what is left unexplained, and no limit is kept by it; null
    /// otherwise.
    #[serde(default)]
    pub refuted_by: Option<String>,
}

impl Value {
    /// Which value it is.
    #[must_use]
    pub fn id(&self) -> ValueId<'_> {
        let (reference, filter) = (Some(self.reference.as_str()), Some(self.filter.as_str()));
        ValueId { symbol: &self.symbol, reference, filter, band_upr: self.band_upr, of: None }
    }
}

/// A value and where it belongs.
#[derive(Debug, Clone, Copy)]
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

impl<'a> PlacedValue<'a> {
    /// A domain's own value, with what it is of.
    #[must_use]
    pub fn own((of, value): &'a (Option<&'a str>, Value)) -> Self {
        Self { station: None, section: *of, z_mm: None, value }
    }
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
    /// Whether the result opens with it; absent where it does not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_key: bool,
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
            is_key: false,
        }
    }

    /// The same of one of several parts.
    #[must_use]
    pub fn of(self, of: impl Into<String>) -> Self {
        Self { of: Some(of.into()), ..self }
    }

    /// The same as one of the few that a result opens with.
    #[must_use]
    pub fn key(self) -> Self {
        Self { is_key: true, ..self }
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
            is_key: false,
        }
    }

    /// A domain's own value as one that a limit may name; nothing of one that is not observable, or that is a standard's.
    #[must_use]
    pub fn own(&self) -> Option<Value> {
        let value = self.value.filter(|_| self.reference.is_none())?;
        let normal = |std: f64| [value - NORMAL_95 * std, value + NORMAL_95 * std];
        let known = |std: f64| Uncertainty::new(std, self.interval_95.unwrap_or(normal(std)), 0);
        Some(Value {
            symbol: self.symbol.clone(),
            unit: self.unit.clone(),
            value,
            source: self.about.clone(),
            band_upr: [0; 2],
            lost_orders: Vec::new(),
            weakened_above_upr: None,
            absent_above_upr: None,
            filter: String::new(),
            reference: String::new(),
            coverage: 1.0,
            uncertainty: self.std.map(known),
            no_uncertainty: self.no_uncertainty.clone(),
            raised_by_noise: None,
            refuted_by: self.refuted_by.clone(),
        })
    }

    /// Which value it is.
    #[must_use]
    pub fn id(&self) -> ValueId<'_> {
        let (reference, filter) = (self.reference.as_deref(), self.filter.as_deref());
        ValueId { symbol: &self.symbol, reference, filter, band_upr: [0; 2], of: self.of.as_deref() }
    }
}
