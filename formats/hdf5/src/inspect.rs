//! A look into a file: what it holds.

use std::{collections::HashMap, path::Path};

use hdf5_metno::{File, LocationType};
use runout_core::Result;
use serde::Serialize;

use crate::{
    MEASUREMENT_FORMAT, RESULT_FORMAT,
    measurement::{CaptureSource, Phase, TRUTH},
    node::{self, Place},
    utf8_path,
};

/// What a file holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FileReport {
    /// "runout-measurement", "runout-result", or what else the file says.
    pub format: Option<String>,
    /// Version of the format.
    pub version: Option<u64>,
    /// For people.
    pub title: Option<String>,
    /// The program that wrote it.
    pub program: Option<String>,
    /// Setups of a measurement.
    pub setups: Vec<String>,
    /// Stations of a measurement, by z.
    pub stations: Vec<StationReport>,
    /// Whether a measurement carries the truth.
    pub truth: bool,
    /// Tables of a result.
    pub tables: Vec<TableReport>,
    /// Names at the top, of a file that is neither.
    pub members: Vec<String>,
}

/// A station of a measurement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StationReport {
    /// Its name.
    pub station: String,
    /// Carriage position, in mm.
    pub z_mm: f64,
    /// One entry a setup that has it.
    pub captures: Vec<CaptureReport>,
}

/// One station in one setup.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaptureReport {
    /// Id of the setup.
    pub setup: String,
    /// Names of the channels.
    pub channels: Vec<String>,
    /// Samples a channel.
    pub samples: usize,
    /// "f64", "f32", "i16" or "i32".
    pub sample_type: &'static str,
    /// Sampling rate, where stated.
    pub sample_rate_hz: Option<f64>,
    /// Speed, where stated.
    pub speed_rpm: Option<f64>,
    /// "index", "angle_deg", or "none": a trace of the mark is known by `marker` in `[load]` only.
    pub phase: &'static str,
    /// Whole turns between the first and the last mark.
    pub turns: usize,
}

/// A table of a result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TableReport {
    /// Its name.
    pub table: String,
    /// Number of rows.
    pub rows: usize,
    /// Names of the columns.
    pub columns: Vec<String>,
}

/// Looks into an HDF5 file.
///
/// # Errors
/// When it cannot be read, or does not hold what its format promises.
pub fn inspect(path: &Path) -> Result<FileReport> {
    utf8_path::check(path)?;
    let (file, place, _) = node::open(path, false)?;
    let version = node::number(&file, &place, "version").ok().flatten();
    let mut report = FileReport {
        format: node::text(&file, &place, "format")?,
        version: version.filter(|version| *version >= 0.0).map(|version| version as u64),
        title: node::text(&file, &place, "title")?.filter(|title| !title.is_empty()),
        program: node::text(&file, &place, "program")?,
        setups: Vec::new(),
        stations: Vec::new(),
        truth: false,
        tables: Vec::new(),
        members: Vec::new(),
    };
    match report.format.as_deref() {
        Some(MEASUREMENT_FORMAT) => measurement(&file, &place, &mut report)?,
        Some(RESULT_FORMAT) => report.tables = tables(&file, &place)?,
        _ => report.members = node::members(&file, &place)?,
    }
    Ok(report)
}

fn measurement(file: &File, place: &Place, report: &mut FileReport) -> Result<()> {
    let mut places: HashMap<String, usize> = HashMap::new();
    for setup in node::members(file, place)? {
        if setup == TRUTH {
            report.truth = !node::group(file, place, TRUTH)?.0.is_empty();
            continue;
        }
        let (group, place) = node::group(file, place, &setup)?;
        for station in node::members(&group, &place)? {
            if node::kind(&group, &place, &station)? != LocationType::Group {
                continue;
            }
            let source = CaptureSource::open(&group, &place, &station, None)?;
            // A trace of the mark is only known by the configuration.
            let is_known = source.phase.check().is_ok();
            let marks = if is_known { source.marks()?.0.at } else { Vec::new() };
            let capture = CaptureReport {
                setup: setup.clone(),
                samples: source.stored.samples,
                sample_type: source.stored.kind.name(),
                sample_rate_hz: source.stored.sample_rate_hz,
                speed_rpm: source.speed_rpm,
                phase: match source.phase {
                    Phase::Index(_) => "index",
                    Phase::Angle(_) => "angle_deg",
                    Phase::Trace(..) | Phase::Unknown(_) => "none",
                },
                turns: marks.len().saturating_sub(1),
                channels: source.stored.sensors,
            };
            if let Some(place) = places.get(&station) {
                report.stations[*place].captures.push(capture);
            } else {
                places.insert(station.clone(), report.stations.len());
                report.stations.push(StationReport { station, z_mm: source.z_mm, captures: vec![capture] });
            }
        }
        report.setups.push(setup);
    }
    report.stations.sort_by(|a, b| a.z_mm.total_cmp(&b.z_mm).then_with(|| a.station.cmp(&b.station)));
    Ok(())
}

fn tables(file: &File, place: &Place) -> Result<Vec<TableReport>> {
    let mut tables = Vec::new();
    for table in node::members(file, place)? {
        if table == "provenance" || node::kind(file, place, &table)? != LocationType::Group {
            continue;
        }
        let (group, place) = node::group(file, place, &table)?;
        let columns = node::members(&group, &place)?;
        let rows = match columns.first() {
            Some(column) => node::dataset(&group, &place, column)?.0.size(),
            None => 0,
        };
        tables.push(TableReport { table, rows, columns });
    }
    Ok(tables)
}
