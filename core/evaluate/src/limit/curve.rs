//! Limits of the amplitudes of harmonics: which orders, and a largest amplitude that may differ from order to order.

mod formula;

use std::{collections::BTreeMap, fmt};

use runout_error::fault::Fault;
use schemars::JsonSchema;
use serde::{
    Deserialize, Deserializer, Serialize, Serializer,
    de::{Error as _, MapAccess, Visitor},
};

use super::{Limit, LimitValue};
use crate::value::{PlacedValue, ValueId};
use formula::Formula;

/// The symbol of the values that have an order each.
pub(crate) const AMPLITUDE: &str = "amplitude";
/// Orders of one limit, at most.
const MOST_ORDERS: usize = 10_000;

/// Orders, both ends included: "2..50".
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(with = "String")]
pub struct Orders {
    /// The lowest.
    pub first: usize,
    /// The highest.
    pub last: usize,
}

impl Orders {
    /// Whether this is one of them.
    #[must_use]
    pub fn contains(&self, order: usize) -> bool {
        (self.first..=self.last).contains(&order)
    }
}

impl fmt::Display for Orders {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}..{}", self.first, self.last)
    }
}

impl From<Orders> for String {
    fn from(orders: Orders) -> Self {
        orders.to_string()
    }
}

impl TryFrom<String> for Orders {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let ends = text.split_once("..").map(|(first, last)| [first, last].map(|end| end.trim().parse().ok()));
        match ends {
            Some([Some(first), Some(last)]) if (2..=last).contains(&first) && last - first < MOST_ORDERS => {
                Ok(Self { first, last })
            }
            _ => Err(format!(
                "expected ascending orders from 2 on, at most {MOST_ORDERS}, both ends included, as \"2..50\", found \"{text}\""
            )),
        }
    }
}

/// The largest amplitude of each order.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum UpperCurve {
    /// A formula in the order n: "2.4 / n^1.5".
    Formula(Formula),
    /// Amplitudes at orders; between them a straight line of both logarithms.
    Table(BTreeMap<usize, f64>),
}

impl UpperCurve {
    /// The largest amplitude of an order; NaN outside a table.
    #[must_use]
    pub fn at(&self, order: usize) -> f64 {
        match self {
            Self::Formula(formula) => formula.at(order as f64),
            Self::Table(table) => between(table, order),
        }
    }
}

/// A straight line of log amplitude over log order between the orders of a table.
fn between(table: &BTreeMap<usize, f64>, order: usize) -> f64 {
    let (below, above) = (table.range(..=order).next_back(), table.range(order..).next());
    let (Some((low, at_low)), Some((high, at_high))) = (below, above) else { return f64::NAN };
    if low == high {
        return *at_low;
    }
    let [low, high, order] = [*low, *high, order].map(|order| (order as f64).ln());
    let share = (order - low) / (high - low);
    ((1.0 - share) * at_low.ln() + share * at_high.ln()).exp()
}

impl fmt::Display for UpperCurve {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Formula(formula) => write!(f, "{formula}"),
            Self::Table(table) => {
                let ends = [table.iter().next(), table.iter().next_back()];
                let [Some((first, at_first)), Some((last, at_last))] = ends else { return f.write_str("a curve") };
                write!(f, "{at_first} at order {first} … {at_last} at order {last}")
            }
        }
    }
}

impl Serialize for UpperCurve {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Formula(formula) => serializer.collect_str(formula),
            Self::Table(table) => serializer.collect_map(table.iter().map(|(order, at)| (order.to_string(), at))),
        }
    }
}

impl<'de> Deserialize<'de> for UpperCurve {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Curve;

        impl<'de> Visitor<'de> for Curve {
            type Value = UpperCurve;

            fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
                formatter.write_str("a formula in n, \"2.4 / n^1.5\", or amplitudes at orders, { 2 = 0.8, 50 = 0.02 }")
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<UpperCurve, E> {
                Formula::parse(text).map(UpperCurve::Formula).map_err(E::custom)
            }

            fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<UpperCurve, A::Error> {
                let mut table = BTreeMap::new();
                while let Some((order, at)) = entries.next_entry::<String, f64>()? {
                    let wrong = || A::Error::custom(format!("expected an order before `=`, found `{order}`"));
                    table.insert(order.parse().map_err(|_| wrong())?, at);
                }
                Ok(UpperCurve::Table(table))
            }
        }

        deserializer.deserialize_any(Curve)
    }
}

/// A formula in n, or amplitudes at orders.
#[derive(JsonSchema)]
#[serde(untagged)]
#[allow(dead_code, reason = "only its schema is made")]
pub(crate) enum UpperCurveSchema {
    Formula(String),
    Table(BTreeMap<String, f64>),
}

