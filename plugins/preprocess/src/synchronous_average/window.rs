//! The frames around the turn that is next.

use runout_core::measurement::Block;

use super::kernel::REACH;

/// Frames of the continuation at either end of the capture: the kernel's reach, and a cubic through the encoder's angles.
pub(super) const CONTINUED: usize = REACH + 2;

/// A stretch of the capture, continued at the capture's ends by an odd reflection, 2x₀ − xₖ.
///
/// The continuation carries level and slope on, which is all that the outermost positions of the first and the last turn
/// ask of it. Places are counted from its first frame, [`CONTINUED`] before the capture's.
pub(super) struct Window {
    channels: usize,
    /// Place of the first frame.
    start: usize,
    pub frames: Vec<f64>,
    pub angle_rev: Vec<f64>,
}

impl Window {
    pub(super) fn new(channels: usize) -> Self {
        Self { channels, start: CONTINUED, frames: Vec::new(), angle_rev: Vec::new() }
    }

    pub(super) fn len(&self) -> usize {
        self.frames.len() / self.channels
    }

    /// Place of the first frame.
    pub(super) fn start(&self) -> usize {
        self.start
    }

    /// Place behind the last frame.
    pub(super) fn end(&self) -> usize {
        self.start + self.len()
    }

    /// A sample position of the capture, counted from the first frame.
    pub(super) fn position(&self, sample: f64) -> f64 {
        // The difference of the two places is exact, so that large positions lose no digits.
        sample - (self.start as f64 - CONTINUED as f64)
    }

    /// Takes a block, and forgets what lies before the place `needed`.
    pub(super) fn take(&mut self, block: &Block, needed: usize) {
        if self.frames.is_empty() {
            self.start = block.start as usize + CONTINUED;
        }
        self.frames.extend_from_slice(&block.samples);
        self.angle_rev.extend_from_slice(&block.angle_rev);
        let surplus = needed.saturating_sub(self.start).min(self.len());
        // Moving the rest to the front is worth while only where it is the smaller part.
        if 2 * surplus >= self.len() {
            self.frames.drain(..surplus * self.channels);
            self.angle_rev.drain(..surplus.min(self.angle_rev.len()));
            self.start += surplus;
        }
    }

    /// Puts the continuation before the capture's first frame, once there are enough to reflect.
    pub(super) fn continue_before(&mut self) {
        if self.start == CONTINUED && self.len() > CONTINUED {
            let before = reflected(&self.frames[..(CONTINUED + 1) * self.channels], self.channels);
            self.frames.splice(..0, before.into_iter().rev().flatten());
            if let Some(angles) = self.angle_rev.get(..=CONTINUED) {
                let before = reflected(angles, 1);
                self.angle_rev.splice(..0, before.into_iter().rev().flatten());
            }
            self.start = 0;
        }
    }

    /// Puts the continuation behind the capture's last frame.
    pub(super) fn continue_behind(&mut self) {
        if self.len() > CONTINUED {
            let behind = reflected(&last(&self.frames, self.channels), self.channels);
            self.frames.extend(behind.into_iter().flatten());
            if self.angle_rev.len() > CONTINUED {
                let behind = reflected(&last(&self.angle_rev, 1), 1);
                self.angle_rev.extend(behind.into_iter().flatten());
            }
        }
    }
}

/// The last frame and those before it, backwards.
fn last(frames: &[f64], channels: usize) -> Vec<f64> {
    frames.rchunks_exact(channels).take(CONTINUED + 1).flatten().copied().collect()
}

/// All frames but the first, reflected at that one.
fn reflected(frames: &[f64], channels: usize) -> Vec<Vec<f64>> {
    let (edge, others) = frames.split_at(channels);
    let reflect = |frame: &[f64]| edge.iter().zip(frame).map(|(edge, value)| 2.0 * edge - value).collect();
    others.chunks_exact(channels).map(reflect).collect()
}
