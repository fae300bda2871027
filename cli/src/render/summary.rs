//! What a run found, for people: `run`'s last words.

mod motion;
mod named;
mod reading;
pub(super) mod values;

use runout_core::{
    answer::Answer,
    draws::IntervalKind,
    evaluate::{Value, ValueId},
    summary::{CaptureSummary, SectionSummary, StationSummary, Summary},
};

use super::{
    answer::{self, REFUTED},
    number::{lacking, place, ranges, rounded_place, significant, spread, with_std},
    page::Page,
    table::Table,
    unit,
};

/// Up to so many stations each has its own row; more are gathered into lowest, median and highest.
const FEW_STATIONS: usize = 8;

/// Rejected turns that are listed one by one.
const FEW_TURNS: usize = 4;

/// The text of a summary, of a terminal of so many columns: the answer, then tables. With `verbose` everything.
#[must_use]
pub(crate) fn text(summary: &Summary, width: usize, verbose: bool) -> String {
    let stations = &summary.stations;
    let mut page = Page::default();
    page.line(&summary.title);
    let answer = Answer::of(summary, None);
    answer::section(&mut page, &answer);
    values::limits(&mut page, summary);
    if !stations.is_empty() {
        turns(&mut page, stations);
        // Where nothing is separated, there is no form and no motion to show.
        if stations.iter().all(|station| station.readings.is_empty()) {
            separated(&mut page, summary);
        } else {
            reading::section(&mut page, stations);
            reading::values(&mut page, stations);
            values::limits(&mut page, summary);
        }
        lost_orders(&mut page, summary);
        page.detail("surface", |page| surface(page, summary));
    }
    named::section(&mut page, &summary.values);
    page.findings(&answer, &summary.warnings, &summary.notes);
    page.written(&summary.outputs);
    page.fitted(width, verbose)
}

/// The mark of a number that its own data refute.
fn mark(refuted_by: Option<&String>) -> &'static str {
    if refuted_by.is_some() { REFUTED } else { "" }
}

/// Form, motion and what the fit leaves.
fn separated(page: &mut Page, summary: &Summary) {
    let stations = &summary.stations;
    // Of many stations the key values are the lowest, the median and the highest already.
    if stations.len() <= FEW_STATIONS {
        by_station(page, summary);
    } else {
        page.detail("form and error motion in all directions", |page| by_station(page, summary));
    }
    residual(page, stations);
    motion_truth(page, stations);
}

fn by_station(page: &mut Page, summary: &Summary) {
    let stations = &summary.stations;
    let form = if stations.len() <= FEW_STATIONS { form_by_station(stations) } else { form_gathered(stations) };
    page.headed_table(form_heading(stations), &form);
    if form.contains(STARRED) {
        page.line(format_args!("  {STARRED} lacks the same lost orders"));
    }
    motion::section(page, stations);
    reading::values(page, stations);
    values::part(page, summary);
}

fn captures(stations: &[StationSummary]) -> impl Iterator<Item = (&StationSummary, &CaptureSummary)> {
    stations.iter().flat_map(|station| station.captures.iter().map(move |capture| (station, capture)))
}

fn turns(page: &mut Page, stations: &[StationSummary]) {
    let mut setups: Vec<&str> = Vec::new();
    for (_, capture) in captures(stations) {
        if !setups.contains(&&*capture.setup) {
            setups.push(&capture.setup);
        }
    }
    let mut table = Table::new(1, ["setup", "turns", "used", "rejected", "set aside", "speed rpm"]);
    for setup in setups {
        let of: Vec<&CaptureSummary> =
            captures(stations).map(|(_, capture)| capture).filter(|capture| capture.setup == setup).collect();
        let recorded: usize = of.iter().map(|capture| capture.turns_recorded).sum();
        let used: usize = of.iter().map(|capture| capture.turns_used).sum();
        let rejected: usize = of.iter().map(|capture| capture.rejected.len()).sum();
        table.row([
            setup.to_owned(),
            recorded.to_string(),
            used.to_string(),
            rejected.to_string(),
            recorded.saturating_sub(used + rejected).to_string(),
            speeds(&of),
        ]);
    }
    if table.is_empty() {
        return;
    }
    page.detail("turns and filters", |page| conditioned(page, &table, stations));
    rejected(page, stations);
}

