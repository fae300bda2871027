//! Surfaces and profiles as they were measured: nothing is separated, the standards' values follow.
//!
//! The separator `as-measured` takes a height map, an open profile, a roundness profile or the circles of a cylinder. Crop, outliers, form and voids
//! of maps and profiles are stages that the configuration states and the result names. Circles and cylinders are those of
//! [`runout_cylinder`].

mod config;
mod filling;
mod form;
mod map;
mod neighbours;
mod profile;
mod quadric;
mod separate;
mod stages;
mod wall;

pub use config::{AsMeasuredConfig, Crop, FormRemoval, Object, Voids};
use runout_core::pipeline::{Plugin, Registry};
pub use separate::AsMeasured;

/// Adds the separator `as-measured`.
pub fn register(registry: &mut Registry) {
    registry.separators.add(Plugin::of::<AsMeasuredConfig>());
}
