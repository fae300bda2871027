//! Where to predict: a grid over the measured volume, the points of a file, or the measured places.

use std::path::PathBuf;

use runout_core::{Error, Result, fault::Fault, input_file::read_text, pipeline::Context};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::campaign::Campaign;

/// Where to predict.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Query {
    /// Distances of a grid over the measured volume along x, y, z, in mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grid_mm: Option<[f64; 3]>,
    /// A text file with the columns `x_mm`, `y_mm`, `z_mm`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<PathBuf>,
}

/// Places of a grid at most.
const MOST: usize = 2_000_000;
const COLUMNS: [&str; 3] = ["x_mm", "y_mm", "z_mm"];

impl Query {
    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub fn check(&self) -> std::result::Result<(), Fault> {
        if self.grid_mm.is_some() && self.path.is_some() {
            return Err(Fault::at("path", "expected `grid_mm` or `path`, found both"));
        }
        let not_positive = |step: &&f64| !(step.is_finite() && **step > 0.0);
        if let Some(step) = self.grid_mm.iter().flatten().find(not_positive) {
            return Err(Fault::at("grid_mm", format!("distances of a grid are above 0 mm, found {step}")));
        }
        Ok(())
    }

    /// The query with a path that does not depend on the folder.
    #[must_use]
    pub fn resolved(&self, context: &Context) -> Self {
        Self { grid_mm: self.grid_mm, path: self.path.as_ref().map(|path| context.path(path)) }
    }

    /// The places, in mm.
    ///
    /// # Errors
    /// When the file cannot be read, or the grid has too many places.
    pub fn places(&self, campaign: &Campaign) -> Result<Vec<[f64; 3]>> {
        match (&self.grid_mm, &self.path) {
            (Some(step_mm), _) => grid(campaign, *step_mm),
            (None, Some(path)) => read(path),
            (None, None) => Ok(campaign.places_mm.clone()),
        }
    }
}

fn grid(campaign: &Campaign, step_mm: [f64; 3]) -> Result<Vec<[f64; 3]>> {
    let volume = &campaign.volume;
    let counts = [0, 1, 2].map(|axis| (2.0 * volume.half_mm[axis] / step_mm[axis] * (1.0 + 1e-9)).floor() + 1.0);
    let total = counts.iter().product::<f64>();
    if total > MOST as f64 {
        let problem =
            format!("`query.grid_mm` gives {total:.0} places in the measured volume: at most {MOST} are predicted");
        return Err(Error::new("predict", &campaign.file, problem).help("take a wider grid, or a file of places"));
    }
    let at = |axis: usize, index: usize| volume.middle_mm[axis] - volume.half_mm[axis] + step_mm[axis] * index as f64;
    let [nx, ny, nz] = counts.map(|count| count as usize);
    let mut places = Vec::with_capacity(nx * ny * nz);
    for z in 0..nz {
        for y in 0..ny {
            places.extend((0..nx).map(|x| [at(0, x), at(1, y), at(2, z)]));
        }
    }
    Ok(places)
}

fn read(path: &std::path::Path) -> Result<Vec<[f64; 3]>> {
    let object = path.display().to_string();
    let refuse = |problem: String| Error::new("read", &object, problem);
    let text = read_text(path).map_err(|error| refuse(error.to_string()))?;
    let header = text.lines().find(|line| !line.trim().is_empty() && !line.starts_with('#')).unwrap_or_default();
    let delimiter = [b'\t', b';', b','].into_iter().find(|mark| header.contains(char::from(*mark))).unwrap_or(b',');
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.trim_start_matches('\u{feff}').as_bytes());
    let names = reader.headers().map_err(|error| refuse(error.to_string()))?.clone();
    let mut columns = [0; 3];
    for (place, name) in columns.iter_mut().zip(COLUMNS) {
        let position = names.iter().position(|found| found == name);
        *place = position.ok_or_else(|| {
            let found: Vec<&str> = names.iter().collect();
            refuse(format!("the column `{name}` is missing (a command, in mm); it has {}", found.join(", ")))
        })?;
    }
    let mut places = Vec::new();
    for (row, record) in reader.records().enumerate() {
        let record = record.map_err(|error| refuse(error.to_string()))?;
        let mut place = [0.0; 3];
        for (value, (column, name)) in place.iter_mut().zip(columns.iter().zip(COLUMNS)) {
            let cell = record.get(*column).unwrap_or_default();
            let cell = if delimiter == b',' { cell.to_owned() } else { cell.replace(',', ".") };
            let number = cell.parse::<f64>().ok().filter(|number| number.is_finite());
            *value = number.ok_or_else(|| {
                refuse(format!("row {} of the column `{name}`: expected a number, found `{cell}`", row + 1))
            })?;
        }
        places.push(place);
    }
    if places.is_empty() {
        return Err(refuse("it has no place".into()));
    }
    Ok(places)
}
