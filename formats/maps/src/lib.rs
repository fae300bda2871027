//! Height maps and profiles as other programs write them, a file a format: X3P, SDF, SUR, text. The loader `height-map` reads these and the HDF5
//! of this program, by their first bytes; the exporters `x3p` and `sdf` write surfaces.
//!
//! Heights are nm and out of the material positive, places mm. A profile is a map of one row.

mod export;
mod input;
mod load;
mod map;
mod numbers;
mod sdf;
mod sur;
mod text;
mod x3p;

pub use export::{SdfConfig, X3pConfig, write};
pub use load::{HeightMapConfig, is_map, read};
pub use map::{Map, Wanted};
use runout_core::pipeline::{Plugin, Registry};

/// Adds the loader `height-map` and the exporters `x3p` and `sdf`.
pub fn register(registry: &mut Registry) {
    registry.loaders.add(Plugin::of::<HeightMapConfig>());
    registry.exporters.add(Plugin::of::<X3pConfig>());
    registry.exporters.add(Plugin::of::<SdfConfig>());
}
