//! Measured circles and generatrices of a cylinder: what a coordinate measuring machine gives.
//!
//! The separator `least-squares-cylinder` takes traces of points, removes the cylinder that fits best and gives the form of each circle by harmonics, for the same surface, meshes and tables
//! as a part measured on a spindle. Traces that are not used test the surface: it has to predict them.

mod circle;
mod config;
mod consistency;
mod defects;
mod generatrix;
mod model;
mod predict;
mod robust;
mod scan;
mod separate;
mod shape;

use runout_core::pipeline::{Plugin, Registry};

pub use config::LeastSquaresCylinderConfig;
pub use predict::Prediction;
pub use separate::{COLUMNS, LeastSquaresCylinder};
pub use shape::Cylinder;

/// Adds the separator `least-squares-cylinder`.
pub fn register(registry: &mut Registry) {
    registry.separators.add(Plugin::of::<LeastSquaresCylinderConfig>());
}
