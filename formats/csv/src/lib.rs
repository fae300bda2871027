//! CSV measurements: one file a setup and station.
//!
//! ```text
//! # any comments
//! time_s;index;S1;S2
//! 0,0000;0;1,25;-0,5
//! 0,0002;1;1,31;-0,4
//! ```
//!
//! The header names the columns: the rig's sensors (readings in µm), `index` (0 or 1) or `angle_deg` (unwrapped spindle
//! angle), and optionally `time_s`, which gives the sampling rate. Delimiters are comma, semicolon or tab; with the last
//! two the decimal separator may be a comma. An empty cell is a missing reading (NaN). Text is UTF-8 or Latin-1.
//!
//! Where `index` goes from 0 to 1, a turn began somewhere between the two samples: half a sample before the first 1 is
//! the best guess, and it is wrong by up to half a sample. An encoder's angle, the mark's time in an HDF5 file, or the mark as
//! an analogue trace (`marker` in `[load]`), whose crossing of a threshold lies between two samples, is better.
//!
//! A file that gzip packed is read as it is.

mod config;
mod header;
mod inspect;
mod lines;
mod number;
mod recording;
mod row;
mod rows;
mod scan;
mod stated;

pub use config::{CsvConfig, FileConfig, StationConfig};
pub use inspect::{TextReport, inspect};
pub use number::parse_number;
use runout_core::pipeline::{Plugin, Registry};

/// Adds the loader `csv`.
pub fn register(registry: &mut Registry) {
    registry.loaders.add(Plugin::of::<CsvConfig>());
}
