//! What the toolkit is, under one name: the pipeline of stages, and the crates that it stands on.
//!
//! The core knows no file format and no plugin by name, and prints nothing. Lengths of displacement and form are in
//! micrometres, geometry in millimetres, angles in radians inside the code (`_deg` in files).
//!
//! A pipeline is TOML that is checked against what a program has registered. A mistake has its place:
//!
//! ```
//! use runout_core::pipeline::{Pipeline, Registry, document::ConfigError};
//!
//! // This program has no plugin. `runout_cli::builtin::registry()` has those of `runout`.
//! let registry = Registry::default();
//! let checked = Pipeline::from_toml("load = { plugin = 'hdf5', path = 'shaft.h5' }", ".", &registry);
//! let Err(ConfigError::Text(mistake)) = checked else { panic!("there is no such plugin") };
//! assert_eq!(mistake.message, "unknown plugin `hdf5`");
//! assert_eq!(mistake.line_and_column(), (1, 19));
//! ```
//!
//! `Pipeline::run` gives what was found as a [`Summary`](summary::Summary), and writes the files that `[[export]]` names.

pub mod answer;
pub mod atomic_file;
pub mod component_curves;
pub mod effects;
pub mod length_unit;
pub mod pipeline;
pub mod points;
pub mod report_head;
pub mod stage;
pub mod summary;

pub use runout_closed_loop as closed_loop;
pub use runout_consistency as consistency;
pub use runout_draws as draws;
pub use runout_error::{Error, ErrorKind, Result, fault};
pub use runout_evaluate::{self as evaluate, error_motion, height_grid};
pub use runout_numerics::{self as numerics, Complex64};
pub use runout_standards as standards;
pub use runout_table as table;
pub use runout_turning::{
    azimuth, checksum, clock, counted_turns, creep, encoder, input_file, inspection, level_step, mains, marker,
    measurement, near_tone, neighbours, profile, profile_change, provenance, reading, rig, separation, spread, station,
    surface,
};
