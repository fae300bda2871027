//! What a batch found, as the report shows it beside the control charts.

use super::{BatchReport, Series, SpeedSeries};
use crate::stage::{Overview, Part, Section};
use runout_numerics::number::significant;

/// Signals that are listed; all are in the table of the trend.
const LISTED: usize = 200;
/// Digits of values and limits.
const DIGITS: usize = 5;

/// Counts, limits, values with signals and the signals themselves, recordings that failed.
pub(super) fn of(report: &BatchReport) -> Overview {
    let recordings = report.done + report.skipped + report.earlier;
    let with_signals = report.trend.iter().filter(|series| series.signals > 0).count();
    let broken: usize = report.limits.iter().map(|limit| limit.does_not_conform).sum();
    let mut headline = vec![
        format!("{}.", count(recordings, "recording")),
        format!("{with_signals} of {} have signals for special causes.", count(report.trend.len(), "value")),
    ];
    if !report.limits.is_empty() {
        headline.push(format!("A limit is proven to be broken {}.", count(broken, "time")));
    }
    if !report.failed.is_empty() {
        headline.push(format!("{} failed.", count(report.failed.len(), "recording")));
    }
    let sections = [
        section("Limits, recordings that are proven to keep them or not", limits(report)),
        section("Values with signals for special causes", series(report)),
        section("Signals", signals(report)),
        section("Error motion against the speed", against_speed(report)),
        section("Recordings that failed", failed(report)),
    ];
    Overview { headline: headline.join(" "), rig: None, sections: sections.into_iter().flatten().collect() }
}

/// "1 value", "2 values".
fn count(number: usize, thing: &str) -> String {
    if number == 1 { format!("1 {thing}") } else { format!("{number} {thing}s") }
}

fn section(heading: &str, part: Option<Part>) -> Option<Section> {
    Some(Section { heading: heading.to_owned(), parts: vec![part?] })
}

fn table(words: usize, header: &[&str], rows: Vec<Vec<String>>) -> Option<Part> {
    let header = header.iter().map(|name| (*name).to_owned()).collect();
    (!rows.is_empty()).then_some(Part::Table { words, header, rows })
}

fn limits(report: &BatchReport) -> Option<Part> {
    let rows = report.limits.iter().map(|limit| {
        let counts = [limit.conforms, limit.does_not_conform, limit.undecided].map(|count| count.to_string());
        std::iter::once(limit.limit.name()).chain(counts).collect()
    });
    table(1, &["limit", "kept", "broken", "undecided"], rows.collect())
}

/// Those with the most signals first.
fn sorted(report: &BatchReport) -> Vec<&Series> {
    let mut sorted: Vec<&Series> = report.trend.iter().filter(|series| series.signals > 0).collect();
    sorted.sort_by_key(|series| std::cmp::Reverse(series.signals));
    sorted
}

fn series(report: &BatchReport) -> Option<Part> {
    let row = |series: &Series| {
        let limits = series.limits.map_or([None; 2], |limits| limits.map(Some));
        let numbers = [series.mean, limits[0], limits[1], series.range_mean, series.range_limit];
        let numbers = numbers.map(|number| number.map_or_else(String::new, |number| significant(number, DIGITS)));
        std::iter::once(series.series.clone()).chain(numbers).chain([series.signals.to_string()]).collect()
    };
    let header =
        ["value", "mean", "lower control limit", "upper control limit", "mean moving range", "its limit", "signals"];
    table(1, &header, sorted(report).into_iter().map(row).collect())
}

fn signals(report: &BatchReport) -> Option<Part> {
    let each = sorted(report).into_iter().flat_map(|series| series.first_signals.iter().map(move |one| (series, one)));
    let rows = each.take(LISTED).map(|(series, one)| {
        let tests: Vec<&str> = one.tests.iter().map(|test| test.about()).collect();
        vec![one.recording.clone(), series.series.clone(), tests.join("; ")]
    });
    table(3, &["recording", "value", "rule that is broken"], rows.collect())
}

fn against_speed(report: &BatchReport) -> Option<Part> {
    let row = |series: &SpeedSeries| {
        let at = [series.slowest, series.fastest, series.largest].into_iter().flatten();
        std::iter::once(series.series.clone()).chain(at.map(|number| significant(number, DIGITS))).collect()
    };
    let header = ["value", "lowest rpm", "there", "highest rpm", "there", "largest at rpm", "there"];
    table(1, &header, report.against_speed.iter().map(row).collect())
}

fn failed(report: &BatchReport) -> Option<Part> {
    let rows = report
        .failed
        .iter()
        .map(|one| vec![one.recording.clone(), one.message.clone(), one.help.clone().unwrap_or_default()]);
    table(3, &["recording", "error", "what to do"], rows.collect())
}
