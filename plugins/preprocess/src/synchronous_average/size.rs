//! Sizes of an average.

/// What a turn is made of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Size {
    pub channels: usize,
    /// Equal angles.
    pub angles: usize,
    /// Harmonics that are kept, from order 0.
    pub orders: usize,
}

impl Size {
    /// Readings of one turn.
    pub(super) fn readings(&self) -> usize {
        self.channels * self.angles
    }
}
