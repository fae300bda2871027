//! R-tests of rotary axes: a ball on the table, three displacement sensors at the spindle.
//!
//! The loader `r-test-points` reads the ball's deviations at commands of the rotary axes; the separator `r-test` is a model
//! for the closed loop: how the C axis and the ball are installed, and what turns more often than once.

mod load;
mod model;

use runout_core::pipeline::registry::{Plugin, Registry};

pub use load::RTestPointsConfig;
pub use model::{RTest, RTestConfig};

/// Adds the loader `r-test-points` and the separator `r-test`.
pub fn register(registry: &mut Registry) {
    registry.loaders.add(Plugin::of::<RTestPointsConfig>());
    registry.separators.add(Plugin::of::<RTestConfig>());
}
