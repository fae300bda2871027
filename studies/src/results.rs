//! Numbers of two folders of results side by side: Parquet, HDF5 and JSON.

use std::{
    collections::BTreeMap,
    fmt::Write,
    fs::{self, File},
    path::{Path, PathBuf},
};

use arrow_array::{cast::AsArray, types::Float64Type};
use hdf5_metno::{Group, LocationType, types::TypeDescriptor};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use runout_core::{Error, Result};
use serde_json::Value;

/// Numbers this small are rounding in µm, µrad and mm alike.
const ROUNDING: f64 = 1e-13;
/// What says where and when a result was made, and is no number of it.
const PLACES: [&str; 4] = ["configuration", "outputs", "inputs", "program"];

/// What two folders have in common, and what differs.
#[derive(Debug, Default)]
pub struct Differences {
    /// Numbers compared.
    compared: usize,
    /// The largest relative difference.
    largest: f64,
    /// Each column or key that differs by more, with its largest relative difference.
    beyond: Vec<(String, f64)>,
    /// What is in one folder only.
    missing: Vec<String>,
}

impl Differences {
    /// Whether a number differs by more, or is in one folder only.
    #[must_use]
    pub fn differ(&self) -> bool {
        !(self.beyond.is_empty() && self.missing.is_empty())
    }

    /// What was found, as text.
    #[must_use]
    pub fn report(&self) -> String {
        let mut text = format!("{} numbers compared; largest relative difference {:.1e}", self.compared, self.largest);
        for (name, difference) in &self.beyond {
            // Writing to a string cannot fail.
            let _ = write!(text, "\n  {name}: {difference:.3e}");
        }
        for name in &self.missing {
            let _ = write!(text, "\n  only in one: {name}");
        }
        text
    }

    fn series(&mut self, name: &str, a: &[f64], b: &[f64], relative: f64) {
        if a.len() != b.len() {
            self.missing.push(format!("{name}: {} and {} rows", a.len(), b.len()));
            return;
        }
        // Of a column, what counts is its size: zeros of a wave differ by more than their own.
        let size = a.iter().filter(|value| value.is_finite()).fold(0.0, |size: f64, value| size.max(value.abs()));
        let mut worst = 0.0_f64;
        for (a, b) in a.iter().zip(b) {
            let difference = if a.is_finite() && b.is_finite() {
                (a - b).abs()
            } else if a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()) {
                0.0
            } else {
                f64::INFINITY
            };
            if difference > ROUNDING {
                worst = worst.max(difference / size.max(f64::MIN_POSITIVE));
            }
        }
        self.compared += a.len();
        self.largest = self.largest.max(worst);
        if worst > relative {
            self.beyond.push((name.to_owned(), worst));
        }
    }
}

/// Compares all tables and documents below two folders.
///
/// # Errors
/// When a file cannot be read.
pub fn compare(a: &Path, b: &Path, relative: f64) -> Result<Differences> {
    let mut found = Differences::default();
    let files = [files(a)?, files(b)?];
    for name in files[0].keys().chain(files[1].keys().filter(|name| !files[0].contains_key(*name))) {
        let (Some(a), Some(b)) = (files[0].get(name), files[1].get(name)) else {
            found.missing.push(name.clone());
            continue;
        };
        let columns = [columns(a)?, columns(b)?];
        for (column, values) in &columns[0] {
            let full = format!("{name}: {column}");
            match columns[1].get(column) {
                Some(other) => found.series(&full, values, other, relative),
                None => found.missing.push(full),
            }
        }
        let new = columns[1].keys().filter(|column| !columns[0].contains_key(*column));
        found.missing.extend(new.map(|column| format!("{name}: {column}")));
    }
    Ok(found)
}

/// Result files below a folder, by their place in it.
fn files(folder: &Path) -> Result<BTreeMap<String, PathBuf>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(current) = folders.pop() {
        let failure = |error: std::io::Error| Error::caused("read", current.display().to_string(), error);
        for entry in fs::read_dir(&current).map_err(failure)? {
            let path = entry.map_err(failure)?.path();
            let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
            if path.is_dir() {
                folders.push(path);
            } else if ["parquet", "h5", "json"].contains(&extension) {
                let name = path.strip_prefix(folder).unwrap_or(&path).to_string_lossy().into_owned();
                found.insert(name, path);
            }
        }
    }
    Ok(found)
}

/// All columns of numbers of a file.
fn columns(path: &Path) -> Result<BTreeMap<String, Vec<f64>>> {
    let shown = path.display().to_string();
    let mut columns = BTreeMap::new();
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("parquet") => {
            let failure = |error: parquet::errors::ParquetError| Error::caused("read", &shown, error);
            let file = File::open(path).map_err(|error| Error::caused("read", &shown, error))?;
            let reader = ParquetRecordBatchReaderBuilder::try_new(file).map_err(failure)?;
            for batch in reader.build().map_err(failure)? {
                let batch = batch.map_err(|error| Error::caused("read", &shown, error))?;
                for (field, values) in batch.schema().fields().iter().zip(batch.columns()) {
                    if let Some(numbers) = values.as_primitive_opt::<Float64Type>() {
                        let all: &mut Vec<f64> = columns.entry(field.name().clone()).or_default();
                        all.extend(numbers.iter().map(|number| number.unwrap_or(f64::NAN)));
                    }
                }
            }
        }
        Some("h5") => {
            let file = hdf5_metno::File::open(path).map_err(|error| Error::caused("read", &shown, error))?;
            datasets(&file, "", &mut columns).map_err(|error| Error::caused("read", &shown, error))?;
        }
        _ => {
            let text = fs::read(path).map_err(|error| Error::caused("read", &shown, error))?;
            let value: Value = serde_json::from_slice(&text).map_err(|error| Error::caused("read", &shown, error))?;
            leaves(&value, "", &mut columns);
        }
    }
    Ok(columns)
}

fn datasets(group: &Group, place: &str, into: &mut BTreeMap<String, Vec<f64>>) -> hdf5_metno::Result<()> {
    for name in group.member_names()? {
        let full = format!("{place}/{name}");
        match group.loc_type_by_name(&name)? {
            LocationType::Group => datasets(&group.group(&name)?, &full, into)?,
            LocationType::Dataset => {
                let dataset = group.dataset(&name)?;
                if let TypeDescriptor::Float(_) = dataset.dtype()?.to_descriptor()? {
                    into.insert(full, dataset.read_raw::<f64>()?);
                }
            }
            _ => {}
        }
    }
    Ok(())
}

fn leaves(value: &Value, place: &str, into: &mut BTreeMap<String, Vec<f64>>) {
    match value {
        Value::Number(number) => {
            into.insert(place.to_owned(), vec![number.as_f64().unwrap_or(f64::NAN)]);
        }
        Value::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                leaves(item, &format!("{place}/{index}"), into);
            }
        }
        Value::Object(items) => {
            for (key, item) in items.iter().filter(|(key, _)| !PLACES.contains(&key.as_str())) {
                leaves(item, &format!("{place}/{key}"), into);
            }
        }
        Value::Null | Value::Bool(_) | Value::String(_) => {}
    }
}
