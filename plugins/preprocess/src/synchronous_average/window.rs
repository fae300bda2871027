//! The frames around the turn that is next.

use runout_core::measurement::Block;

use super::kernel::REACH;

/// A stretch of the capture, continued at the capture's ends by an odd reflection, 2x₀ − xₖ.
///
/// The continuation carries level and slope on, which is all that the outermost [`REACH`] positions of the first and the
/// last turn ask of it.
pub(super) struct Window {
    channels: usize,
    /// Position of the first frame in the capture; negative in the continuation.
    pub start: i64,
    pub frames: Vec<f64>,
    pub angle_rev: Vec<f64>,
}

/// Frames of the continuation at either end.
pub(super) const CONTINUED: usize = REACH + 2;

impl Window {
    pub(super) fn new(channels: usize) -> Self {
        Self { channels, start: 0, frames: Vec::new(), angle_rev: Vec::new() }
    }

    pub(super) fn len(&self) -> usize {
        self.frames.len() / self.channels
    }

    /// Behind its last frame.
    pub(super) fn end(&self) -> i64 {
        self.start + self.len() as i64
    }

    /// Takes a block, and forgets what lies before `needed`.
    pub(super) fn take(&mut self, block: &Block, needed: i64) {
        if self.frames.is_empty() {
            self.start = block.start as i64;
        }
        self.frames.extend_from_slice(&block.samples);
        self.angle_rev.extend_from_slice(&block.angle_rev);
        let surplus = (needed - self.start).clamp(0, self.len() as i64) as usize;
        // Moving the rest to the front is worth while only where it is the smaller part.
        if 2 * surplus >= self.len() {
            self.frames.drain(..surplus * self.channels);
            self.angle_rev.drain(..surplus.min(self.angle_rev.len()));
            self.start += surplus as i64;
        }
    }

    /// Puts the continuation before the capture's first frame, once there are enough to reflect.
    pub(super) fn continue_before(&mut self) {
        if self.start == 0 && self.len() > CONTINUED {
            let count = self.channels;
            let before = reflected(&self.frames[..(CONTINUED + 1) * count], count);
            self.frames.splice(..0, before.into_iter().rev().flatten());
            if !self.angle_rev.is_empty() {
                let before = reflected(&self.angle_rev[..=CONTINUED], 1);
                self.angle_rev.splice(..0, before.into_iter().rev().flatten());
            }
            self.start -= CONTINUED as i64;
        }
    }

    /// Puts the continuation behind the capture's last frame.
    pub(super) fn continue_behind(&mut self) {
        let count = self.channels;
        if self.len() > CONTINUED {
            let backwards = |values: &[f64], count: usize| -> Vec<f64> {
                let last = &values[values.len() - (CONTINUED + 1) * count..];
                last.rchunks_exact(count).flatten().copied().collect()
            };
            let behind = reflected(&backwards(&self.frames, count), count);
            self.frames.extend(behind.into_iter().flatten());
            if !self.angle_rev.is_empty() {
                let behind = reflected(&backwards(&self.angle_rev, 1), 1);
                self.angle_rev.extend(behind.into_iter().flatten());
            }
        }
    }
}

/// All frames but the first, reflected at that one.
fn reflected(frames: &[f64], count: usize) -> Vec<Vec<f64>> {
    let (edge, others) = frames.split_at(count);
    let reflect = |frame: &[f64]| edge.iter().zip(frame).map(|(edge, value)| 2.0 * edge - value).collect();
    others.chunks_exact(count).map(reflect).collect()
}
