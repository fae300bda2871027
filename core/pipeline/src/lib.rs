//! What the toolkit is, under one name: the pipeline of stages, and the crates that it stands on.
//!
//! The core knows no file format and no plugin by name, and prints nothing. Lengths of displacement and form are in
//! micrometres, geometry in millimetres, angles in radians inside the code (`_deg` in files).

pub mod atomic_file;
pub mod height_grid;
pub mod pipeline;
pub mod points;
pub mod stage;

pub use runout_closed_loop as model;
pub use runout_error::{Error, ErrorKind, Result};
pub use runout_numerics::{self as numerics, Complex64};
pub use runout_table as table;
pub use runout_turning::{
    azimuth, checksum, creep, encoder, inspection, marker, measurement, near_tone, profile, provenance, rig,
    separation, spread, surface,
};

/// The standards' values, and those of recorded turns.
pub mod evaluate {
    pub use runout_standards::*;
    pub use runout_turning::{error_motion, reading};
}

/// Errors of data and files.
pub mod error {
    pub use runout_error::{Error, ErrorKind, Result};
}
