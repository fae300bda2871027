//! What all recorded turns share: the rig, captures read in blocks, inspection, profiles with their covariance, separation into
//! form and motion, and the surface over all stations.
//!
//! Lengths of displacement and form are in micrometres, geometry in millimetres, angles in radians inside the code (`_deg` in files).
//!
//! ```
//! use runout_turning::surface::Surface;
//!
//! // A cone: 1 µm at one end and 3 µm at the other.
//! let surface = Surface {
//!     radius_mm: 30.0,
//!     angles: 8,
//!     z_mm: vec![0.0, 10.0],
//!     deviation_um: [vec![1.0; 8], vec![3.0; 8]].concat(),
//!     interpolation: "",
//!     meetings: Vec::new(),
//! };
//! assert_eq!(surface.ring(1)[0], 3.0);
//! assert_eq!(surface.height_map()?.rows(), 2);
//! # Ok::<(), runout_error::Error>(())
//! ```

pub mod azimuth;
pub mod calibrated;
pub mod checksum;
pub mod clock;
pub mod counted_turns;
pub mod creep;
pub mod encoder;
pub mod groove;
pub mod input_file;
pub mod inspection;
pub mod level_step;
pub mod mains;
pub mod marker;
pub mod measurement;
pub mod near_tone;
pub mod neighbours;
pub mod profile;
pub mod profile_change;
pub mod provenance;
pub mod reading;
mod residual;
pub mod rig;
pub mod separation;
mod smoothing;
pub mod spread;
pub mod station;
pub mod surface;
