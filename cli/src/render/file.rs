//! What a file holds, for people.

use runout_channels::{ChannelReport, ChannelsReport};
use runout_csv::TextReport;
use runout_hdf5::{FileReport, StationReport};

use super::{
    number::{place, significant},
    page::Page,
    table::Table,
};
use crate::reports::inspect::{ConvertReport, MapReport, Report, TableReport};

/// The text of a report.
#[must_use]
pub(crate) fn text(report: &Report) -> String {
    let mut page = Page::default();
    match report {
        Report::Hdf5(file) => hdf5(&mut page, file),
        Report::Parquet(table) => parquet(&mut page, table),
        Report::Text(table) => csv(&mut page, table),
        Report::Channels(file) => channels(&mut page, file),
        Report::Map(found) => {
            map(&mut page, found);
            page.line("  in a pipeline: load = { plugin = \"height-map\", path = … }, separate = { plugin = \"as-measured\" }");
        }
    }
    page.into_text()
}

/// What `runout convert` did.
#[must_use]
pub(crate) fn converted(report: &ConvertReport) -> String {
    let mut page = Page::default();
    map(&mut page, &report.input);
    page.line(format_args!("  written: {}", report.output.display()));
    page.bullets("Not in the written file", &report.lost);
    page.into_text()
}

fn map(page: &mut Page, map: &MapReport) {
    let [low, high] = map.height_nm.map(|height| significant(1e-3 * height, 6));
    let [step_x, step_y] = map.step_mm.map(|step| significant(step, 6));
    let what = if map.rows == 1 { "profile" } else { "height map" };
    page.line(format_args!("{}, {what} of {} rows and {} columns", map.format, map.rows, map.columns));
    page.line(format_args!("  steps: {step_x} mm along x, {step_y} mm along y"));
    page.line(format_args!("  heights: {low} to {high} µm, {} points without one", map.voids));
    if map.layers.len() > 1 {
        page.line(format_args!("  maps in the file: {}", map.layers.join(", ")));
    }
    for (name, value) in &map.about {
        page.line(format_args!("  {name}: {value}"));
    }
    page.warnings("Warnings and notes", &map.warnings);
}

fn hdf5(page: &mut Page, file: &FileReport) {
    let version = file.version.map(|version| format!(", version {version}")).unwrap_or_default();
    page.line(format_args!(
        "{}{version}",
        file.format.as_deref().unwrap_or("HDF5 without a format that is known here")
    ));
    for (name, value) in [("title", &file.title), ("program", &file.program)] {
        if let Some(value) = value {
            page.line(format_args!("  {name}: {value}"));
        }
    }
    if file.truth {
        page.line("  truth: the file says what is true");
    }
    page.headed_table("Captures", &captures(&file.stations));
    let mut tables = Table::new(1, ["table", "rows", "columns"]);
    for table in &file.tables {
        tables.row([table.table.clone(), table.rows.to_string(), table.columns.join(", ")]);
    }
    page.headed_table("Tables", &tables);
    page.bullets("Members", &file.members);
}

fn captures(stations: &[StationReport]) -> Table {
    let header = ["station", "setup", "channels", "angle by", "type", "z mm", "turns", "samples", "rate Hz", "rpm"];
    let mut table = Table::new(5, header);
    let known = |value: Option<f64>| value.map_or_else(String::new, |value| significant(value, 5));
    for station in stations {
        for capture in &station.captures {
            table.row([
                station.station.clone(),
                capture.setup.clone(),
                capture.channels.join(" "),
                capture.phase.to_owned(),
                capture.sample_type.to_owned(),
                place(station.z_mm),
                capture.turns.to_string(),
                capture.samples.to_string(),
                known(capture.sample_rate_hz),
                known(capture.speed_rpm),
            ]);
        }
    }
    table
}

fn channels(page: &mut Page, file: &ChannelsReport) {
    page.line(format_args!("{}, {} channels", file.format, file.channels.len()));
    let header = ["channel", "unit", "type", "samples", "rate Hz", "starts s", "first readings"];
    let mut table = Table::new(3, header);
    let known = |value: Option<f64>| value.map_or_else(String::new, |value| significant(value, 6));
    for ChannelReport { channel, first } in &file.channels {
        table.row([
            channel.path(),
            channel.unit.clone().unwrap_or_default(),
            channel.kind.name().to_owned(),
            channel.samples.to_string(),
            known(channel.rate_hz),
            known(channel.start_s),
            first.iter().map(|value| significant(*value, 6)).collect::<Vec<_>>().join(" "),
        ]);
    }
    page.headed_table("Channels", &table);
    page.line(format_args!("  the mark seems to be in: {}", file.mark.as_deref().unwrap_or("no channel")));
    page.bullets("Remarks", &file.remarks);
    page.heading("To load it");
    file.load.lines().for_each(|line| page.code(line));
}

fn csv(page: &mut Page, table: &TextReport) {
    let TextReport { delimiter, header_line, columns, rows, .. } = table;
    page.line(format_args!(
        "CSV, {rows} rows of {} columns, split at each {delimiter}, header in line {header_line}",
        columns.len()
    ));
    page.line(format_args!("  columns: {}", columns.join(", ")));
    page.line(format_args!(
        "  angle by: {}",
        table
            .angle_by
            .unwrap_or("no column `index` or `angle_deg`; the trace of a mark is named by `marker` in [load]")
    ));
    page.line(format_args!("  sampling rate: {}", if table.time { "by time_s" } else { "sample_rate_hz in [load]" }));
}

fn parquet(page: &mut Page, table: &TableReport) {
    page.line(format_args!("Parquet, {} rows in {} row groups", table.rows, table.row_groups));
    let mut columns = Table::new(3, ["column", "type", ""]);
    for column in &table.columns {
        let optional = if column.optional { "may be absent" } else { "" };
        columns.row([column.name.as_str(), &column.r#type, optional]);
    }
    page.headed_table("Columns", &columns);
    page.heading("Metadata");
    for (key, value) in &table.metadata {
        match value.as_deref().unwrap_or_default() {
            text if text.contains('\n') => page.line(format_args!("  {key}: {} lines", text.lines().count())),
            text => page.line(format_args!("  {key}: {text}")),
        }
    }
}
