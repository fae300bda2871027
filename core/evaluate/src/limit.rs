//! `[[limit]]`: what values have to keep, and what was found of them.

mod curve;

use crate::value::{PlacedValue, Value, ValueId};
use curve::{UpperCurveSchema, single};
use runout_error::{Error, Result, fault::known_names};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

pub use curve::{Orders, UpperCurve};

/// `[[limit]]`: a limit of every value that it names. What it leaves open (section, reference, filter) it does not narrow: all
/// values of the symbol have to keep it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Limit {
    /// The standard's symbol: "RONt", "CYLt", "Ra".
    pub symbol: String,
    /// Id of a section; all without it.
    pub section: Option<String>,
    /// What the value is referred to: "LSCI", "MZCI", "LSCY"; all without it.
    pub reference: Option<String>,
    /// The filter as values name it: "none", "Gaussian 50 UPR"; all without it.
    pub filter: Option<String>,
    /// The smallest value that may be, in `unit`.
    pub lower: Option<f64>,
    /// The largest value that may be, in `unit`.
    pub upper: Option<f64>,
    /// Orders that it is of, both ends included: "2..50". Of `amplitude` alone, which is computed for these orders then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orders: Option<Orders>,
    /// The largest amplitude of each order, in `unit`, in place of `upper`: a formula in n, "2.4 / n^1.5", or amplitudes at orders,
    /// { 2 = 0.8, 50 = 0.02 }, between which it is a straight line of both logarithms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<UpperCurveSchema>")]
    pub upper_curve: Option<UpperCurve>,
    /// Unit of the limits, which is the value's: "um".
    pub unit: String,
}

/// What can be said of a value and a limit (ISO 14253-1:2017).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Decision {
    /// Conformity is proven: the whole 95 % interval keeps the limits.
    Conforms,
    /// Non-conformity is proven: the whole interval lies beyond a limit.
    DoesNotConform,
    /// Neither is proven: the interval contains a limit, there is no uncertainty to decide with, or something of the value's band
    /// is not in it.
    Undecided,
}

/// A limit and what was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub struct LimitSummary {
    /// The limit.
    pub limit: Limit,
    /// Of all values together: proven to conform when each of them is, proven not to when one is; undecided without a value.
    pub decision: Decision,
    /// Every value that it names.
    pub values: Vec<LimitValue>,
}

/// One value under a limit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LimitValue {
    /// The station; null for a value of the whole part.
    pub station: Option<String>,
    /// The section; null for a value of a station or the whole part.
    pub section: Option<String>,
    /// What it is referred to; null for a domain's own value.
    pub reference: Option<String>,
    /// Its filter; null for a domain's own value.
    pub filter: Option<String>,
    /// Undulations per revolution that it is of, both ends included: what is said of a value without filter is said of
    /// these.
    #[serde(default)]
    pub band_upr: [usize; 2],
    /// The number; null of an order that is lost.
    #[serde(deserialize_with = "nan_for_null")]
    #[schemars(with = "Option<f64>")]
    pub value: f64,
    /// Its own upper limit, where the limit differs from order to order; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upper: Option<f64>,
    /// Where the truth lies with 95 % probability; null where that is not known.
    pub interval_95: Option<[f64; 2]>,
    /// Whether the number itself keeps the limits.
    pub within: bool,
    /// What that proves.
    pub decision: Decision,
    /// Why nothing is proven: what of its band is not in the value, or why no uncertainty is stated; null otherwise.
    #[serde(default)]
    pub missing: Option<String>,
}

/// NaN, which JSON has no number for, is written as null.
///
/// # Errors
/// When it is neither a number nor null.
pub fn nan_for_null<'de, D: Deserializer<'de>>(deserializer: D) -> std::result::Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

impl LimitSummary {
    /// Of the values that the decision follows from, the one nearest to a limit, or farthest beyond it: of an undecided limit a value that is
    /// undecided itself, so that its reason is that of the decision.
    #[must_use]
    pub fn deciding(&self) -> Option<&LimitValue> {
        self.by_risk().into_iter().find(|value| value.decision == self.decision)
    }

    /// All values, those nearest to breaking the limit first.
    #[must_use]
    pub fn by_risk(&self) -> Vec<&LimitValue> {
        let mut values: Vec<&LimitValue> = self.values.iter().collect();
        values.sort_by(|a, b| a.room(&self.limit).total_cmp(&b.room(&self.limit)));
        values
    }
}

impl LimitValue {
    /// Which value it is, by the limit that names it.
    #[must_use]
    pub fn id<'a>(&'a self, limit: &'a Limit) -> ValueId<'a> {
        ValueId {
            symbol: &limit.symbol,
            reference: self.reference.as_deref(),
            filter: self.filter.as_deref(),
            band_upr: self.band_upr,
            of: self.section.as_deref(),
        }
    }