impl ValueId<'_> {
    /// The order that it is of, where it is of one alone.
    #[must_use]
    pub fn order(&self) -> Option<usize> {
        single(self.band_upr)
    }
}

/// The order of a band that is one order.
pub(crate) fn single([low, high]: [usize; 2]) -> Option<usize> {
    (low == high && low > 0).then_some(low)
}

impl Limit {
    /// The largest value at an order that it allows.
    #[must_use]
    pub fn upper_at(&self, order: usize) -> Option<f64> {
        self.upper_curve.as_ref().map(|curve| curve.at(order)).or(self.upper)
    }

    /// Whether it is of values with this band: of all, or of those of one of its orders.
    #[must_use]
    pub(crate) fn is_of_band(&self, band_upr: [usize; 2]) -> bool {
        self.orders.is_none_or(|orders| single(band_upr).is_some_and(|order| orders.contains(order)))
    }

    /// Refuses orders and curves that cannot be.
    pub(crate) fn check_orders(&self) -> Result<(), Fault> {
        let Some(orders) = self.orders else {
            let curve = self.upper_curve.as_ref();
            return curve.map_or(Ok(()), |_| Err(Fault::at("upper_curve", "a curve needs `orders`, as \"2..50\"")));
        };
        if self.symbol != AMPLITUDE {
            let fault = Fault::at("orders", format!("`{}` is no value of single orders", self.symbol));
            return Err(fault.help(format!("`symbol = \"{AMPLITUDE}\"`")));
        }
        let Some(curve) = &self.upper_curve else { return Ok(()) };
        if self.upper.is_some() || self.lower.is_some() {
            return Err(Fault::at("upper_curve", "expected `upper_curve` alone").help("leave `lower` and `upper` out"));
        }
        let wrong = |order: &usize| !(curve.at(*order).is_finite() && curve.at(*order) > 0.0);
        match (orders.first..=orders.last).find(wrong) {
            Some(order) => {
                let found = curve.at(order);
                let found = if found.is_nan() { "none".to_owned() } else { found.to_string() };
                let message = format!("expected an amplitude above 0 at every order, found {found} at order {order}");
                Err(Fault::at("upper_curve", message).help("a table needs the first and the last of `orders`"))
            }
            None => Ok(()),
        }
    }

