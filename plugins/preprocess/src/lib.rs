//! From raw samples to one profile a capture: trims, filters, synchronous average.

mod butterworth;
mod cascade;
mod low_pass;
mod synchronous_average;
mod trim;

#[cfg(test)]
mod testing;

pub use low_pass::{LowPass, LowPassConfig};
use runout_core::pipeline::{registry::Plugin, registry::Registry};
pub use synchronous_average::{SynchronousAverage, SynchronousAverageConfig};
pub use trim::{EndTrim, TrimConfig};

/// Adds this crate's preprocessors.
pub fn register(registry: &mut Registry) {
    registry.preprocessors.add(Plugin::of::<TrimConfig>());
    registry.preprocessors.add(Plugin::of::<LowPassConfig>());
    registry.preprocessors.add(Plugin::of::<SynchronousAverageConfig>());
}
