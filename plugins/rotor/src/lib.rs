//! Rotors: natural frequencies, Campbell diagram and critical speeds, and at which speeds not to measure.
//!
//! The loader `rotor-model` makes equations of motion of a rotor's parts (Timoshenko beams, rigid disks, springs and dampers) or
//! reads their matrices; the separator `rotor-modes` solves them; the check `rotor-speeds` compares the modes with the speed of a
//! campaign.

pub mod assemble;
mod avoid;
mod beam;
pub mod crossings;
pub mod equations;
pub mod loader;
mod matrix_market;
pub mod modal;
pub mod model;
mod plausible;
mod separate;
mod speeds;
mod transfer;
pub mod whirl;

use runout_core::pipeline::registry::{Plugin, Registry};

pub use loader::RotorModelConfig;
pub use separate::RotorModesConfig;
pub use speeds::RotorSpeedsConfig;

/// Adds the loader, the separator and the check.
pub fn register(registry: &mut Registry) {
    registry.loaders.add(Plugin::of::<RotorModelConfig>());
    registry.separators.add(Plugin::of::<RotorModesConfig>());
    registry.checks.add(Plugin::of::<RotorSpeedsConfig>());
}