fn conditioned(page: &mut Page, table: &Table, stations: &[StationSummary]) {
    page.headed_table("Turns", table);
    let filters: Vec<String> = captures(stations).flat_map(|(_, capture)| capture.filters.clone()).collect();
    page.bullets("Filters", &filters);
    let trims = captures(stations).flat_map(|(_, capture)| {
        capture.trimmed.iter().map(|trim| format!("{}: {trim}", capture.setup)).collect::<Vec<_>>()
    });
    page.bullets("Set aside", &trims.collect::<Vec<_>>());
}

fn speeds(captures: &[&CaptureSummary]) -> String {
    match spread(captures.iter().filter_map(|capture| capture.speed_rpm)) {
        None => String::new(),
        Some([low, middle, high]) if high - low < 1e-3 * middle => significant(middle, 4),
        Some([low, _, high]) => format!("{} to {}", significant(low, 4), significant(high, 4)),
    }
}

fn rejected(page: &mut Page, stations: &[StationSummary]) {
    let all: Vec<String> = captures(stations)
        .flat_map(|(station, capture)| {
            let place = format!("{}/{}", capture.setup, station.station);
            capture.rejected.iter().map(move |turn| {
                format!("{place} turn {} (from sample {}): {}", turn.turn, turn.start_sample, turn.reason)
            })
        })
        .collect();
    let mut shown: Vec<String> = all.iter().take(FEW_TURNS).cloned().collect();
    if all.len() > shown.len() {
        shown.push(format!("and {} more: every one is listed with --json", all.len() - shown.len()));
    }
    page.bullets("Rejected turns", &shown);
}

/// Values of sections that are shown, each by the first one there is: unfiltered, about LSCI and the mean line unless the
/// pipeline has others. All of them are in the files.
const SHOWN: [&str; 2] = ["RONt", "Ra"];

/// Behind a number that lacks the orders which are named beside another one.
const STARRED: char = '*';

/// The values shown that any section has, each by the first one there is.
fn first_values(stations: &[StationSummary]) -> Vec<&Value> {
    let first = |symbol| sections(stations).find_map(|(_, section)| value_of(section, symbol));
    SHOWN.into_iter().filter_map(first).collect()
}

/// "RONt LSCI, unfiltered µm": what a value is, with reference and filter.
fn label(value: &Value) -> String {
    format!("{} {}", described(&value.id()), unit(&value.unit))
}

/// "RONt LSCI, unfiltered": a value with reference and filter, without its unit; of a domain's own value its symbol.
pub(super) fn described(id: &ValueId) -> String {
    let (Some(reference), Some(filter)) = (id.reference, id.filter) else { return id.symbol.to_owned() };
    // The mean line is the only one that there is for texture.
    let reference = if reference == "mean line" { String::new() } else { format!(" {reference}") };
    let filter = if filter == "none" { "unfiltered" } else { filter };
    format!("{}{reference}, {filter}", id.symbol)
}

fn sections(stations: &[StationSummary]) -> impl Iterator<Item = (&StationSummary, &SectionSummary)> {
    stations.iter().flat_map(|station| station.sections.iter().map(move |section| (station, section)))
}

fn value_of<'a>(section: &'a SectionSummary, symbol: &str) -> Option<&'a Value> {
    section.values.iter().find(|value| value.symbol == symbol)
}

fn std_of(value: &Value) -> Option<f64> {
    value.uncertainty.as_ref().map(|uncertainty| uncertainty.std)
}

/// A value with its standard uncertainty, or with its 95 % interval where this does not cover the value: noise adds to ranges.
fn with_uncertainty(value: &Value) -> String {
    let mark = mark(value.refuted_by.as_ref());
    let Some(known) = &value.uncertainty else { return significant(value.value, 4) + mark };
    let [low, high] = known.interval_95;
    if (low..=high).contains(&value.value) {
        return with_std(value.value, Some(known.std)) + mark;
    }
    // As many decimals as the uncertainty has.
    let number = |number: f64| with_std(number, Some(known.std)).split(' ').next().unwrap_or_default().to_owned();
    let of = if known.kind == IntervalKind::Prediction { "predicted" } else { "95 %" };
    format!("{} ({of}: {} to {}){mark}", number(value.value), number(low), number(high))
}

