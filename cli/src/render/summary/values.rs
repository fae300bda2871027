//! Values of all sections together, and limits.

use runout_core::{
    answer::limit_text,
    evaluate::Value,
    summary::{Decision, LimitSummary, LimitValue, Summary},
};

use super::{FEW_STATIONS, known, unit, with_uncertainty};
use crate::render::{
    number::{lacking, significant},
    page::Page,
    table::Table,
};

/// Peak-to-valley values of the whole part, unfiltered.
pub(crate) fn part(page: &mut Page, summary: &Summary) {
    let Some(part) = &summary.part else { return };
    let mut table = Table::new(2, ["value", "reference", ""]);
    let shown =
        |value: &&Value| ["CYLt", "Sa", "Sz"].contains(&&*value.symbol) && value.filter.as_deref() == Some("none");
    for value in part.values.iter().filter(shown) {
        let number = with_uncertainty(value) + &lacking(&value.lost_orders);
        table.row([
            format!("{} {}", value.symbol, unit(&value.unit)),
            value.reference.clone().unwrap_or_default(),
            number,
        ]);
    }
    page.headed_table("The whole part", &table);
}

/// What was found of each limit, by the worst of the values that decide it.
pub(crate) fn limits(page: &mut Page, summary: &Summary) {
    let mut table = Table::new(2, ["limit", "decision", "values", "proven", "the worst", "95 % interval"]);
    for limit in &summary.limits {
        let worst = limit.deciding();
        let proven = limit.values.iter().filter(|value| value.decision == Decision::Conforms).count();
        let interval = worst.and_then(|value| value.interval_95);
        table.row([
            limit_text(&limit.limit),
            decided(limit, worst),
            limit.values.len().to_string(),
            proven.to_string(),
            known(worst.map(|value| value.value), 4) + &worst.map(order).unwrap_or_default(),
            interval.map_or_else(String::new, |ends| ends.map(|end| significant(end, 4)).join(" to ")),
        ]);
    }
    page.headed_table("Limits", &table);
    let beyond = summary.limits.iter().flat_map(|limit| {
        let open = limit.by_risk().into_iter().filter(|value| value.decision != Decision::Conforms);
        open.map(|value| format!("{}: {}", limit_text(&limit.limit), place(value)))
    });
    let mut beyond: Vec<String> = beyond.collect();
    let more = beyond.len().saturating_sub(FEW_STATIONS);
    beyond.truncate(FEW_STATIONS);
    if more > 0 {
        beyond.push(format!("and {more} more: every one is listed with --json"));
    }
    page.bullets("Not proven to be kept", &beyond);
}

fn decided(limit: &LimitSummary, worst: Option<&LimitValue>) -> String {
    match (limit.decision, worst) {
        (Decision::Conforms, _) => "conforms".into(),
        (Decision::DoesNotConform, _) => "does not conform".into(),
        (Decision::Undecided, None) => "undecided: no value".into(),
        (Decision::Undecided, Some(LimitValue { missing: Some(missing), .. })) => format!("undecided: {missing}"),
        (Decision::Undecided, Some(LimitValue { interval_95: None, within, .. })) => {
            format!("undecided: {}, without uncertainty", if *within { "within" } else { "beyond" })
        }
        (Decision::Undecided, Some(_)) => "undecided: the interval contains the limit".into(),
    }
}

/// " (order 7)" of a value of one order.
fn order(value: &LimitValue) -> String {
    value.order().map(|order| format!(" (order {order})")).unwrap_or_default()
}

/// "s31, section a, MZCI, 5.31"; of an order its limit too, or why it has no number.
fn place(value: &LimitValue) -> String {
    let by = value.by().trim_end_matches(", none").to_owned();
    let number = match (value.value.is_nan(), &value.missing, value.upper) {
        (true, Some(missing), _) => missing.clone(),
        (_, _, Some(upper)) => format!("{} of {}", significant(value.value, 4), significant(upper, 4)),
        _ => significant(value.value, 4),
    };
    let words = [value.place(), by, number];
    words.into_iter().filter(|word| !word.is_empty()).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use runout_core::summary::Limit;

    use super::*;

    fn value(interval_95: [f64; 2], decision: Decision, missing: Option<&str>) -> LimitValue {
        LimitValue {
            station: None,
            section: None,
            reference: Some("MZCI".into()),
            filter: Some("none".into()),
            band_upr: [2, 63],
            value: 0.5 * (interval_95[0] + interval_95[1]),
            upper: None,
            interval_95: Some(interval_95),
            within: true,
            decision,
            missing: missing.map(str::to_owned),
        }
    }

    /// The value nearest to the limit keeps it; another one is undecided, and says why.
    #[test]
    fn the_reason_of_a_limit_is_that_of_a_value_that_decides_it() {
        let limit: Limit = toml::from_str("symbol = 'RONt'\nupper = 7.0\nunit = 'um'").unwrap();
        let near = value([6.8, 6.9], Decision::Conforms, None);
        let lacks = value([5.1, 5.2], Decision::Undecided, Some("its filter passes more than there is"));
        let covers = value([6.9, 7.1], Decision::Undecided, None);
        let beyond = value([7.2, 7.3], Decision::DoesNotConform, None);
        for (values, decision, said) in [
            (vec![near.clone(), lacks.clone()], Decision::Undecided, "undecided: its filter passes more than there is"),
            (vec![near.clone(), lacks, covers], Decision::Undecided, "undecided: the interval contains the limit"),
            (vec![near.clone(), beyond], Decision::DoesNotConform, "does not conform"),
            (vec![near], Decision::Conforms, "conforms"),
            (Vec::new(), Decision::Undecided, "undecided: no value"),
        ] {
            let document = serde_json::json!({ "limit": limit, "decision": decision, "values": values });
            let summary: LimitSummary = serde_json::from_value(document).unwrap();
            let deciding = summary.deciding();
            assert!(deciding.is_none_or(|value| value.decision == decision));
            assert_eq!(decided(&summary, deciding), said);
        }
    }
}
