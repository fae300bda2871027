//! Measurement files.

mod capture;
mod coding;
mod extent;
pub(crate) mod loader;
mod orientation;
mod rows;
pub(crate) mod samples;
mod stream;
mod structure;
mod truth;
mod vector;
pub(crate) mod write;

pub(crate) use capture::{CaptureSource, Phase};

/// Samples of all channels; attributes `sensors`, `sample_rate_hz`, and for integers `scale`, `offset`.
pub(crate) const SAMPLES: &str = "samples";
/// Names of the channels.
pub(crate) const SENSORS: &str = "sensors";
/// Sample positions of the once-per-turn mark.
pub(crate) const INDEX: &str = "index";
/// Spindle angle of each sample.
pub(crate) const ANGLE: &str = "angle_deg";
/// The group of what is declared to be true.
pub(crate) const TRUTH: &str = "truth";
