//! Readings by themselves, where the layout separates nothing.

use runout_core::{reading::ReadingValues, summary::StationSummary};

use super::{FEW_STATIONS, sections, unit, with_uncertainty};
use crate::render::{
    number::{significant, with_std},
    page::Page,
    table::Table,
};

/// Harmonics that are shown beside a reading, the largest first.
const SHOWN: usize = 5;

/// Run-out, 1/rev and the largest harmonics of every reading.
pub(crate) fn section(page: &mut Page, stations: &[StationSummary]) {
    let all = || stations.iter().flat_map(|station| station.readings.iter().map(move |reading| (station, reading)));
    let header = ["station", "setup", "sensor", "run-out TIR µm", "1/rev µm", "at °", "turns ± µm", "harmonics µm"];
    let mut table = Table::new(3, header);
    for (station, reading) in all().take(FEW_STATIONS) {
        table.row([
            if stations.len() > 1 { station.station.clone() } else { String::new() },
            reading.setup.clone(),
            reading.sensor.clone(),
            with_std(reading.tir_um, reading.tir_std_um),
            with_std(reading.once_per_rev.amplitude_um, reading.once_per_rev.std_um),
            significant(reading.once_per_rev.phase_deg, 4),
            reading.turns_std_um.map_or_else(String::new, |std| significant(std, 3)),
            harmonics(reading),
        ]);
    }
    page.headed_table("Reading: form, eccentricity and error motion together", &table);
    let more = all().count().saturating_sub(FEW_STATIONS);
    if more > 0 {
        page.line(format_args!("  and {more} more: every one is listed with --json"));
    }
    page.line("  1/rev is the amplitude, highest at that spindle angle; turns ± is the standard deviation of single turns at one angle;");
    page.line("  harmonics are the largest amplitudes from order 2, behind their order");
}

/// Symbols of what readings have by themselves.
const OF_READINGS: [&str; 3] = ["TIR", "eccentricity", "eccentricity-angle"];

/// Run-out and eccentricity of each section in each setup, of the first stations.
pub(crate) fn values(page: &mut Page, stations: &[StationSummary]) {
    let mut table = Table::new(3, ["station", "section", "value", "of", "number ± std", "unit"]);
    for (station, section) in sections(&stations[..stations.len().min(FEW_STATIONS)]) {
        for value in section.values.iter().filter(|value| OF_READINGS.contains(&&*value.symbol)) {
            table.row([
                if stations.len() > 1 { station.station.clone() } else { String::new() },
                section.section.clone(),
                value.symbol.clone(),
                value.reference.clone().unwrap_or_default(),
                with_uncertainty(value),
                unit(&value.unit),
            ]);
        }
    }
    page.headed_table("Run-out and eccentricity", &table);
}

fn harmonics(reading: &ReadingValues) -> String {
    let mut largest: Vec<_> = reading.harmonics.iter().collect();
    largest.sort_by(|a, b| b.amplitude_um.total_cmp(&a.amplitude_um));
    let shown = largest.iter().take(SHOWN);
    shown.map(|one| format!("{}: {}", one.order, significant(one.amplitude_um, 2))).collect::<Vec<_>>().join(", ")
}
