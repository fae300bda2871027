//! Limits against values, decided by ISO 14253-1.

use crate::summary::{Decision, Limit, LimitSummary, LimitValue, PlacedValue};
use runout_standards::Value;

impl Limit {
    fn decide(&self, placed: &PlacedValue) -> LimitValue {
        let value = placed.value;
        let [low, high] = [self.lower.unwrap_or(f64::NEG_INFINITY), self.upper.unwrap_or(f64::INFINITY)];
        let interval_95 = value.uncertainty.as_ref().map(|uncertainty| uncertainty.interval_95);
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
            interval_95,
            within: value.value >= low && value.value <= high,
            decision,
            missing: missing.or_else(|| value.no_uncertainty.clone()),
        }
    }
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
        return Some(format!(
            "its filter passes more than a thousandth above order {order}, the highest that there is"
        ));
    }
    let above = value.weakened_above_upr?;
    Some(format!("of its band, a low-pass has weakened what is above {above:.1} undulations"))
}

/// Holds all values against all limits. Besides, what the user should know: limits that name no value.
pub(crate) fn decide(limits: &[Limit], all: &[PlacedValue]) -> (Vec<LimitSummary>, Vec<String>) {
    let mut remarks = Vec::new();
    let decide = |limit: &Limit| {
        let named = all.iter().filter(|PlacedValue { section, value, .. }| {
            limit.names(&value.symbol, *section, &value.reference, &value.filter)
        });
        let values: Vec<LimitValue> = named.map(|placed| limit.decide(placed)).collect();
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
    (decided, remarks)
}
