//! The synchronous error motion of a spindle run: `motion.parquet`.

use std::{f64::consts::TAU, path::Path};

use arrow_array::{Array, Float64Array, RecordBatch, StringArray, cast::AsArray};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use runout_core::{
    Error, Result,
    closed_loop::diagnosis::Diagnosis,
    input_file::{open_regular, read_text},
};

/// Displacement and tilt of the axis.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Displacement {
    pub x_um: f64,
    pub y_um: f64,
    pub z_um: f64,
    pub tilt_x_urad: f64,
    pub tilt_y_urad: f64,
}

/// Motion over the angle of the spindle.
#[derive(Debug, Clone)]
pub(super) struct Synchronous {
    /// Angles from 0 to below 2π, ascending.
    angles: Vec<f64>,
    motion: Vec<Displacement>,
}

/// Columns of numbers: what is not there, or lost, is 0.
const COLUMNS: [&str; 5] = ["x_um", "y_um", "z_um", "tilt_x_urad", "tilt_y_urad"];

impl Synchronous {
    /// Reads one station.
    pub(crate) fn read(path: &Path, station: Option<&str>) -> Result<Self> {
        let shown = path.display().to_string();
        let failure = |problem: String| Error::new("read the motion from", &shown, problem);
        let file = open_regular(path).map_err(|error| failure(error.to_string()))?;
        let reader = ParquetRecordBatchReaderBuilder::try_new(file).and_then(ParquetRecordBatchReaderBuilder::build);
        let reader = reader.map_err(|error| failure(format!("expected `motion.parquet` of a spindle run: {error}")))?;
        let mut wanted = station.map(str::to_owned);
        let mut all: Vec<(f64, Displacement)> = Vec::new();
        for batch in reader {
            let batch = batch.map_err(|error| failure(error.to_string()))?;
            let stations = names(&batch, "station").ok_or_else(|| failure("the column `station` is missing".into()))?;
            let angles = numbers(&batch, "angle_deg");
            let angles = angles.ok_or_else(|| failure("the column `angle_deg` is missing".into()))?;
            let columns = COLUMNS.map(|name| numbers(&batch, name));
            if columns.iter().all(Option::is_none) {
                return Err(failure(format!("none of the columns {} is there", COLUMNS.join(", "))));
            }
            let value = |column: usize, row: usize| {
                let values = columns[column].as_ref();
                values.map(|values| values[row]).filter(|value| value.is_finite()).unwrap_or(0.0)
            };
            for row in 0..batch.num_rows() {
                let name = &stations[row];
                if wanted.get_or_insert_with(|| name.clone()) != name {
                    continue;
                }
                let [x_um, y_um, z_um, tilt_x_urad, tilt_y_urad] = [0, 1, 2, 3, 4].map(|column| value(column, row));
                let angle = angles[row].to_radians().rem_euclid(TAU);
                all.push((angle, Displacement { x_um, y_um, z_um, tilt_x_urad, tilt_y_urad }));
            }
        }
        if all.len() < 2 {
            let of = wanted.map_or(String::new(), |name| format!(" of the station `{name}`"));
            return Err(failure(format!("there are {} angles{of}; two or more are needed", all.len())));
        }
        all.sort_by(|one, other| one.0.total_cmp(&other.0));
        Ok(Self {
            angles: all.iter().map(|(angle, _)| *angle).collect(),
            motion: all.iter().map(|(_, at)| *at).collect(),
        })
    }

    /// Between the angles measured, a straight line.
    pub(crate) fn at(&self, angle: f64) -> Displacement {
        let angle = angle.rem_euclid(TAU);
        let count = self.angles.len();
        let next = self.angles.partition_point(|known| *known <= angle);
        let (before, next) = ((next + count - 1) % count, next % count);
        let width = (self.angles[next] - self.angles[before]).rem_euclid(TAU);
        let share = if width > 0.0 { (angle - self.angles[before]).rem_euclid(TAU) / width } else { 0.0 };
        let [one, other] = [self.motion[before], self.motion[next]];
        let between = |of: fn(&Displacement) -> f64| of(&one) + share * (of(&other) - of(&one));
        Displacement {
            x_um: between(|at| at.x_um),
            y_um: between(|at| at.y_um),
            z_um: between(|at| at.z_um),
            tilt_x_urad: between(|at| at.tilt_x_urad),
            tilt_y_urad: between(|at| at.tilt_y_urad),
        }
    }

    /// A bound of the height at a tool, in nm.
    pub(crate) fn highest_nm(&self, radius_mm: f64) -> f64 {
        let height =
            |at: &Displacement| 1e3 * at.z_um.abs() + radius_mm * (at.tilt_x_urad.abs() + at.tilt_y_urad.abs());
        self.motion.iter().map(height).fold(0.0, f64::max)
    }
}

/// A line that was found in a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FoundLine {
    /// Periods a turn.
    pub order: f64,
    pub amplitude_um: f64,
}

/// The asynchronous lines of a diagnosis.
pub(super) fn lines(path: &Path) -> Result<Vec<FoundLine>> {
    let shown = path.display().to_string();
    let failure = |problem: String| Error::new("read the diagnosis", &shown, problem);
    let text = read_text(path).map_err(|error| failure(error.to_string()))?;
    let diagnosis: Diagnosis = serde_json::from_str(&text)
        .map_err(|error| failure(format!("expected `diagnosis.json` of a spindle's recording: {error}")))?;
    let lines = diagnosis.added.iter().filter(|added| added.effect == "asynchronous-line").filter_map(|added| {
        let value = |name: &str| added.parameters.iter().find(|one| one.name == name).map(|one| one.value);
        Some(FoundLine { order: value("order")?, amplitude_um: value("amplitude")? })
    });
    let lines: Vec<FoundLine> = lines.collect();
    if lines.is_empty() {
        return Err(
            failure("it names no `asynchronous-line`".into()).help("`runout diagnose` of the recording writes it")
        );
    }
    Ok(lines)
}

fn names(batch: &RecordBatch, name: &str) -> Option<Vec<String>> {
    let column = batch.column_by_name(name)?;
    let text = |texts: &StringArray| texts.iter().map(|text| text.unwrap_or_default().to_owned()).collect();
    if let Some(texts) = column.as_string_opt::<i32>() {
        return Some(text(texts));
    }
    let dictionary = column.as_any_dictionary_opt()?;
    let values = dictionary.values().as_string_opt::<i32>()?;
    Some(dictionary.normalized_keys().into_iter().map(|key| values.value(key).to_owned()).collect())
}

fn numbers(batch: &RecordBatch, name: &str) -> Option<Vec<f64>> {
    let column = batch.column_by_name(name)?.as_any().downcast_ref::<Float64Array>()?;
    Some(column.iter().map(|value| value.unwrap_or(f64::NAN)).collect())
}