fn form_heading(stations: &[StationSummary]) -> String {
    let band = sections(stations).find_map(|(_, section)| of_form(section)).map(|value| value.band_upr);
    let band = band.map(|[low, high]| format!(", {low} to {high} undulations per revolution")).unwrap_or_default();
    format!("Form{band}")
}

fn form_by_station(stations: &[StationSummary]) -> Table {
    let firsts = first_values(stations);
    let mut header =
        vec!["station".to_owned(), "section".into(), "z mm".into(), "rms µm".into(), "± at one angle µm".into()];
    header.extend(firsts.iter().map(|value| label(value)));
    header.push("true error µm".into());
    let mut table = Table::new(2, header);
    for (station, section) in sections(stations) {
        // A measured circle is its own station.
        let name = if station.station == section.section { "" } else { &station.station };
        let mut row = vec![
            name.to_owned(),
            section.section.clone(),
            place(section.z_mm),
            significant(section.form_rms_um, 4),
            known(section.form_std_um, 2),
        ];
        let lost = lost_in(section);
        row.extend(firsts.iter().enumerate().map(|(place, first)| {
            let Some(value) = value_of(section, &first.symbol) else { return String::new() };
            let number = with_uncertainty(value);
            // The orders are named once a row.
            if place == 0 { number + &lacking(lost) } else { number + star(lost) }
        }));
        if firsts.is_empty() {
            row[3].push_str(&lacking(lost));
        } else {
            row[3].push_str(star(lost));
        }
        row.push(known(section.truth_form_rms_error_um, 2));
        table.row(row);
    }
    table
}

/// Orders that a section's form lacks, as its unfiltered values say.
fn lost_in(section: &SectionSummary) -> &[usize] {
    of_form(section).map_or(&[], |value| &value.lost_orders)
}

/// The first value of the whole form: not one of a single order, nor of a reading.
fn of_form(section: &SectionSummary) -> Option<&Value> {
    section.values.iter().find(|value| SHOWN.contains(&&*value.symbol))
}

fn star(lost: &[usize]) -> &'static str {
    if lost.is_empty() { "" } else { "*" }
}

fn form_gathered(stations: &[StationSummary]) -> Table {
    let mut ids: Vec<&str> = sections(stations).map(|(_, section)| &*section.section).collect();
    ids.sort_unstable();
    ids.dedup();
    // Measured circles are sections of their own; those of a rig come back at every station.
    if ids.len() > FEW_STATIONS {
        ids = vec![""];
    }
    let mut table = Table::new(2, ["section", "value", "lowest", "median", "highest"]);
    for id in ids {
        let of: Vec<&SectionSummary> =
            sections(stations).map(|(_, section)| section).filter(|one| id.is_empty() || one.section == id).collect();
        let mut gather = |name: String, digits, value: &dyn Fn(&SectionSummary) -> Option<f64>| {
            if let Some(values) = spread(of.iter().filter_map(|section| value(section))) {
                let mut row = vec![id.to_owned(), name];
                row.extend(values.map(|value| significant(value, digits)));
                table.row(row);
            }
        };
        gather("z mm".into(), 5, &|section| Some(rounded_place(section.z_mm)));
        // All sections of a rig lose the same orders, or nearly so.
        let mut lost: Vec<usize> = of.iter().flat_map(|section| lost_in(section)).copied().collect();
        lost.sort_unstable();
        lost.dedup();
        let lost = lacking(&lost);
        gather(format!("rms µm{lost}"), 4, &|section| Some(section.form_rms_um));
        gather("± at one angle µm".into(), 2, &|section| section.form_std_um);
        for first in first_values(stations) {
            let (symbol, unit) = (&first.symbol, unit(&first.unit));
            let refuted = of.iter().find_map(|section| value_of(section, symbol)?.refuted_by.as_ref());
            let name = format!("{}{lost}{}", label(first), mark(refuted));
            gather(name, 4, &|section| Some(value_of(section, symbol)?.value));
            gather(format!("{symbol} ± {unit}"), 2, &|section| std_of(value_of(section, symbol)?));
        }
        gather("true error µm".into(), 2, &|section| section.truth_form_rms_error_um);
    }
    table
}

