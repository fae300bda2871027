//! A batch, for people.

use runout_core::pipeline::batch::{BatchReport, Failed, Series, Signals, Warned};

use super::{count, number::significant, page::Page, table::Table};

/// Rows of a table of the trend: all are in the file.
const SHOWN: usize = 20;
/// Rows of values against the speed: those of a station with its shift.
const SPEED_SHOWN: usize = 60;
/// Recordings from which on control limits are usual (ISO 7870-2 asks for 20 to 25 subgroups).
const ENOUGH: usize = 20;
/// Digits of values and limits.
const DIGITS: usize = 5;

/// The report.
#[must_use]
pub(crate) fn text(report: &BatchReport) -> String {
    let mut page = Page::default();
    page.line(&report.title);
    let mut counts = vec![format!("{} run", count(report.done, "recording"))];
    let mut more = |number: usize, what: &str| {
        if number > 0 {
            counts.push(format!("{number} {what}"));
        }
    };
    more(report.skipped, "skipped as up to date");
    more(report.earlier, "of earlier calls");
    more(report.failed.len(), "failed");
    page.line(counts.join(", "));
    page.headed_table("Limits, recordings that are proven to keep them or not", &limits(report));
    trend(&mut page, report);
    against_speed(&mut page, report);
    let other = report.other_configuration.len();
    if other > 0 {
        let names: Vec<&str> = report.other_configuration.iter().take(SHOWN).map(String::as_str).collect();
        let dots = if other > SHOWN { ", …" } else { "" };
        page.bullets(
            "Warnings",
            &[format!(
                "{} in the data set {} of another configuration or version, or not complete, and in no value and no trend: {}{dots}; \
                 give them again to bring them up to date",
                count(other, "recording"),
                if other == 1 { "is" } else { "are" },
                names.join(", "),
            )],
        );
    }
    warned(&mut page, report);
    let failed = |one: &Failed| {
        let Failed { recording, message, help, .. } = one;
        let help = help.as_ref().map(|help| format!(" ({help})")).unwrap_or_default();
        format!("{recording}: {message}{help}")
    };
    page.bullets("Failed", &report.failed.iter().map(failed).collect::<Vec<_>>());
    let outputs: Vec<String> = report.outputs.iter().map(|path| path.display().to_string()).collect();
    page.bullets("Written", &outputs);
    page.into_text()
}

fn warned(page: &mut Page, report: &BatchReport) {
    let of_one = |one: &Warned| {
        let more = one.count - one.first.len().min(one.count);
        let more = if more > 0 { format!("; and {more} more") } else { String::new() };
        format!("{}: {}{more}", one.recording, one.first.join("; "))
    };
    let mut shown: Vec<String> = report.warnings.iter().take(SHOWN).map(of_one).collect();
    if report.warned > shown.len() {
        shown.push(format!("and {} more", count(report.warned - shown.len(), "recording")));
    }
    page.bullets("Recordings with warnings", &shown);
}

fn limits(report: &BatchReport) -> Table {
    let mut table = Table::new(1, ["limit", "conform", "do not conform", "undecided"]);
    for limit in &report.limits {
        let numbers = [limit.conforms, limit.does_not_conform, limit.undecided].map(|number| number.to_string());
        table.row(std::iter::once(limit.limit.name()).chain(numbers));
    }
    table
}

fn trend(page: &mut Page, report: &BatchReport) {
    let recordings = report.trend.iter().map(|series| series.count).max().unwrap_or_default();
    if recordings < 2 {
        return;
    }
    let with_signals: Vec<&Series> = report.trend.iter().filter(|series| series.signals > 0).collect();
    page.heading(format_args!(
        "Trend of {} over {}: {} of them with signals for special causes",
        count(report.trend.len(), "value"),
        count(recordings, "recording"),
        with_signals.len(),
    ));
    let mut table =
        Table::new(1, ["value", "mean", "lower limit", "upper limit", "moving range", "its limit", "signals"]);
    // The most signals first; of as many the order of the table.
    let mut sorted = with_signals.clone();
    sorted.sort_by_key(|series| std::cmp::Reverse(series.signals));
    for series in sorted.iter().take(SHOWN) {
        let limits = series.limits.map_or([None; 2], |limits| limits.map(Some));
        let numbers = [series.mean, limits[0], limits[1], series.range_mean, series.range_limit];
        let numbers = numbers.map(|number| number.map_or_else(String::new, |number| significant(number, DIGITS)));
        table.row(std::iter::once(series.series.clone()).chain(numbers).chain([series.signals.to_string()]));
    }
    page.table(&table);
    if with_signals.len() > SHOWN {
        page.line(format_args!("  … and {} more in the table trend", with_signals.len() - SHOWN));
    }
    let first = |series: &&Series| {
        let more = if series.signals > series.first_signals.len() { ", …" } else { "" };
        let places: Vec<String> = series.first_signals.iter().map(place).collect();
        format!("{}: {}{more}", series.series, places.join(", "))
    };
    page.bullets("Signals", &sorted.iter().take(SHOWN).map(first).collect::<Vec<_>>());
    if recordings < ENOUGH {
        page.line(format_args!("  Limits from fewer than {ENOUGH} recordings are preliminary (ISO 7870-2)."));
    }
}

/// Values at the lowest and at the highest speed, and the largest ones.
fn against_speed(page: &mut Page, report: &BatchReport) {
    let mut table = Table::new(1, ["value", "lowest rpm", "value", "highest rpm", "value", "largest at rpm", "value"]);
    for series in report.against_speed.iter().take(SPEED_SHOWN) {
        let at = [series.slowest, series.fastest, series.largest].into_iter().flatten();
        table.row(std::iter::once(series.series.clone()).chain(at.map(|number| significant(number, 4))));
    }
    page.headed_table("Error motion against the speed", &table);
    let more = report.against_speed.len().saturating_sub(SPEED_SHOWN);
    if more > 0 {
        page.line(format_args!("  … and {more} more in the table speed"));
    }
    let without: Vec<&str> = report.without_speed.iter().take(SHOWN).map(String::as_str).collect();
    if !without.is_empty() {
        let dots = if report.without_speed.len() > SHOWN { ", …" } else { "" };
        page.line(format_args!(
            "  Speed not known, so in no row: {}{dots} (a sampling rate is needed: `sample_rate_hz`)",
            without.join(", ")
        ));
    }
}

fn place(signals: &Signals) -> String {
    let tests: Vec<&str> = signals.tests.iter().map(|test| test.name()).collect();
    format!("{} ({})", signals.recording, tests.join(", "))
}
