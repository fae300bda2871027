//! What the toolkit is: rigs, recorded turns, profiles, separations, surfaces, and the pipeline that carries them.
//!
//! The core knows no file format and no plugin by name, and prints nothing. Lengths of displacement and form are in
//! micrometres, geometry in millimetres, angles in radians inside the code (`_deg` in files).

pub mod atomic_file;
pub mod azimuth;
mod calibrated;
pub mod checksum;
pub mod creep;
pub mod encoder;
pub mod error;
pub mod evaluate;
pub mod inspection;
pub mod marker;
pub mod measurement;
pub mod model;
pub mod numerics;
pub mod pipeline;
pub mod points;
pub mod profile;
pub mod provenance;
pub mod rig;
pub mod separation;
pub mod spread;
pub mod stage;
pub mod surface;
pub mod table;

pub use error::{Error, Result};
pub use num_complex::Complex64;