    /// What is said of its orders of which a section has no amplitude, where it has some.
    pub(crate) fn without_amplitude(&self, found: &[LimitValue], all: &[PlacedValue]) -> Vec<LimitValue> {
        let Some(orders) = self.orders else { return Vec::new() };
        let mut lost = Vec::new();
        for of_section in found.chunk_by(|one, next| (&one.station, &one.section) == (&next.station, &next.section)) {
            let Some(first) = of_section.first() else { continue };
            let here = |placed: &&PlacedValue| {
                (placed.station, placed.section) == (first.station.as_deref(), first.section.as_deref())
            };
            let unobservable: Vec<usize> =
                all.iter().filter(here).flat_map(|placed| placed.value.lost_orders.iter().copied()).collect();
            let absent = |order: &usize| !of_section.iter().any(|one| one.band_upr[0] == *order);
            for order in (orders.first..=orders.last).filter(absent) {
                let reason = if unobservable.contains(&order) {
                    "is not observable with the layout"
                } else {
                    "is not there: it is lost, or above the highest order"
                };
                lost.push(first.lost(order, self.upper_at(order), format!("order {order} {reason}")));
            }
        }
        lost
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::{
        Decision, Evaluate, decide, section_values,
        tests::{RADIUS_MM, lobes, station},
    };

    fn limit(text: &str) -> Limit {
        toml::from_str(&format!("symbol = 'amplitude'\nunit = 'um'\n{text}")).unwrap()
    }

    fn refusal(text: &str) -> String {
        limit(text).check_orders().unwrap_err().to_string()
    }

    #[test]
    fn orders_are_two_ends() {
        let orders = |text: &str| Orders::try_from(text.to_owned());
        assert_eq!(orders("2..50").unwrap(), Orders { first: 2, last: 50 });
        assert_eq!(orders("7..7").unwrap().to_string(), "7..7");
        for wrong in ["50..2", "1..50", "2-50", "2..", "..9", "2..50000", ""] {
            assert!(orders(wrong).unwrap_err().contains("2..50"), "{wrong}");
        }
    }

    /// A power law is straight on logarithms, so that two of its points are all of it: here 0.8 (n/2)^−1.5.
    #[test]
    fn a_table_of_two_points_of_a_power_law_is_that_law() {
        let table = limit("orders = '2..32'\nupper_curve = { 2 = 0.8, 32 = 0.0125 }");
        table.check_orders().unwrap();
        for order in 2..=32 {
            let expected = 0.8 / (order as f64 / 2.0).sqrt().powi(3);
            assert!((table.upper_at(order).unwrap() / expected - 1.0).abs() < 1e-12, "{order}");
        }
        assert!(table.upper_at(33).unwrap().is_nan());
        let stepped = limit("orders = '2..4'\nupper_curve = { 2 = 1.0, 3 = 5.0, 4 = 2.0 }");
        assert_eq!([2, 3, 4].map(|order| stepped.upper_at(order)), [Some(1.0), Some(5.0), Some(2.0)]);
    }

    #[test]
    fn a_curve_is_written_as_it_was_read() {
        for text in ["upper_curve = '2.4 / n^1.5'", "upper_curve = { 2 = 0.8, 50 = 0.02 }", "upper = 0.1"] {
            let limit = limit(&format!("orders = '2..50'\n{text}"));
            let written = toml::to_string(&limit).unwrap();
            assert_eq!(toml::from_str::<Limit>(&written).unwrap(), limit, "{written}");
        }
        let named = |text: &str| limit(&format!("orders = '2..50'\n{text}")).name();
        assert_eq!(named("upper_curve = '2.4 / n^1.5'"), "amplitude of orders 2..50 ≤ 2.4 / n^1.5 um");
        assert_eq!(
            named("upper_curve = { 2 = 0.8, 50 = 0.02 }"),
            "amplitude of orders 2..50 ≤ 0.8 at order 2 … 0.02 at order 50 um"
        );
    }

    #[test]
    fn what_cannot_be_is_refused() {
        assert!(refusal("upper_curve = '1/n'").contains("needs `orders`"));
        assert!(refusal("orders = '2..9'\nupper = 1\nupper_curve = '1/n'").contains("alone"));
        assert!(refusal("orders = '2..9'\nupper_curve = { 2 = 1.0, 8 = 0.5 }").contains("found none at order 9"));
        assert!(refusal("orders = '2..9'\nupper_curve = '5 - n'").contains("found 0 at order 5"));
        let other = Limit { symbol: "RONt".into(), ..limit("orders = '2..9'\nupper = 1") };
        assert!(other.check_orders().unwrap_err().to_string().contains("no value of single orders"));
        for wrong in ["orders = '2 to 9'", "orders = '2..9'\nupper_curve = { two = 1.0 }"] {
            let text = format!("symbol = 'amplitude'\nunit = 'um'\n{wrong}");
            let said = toml::from_str::<Limit>(&text).unwrap_err().to_string();
            assert!(said.contains("expected"), "{said}");
        }
    }

    /// Amplitudes with a standard uncertainty of √(0.01/2) = 0.07 µm: their intervals reach 0.14 µm to each side.
    #[test]
    fn each_order_is_decided_by_its_own_limit() {
        let waves = [lobes(2, 1.0), lobes(3, 0.5), lobes(4, 0.3)];
        let limit = limit("orders = '2..7'\nupper_curve = { 2 = 2.0, 3 = 0.3, 4 = 0.3, 6 = 0.5, 7 = 0.4 }");
        let mut evaluate = Evaluate::ront();
        evaluate.add_amplitudes(limit.orders.unwrap());
        let result = station(0.0, &waves, 6, 1e-2, &[5]);
        let values = section_values(&result, 0, &evaluate, RADIUS_MM);
        let place = |value| PlacedValue { station: Some("s0"), section: Some("a"), z_mm: None, value };
        let (decided, remarks) =
            decide(&[limit.check(&evaluate, &[], None).unwrap()], &values.iter().map(place).collect::<Vec<_>>())
                .unwrap();
        let found: Vec<_> = decided[0].values.iter().map(|value| (value.order().unwrap(), value.decision)).collect();
        let expected = [
            (2, Decision::Conforms),
            (3, Decision::DoesNotConform),
            (4, Decision::Undecided),
            (6, Decision::Conforms),
            (5, Decision::Undecided),
            (7, Decision::Undecided),
        ];
        assert_eq!(
            (found.as_slice(), decided[0].decision, remarks.len()),
            (&expected[..], Decision::DoesNotConform, 0)
        );
        let worst: Vec<usize> = decided[0].by_risk().iter().filter_map(|value| value.order()).collect();
        // Order 4 lacks 0.14 of 0.3, order 3 exceeds by 0.34 of 0.3; lost orders have no number.
        assert_eq!(worst[..2], [3, 4]);
        let reasons: Vec<_> = decided[0].values.iter().filter_map(|value| value.missing.as_deref()).collect();
        assert!(reasons[0].contains("order 5 is not observable") && reasons[1].contains("order 7 is not there"));
        // As summary.json has it: a lost order is null.
        let written = toml::to_string(&decided[0].values[0]).unwrap();
        assert!(written.contains("upper = 2.0"), "{written}");
    }
}
