//! Acceptance tests of machine tools from measured points: values of the standards by their symbols, with uncertainty.
//!
//! | separator | test |
//! | --- | --- |
//! | `positioning` | ISO 230-2: accuracy and repeatability of positioning of one axis |
//! | `circular` | ISO 230-4: circular deviation, radial deviation and hysteresis of a circular path |
//! | `drift` | ISO 230-3: thermal drift, range of each axis and combined, time to stability |

mod circular;
mod draws;
mod drift;
mod paths;
mod positioning;
mod runs;

use runout_core::pipeline::{Plugin, Registry};

pub use circular::CircularConfig;
pub use drift::DriftConfig;
pub use positioning::PositioningConfig;

/// Adds the separators.
pub fn register(registry: &mut Registry) {
    registry.separators.add(Plugin::of::<PositioningConfig>());
    registry.separators.add(Plugin::of::<CircularConfig>());
    registry.separators.add(Plugin::of::<DriftConfig>());
}
