//! Fly cutting: the surface that a single tool leaves, and what it says of the spindle.
//!
//! A tool on a large radius cuts arcs, one a turn, a feed apart. Its nose leaves scallops; motion of the spindle that does not repeat
//! with the turn leaves stripes. The separator `fly-cutting` takes the scallops out of a height map and looks for lines of the
//! spindle's motion, errors of the feed, of the nose, of the table and of how the work was levelled. The simulator `fly-cutting` computes such a
//! surface by interference of all passes of the tool.

mod aliases;
mod cells;
mod config;
mod diagnose;
mod effects;
mod heights;
mod lines;
mod mistakes;
mod model;
mod outcome;
mod passes;
mod phase;
mod search;
mod separate;
pub mod simulate;
mod strangers;
#[cfg(test)]
mod tests;

use runout_core::{
    effects::EffectEntry,
    pipeline::{Plugin, Registry},
};

pub use config::FlyCuttingConfig;
pub use separate::FlyCutting;

/// Adds the separator and the simulator `fly-cutting`, and what the separator's model may lack.
pub fn register(registry: &mut Registry) {
    registry.separators.add(Plugin::of::<FlyCuttingConfig>());
    registry.simulators.add(Plugin::of::<simulate::FlyCuttingScenario>());
    for missing in effects::MISSING {
        let (id, about) = missing.about();
        registry.effects.add(EffectEntry::new(id, about, missing.effect().parameters, missing));
    }
}
