//! Measured circles and generatrices of a cylinder: what a coordinate measuring machine gives.
//!
//! The loader `cylinder-traces` reads traces of points from a CSV file; the separator `least-squares-cylinder` removes
//! the cylinder that fits best and gives the form of each circle by harmonics, for the same surface, meshes and tables
//! as a part measured on a spindle. Traces that are not used test the surface: it has to predict them.

mod circle;
mod least_squares;
mod load;
mod model;
mod predict;
mod robust;
mod scan;
mod separate;
mod shape;

use runout_core::pipeline::registry::{Plugin, Registry};

pub use load::CylinderTracesConfig;
pub use predict::Prediction;
pub use separate::{LeastSquaresCylinder, LeastSquaresCylinderConfig};
pub use shape::Cylinder;

/// Adds the loader `cylinder-traces` and the separator `least-squares-cylinder`.
pub fn register(registry: &mut Registry) {
    registry.loaders.add(Plugin::of::<CylinderTracesConfig>());
    registry.separators.add(Plugin::of::<LeastSquaresCylinderConfig>());
}
