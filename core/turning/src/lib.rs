//! What all recorded turns share: the rig, captures read in blocks, inspection, profiles with their covariance, separation into
//! form and motion, error motion values, and the surface over all stations.
//!
//! Lengths of displacement and form are in micrometres, geometry in millimetres, angles in radians inside the code (`_deg` in files).

pub mod azimuth;
pub mod calibrated;
pub mod checksum;
pub mod creep;
pub mod encoder;
pub mod error_motion;
pub mod inspection;
pub mod marker;
pub mod measurement;
pub mod near_tone;
pub mod profile;
pub mod provenance;
pub mod reading;
pub mod rig;
pub mod separation;
pub mod smoothing;
pub mod spread;
pub mod station;
pub mod surface;
