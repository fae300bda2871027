//! What `runout inspect` says.

use std::{collections::BTreeMap, path::PathBuf};

use runout_channels::ChannelsReport;
use runout_csv::TextReport;
use runout_hdf5::FileReport;
use runout_maps::Map;
use serde::Serialize;

/// What a file holds.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub(crate) enum Report {
    /// A measurement, a result, or another HDF5 file.
    Hdf5(FileReport),
    /// A table.
    Parquet(TableReport),
    /// Samples as text.
    Text(TextReport),
    /// Named channels of other programs.
    Channels(ChannelsReport),
    /// A height map or a profile.
    Map(MapReport),
}

/// A height map of another program.
#[derive(Debug, Serialize)]
pub(crate) struct MapReport {
    /// "X3P", "SDF", "SUR".
    pub format: &'static str,
    /// Points along y; 1 of a profile.
    pub rows: usize,
    /// Points along x.
    pub columns: usize,
    /// Distance of columns and of rows.
    pub step_mm: [f64; 2],
    /// Points without a height.
    pub voids: usize,
    /// Lowest and highest height.
    pub height_nm: [f64; 2],
    /// Names of the maps in the file.
    pub layers: Vec<String>,
    /// What the file says of itself.
    pub about: BTreeMap<String, String>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

impl MapReport {
    pub(crate) fn new(map: Map) -> Self {
        let grid = &map.grid;
        let known = grid.height_nm.iter().filter(|height| height.is_finite());
        let height_nm =
            known.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], height| [low.min(*height), high.max(*height)]);
        Self {
            format: map.format,
            rows: grid.rows(),
            columns: grid.columns,
            step_mm: [grid.step_x_mm, grid.step_y_mm],
            voids: grid.holes(),
            height_nm,
            layers: map.layers,
            about: map.about.into_iter().collect(),
            warnings: map.remarks,
        }
    }
}

/// What `runout convert` did.
#[derive(Debug, Serialize)]
pub(crate) struct ConvertReport {
    /// What was read.
    pub input: MapReport,
    /// The file that was written.
    pub output: PathBuf,
    /// What it does not hold, in words.
    pub lost: Vec<String>,
}

/// A Parquet table in short.
#[derive(Debug, Serialize)]
pub(crate) struct TableReport {
    /// "parquet".
    pub format: &'static str,
    /// Number of rows.
    pub rows: i64,
    /// Parts that a reader can skip.
    pub row_groups: usize,
    /// In the file's order.
    pub columns: Vec<ColumnReport>,
    /// What the writer noted.
    pub metadata: BTreeMap<String, Option<String>>,
}

/// A column of a Parquet table.
#[derive(Debug, Serialize)]
pub(crate) struct ColumnReport {
    /// Its name.
    pub name: String,
    /// As Parquet stores it.
    pub r#type: String,
    /// Whether values may be absent.
    pub optional: bool,
}
