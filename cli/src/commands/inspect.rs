//! `runout inspect`: what a file holds.

use std::{fs::File, io::Read, path::Path};

use parquet::file::reader::{FileReader, SerializedFileReader};
use runout_core::{Error, Result};
use serde::Serialize;
use serde_json::Value;

use super::print;
use crate::{args::InspectArgs, failure::Failure, render::tree};

/// Says what a file holds, told by its first bytes and not by its name.
///
/// # Errors
/// When it cannot be read, or is of no known kind.
pub fn execute(args: &InspectArgs, json: bool) -> std::result::Result<(), Failure> {
    let report = report(&args.file)?;
    print(&report, json, tree::text)
}

fn report(path: &Path) -> Result<Value> {
    let shown = path.display().to_string();
    let failure = |problem: &dyn ToString| Error::new("inspect", &shown, problem.to_string());
    let mut signature = Vec::new();
    let file = File::open(path).map_err(|error| failure(&error))?;
    file.take(8).read_to_end(&mut signature).map_err(|error| failure(&error))?;
    if signature == *b"\x89HDF\r\n\x1a\n" {
        return serde_json::to_value(runout_hdf5::inspect(path)?).map_err(|error| failure(&error));
    }
    if signature.starts_with(b"PAR1") {
        return serde_json::to_value(table(path)?).map_err(|error| failure(&error));
    }
    Err(failure(&"it is neither HDF5 nor Parquet").help("inspect reads measurement files, results and Parquet tables"))
}

/// A Parquet table in short.
#[derive(Debug, Serialize)]
struct TableReport {
    format: &'static str,
    rows: i64,
    row_groups: usize,
    columns: Vec<ColumnReport>,
    metadata: Vec<MetadataReport>,
}

#[derive(Debug, Serialize)]
struct ColumnReport {
    name: String,
    r#type: String,
    optional: bool,
}

#[derive(Debug, Serialize)]
struct MetadataReport {
    key: String,
    value: Option<String>,
}

/// Arrow's own schema, in Base64: the columns say the same.
const ARROW_SCHEMA: &str = "ARROW:schema";

fn table(path: &Path) -> Result<TableReport> {
    let failure = |problem: &dyn ToString| Error::new("inspect", path.display().to_string(), problem.to_string());
    let file = File::open(path).map_err(|error| failure(&error))?;
    let reader = SerializedFileReader::new(file).map_err(|error| failure(&error))?;
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
        metadata: entries.map(|entry| MetadataReport { key: entry.key.clone(), value: entry.value.clone() }).collect(),
    })
}
