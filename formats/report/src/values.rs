//! The values of a result, column by column: texts that repeat are written once.

use std::collections::HashMap;

use runout_core::{
    draws::Uncertainty,
    numerics::number::{significant, with_std},
    summary::{PlacedValue, Summary},
};
use serde::Serialize;

use crate::{one_line, symbol};

/// A value as the page lists it.
#[derive(Debug)]
struct Row {
    /// Station and section, or what it is of.
    place: String,
    /// What of these belongs to a station's own sheet, and where in it.
    station: String,
    section: String,
    symbol: String,
    /// The number as it is shown, with its standard uncertainty.
    shown: String,
    /// The number, to sort by and to copy.
    value: Option<f64>,
    std: Option<f64>,
    unit: String,
    /// 95 % interval as it is shown.
    interval: String,
    /// What the interval contains.
    kind: &'static str,
    /// Reference and filter.
    refers: String,
    /// Values of one quantity at several stations have the same: of a section, of all of a station.
    group: String,
    /// What is not in the value, and what its data say against it.
    remark: String,
    /// Standard and clause, and band.
    about: String,
}

/// All rows of the table of values.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Columns {
    place: Column,
    station: Column,
    section: Column,
    symbol: Column,
    shown: Vec<String>,
    value: Vec<Option<f64>>,
    std: Vec<Option<f64>>,
    unit: Column,
    interval: Vec<String>,
    kind: Column,
    refers: Column,
    group: Column,
    remark: Column,
    about: Column,
}

/// A column of texts: each text once, and its place among them row by row.
#[derive(Debug, Default, Serialize)]
struct Column {
    texts: Vec<String>,
    rows: Vec<usize>,
    #[serde(skip)]
    known: HashMap<String, usize>,
}

impl Column {
    fn add(&mut self, text: String) {
        let next = self.texts.len();
        let place = *self.known.entry(text).or_insert_with_key(|text| {
            self.texts.push(text.clone());
            next
        });
        self.rows.push(place);
    }
}

impl Columns {
    /// Every value of a result.
    pub(crate) fn of(summary: &Summary) -> Self {
        let mut all = Self::default();
        for row in rows(summary) {
            all.place.add(row.place);
            all.station.add(row.station);
            all.section.add(row.section);
            all.symbol.add(row.symbol);
            all.shown.push(row.shown);
            all.value.push(row.value);
            all.std.push(row.std);
            all.unit.add(row.unit);
            all.interval.push(row.interval);
            all.kind.add(row.kind.to_owned());
            all.refers.add(row.refers);
            all.group.add(row.group);
            all.remark.add(row.remark);
            all.about.add(row.about);
        }
        all
    }

    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.shown.len()
    }
}

fn rows(summary: &Summary) -> Vec<Row> {
    summary.all_values().into_iter().map(row).collect()
}

fn row(placed: PlacedValue) -> Row {
    let value = placed.value;
    // A domain's own values are of a part or of the whole, and of no orders.
    let is_of_form = value.band_upr != [0; 2];
    let place = match (placed.station, placed.part()) {
        (None, None) if is_of_form => "whole part".to_owned(),
        (station, part) => station.map(str::to_owned).into_iter().chain(part).collect::<Vec<_>>().join(", "),
    };
    let lacks = match value.lost_orders.len() {
        0 => String::new(),
        1 => format!("order {} is lost; ", value.lost_orders[0]),
        count => format!("{count} orders are lost, the first is {}; ", value.lost_orders[0]),
    };
    let band = if is_of_form { format!("; {} to {} UPR", value.band_upr[0], value.band_upr[1]) } else { String::new() };
    let shown = value.number().map_or_else(|| "not observable".into(), |number| with_std(number, value.std()));
    Row {
        place: one_line(&place),
        station: one_line(placed.station.unwrap_or_default()),
        section: one_line(&placed.part().unwrap_or_default()),
        symbol: value.symbol.clone(),
        shown: shown + mark(value.refuted_by.as_ref()),
        value: value.number(),
        std: value.std(),
        unit: symbol(&value.unit),
        interval: value.uncertainty.as_ref().map_or_else(String::new, interval),
        kind: value.uncertainty.as_ref().map_or("", |known| known.kind.name()),
        refers: [&value.reference, &value.filter].into_iter().flatten().cloned().collect::<Vec<_>>().join(", "),
        group: match (placed.station, placed.section) {
            // Where each section is a station of its own, all sections are alike.
            (Some(station), Some(section)) if station == section => "sections".into(),
            (Some(_), Some(section)) => format!("section {}", one_line(section)),
            (Some(_), None) => "stations".into(),
            (None, _) => String::new(),
        },
        remark: format!(
            "{lacks}{}{}",
            value
                .raised_by_noise
                .map_or_else(String::new, |by| format!("raised by noise, by {}; ", significant(by, 2))),
            reason(value.refuted_by.as_ref())
        ),
        about: format!("{}{band}", value.source),
    }
}

/// The mark of a number that its own data refute.
fn mark(refuted_by: Option<&String>) -> &'static str {
    if refuted_by.is_some() { " !" } else { "" }
}

fn reason(refuted_by: Option<&String>) -> String {
    refuted_by.map_or_else(String::new, |by| format!("! its own data refute it: {}", one_line(by)))
}

/// A 95 % interval as it is shown.
fn interval(known: &Uncertainty) -> String {
    let [low, high] = known.interval_95.map(|end| as_precise(end, known.std));
    format!("{low} … {high}")
}

/// A number with two digits of its standard uncertainty.
fn as_precise(number: f64, std: f64) -> String {
    match with_std(number, Some(std)).split_once(" ± ") {
        Some((number, _)) => number.to_owned(),
        None => significant(number, 5),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_that_repeats_is_written_once() {
        let mut column = Column::default();
        ["a", "b", "a", "", "b"].into_iter().for_each(|text| column.add(text.to_owned()));
        assert_eq!((column.texts, column.rows), (vec!["a".into(), "b".into(), String::new()], vec![0, 1, 0, 2, 1]));
    }
}
