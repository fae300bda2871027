//! The samples around the turn that is next.

#![allow(clippy::inline_always, reason = "see runout_core::numerics::lanes")]

use runout_core::{
    measurement::Block,
    numerics::lanes::{Arithmetic, LaneWork, Transposition, in_lanes, load},
};

use super::kernel::REACH;

/// Samples of the continuation at either end of the capture: the kernel's reach, and a cubic through the encoder's angles.
pub(super) const CONTINUED: usize = REACH + 2;

/// A stretch of the capture, continued at the capture's ends by an odd reflection, 2x₀ − xₖ.
///
/// The continuation carries level and slope on, which is all that the outermost positions of the first and the last turn
/// ask of it. Places are counted from its first sample, [`CONTINUED`] before the capture's.
pub(super) struct Window {
    /// Place of the first sample.
    start: usize,
    /// `[channel][sample]`, with room for more behind the first `length`.
    samples: Vec<Vec<f64>>,
    length: usize,
    pub angle_rev: Vec<f64>,
}

impl Window {
    pub(super) fn new(channels: usize) -> Self {
        Self { start: CONTINUED, samples: vec![Vec::new(); channels], length: 0, angle_rev: Vec::new() }
    }

    pub(super) fn len(&self) -> usize {
        self.length
    }

    /// The samples of each channel.
    pub(super) fn channels(&self) -> Vec<&[f64]> {
        self.samples.iter().map(|samples| &samples[..self.length]).collect()
    }

    /// Place of the first sample.
    pub(super) fn start(&self) -> usize {
        self.start
    }

    /// Place behind the last sample.
    pub(super) fn end(&self) -> usize {
        self.start + self.len()
    }

    /// A sample position of the capture, counted from the first sample.
    pub(super) fn position(&self, sample: f64) -> f64 {
        // The difference of the two places is exact, so that large positions lose no digits.
        sample - (self.start as f64 - CONTINUED as f64)
    }

    /// Takes a block, and forgets what lies before the place `needed`.
    pub(super) fn take(&mut self, block: &Block, needed: usize) {
        if self.len() == 0 {
            self.start = block.start as usize + CONTINUED;
        }
        let surplus = needed.saturating_sub(self.start).min(self.len());
        // Moving the rest to the front is worth while only where it is the smaller part.
        if 2 * surplus >= self.len() {
            for samples in &mut self.samples {
                samples.copy_within(surplus..self.length, 0);
            }
            self.length -= surplus;
            self.angle_rev.drain(..surplus.min(self.angle_rev.len()));
            self.start += surplus;
        }
        let (channels, kept) = (self.samples.len(), self.length);
        self.length += block.samples.len() / channels;
        for samples in &mut self.samples {
            // Only ever longer: what is written over needs no zeros.
            samples.resize(samples.len().max(self.length), 0.0);
        }
        in_lanes(channels, &mut Parting { frames: &block.samples, samples: &mut self.samples, kept });
        self.angle_rev.extend_from_slice(&block.angle_rev);
    }

    /// Puts the continuation before the capture's first sample, once there are enough to reflect.
    pub(super) fn continue_before(&mut self) {
        if self.start == CONTINUED && self.len() > CONTINUED {
            for course in self.courses() {
                let continuation: Vec<f64> = reflected(course[0], &course[1..=CONTINUED]).rev().collect();
                course.splice(..0, continuation);
            }
            self.length += CONTINUED;
            self.start = 0;
        }
    }

    /// Puts the continuation behind the capture's last sample.
    pub(super) fn continue_behind(&mut self) {
        if self.len() > CONTINUED {
            for course in self.courses() {
                let inner = course.len() - 1;
                let continuation: Vec<f64> =
                    reflected(course[inner], &course[inner - CONTINUED..inner]).rev().collect();
                course.extend(continuation);
            }
            self.length += CONTINUED;
        }
    }

    /// All that can be reflected, as long as the window.
    fn courses(&mut self) -> impl Iterator<Item = &mut Vec<f64>> {
        for samples in &mut self.samples {
            samples.truncate(self.length);
        }
        self.samples.iter_mut().chain([&mut self.angle_rev].into_iter().filter(|angle_rev| angle_rev.len() > CONTINUED))
    }
}

/// Frames on their way into the channels' samples, behind those kept.
struct Parting<'a> {
    frames: &'a [f64],
    samples: &'a mut [Vec<f64>],
    kept: usize,
}

impl LaneWork for Parting<'_> {
    #[inline(always)]
    fn lanes<A: Arithmetic, const C: usize>(&mut self, offset: usize) {
        /// Frames and channels that change places together.
        const SIDE: usize = 4;
        let channels = self.samples.len();
        let count = self.frames.len() / channels;
        let transposition = Transposition::here();
        let mut targets: [&mut [f64]; C] = std::array::from_fn(|_| &mut [][..]);
        for (target, samples) in targets.iter_mut().zip(&mut self.samples[offset..offset + C]) {
            *target = &mut samples[self.kept..][..count];
        }
        for (block, frames) in self.frames.chunks_exact(SIDE * channels).enumerate() {
            let place = block * SIDE;
            let mut squares = targets.chunks_exact_mut(SIDE);
            for (square, targets) in squares.by_ref().enumerate() {
                let rows = |row: usize| load::<SIDE>(frames, row * channels + offset + square * SIDE);
                for (target, column) in targets.iter_mut().zip(transposition.of(std::array::from_fn(rows))) {
                    target[place..place + SIDE].copy_from_slice(&column);
                }
            }
            for (lane, target) in squares.into_remainder().iter_mut().enumerate() {
                let first = offset + C / SIDE * SIDE + lane;
                let column: [f64; SIDE] = std::array::from_fn(|row| frames[row * channels + first]);
                target[place..place + SIDE].copy_from_slice(&column);
            }
        }
        let rest = count - count % SIDE;
        for (index, frame) in self.frames.chunks_exact(channels).enumerate().skip(rest) {
            let frame: [f64; C] = load(frame, offset);
            for (target, value) in targets.iter_mut().zip(frame) {
                target[index] = value;
            }
        }
    }
}

/// Values reflected at one of them, 2x₀ − xₖ.
fn reflected(edge: f64, values: &[f64]) -> impl DoubleEndedIterator<Item = f64> + '_ {
    values.iter().map(move |value| 2.0 * edge - value)
}