fn known(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(String::new, |value| significant(value, digits))
}

/// One value of a station.
type OfStation<'a> = &'a dyn Fn(&StationSummary) -> Option<f64>;

/// Rows of one value a station, gathered: the one where there is one station, lowest, median and highest else.
fn gathered(rows: &[(&str, OfStation)], stations: &[StationSummary]) -> Table {
    let single = stations.len() == 1;
    let header: &[&str] = if single { &["", "value"] } else { &["", "lowest", "median", "highest"] };
    let mut table = Table::new(1, header.iter().copied());
    for (name, value) in rows {
        if let Some(values) = spread(stations.iter().filter_map(value)) {
            let shown = if single { &values[..1] } else { &values[..] };
            let cells = shown.iter().map(|value| significant(*value, 3));
            table.row(std::iter::once((*name).to_owned()).chain(cells));
        }
    }
    table
}

fn residual(page: &mut Page, stations: &[StationSummary]) {
    let table = gathered(
        &[
            ("left by the fit, rms µm", &|station| station.residual_rms_um),
            ("expected from the noise measured, rms µm", &|station| station.expected_residual_rms_um),
            ("chi squared per degree of freedom", &|station| station.chi2_per_dof),
        ],
        stations,
    );
    let of_one_order = stations.iter().filter_map(|station| station.residual_orders).all(|orders| orders == [1, 1]);
    let only = stations.iter().any(|station| station.residual_orders.is_some()) && of_one_order;
    page.headed_table(
        if only { "Residual, of order 1 only: no other order has a redundant reading" } else { "Residual" },
        &table,
    );
    if table.is_empty() {
        page.heading("Residual");
        page.line("  none: no reading is redundant, so nothing checks the fit");
    }
}

fn motion_truth(page: &mut Page, stations: &[StationSummary]) {
    let table = gathered(
        &[
            ("x, rms µm", &|station| station.truth.as_ref()?.x_rms_error_um),
            ("y, rms µm", &|station| station.truth.as_ref()?.y_rms_error_um),
            ("tilt x, rms µrad", &|station| station.truth.as_ref()?.tilt_x_rms_error_urad),
            ("tilt y, rms µrad", &|station| station.truth.as_ref()?.tilt_y_rms_error_urad),
            ("along the line, rms µm", &|station| station.truth.as_ref()?.along_rms_error_um),
            ("tilt along the line, rms µrad", &|station| station.truth.as_ref()?.tilt_along_rms_error_urad),
        ],
        stations,
    );
    page.headed_table("True error of the motion", &table);
}

fn lost_orders(page: &mut Page, summary: &Summary) {
    let lost = [("form", &summary.lost_orders.form), ("motion", &summary.lost_orders.motion)];
    if lost.iter().any(|(_, orders)| !orders.is_empty()) {
        page.heading("Lost orders");
        for (quantity, orders) in lost {
            page.line(format_args!("  {quantity:<6}  {}", ranges(orders)));
        }
    }
}

fn surface(page: &mut Page, summary: &Summary) {
    let Some(surface) = &summary.surface else { return };
    let [from, to] = surface.z_mm.map(place);
    page.heading("Surface");
    page.line(format_args!("  {} angles × {} rings, z {from} to {to} mm", surface.angles, surface.rings));
    page.line(format_args!("  between sections: {}", surface.interpolation));
    let mut meetings: Vec<_> = surface.meetings.iter().collect();
    meetings.sort_by(|a, b| b.rms_um.total_cmp(&a.rms_um));
    let mut table = Table::new(1, ["sections that meet", "z mm", "differ by rms µm", "expected µm", "at most µm"]);
    for meeting in meetings.iter().take(FEW_STATIONS) {
        table.row([
            meeting.sections.join(" and "),
            place(meeting.z_mm),
            significant(meeting.rms_um, 3),
            known(meeting.expected_rms_um, 3),
            significant(meeting.max_um, 3),
        ]);
    }
    page.table(&table);
    if meetings.len() > FEW_STATIONS {
        page.line(format_args!("  and {} more that agree better", meetings.len() - FEW_STATIONS));
    }
}

#[cfg(test)]
mod tests;
