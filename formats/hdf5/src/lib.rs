//! HDF5: measurement files (read, written, looked into) and results.
//!
//! A measurement file of version 1 holds one group a setup and station:
//!
//! ```text
//! /                             format = "runout-measurement", version = 1, length_unit = "um"
//! /<setup>/<station>            z_mm, optionally speed_rpm
//! /<setup>/<station>/samples    [n, channels] f64, f32, i16 or i32; sensors = ["S1", …], optionally sample_rate_hz
//! /<setup>/<station>/index      [turns] fractional sample positions of the once-per-turn mark; or
//! /<setup>/<station>/angle_deg  [n] spindle angle of each sample, unwrapped; or
//! /<setup>/<station>/<channel>  [n] the mark as an analogue trace, also as a channel of the samples: `marker` in `[load]`
//! /truth/<station>/…            what a simulation declares to be true
//! ```
//!
//! As MATLAB and LabVIEW write it, the same is read as `[channels, n]` (the number of names in `sensors` decides), `[n, 1]` or
//! `[1, n]`, with names that are padded with blanks or NULs, separated by commas in one text, or in a dataset
//! `/<setup>/<station>/sensors`, there also as MATLAB's characters or cells.
//!
//! The C library behind it is not safe for threads; the `hdf5-metno` crate lets one thread in at a time.

mod foreign;
mod heaps;
mod height_map;
mod inspect;
mod links;
mod measurement;
mod node;
mod raw;
mod result;
mod superblock;
mod text;
mod type_name;
mod utf8_path;

pub use foreign::{AttributeValue, Attributes, ForeignDataset, ForeignFile};
pub use height_map::{height_map_points, read_height_map, write_height_map};
pub use inspect::{CaptureReport, FileReport, StationReport, TableReport, inspect};
pub use measurement::{
    loader::Hdf5Config,
    samples::{SampleFormat, Scale},
    write::{WriteOptions, write_measurement},
};
pub use result::{ResultConfig, StoredResult, read_result};
use runout_core::pipeline::{Plugin, Registry};

/// `format` of a measurement file.
pub const MEASUREMENT_FORMAT: &str = "runout-measurement";
/// `format` of a result file.
pub const RESULT_FORMAT: &str = "runout-result";
/// `format` of a height map.
pub const SURFACE_FORMAT: &str = "runout-surface";
/// `version` of all of them.
pub const VERSION: u64 = 1;

/// Adds the loader and the exporter, both named `hdf5`.
pub fn register(registry: &mut Registry) {
    registry.loaders.add(Plugin::of::<Hdf5Config>());
    registry.exporters.add(Plugin::of::<ResultConfig>());
}
