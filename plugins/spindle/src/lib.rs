//! Spindles: separators of the part's form from the axis's error motion, and a simulator of both.

pub mod layout;
pub mod separators;
pub mod simulate;

use runout_core::pipeline::{Registry, registry::Plugin};
use separators::{four_sensor_reversal::FourSensorReversalConfig, harmonic_least_squares::HarmonicLeastSquaresConfig};
use simulate::SpindleConfig;

/// Adds what this crate has.
pub fn register(registry: &mut Registry) {
    registry.separators.add(Plugin::of::<FourSensorReversalConfig>());
    registry.separators.add(Plugin::of::<HarmonicLeastSquaresConfig>());
    registry.simulators.add(Plugin::of::<SpindleConfig>());
}
