//! Quadrature signals: the sine and cosine of an interferometer or an encoder, seen as radius over phase.
//!
//! A perfect pair draws a circle about the origin. The separator `quadrature` takes measured phases and radii of a circle that may be
//! off centre, an ellipse, or worse. Its diagnosis gives the angle, corrected by what is decided.

mod angle;
mod components;
mod model;
mod samples;
mod signal;

use runout_core::pipeline::{Plugin, Registry};

pub use model::{Quadrature, QuadratureConfig};

/// Adds the separator `quadrature`.
pub fn register(registry: &mut Registry) {
    registry.separators.add(Plugin::of::<QuadratureConfig>());
}
