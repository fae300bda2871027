//! Values with their places.

pub mod own;

use std::fmt;

use runout_draws::Uncertainty;
use runout_numerics::number::ROUNDING;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::ascii_unit;

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

/// One value: a standard's of a profile, a wall, a map or a motion, or one that a domain computes of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Value {
    /// The standard's symbol, or a short name.
    pub symbol: String,
    /// What it is of, where the result has several and its place does not say it: a part, an axis.
    #[serde(skip)]
    pub of: Option<String>,
    /// Its unit; empty for a number without one.
    pub unit: String,
    /// The number; NaN where it is not observable.
    pub value: f64,
    /// Standard and clause, or paper and equation.
    pub source: String,
    /// Undulations per revolution over which it was computed, both ends included; a filter's end is where half passes. 0 of what is of none.
    pub band_upr: [usize; 2],
    /// Orders not observable with the layout, of which the filter passes a hundredth or more: they are not in the value.
    pub lost_orders: Vec<usize>,
    /// Undulations per revolution from which on a filter before the average passes less than half of the power, where the
    /// value's own filter passes a hundredth or more: what is above is not in the value; null where nothing is missing.
    #[serde(default)]
    pub weakened_above_upr: Option<f64>,
    /// Highest order that there is, where the value's own filter passes a thousandth or more of those above, or everything and form shows there: they are
    /// not in the value; null where nothing is missing.
    #[serde(default)]
    pub absent_above_upr: Option<usize>,
    /// The filter applied; none where none could be.
    pub filter: Option<String>,
    /// What the profile was referred to; none where there is nothing to refer to.
    pub reference: Option<String>,
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
    /// Whether the result opens with it, by what its domain says.
    #[serde(skip)]
    pub is_key: bool,
}

impl Value {
    /// A number under a name, with a unit, referred to nothing and not filtered: what is not finite is not observable, and an uncertainty
    /// that is rounding of arithmetic is none. Its interval is that of a normal distribution.
    #[must_use]
    pub fn new(symbol: &str, value: f64, std: f64, unit: &str, source: &str) -> Self {
        let value = if value.is_finite() { value } else { f64::NAN };
        let is_known = value.is_finite() && std.is_finite() && (std == 0.0 || std > ROUNDING);
        Self {
            symbol: symbol.into(),
            of: None,
            unit: unit.into(),
            value,
            source: source.into(),
            band_upr: [0; 2],
            lost_orders: Vec::new(),
            weakened_above_upr: None,
            absent_above_upr: None,
            filter: None,
            reference: None,
            coverage: 1.0,
            uncertainty: is_known.then(|| Uncertainty::normal(value, std)),
            no_uncertainty: None,
            raised_by_noise: None,
            refuted_by: None,
            is_key: false,
        }
    }

    /// A standard's value, unfiltered, of which no error is known yet. The unit is written in ASCII.
    #[must_use]
    pub fn referred(symbol: &str, value: f64, unit: &str, source: &str, reference: &str) -> Self {
        Self {
            reference: Some(reference.to_owned()),
            filter: Some("none".to_owned()),
            ..Self::new(symbol, value, f64::NAN, &ascii_unit(unit), source)
        }
    }

    /// Names the part that the value is of, where a result has several.
    #[must_use]
    pub fn of(self, of: impl Into<String>) -> Self {
        Self { of: Some(of.into()), ..self }
    }

    /// Marks the value as one of the few that a result opens with.
    #[must_use]
    pub fn key(self) -> Self {
        Self { is_key: true, ..self }
    }

    /// Limits the interval to 0 and above: that of an amplitude, a range or a root mean square, none of which is below 0.
    #[must_use]
    pub fn not_negative(mut self) -> Self {
        if let Some(known) = &mut self.uncertainty {
            known.interval_95 = known.interval_95.map(|end| end.max(0.0));
        }
        self
    }

    /// Adds what of the value's own data refutes it; without a new reason, an earlier one stays.
    #[must_use]
    pub fn refuted_by(self, by: Option<String>) -> Self {
        Self { refuted_by: by.or(self.refuted_by), ..self }
    }

    /// The number; none where it is not observable.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        Some(self.value).filter(|value| value.is_finite())
    }

    /// Its standard uncertainty; none where it is not known.
    #[must_use]
    pub fn std(&self) -> Option<f64> {
        self.uncertainty.as_ref().map(|known| known.std)
    }

    /// Where the truth lies with 95 % probability; none where that is not known.
    #[must_use]
    pub fn interval_95(&self) -> Option<[f64; 2]> {
        self.uncertainty.as_ref().map(|known| known.interval_95)
    }

    /// Which value it is.
    #[must_use]
    pub fn id(&self) -> ValueId<'_> {
        ValueId {
            symbol: &self.symbol,
            reference: self.reference.as_deref(),
            filter: self.filter.as_deref(),
            band_upr: self.band_upr,
            of: self.of.as_deref(),
        }
    }

    /// Where it belongs, where it is of no station.
    #[must_use]
    pub fn placed(&self) -> PlacedValue<'_> {
        PlacedValue { station: None, section: self.of.as_deref(), z_mm: None, value: self }
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
    /// Which value it is: `of` its section where it has one.
    #[must_use]
    pub fn id(&self) -> ValueId<'a> {
        ValueId { of: self.section, ..self.value.id() }
    }

    /// What it is of: "section a"; of a domain's own values their part or axis.
    #[must_use]
    pub fn part(&self) -> Option<String> {
        self.value.of.clone().or_else(|| Some(format!("section {}", self.section?)))
    }
}
