//! HDF5: measurement files (read, written, looked into) and results.
//!
//! A measurement file of version 1 holds one group a setup and station:
//!
//! ```text
//! /                             format = "runout-measurement", version = 1, length_unit = "um"
//! /<setup>/<station>            z_mm, optionally speed_rpm
//! /<setup>/<station>/samples    [n, channels] f64, f32, i16 or i32; sensors = ["S1", …], optionally sample_rate_hz
//! /<setup>/<station>/index      [turns] fractional sample positions of the once-per-turn mark; or
//! /<setup>/<station>/angle_deg  [n] spindle angle of each sample, unwrapped
//! /truth/<station>/…            what a simulation declares to be true
//! ```
//!
//! The C library behind it is not safe for threads; the `hdf5-metno` crate lets one thread in at a time.

mod heaps;
mod inspect;
mod measurement;
mod node;
mod result;

pub use inspect::{CaptureReport, FileReport, StationReport, TableReport, inspect};
pub use measurement::{
    loader::Hdf5Config,
    samples::{SampleFormat, Scale},
    write::{WriteOptions, write_measurement},
};
pub use result::ResultConfig;
use runout_core::pipeline::registry::{Plugin, Registry};

/// `format` of a measurement file.
pub const MEASUREMENT_FORMAT: &str = "runout-measurement";
/// `format` of a result file.
pub const RESULT_FORMAT: &str = "runout-result";
/// `version` of both.
pub const VERSION: u64 = 1;

/// Adds the loader and the exporter, both named `hdf5`.
pub fn register(registry: &mut Registry) {
    registry.loaders.add(Plugin::of::<Hdf5Config>());
    registry.exporters.add(Plugin::of::<ResultConfig>());
}
