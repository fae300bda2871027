//! Acceptance tests of machine tools from measured points: values of the standards by their symbols, with uncertainty.
//!
//! | separator | test |
//! | --- | --- |
//! | `positioning` | ISO 230-2: accuracy and repeatability of positioning of one axis |
//! | `circular` | ISO 230-4: circular deviation, radial deviation and hysteresis of a circular path |
//! | `diagonals` | ISO 230-6: positioning along body and face diagonals |
//! | `probing` | ISO 230-10: probing error of a sphere or a ring, repeatability of touches |
//! | `rotary-path` | ISO 10791-6, BK1 to BK4: a rotary axis and linear axes, read by an R-test |
//! | `structural-motion` | ISO 230-7: motion with the spindle still |
//! | `drift` | ISO 230-3: thermal drift, range of each axis and combined, time to stability |

mod cells;
mod circular;
mod diagonals;
mod draws;
mod drift;
mod paths;
mod positioning;
mod probing;
mod repeated;
mod rotary_path;
mod runs;
mod structural;

use runout_core::pipeline::{Plugin, Registry};

pub use circular::CircularConfig;
pub use diagonals::DiagonalsConfig;
pub use drift::DriftConfig;
pub use positioning::PositioningConfig;
pub use probing::{Object, ProbingConfig};
pub use rotary_path::{Ball, RotaryAxis, RotaryPathConfig, Test};
pub use structural::StructuralMotionConfig;

/// Adds the separators.
pub fn register(registry: &mut Registry) {
    registry.separators.add(Plugin::of::<PositioningConfig>());
    registry.separators.add(Plugin::of::<CircularConfig>());
    registry.separators.add(Plugin::of::<DriftConfig>());
    registry.separators.add(Plugin::of::<DiagonalsConfig>());
    registry.separators.add(Plugin::of::<ProbingConfig>());
    registry.separators.add(Plugin::of::<RotaryPathConfig>());
    registry.separators.add(Plugin::of::<StructuralMotionConfig>());
}
