//! The values of a result, row by row.

use runout_core::{
    pipeline::summary::Summary,
    table::number::{significant, with_std},
};
use serde::Serialize;

use crate::{one_line, symbol};

/// A value as the page lists it.
#[derive(Debug, Serialize)]
pub(crate) struct Row {
    /// Station and section, or what it is of.
    place: String,
    symbol: String,
    /// The number as it is shown, with its standard uncertainty.
    shown: String,
    /// The number, to sort by and to copy.
    value: Option<f64>,
    std: Option<f64>,
    unit: String,
    /// 95 % interval as it is shown.
    interval: String,
    /// Reference and filter.
    refers: String,
    /// Standard and clause, and what is not in the value.
    about: String,
}

/// Every value of a result.
pub(crate) fn rows(summary: &Summary) -> Vec<Row> {
    let placed = summary.placed_values();
    let of_form = placed.iter().map(|placed| {
        let value = placed.value;
        let uncertainty = value.uncertainty.as_ref();
        let std = uncertainty.map(|uncertainty| uncertainty.std);
        let place = match (placed.station, placed.section) {
            (None, None) => "whole part".to_owned(),
            (Some(station), None) => station.to_owned(),
            (None, Some(section)) => format!("section {section}"),
            (Some(station), Some(section)) => format!("{station}, section {section}"),
        };
        let lacks = match value.lost_orders.len() {
            0 => String::new(),
            1 => format!("; order {} is lost", value.lost_orders[0]),
            count => format!("; {count} orders are lost, the first is {}", value.lost_orders[0]),
        };
        Row {
            place: one_line(&place),
            symbol: value.symbol.clone(),
            shown: with_std(value.value, std),
            value: finite(value.value),
            std,
            unit: symbol(&value.unit),
            interval: uncertainty.map_or_else(String::new, |known| {
                let [low, high] = known.interval_95.map(|end| as_precise(end, known.std));
                format!("{low} … {high}")
            }),
            refers: [value.reference.as_str(), value.filter.as_str()].join(", "),
            about: format!("{}; {} to {} UPR{lacks}", value.source, value.band_upr[0], value.band_upr[1]),
        }
    });
    let named = summary.values.iter().map(|value| Row {
        place: value.of.as_deref().map(one_line).unwrap_or_default(),
        symbol: value.symbol.clone(),
        shown: value.value.map_or_else(|| "not observable".into(), |number| with_std(number, value.std)),
        value: value.value.and_then(finite),
        std: value.std,
        unit: symbol(&value.unit),
        interval: String::new(),
        refers: String::new(),
        about: value.about.clone(),
    });
    of_form.chain(named).collect()
}

fn finite(number: f64) -> Option<f64> {
    number.is_finite().then_some(number)
}

/// A number with two digits of its standard uncertainty.
fn as_precise(number: f64, std: f64) -> String {
    match with_std(number, Some(std)).split_once(" ± ") {
        Some((number, _)) => number.to_owned(),
        None => significant(number, 5),
    }
}
