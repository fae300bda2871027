//! Touch-trigger probes: pre-travel that depends on the direction of touching.
//!
//! A kinematic probe triggers at a force that depends on the direction; its stylus bends by as much more or less before it does.
//! Touches of a ring all around, with the ring or the probe turned between setups, separate the probe's lobing from
//! the form of the ring. The separator `touch-probe` does this; the simulator `touch-probe` computes such touches from the statics
//! of a probe on three seats.

mod config;
mod consistency;
mod design;
mod diagnose;
mod effects;
mod held_out;
mod lobe;
mod mistakes;
mod noise;
mod outcome;
mod plan;
mod second_order;
mod separate;
pub mod simulate;
mod tables;
mod touches;
mod waves;

use runout_core::pipeline::{Plugin, Registry};

pub use config::{SetupConfig, TouchProbeConfig};
pub use separate::TouchProbe;

/// Adds the separator and the simulator `touch-probe`.
pub fn register(registry: &mut Registry) {
    registry.separators.add(Plugin::of::<TouchProbeConfig>());
    registry.simulators.add(Plugin::of::<simulate::TouchProbeScenario>());
}
