//! R-tests of rotary axes: balls on the table, three displacement sensors at the spindle.
//!
//! The separator `rotary-axis` takes the deviations of one or more balls at commands of a rotary axis: its four location errors, its
//! six component errors at each command, and what compensates them. `rotary-axis-circle-fit` and `rotary-axis-three-point` are the
//! methods of a paper, for comparison. The separator `r-test` is for single tables of one ball: how
//! the C axis and the ball are installed, and, by the closed loop, what turns more often than once.

mod axis;
mod bias;
mod campaign;
mod config;
mod consistency;
mod curves;
mod diagnose;
mod effects;
mod kinematics;
mod left_out;
mod mistakes;
mod model;
mod motion;
mod nest;
mod noise;
mod paper;
mod plan;
mod rows;
mod scale;
mod separate;
pub mod simulate;
mod solve;
mod tables;

use runout_core::{
    effects::EffectEntry,
    pipeline::{Plugin, Registry},
};

pub use axis::Axis;
pub use config::{Ball, Curves, RotaryAxis, RotaryAxisConfig};
pub use model::{RTest, RTestConfig};
pub use paper::{CircleFitConfig, ThreePointConfig};

/// Adds the separators and what they may lack.
pub fn register(registry: &mut Registry) {
    registry.separators.add(Plugin::of::<RTestConfig>());
    registry.separators.add(Plugin::of::<RotaryAxisConfig>());
    registry.separators.add(Plugin::of::<CircleFitConfig>());
    registry.separators.add(Plugin::of::<ThreePointConfig>());
    registry.simulators.add(Plugin::of::<simulate::Scenario>());
    for kind in effects::KINDS {
        registry.effects.add(EffectEntry::new(kind.id(), kind.about(), kind.parameters(), kind));
    }
}
