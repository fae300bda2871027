//! What the configuration states.

use runout_core::marker::Marker;

/// What the configuration says of all files.
#[derive(Debug, Clone, Default)]
pub(crate) struct Stated {
    pub(crate) sample_rate_hz: Option<f64>,
    pub(crate) speed_rpm: Option<f64>,
    pub(crate) marker: Option<Marker>,
}
