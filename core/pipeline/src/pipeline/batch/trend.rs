//! Control charts of every value of a batch, in passes over the values of all recordings: memory grows with the number of values of
//! one recording, not with the number of recordings.

use std::collections::HashMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::names::{NAMES, columns_of, label, names_at, texts_of};
use crate::summary::Limit;
use runout_error::Result;
use runout_evaluate::ValueId;
use runout_standards::control_chart::{ControlChart, Signal, Tests};
use runout_table::{
    Array, ColumnSpec, Figure, Float64Array, Measure, RecordBatch, TableSpec, counts, numbers_or_null, texts,
};

/// The column that names the recording of a row.
pub const RECORDING: &str = "recording";
/// The column that says whether a series has a signal, and what it holds then.
const SIGNAL: (&str, &str) = ("has_signal", "yes");
/// Signals of a series that are listed; all are in the table.
const LISTED: usize = 10;

/// The column that names the recording, before the columns of a recording's own table.
#[must_use]
pub fn recording_column() -> ColumnSpec {
    ColumnSpec::name(RECORDING, "name of the recording")
}

/// The table of all control charts.
#[must_use]
pub(crate) fn table() -> TableSpec {
    let value =
        |name: &str, about: &str| ColumnSpec::number(name, "", format!("{about}, in the unit of the series")).or_null();
    let limit = |name: &str, about: &str| value(name, about).repeating();
    let measures = |columns: &[(&str, &str)]| {
        columns.iter().map(|(column, symbol)| Measure::new(*column).with_symbol(*symbol)).collect::<Vec<_>>()
    };
    let mut individuals = measures(&[
        ("value", "value"),
        ("mean", "mean"),
        ("lower_limit", "lower control limit"),
        ("upper_limit", "upper control limit"),
        ("lower_tolerance", "lower limit"),
        ("upper_tolerance", "upper limit"),
    ]);
    individuals[0] = individuals[0].clone().with_marks("signals");
    let ranges = measures(&[("moving_range", "moving range"), ("range_mean", "mean"), ("range_limit", "upper limit")]);
    let chart = |id: &str, title: &str, measures: &[Measure]| {
        Figure::lines(id, title, "number", measures.iter().cloned()).quantities(["series"]).places(RECORDING)
    };
    TableSpec::new(
        "trend",
        "control charts of all values over the recordings in the order of their names: individuals with limits X̄ ± 2.66 R̄ and moving range \
         of two with the limit 3.267 R̄ (ISO 7870-2); tests for special causes 1 to 4 of Nelson (1984)",
        vec![
            recording_column(),
            ColumnSpec::count("number", "", "place of the recording in the order, from 1"),
            ColumnSpec::name("series", "the value: symbol, reference, filter, where, unit"),
            value("value", "the value; null where it is not known"),
            value("moving_range", "difference from the value before, without sign; null for the first"),
            limit("mean", "X̄, mean of the series"),
            limit("lower_limit", "lower control limit; null of one value"),
            limit("upper_limit", "upper control limit; null of one value"),
            limit("lower_tolerance", "the narrowest lower end of the [[limit]] tables that name the value; null without one"),
            limit("upper_tolerance", "the narrowest upper end; null without one"),
            limit("range_mean", "R̄, mean moving range; null of one value"),
            limit("range_limit", "upper control limit of the moving range; null of one value"),
            ColumnSpec::text("signals", "tests for special causes that this value completes, by name; empty for none"),
            ColumnSpec::name(SIGNAL.0, "yes where the series has a signal in any recording, else no"),
        ],
    )
    .figure(chart("trend-signals", "Individuals of values with signals", &individuals).only(SIGNAL.0, [SIGNAL.1]))
    .figure(chart("trend", "Individuals", &individuals))
    .figure(chart("trend-range", "Moving range", &ranges))
}

/// A value over all recordings, with its control chart.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Series {
    /// The value: symbol, reference, filter, where, unit.
    pub series: String,
    /// Its unit; empty for a number without one.
    pub unit: String,
    /// Recordings in which it is known.
    pub count: usize,
    /// Mean; null without values.
    pub mean: Option<f64>,
    /// Control limits of the individuals; null of one value.
    pub limits: Option<[f64; 2]>,
    /// Mean moving range; null of one value.
    pub range_mean: Option<f64>,
    /// Upper control limit of the moving range; null of one value.
    pub range_limit: Option<f64>,
    /// How many values complete a test for special causes.
    pub signals: usize,
    /// The first of them.
    pub first_signals: Vec<Signals>,
}

/// The tests that one value completes.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Signals {
    /// Its recording.
    pub recording: String,
    /// The tests.
    pub tests: Vec<Signal>,
}

/// A series under way.
struct Charted {
    label: String,
    unit: String,
    /// Lower and upper end of what is allowed.
    tolerance: [Option<f64>; 2],
    chart: ControlChart,
    tests: Tests,
    signals: usize,
    first: Vec<Signals>,
}