    /// Where it is: "s31, section a"; of a domain's own value what it is of, "X".
    #[must_use]
    pub fn place(&self) -> String {
        let own = self.reference.is_none() && self.filter.is_none();
        let section = self.section.as_ref().map(|id| if own { id.clone() } else { format!("section {id}") });
        let words: Vec<String> = self.station.iter().cloned().chain(section).collect();
        if words.is_empty() { "whole part".to_owned() } else { words.join(", ") }
    }

    /// The order that it is of, where it is of one.
    #[must_use]
    pub fn order(&self) -> Option<usize> {
        single(self.band_upr)
    }

    /// Lower and upper limit of the value.
    #[must_use]
    pub fn ends(&self, limit: &Limit) -> [Option<f64>; 2] {
        [limit.lower, self.upper.or(limit.upper)]
    }

    /// How far its interval keeps away from the limits, below 0 where it does not: of one that differs from order to order as a share of it.
    #[must_use]
    pub fn room(&self, limit: &Limit) -> f64 {
        let [from, to] = self.interval_95.unwrap_or([self.value; 2]);
        let [lower, upper] = self.ends(limit);
        let above = lower.map_or(f64::INFINITY, |lower| from - lower);
        let below = upper.map_or(f64::INFINITY, |upper| upper - to);
        above.min(below / self.upper.unwrap_or(1.0))
    }

    /// The section's value at an order that is lost: no number, undecided, with the reason.
    pub(crate) fn lost(&self, order: usize, upper: Option<f64>, reason: String) -> Self {
        Self {
            band_upr: [order; 2],
            value: f64::NAN,
            upper: self.upper.and(upper),
            interval_95: None,
            within: false,
            decision: Decision::Undecided,
            missing: Some(reason),
            ..self.clone()
        }
    }

    /// Order, reference and filter: "order 7", "MZCI, Gaussian 50 UPR"; empty of a domain's own value.
    #[must_use]
    pub fn by(&self) -> String {
        let order = self.order().map(|order| format!("order {order}"));
        let all = [&order, &self.reference, &self.filter].into_iter().flatten();
        all.map(String::as_str).collect::<Vec<_>>().join(", ")
    }
}

impl Limit {
    /// "RONt of section a ≤ 5 um".
    #[must_use]
    pub fn name(&self) -> String {
        let end = |sign: &str, end: Option<f64>| end.map(|end| format!("{sign} {end}")).unwrap_or_default();
        let curve = self.upper_curve.as_ref().map(|curve| format!("≤ {curve}"));
        let ends = [end("≥", self.lower), curve.unwrap_or_else(|| end("≤", self.upper))];
        let ends: Vec<&str> = ends.iter().map(String::as_str).filter(|end| !end.is_empty()).collect();
        let of =
            |word: &str, what: &Option<String>| what.as_ref().map(|what| format!(" {word}{what}")).unwrap_or_default();
        let (reference, section) = (of("", &self.reference), of("of section ", &self.section));
        let filter = of("filter ", &self.filter);
        let orders = self.orders.map(|orders| format!(" of orders {orders}")).unwrap_or_default();
        format!("{}{reference}{filter}{orders}{section} {} {}", self.symbol, ends.join(" and "), self.unit)
    }

    /// Whether it is one of this value, which is `of` a section or of what a domain's own values are of, and where it has `orders` of one of them.
    #[must_use]
    pub fn names(&self, id: &ValueId) -> bool {
        // "LSCY" is also "LSCY of centred sections".
        let referred = self.reference.as_deref().is_none_or(|asked| {
            let rest = id.reference.and_then(|reference| reference.strip_prefix(asked));
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(" of "))
        });
        let is_asked = |asked: &Option<String>, found: Option<&str>| asked.is_none() || asked.as_deref() == found;
        let here = is_asked(&self.section, id.of) && self.is_of_band(id.band_upr);
        id.symbol == self.symbol && referred && here && is_asked(&self.filter, id.filter)
    }
}

impl Limit {
    fn decide(&self, placed: &PlacedValue) -> LimitValue {
        let value = placed.value;
        let upper = self.upper_at(value.band_upr[0]);
        let [low, high] = [self.lower.unwrap_or(f64::NEG_INFINITY), upper.unwrap_or(f64::INFINITY)];
        let interval_95 = value.interval_95();
        let refuted = value.refuted_by.as_ref().map(|by| format!("its own data refute the value: {by}"));
        let missing = refuted.or_else(|| missing(value));
        let decision = match interval_95 {
            _ if missing.is_some() => Decision::Undecided,
            Some([from, to]) if from >= low && to <= high => Decision::Conforms,
            Some([from, to]) if to < low || from > high => Decision::DoesNotConform,
            _ => Decision::Undecided,
        };
        LimitValue {
            station: placed.station.map(str::to_owned),
            section: placed.section.map(str::to_owned),
            reference: value.reference.clone(),
            filter: value.filter.clone(),
            band_upr: value.band_upr,
            value: value.value,
            upper: upper.filter(|_| self.upper_curve.is_some()),
            interval_95,
            within: value.value >= low && value.value <= high,
            decision,
            missing: missing.or_else(|| value.no_uncertainty.clone()),
        }
    }
}

