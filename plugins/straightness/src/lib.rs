//! Reversal along an axis: the straightness of a part and of the slide that carries the probe along it.
//!
//! A probe rides on a slide along a generatrix of a cylinder, or along a straightedge. In the second setup the part is
//! turned by 180° about its axis and the probe looks at the same line of it from the opposite side. The separator `axial-reversal`
//! takes traces of both setups and separates part and slide.

mod contrasts;
mod data;
mod design;
mod diagnose;
mod effects;
mod grid;
mod interpolate;
mod judged;
mod mixture;
mod model;
mod moves;
mod positions;
mod separate;
mod shifts;
mod spline;
mod straightness;
mod trace;
mod value_std;

use runout_core::{
    effects::EffectEntry,
    pipeline::{Plugin, Registry},
};

pub use separate::{AxialReversal, AxialReversalConfig};
pub use straightness::Straightness;

/// Adds the separator `axial-reversal` and what a reversal may lack.
pub fn register(registry: &mut Registry) {
    registry.separators.add(Plugin::of::<AxialReversalConfig>());
    for kind in effects::KINDS {
        registry.effects.add(EffectEntry::new(kind.id(), kind.about(), kind.parameters(), kind));
    }
}