/// Control charts of all values. Each pass takes all rows, recording by recording in the same order: the first
/// [estimates](Self::estimate), the second [judges](Self::judge), the third gives [rows](Self::rows).
#[derive(Default)]
pub(super) struct Trend {
    limits: Vec<Limit>,
    series: Vec<Charted>,
    known: HashMap<String, usize>,
    /// The recording whose rows are coming, its place, and how often each series has come.
    recording: String,
    number: usize,
    seen: HashMap<String, usize>,
}

/// A row of values.
struct Row {
    series: usize,
    value: f64,
}

impl Trend {
    /// Without rows yet.
    pub(super) fn new(limits: &[Limit]) -> Self {
        Self { limits: limits.to_vec(), ..Self::default() }
    }

    /// Begins another pass.
    pub(super) fn rewind(&mut self) {
        self.series.iter_mut().for_each(|series| series.tests = Tests::default());
        self.begin_table();
    }

    /// Begins the rows of another table.
    pub(super) fn begin_table(&mut self) {
        self.recording.clear();
        self.seen.clear();
        self.number = 0;
    }

    /// Takes rows for means and limits.
    pub(super) fn estimate(&mut self, rows: &RecordBatch) {
        self.each(rows, |trend, row| trend.series[row.series].chart.take(row.value));
    }

    /// Takes rows for the tests.
    pub(super) fn judge(&mut self, rows: &RecordBatch) {
        self.each(rows, |trend, row| {
            let series = &mut trend.series[row.series];
            let judged = series.tests.take(row.value, &series.chart);
            if !judged.signals.is_empty() {
                series.signals += 1;
                if series.first.len() < LISTED {
                    series.first.push(Signals { recording: trend.recording.clone(), tests: judged.signals });
                }
            }
        });
    }

    /// The rows of the table.
    ///
    /// # Errors
    /// Never in practice: the columns are of one length.
    pub(super) fn rows(&mut self, rows: &RecordBatch) -> Result<RecordBatch> {
        let mut names: [Vec<String>; 4] = Default::default();
        let mut places = Vec::with_capacity(rows.num_rows());
        let mut columns: [Vec<Option<f64>>; 9] = Default::default();
        self.each(rows, |trend, row| {
            let series = &mut trend.series[row.series];
            let chart = &series.chart;
            let judged = series.tests.take(row.value, chart);
            let limits = chart.limits();
            let numbers = [
                Some(row.value).filter(|value| value.is_finite()),
                judged.moving_range,
                chart.mean(),
                limits.map(|limits| limits[0]),
                limits.map(|limits| limits[1]),
                series.tolerance[0],
                series.tolerance[1],
                chart.range_mean(),
                chart.range_limit(),
            ];
            columns.iter_mut().zip(numbers).for_each(|(column, number)| column.push(number));
            let tests: Vec<&str> = judged.signals.iter().map(|signal| signal.name()).collect();
            let has_signal = if series.signals > 0 { SIGNAL.1 } else { "no" };
            let texts = [trend.recording.clone(), series.label.clone(), tests.join(" "), has_signal.to_owned()];
            names.iter_mut().zip(texts).for_each(|(column, text)| column.push(text));
            places.push(trend.number);
        });
        let [recording, series, signals, has_signal] = names.map(texts);
        let mut all = vec![recording, counts(places), series];
        all.extend(columns.map(numbers_or_null));
        all.extend([signals, has_signal]);
        table().rows(all)
    }

    /// What was found.
    pub(super) fn into_series(self) -> Vec<Series> {
        let series = |one: Charted| Series {
            series: one.label,
            unit: one.unit,
            count: one.chart.count(),
            mean: one.chart.mean(),
            limits: one.chart.limits(),
            range_mean: one.chart.range_mean(),
            range_limit: one.chart.range_limit(),
            signals: one.signals,
            first_signals: one.first,
        };
        self.series.into_iter().map(series).collect()
    }

    fn each(&mut self, rows: &RecordBatch, mut take: impl FnMut(&mut Self, Row)) {
        let columns = columns_of(rows);
        let values = rows.column_by_name("value").and_then(|column| column.as_any().downcast_ref::<Float64Array>());
        let (Some(recordings), Some(values)) = (texts_of(rows, RECORDING), values) else { return };
        for row in 0..rows.num_rows() {
            if self.number == 0 || recordings.value(row) != self.recording {
                recordings.value(row).clone_into(&mut self.recording);
                self.number += 1;
                self.seen.clear();
            }
            let series = self.series_of(&names_at(&columns, row));
            let value = if values.is_valid(row) { values.value(row) } else { f64::NAN };
            take(self, Row { series, value });
        }
    }

