//! Rotors: natural frequencies, Campbell diagram and critical speeds, and at which speeds not to measure.
//!
//! The loader `rotor-model` makes equations of motion of a rotor's parts (Timoshenko beams, rigid disks, springs and dampers) or
//! reads their matrices; the separator `rotor-modes` solves them; the check `rotor-speeds` compares the modes with the speed of a
//! campaign.

mod assemble;
mod avoid;
pub mod beam;
mod crossings;
mod equations;
mod loader;
mod matrix_market;
mod modal;
mod model;
mod plausible;
mod separate;
mod speeds;
mod transfer;
mod whirl;

use runout_core::pipeline::{Plugin, Registry};

pub use assemble::assemble;
pub use crossings::{Crossing, Search};
pub use equations::{Equations, Node, Role};
pub use loader::{Rotor, RotorModelConfig, read};
pub use modal::{Modal, Mode, hertz, rpm};
pub use model::{Bearing, Disk, Dof, Material, Matrices, RotorModel, Segment, Support, SupportKind};
pub use separate::RotorModesConfig;
pub use speeds::RotorSpeedsConfig;
pub use whirl::{Whirl, whirl};

/// Adds the loader, the separator and the check.
pub fn register(registry: &mut Registry) {
    registry.loaders.add(Plugin::of::<RotorModelConfig>());
    registry.separators.add(Plugin::of::<RotorModesConfig>());
    registry.checks.add(Plugin::of::<RotorSpeedsConfig>());
}
