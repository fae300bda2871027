//! What `runout inspect` says.

use std::collections::BTreeMap;

use runout_channels::ChannelsReport;
use runout_csv::TextReport;
use runout_hdf5::FileReport;
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
