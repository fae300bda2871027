//! `runout inspect`: what a file holds.

use std::{fs::File, io::Read, path::Path};

use parquet::file::reader::{FileReader, SerializedFileReader};
use runout_core::{Error, ErrorKind, Result, atomic_file::complete_publication, input_file::open_regular};
use runout_parquet::ParquetFile;

use super::print;
use crate::{
    args::InspectArgs,
    failure::Failure,
    render,
    reports::inspect::{ColumnReport, MapReport, Report, TableReport},
};

/// Says what a file holds, by its first bytes and not by its name.
///
/// # Errors
/// When it cannot be read, or is of no known kind.
pub(crate) fn execute(args: &InspectArgs, json: bool) -> std::result::Result<(), Failure> {
    let report = report(&args.file)?;
    print(&report, json, render::file::text)
}

/// What a file holds.
///
/// # Errors
/// When it cannot be read, or is of no known kind.
pub(crate) fn report(path: &Path) -> Result<Report> {
    complete_publication(path)?;
    let mut signature = Vec::new();
    let start = open_regular(path).and_then(|file| file.take(8).read_to_end(&mut signature));
    start.map_err(|error| Error::caused("inspect", path.display().to_string(), error))?;
    if signature == *b"\x89HDF\r\n\x1a\n" {
        let report = runout_hdf5::inspect(path)?;
        if report.format.is_some() {
            return Ok(Report::Hdf5(report));
        }
        return Ok(channels(path)?.unwrap_or(Report::Hdf5(report)));
    }
    if signature.starts_with(b"PAR1") {
        let report = table(path)?;
        // What this program wrote says so.
        if report.metadata.keys().any(|key| key.starts_with("runout")) {
            return Ok(Report::Parquet(report));
        }
        return Ok(channels(path)?.unwrap_or(Report::Parquet(report)));
    }
    if runout_maps::is_map(path)? {
        let map = runout_maps::read(path, &runout_maps::Wanted::default())?;
        return Ok(Report::Map(MapReport::new(map)));
    }
    // What is no text is left to those who know it.
    if let Ok(Some(text)) = runout_csv::inspect(path)
        && text.angle_by.is_some()
    {
        return Ok(Report::Text(text));
    }
    if let Some(report) = channels(path)? {
        return Ok(report);
    }
    if let Some(text) = runout_csv::inspect(path)? {
        return Ok(Report::Text(text));
    }
    let problem = "it is of no format that is known here, nor a table as text";
    Err(Error::new("inspect", path.display().to_string(), problem)
        .of(ErrorKind::DamagedData)
        .help(
            "inspect reads measurement files, results, recordings of named channels (TDMS, MAT, HDF5, LVM, NumPy, Parquet, Arrow, UFF, WAV), height maps (X3P, SDF, SUR) and CSV files with a header. Columns of CSV files are delimited by comma, \
             semicolon or tab (those of numbers with decimal commas by semicolon or tab), and lines before the header begin with `#`",
        ))
}

/// Named channels, where the file is of one of their formats.
fn channels(path: &Path) -> Result<Option<Report>> {
    Ok(runout_channels::inspect(path)?.map(Report::Channels))
}

/// Arrow's own schema, in Base64: the columns say the same.
const ARROW_SCHEMA: &str = "ARROW:schema";

fn table(path: &Path) -> Result<TableReport> {
    let shown = path.display().to_string();
    let file = File::open(path).and_then(ParquetFile::new).map_err(|error| Error::caused("inspect", &shown, error))?;
    let reader = SerializedFileReader::new(file)
        .map_err(|error| Error::caused("inspect", &shown, error).of(ErrorKind::DamagedData))?;
    let metadata = reader.metadata();
    let about = metadata.file_metadata();
    let columns = about.schema_descr().columns().iter().map(|column| ColumnReport {
        name: column.path().string(),
        r#type: column.physical_type().to_string(),
        optional: column.self_type().is_optional(),
    });
    let entries = about.key_value_metadata().into_iter().flatten().filter(|entry| entry.key != ARROW_SCHEMA);
    Ok(TableReport {
        format: "parquet",
        rows: about.num_rows(),
        row_groups: metadata.num_row_groups(),
        columns: columns.collect(),
        metadata: entries.map(|entry| (entry.key.clone(), entry.value.clone())).collect(),
    })
}
