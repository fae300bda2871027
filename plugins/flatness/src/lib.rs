//! Flatness of a table or a surface plate, from the slopes that an autocollimator or a level reads along lines.

mod model;
mod nodes;
mod values;

use runout_core::pipeline::{Plugin, Registry};

pub use model::{Flatness, FlatnessConfig};

/// Adds the separator `flatness`.
pub fn register(registry: &mut Registry) {
    registry.separators.add(Plugin::of::<FlatnessConfig>());
}
