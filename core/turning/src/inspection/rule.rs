//! How clipping and wrapping round show.

use super::{FARTHEST_UM, WRAPPED_SHARE};

/// How clipping shows.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Rule {
    /// At the converter's limits, lowest and highest of each channel.
    Limits(Vec<[f64; 2]>),
    /// Flat at the extreme so far; lengths in samples.
    Flat {
        /// Of a run that began steeply.
        shortest: u64,
        /// Of any run.
        pegged: u64,
        /// Of the approach that is examined.
        approach: u64,
    },
    /// Not at all.
    None,
}

impl Rule {
    /// Readings between which a channel is certainly neither clipped nor out of reach.
    pub(super) fn inside(&self, channel: usize) -> [f64; 2] {
        match self {
            // Readings and limits come from the same integers; the margin covers their rounding.
            Self::Limits(limits) => {
                let [low, high] = limits[channel];
                let margin = 1e-9 * (high - low).abs();
                [(low.min(high) + margin).max(-FARTHEST_UM), (low.max(high) - margin).min(FARTHEST_UM)]
            }
            Self::Flat { .. } | Self::None => [-FARTHEST_UM, FARTHEST_UM],
        }
    }

    /// Step between two samples from which on a channel has wrapped round.
    pub(super) fn wrapped_step(&self, channel: usize) -> f64 {
        match self {
            Self::Limits(limits) => WRAPPED_SHARE * (limits[channel][1] - limits[channel][0]).abs(),
            Self::Flat { .. } | Self::None => f64::INFINITY,
        }
    }
}
