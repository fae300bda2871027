//! Spindles: separators of the part's form from the axis's error motion, and a simulator of both.

mod alterations;
pub mod diagnose;
pub mod effects;
pub mod layout;
pub mod plan;
pub mod selection;
pub mod separators;
pub mod simulate;
mod sizes;
mod solve;
mod wiring;

use runout_core::pipeline::{Plugin, Registry};
use separators::{
    DonaldsonReversal, HarmonicLeastSquaresConfig, MethodConfig, MultiStep, ThreePoint,
    four_sensor_reversal::FourSensorReversalConfig,
};
use simulate::SpindleConfig;

/// Adds what this crate has.
pub fn register(registry: &mut Registry) {
    registry.separators.add(Plugin::of::<MethodConfig<DonaldsonReversal>>());
    registry.separators.add(Plugin::of::<FourSensorReversalConfig>());
    registry.separators.add(Plugin::of::<MethodConfig<ThreePoint>>());
    registry.separators.add(Plugin::of::<MethodConfig<MultiStep>>());
    registry.separators.add(Plugin::of::<HarmonicLeastSquaresConfig>());
    registry.simulators.add(Plugin::of::<SpindleConfig>());
    for effect in effects::all() {
        registry.effects.add(effects::entry(effect));
    }
}
