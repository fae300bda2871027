//! Quadrature signals: the sine and cosine of an interferometer or an encoder, seen as radius over phase.
//!
//! A perfect pair draws a circle about the origin. The loader `quadrature-samples` reads measured phases and radii; the separator
//! `quadrature` is a model for the closed loop: a circle that may be off centre, an ellipse, or worse. Its diagnosis gives the
//! angle, corrected by what is decided.

mod angle;
mod components;
mod load;
mod model;
mod signal;

use runout_core::pipeline::registry::{Plugin, Registry};

pub use load::QuadratureSamplesConfig;
pub use model::{Quadrature, QuadratureConfig};

/// Adds the loader `quadrature-samples` and the separator `quadrature`.
pub fn register(registry: &mut Registry) {
    registry.loaders.add(Plugin::of::<QuadratureSamplesConfig>());
    registry.separators.add(Plugin::of::<QuadratureConfig>());
}
