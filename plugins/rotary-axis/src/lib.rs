//! R-tests of rotary axes: a ball on the table, three displacement sensors at the spindle.
//!
//! The separator `r-test` takes the ball's deviations at commands of the rotary axes: how the C axis and the ball are installed,
//! and, by the closed loop, what turns more often than once.

mod model;

use runout_core::pipeline::registry::{Plugin, Registry};

pub use model::{RTest, RTestConfig};

/// Adds the separator `r-test`.
pub fn register(registry: &mut Registry) {
    registry.separators.add(Plugin::of::<RTestConfig>());
}