/// Samples a turn whose orders hold all that a Gaussian filter passes by more than a thousandth: 2^−(n/n_c)² of order n (ISO 16610-21, 4.3).
fn samples_for(cut_off_upr: usize) -> usize {
    2 * (1000_f64.log2().sqrt() * cut_off_upr as f64).ceil() as usize
}

/// What of a value's band is not in it.
fn missing(value: &Value) -> Option<String> {
    if let [first, others @ ..] = &value.lost_orders[..] {
        let of_band = match others.len() {
            0 => "of its band is".to_owned(),
            more => format!("and {more} more of its band are"),
        };
        return Some(format!("order {first} {of_band} not observable"));
    }
    if let Some(order) = value.absent_above_upr {
        let said = format!("orders above {order}, the highest that there is, belong to it");
        let cut_off = value.band_upr[1];
        return Some(if cut_off < order {
            format!("{said}: `samples_per_rev` ≥ {} holds all", samples_for(cut_off))
        } else {
            said
        });
    }
    let above = value.weakened_above_upr?;
    Some(format!("of its band, a low-pass has weakened what is above {above:.1} undulations"))
}

/// Refuses a limit of a section that none of its values is of, where these are a domain's own or of no station: only a run knows what they
/// are of.
fn check_section(limit: &Limit, all: &[PlacedValue]) -> Result<()> {
    let Some(asked) = &limit.section else { return Ok(()) };
    let of_symbol = || all.iter().filter(|placed| placed.value.symbol == limit.symbol);
    let mut sections: Vec<&str> = of_symbol().filter_map(|placed| placed.section).collect();
    if of_symbol().any(|placed| placed.station.is_some())
        || of_symbol().count() == 0
        || sections.contains(&asked.as_str())
    {
        return Ok(());
    }
    sections.sort_unstable();
    sections.dedup();
    let what = format!("no value {} is of `{asked}`", limit.symbol);
    let error = Error::new("decide", format!("the limit {}", limit.name()), what);
    Err(error.help(if sections.is_empty() {
        format!("the result has one {}: leave `section` out", limit.symbol)
    } else {
        known_names(asked, sections)
    }))
}

/// Holds all values against all limits. Besides, what the user should know: limits that name no value.
///
/// # Errors
/// When a limit names a section that a domain's own values are not of.
pub fn decide(limits: &[Limit], all: &[PlacedValue]) -> Result<(Vec<LimitSummary>, Vec<String>)> {
    limits.iter().try_for_each(|limit| check_section(limit, all))?;
    let mut remarks = Vec::new();
    let decide = |limit: &Limit| {
        // What is not observable is not there to keep a limit.
        let named = all.iter().filter(|placed| limit.names(&placed.id()) && placed.value.value.is_finite());
        let mut values: Vec<LimitValue> = named.map(|placed| limit.decide(placed)).collect();
        values.extend(limit.without_amplitude(&values, all));
        if values.is_empty() {
            let mut symbols: Vec<&str> = all.iter().map(|placed| &*placed.value.symbol).collect();
            symbols.sort_unstable();
            symbols.dedup();
            remarks.push(format!("limit {} names no value; there are {}", limit.name(), symbols.join(", ")));
        }
        let any = |decision| values.iter().any(|value| value.decision == decision);
        let decision = match () {
            () if any(Decision::DoesNotConform) => Decision::DoesNotConform,
            () if any(Decision::Undecided) || values.is_empty() => Decision::Undecided,
            () => Decision::Conforms,
        };
        LimitSummary { limit: limit.clone(), decision, values }
    };
    let decided = limits.iter().map(decide).collect();
    Ok((decided, remarks))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    /// A limit of a domain's own values names what they are of.
    #[test]
    fn a_section_that_no_own_value_is_of_is_refused() {
        let values = ["X", "Y"].map(|axis| Value::new("A", 1.0, 0.1, "um", "bi-directional accuracy").of(axis));
        let whole = Value::new("E", 1.0, 0.1, "um", "of the machine");
        let placed: Vec<_> = values.iter().chain([&whole]).map(Value::placed).collect();
        let limit = |text: &str| toml::from_str::<Limit>(&format!("{text}\nupper = 2.0\nunit = 'um'")).unwrap();
        let decided = |text: &str| decide(&[limit(text)], &placed);
        assert_eq!(decided("symbol = 'A'\nsection = 'X'").unwrap().0[0].values.len(), 1);
        assert_eq!(decided("symbol = 'A'").unwrap().0[0].values.len(), 2);
        let refused = |text: &str| {
            let error = decided(text).unwrap_err();
            format!("{error}; {}", error.advice().unwrap_or_default())
        };
        let said = refused("symbol = 'A'\nsection = 'Z'");
        assert!(said.contains("`Z`") && said.contains('X') && said.contains('Y'), "{said}");
        let said = refused("symbol = 'E'\nsection = 'X'");
        assert!(said.contains("leave `section` out"), "{said}");
        // Without any value of the symbol there is a remark instead.
        assert_eq!(decided("symbol = 'B'\nsection = 'X'").unwrap().1.len(), 1);
    }
}