    /// What the limits allow for a value of these names.
    fn tolerance(&self, names: &[String; NAMES.len()]) -> [Option<f64>; 2] {
        let [symbol, reference, filter, of, section, ..] = names.each_ref().map(String::as_str);
        let there = |text| Some(text).filter(|text: &&str| !text.is_empty());
        let of = there(of).or(there(section));
        let id = ValueId { symbol, reference: there(reference), filter: there(filter), band_upr: [0; 2], of };
        // The order of an amplitude is not among the names: no limit with orders is of these.
        let named = || self.limits.iter().filter(|limit| limit.names(&id));
        [
            named().filter_map(|limit| limit.lower).reduce(f64::max),
            named().filter_map(|limit| limit.upper).reduce(f64::min),
        ]
    }

    /// The series of these names; one that comes several times in a recording is as many series.
    fn series_of(&mut self, names: &[String; NAMES.len()]) -> usize {
        let key = names.join("\u{1f}");
        let times = self.seen.entry(key.clone()).or_default();
        *times += 1;
        let key = format!("{key}\u{1f}{times}");
        if let Some(series) = self.known.get(&key) {
            return *series;
        }
        let times = *times;
        let unit = names[NAMES.len() - 1].clone();
        let charted = Charted {
            label: label(names, times),
            tolerance: self.tolerance(names),
            unit,
            chart: ControlChart::default(),
            tests: Tests::default(),
            signals: 0,
            first: Vec::new(),
        };
        self.series.push(charted);
        self.known.insert(key, self.series.len() - 1);
        self.series.len() - 1
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use runout_table::{ArrayRef, texts_or_null};

    fn values() -> TableSpec {
        TableSpec::new(
            "values",
            "",
            vec![
                recording_column(),
                ColumnSpec::name("section", "").or_null(),
                ColumnSpec::text("symbol", ""),
                ColumnSpec::text("unit", ""),
                ColumnSpec::number("value", "", "").or_null(),
            ],
        )
    }

    /// RONt of two sections and of none, recording by recording.
    fn rows(numbers: std::ops::Range<usize>) -> RecordBatch {
        let each = || numbers.clone().flat_map(|number| (0..3).map(move |section| (number, section)));
        let value = |(number, section): (usize, usize)| match section {
            0 => Some(number as f64),
            1 => Some(1.0),
            _ => None,
        };
        let columns: Vec<ArrayRef> = vec![
            texts(each().map(|(number, _)| format!("r{number}"))),
            texts_or_null(each().map(|(_, section)| ["a", "b"].get(section))),
            texts(each().map(|_| "RONt")),
            texts(each().map(|_| "um")),
            numbers_or_null(each().map(value)),
        ];
        values().rows(columns).unwrap()
    }

    #[test]
    fn charts_do_not_depend_on_how_rows_are_cut() {
        let charted = |batches: &[RecordBatch]| {
            let mut trend = Trend::default();
            for pass in [Trend::estimate, Trend::judge] {
                trend.rewind();
                batches.iter().for_each(|rows| pass(&mut trend, rows));
            }
            trend.rewind();
            let rows: usize = batches.iter().map(|rows| trend.rows(rows).unwrap().num_rows()).sum();
            (rows, trend.into_series())
        };
        let whole = rows(0..10);
        let cut = [whole.slice(0, 4), whole.slice(4, 1), whole.slice(5, 25)];
        let (count, series) = charted(&[whole]);
        assert_eq!((count, &series), (30, &charted(&cut).1));
        let [a, b, none] = &series[..] else { panic!("{series:?}") };
        assert_eq!((a.series.as_str(), a.mean, a.range_mean), ("RONt, a / um", Some(4.5), Some(1.0)));
        // From the sixth of ten rising values on, and beyond 4.5 ± 2.66 at 0, 1, 8 and 9.
        let named = a.first_signals.iter().map(|one| one.recording.as_str()).collect::<Vec<_>>();
        assert_eq!((a.signals, named), (7, vec!["r0", "r1", "r5", "r6", "r7", "r8", "r9"]));
        assert_eq!((b.signals, b.limits), (0, Some([1.0, 1.0])));
        assert_eq!((none.count, none.mean, none.series.as_str()), (0, None, "RONt / um"));
    }

    #[test]
    fn a_value_that_comes_twice_in_a_recording_is_two_series() {
        let mut trend = Trend::default();
        let columns: Vec<ArrayRef> = vec![
            texts(["x", "x", "y", "y"]),
            texts_or_null([Some("a"); 4]),
            texts(["RONt"; 4]),
            texts(["um"; 4]),
            numbers_or_null([1.0, 10.0, 2.0, 20.0].map(Some)),
        ];
        trend.estimate(&values().rows(columns).unwrap());
        let series = trend.into_series();
        assert_eq!(series.iter().map(|one| one.mean).collect::<Vec<_>>(), [Some(1.5), Some(15.0)]);
        assert_eq!(series[1].series, "RONt, a / um (2)");
    }
}
