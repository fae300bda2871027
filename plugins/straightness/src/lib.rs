//! Reversal along an axis: the straightness of a part and of the slide that carries the probe along it.
//!
//! A probe rides on a slide along a generatrix of a cylinder, or along a straightedge. In the second setup the part is
//! turned by 180° about its axis and the probe looks at the same line of it from the opposite side. The loader
//! `axial-traces` reads traces of both setups; the separator `axial-reversal` tells part and slide apart.

mod interpolate;
mod load;
mod positions;
mod separate;
mod trace;

use runout_core::pipeline::registry::{Plugin, Registry};

pub use load::AxialTracesConfig;
pub use separate::{AxialReversal, AxialReversalConfig};

/// Adds the loader `axial-traces` and the separator `axial-reversal`.
pub fn register(registry: &mut Registry) {
    registry.loaders.add(Plugin::of::<AxialTracesConfig>());
    registry.separators.add(Plugin::of::<AxialReversalConfig>());
}
