//! Every sample is examined before any other use: what is not a number, clipped or dead is found here.
//!
//! - A value that is not finite is replaced by the channel's last good one (0 before the first), so that recursive
//!   filters stay finite, and marked as [`DefectKind::NotFinite`](crate::measurement::DefectKind::NotFinite); so is one beyond [`FARTHEST_UM`], as
//!   [`DefectKind::OutOfReach`](crate::measurement::DefectKind::OutOfReach).
//! - Integer data is clipped where at least [`LIMIT_RUN`] samples in a row stand at the converter's limit.
//! - Integer data has wrapped round where a step between two samples is [`WRAPPED_SHARE`] of the converter's range or more: a counter or a
//!   conversion without saturation has passed its limit and goes on from the other one.
//! - Other data gives no limit. There, a run of equal samples at the channel's extreme so far is clipped if it is at least
//!   [`FLAT_RUN`] samples and [`FLAT_RUN_TURN`] of a turn long *and* the signal came to it steeply. A quantised signal
//!   also stands still at its crest, but it rounds off towards it: the crest of a parabola that stays within one step
//!   for n samples lies less than 7 steps above the signal 0.8·n samples before. So a rise of more than
//!   [`STEEP_STEPS`] of the channel's finest steps over the [`APPROACH_TURN`] of a turn before the run is steep. A run
//!   of [`PEGGED_TURN`] of a turn at the extreme is clipped however it began. Without marks there is no turn to measure
//!   by, and no such look.
//! - A run of exactly equal samples of [`PEGGED_TURN`] of a turn or more that is not clipped is stuck, wherever it lies:
//!   its first reading is good, those that repeat it are marked. A signal that swings by few of the converter's steps
//!   may truly stand so long (a sine of amplitude 3.4 steps does, at its crest), so that a channel is not judged while
//!   its swing so far is at most [`STUCK_STEPS`] of its finest steps, unless it has not moved at all.
//! - A channel that never moves is an error at the end of the stream.
//! - A channel whose readings stand for several samples each is handed on, and reported.
//! - A reading far from what the channel reads in all other turns may be a disturbance, or what the part and the spindle did:
//!   it is handed on, and [reported](Inspection::reporting).

mod channel;
mod held;
mod rule;
mod spikes;

use channel::{Channel, Look};
pub use held::HeldChannel;
use rule::Rule;
pub use spikes::Spike;

use crate::measurement::{Block, Capture, SampleStream};
use runout_error::{Error, Result};
use runout_numerics::lanes::in_lanes;

/// No displacement sensor reads so much, whatever its zero: a damaged number, which would drown all others.
pub const FARTHEST_UM: f64 = 1e6;
/// Shortest run at the converter's limit that is clipping; a single sample may just touch it.
pub const LIMIT_RUN: u64 = 2;
/// Step between two samples, as a share of the converter's range, from which on a channel has wrapped round. A reading that moves by less
/// than a quarter of the range from sample to sample makes such a step where it wraps round, and nowhere else.
pub const WRAPPED_SHARE: f64 = 0.75;
/// Shortest flat run, in samples.
pub const FLAT_RUN: f64 = 8.0;
/// Shortest flat run, in turns.
pub const FLAT_RUN_TURN: f64 = 0.02;
/// How far before a flat run the approach to it is examined, in turns.
pub const APPROACH_TURN: f64 = 1.0 / 64.0;
/// Rise over the approach, in the channel's finest steps, above which it is steep.
pub const STEEP_STEPS: f64 = 16.0;
/// Length of a flat run that needs no steep approach, in turns.
pub const PEGGED_TURN: f64 = 0.25;

/// Swing of a channel, in its finest steps, up to which it may truly stand still for long.
pub const STUCK_STEPS: f64 = 16.0;

/// Frames that are looked over at once: about a turn, between these.
const CHUNK: [usize; 2] = [64, 1024];

/// Passes samples on, with defects marked and unusable values bridged so that filters stay finite.
///
/// A sample is held back while it may turn out to begin a clipped or stuck run, at most for [`PEGGED_TURN`] of a turn.
pub struct Inspection<'a> {
    input: Box<dyn SampleStream + 'a>,
    raw: Block,
    /// Examined, not handed on.
    held: Block,
    /// The frames before those held, for the approach to a run.
    past: Vec<f64>,
    channels: Vec<Channel>,
    rule: Rule,
    /// Equal samples in a row that are stuck; `None` without marks.
    stuck: Option<u64>,
    /// Frames that are looked over at once.
    chunk: usize,
    ended: bool,
    /// Channels whose readings stand for several samples, once the first frames were examined.
    several: Option<Vec<HeldChannel>>,
    report: Option<Box<dyn FnOnce(UnusualReadings) + Send + 'a>>,
}

/// What is unusual in a capture, and handed on.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct UnusualReadings {
    /// Readings far from all others.
    pub spikes: Vec<Spike>,
    /// Channels whose readings stand for several samples each.
    pub held: Vec<HeldChannel>,
}

impl<'a> Inspection<'a> {
    /// Wraps a loader's stream; at its end `report` gets what is unusual.
    #[must_use]
    pub fn reporting(input: Box<dyn SampleStream + 'a>, report: impl FnOnce(UnusualReadings) + Send + 'a) -> Self {
        Self { report: Some(Box::new(report)), ..Self::new(input) }
    }

    /// Wraps a loader's stream.
    #[must_use]
    pub fn new(input: Box<dyn SampleStream + 'a>) -> Self {
        let capture = input.capture();
        let count = capture.channels();
        let turn = capture.median_turn_samples().filter(|turn| *turn > 0.0);
        let stuck = turn.map(|turn| (PEGGED_TURN * turn).ceil().max(FLAT_RUN) as u64);
        let rule = match (&capture.converter_limits_um, turn.zip(stuck)) {
            (Some(limits), _) if limits.len() == count => Rule::Limits(limits.clone()),
            (_, Some((turn, pegged))) => Rule::Flat {
                shortest: (FLAT_RUN_TURN * turn).ceil().max(FLAT_RUN) as u64,
                pegged,
                approach: (APPROACH_TURN * turn).ceil().max(1.0) as u64,
            },
            _ => Rule::None,
        };
        let channels = vec![Channel::new(turn); count];
        let chunk = turn.map_or(CHUNK[1], |turn| (turn.ceil() as usize).clamp(CHUNK[0], CHUNK[1]));
        let (raw, held, past) = (Block::default(), Block::default(), Vec::new());
        Self { input, raw, held, past, channels, rule, stuck, chunk, ended: false, several: None, report: None }
    }

    /// Examines the block in `raw` and joins it to those held.
    fn take(&mut self) {
        let count = self.channels.len();
        if self.held.samples.is_empty() {
            self.held.start = self.raw.start;
        }
        let first = self.held.samples.len();
        if first == 0 && self.held.defects.is_empty() {
            std::mem::swap(&mut self.held, &mut self.raw);
        } else {
            self.held.samples.append(&mut self.raw.samples);
            self.held.angle_rev.append(&mut self.raw.angle_rev);
            self.held.defects.append(&mut self.raw.defects);
        }
        if self.several.is_none() && self.held.samples.len() >= held::FRAMES[0] * count {
            self.several = Some(held::held(&self.held.samples, count));
        }
        let mut from = first;
        while from < self.held.samples.len() {
            let to = (from + self.chunk * count).min(self.held.samples.len());
            let mut look = Look {
                channels: &mut self.channels,
                rule: &self.rule,
                stuck: self.stuck,
                block: &mut self.held,
                past: &self.past,
                frames: from / count..to / count,
            };
            in_lanes(count, &mut look);
            from = to;
        }
    }

    /// Frames held that can no longer turn out to be clipped or stuck.
    fn decided(&self) -> usize {
        let frames = self.held.samples.len() / self.channels.len().max(1);
        if self.ended {
            return frames;
        }
        let undecided = self.channels.iter().filter_map(|channel| channel.undecided(&self.rule, self.stuck)).min();
        undecided.map_or(frames, |start| (start.saturating_sub(self.held.start) as usize).min(frames))
    }

    /// Hands on the first frames held.
    fn hand_on(&mut self, frames: usize, block: &mut Block) {
        let count = self.channels.len();
        let values = frames * count;
        if let Rule::Flat { approach, .. } = self.rule {
            let kept = approach as usize * count;
            let new = &self.held.samples[values.saturating_sub(kept)..values];
            let surplus = (self.past.len() + new.len()).saturating_sub(kept).min(self.past.len());
            self.past.drain(..surplus);
            self.past.extend_from_slice(new);
        }
        if values == self.held.samples.len() {
            let next = self.held.start + frames as u64;
            std::mem::swap(block, &mut self.held);
            self.held.clear();
            self.held.start = next;
        } else {
            block.start = self.held.start;
            block.samples.extend(self.held.samples.drain(..values));
            let angles = frames.min(self.held.angle_rev.len());
            block.angle_rev.extend(self.held.angle_rev.drain(..angles));
            block.defects.append(&mut self.held.defects);
            self.held.start += frames as u64;
        }
    }

    /// That every channel moved, or the first that did not.
    fn alive(&self) -> Result<()> {
        let capture = self.input.capture();
        for (index, channel) in self.channels.iter().enumerate() {
            let Some(problem) = channel.dead() else { continue };
            let sensor = capture.sensor_ids.get(index).map_or_else(String::new, |id| format!("sensor {id}, "));
            let object = format!("{sensor}channel {} of {}", index + 1, capture.object);
            let help = "check its cable and supply, or take the sensor out of the rig and measure again";
            return Err(Error::new("use", object, format!("the channel is dead: {problem}")).help(help));
        }
        Ok(())
    }
}

impl SampleStream for Inspection<'_> {
    fn capture(&self) -> &Capture {
        self.input.capture()
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        if self.channels.is_empty() {
            return self.input.next_block(block);
        }
        // What the block was is read into next; not cleared, it needs no zeros.
        std::mem::swap(block, &mut self.raw);
        block.clear();
        loop {
            let decided = self.decided();
            if decided > 0 {
                self.hand_on(decided, block);
                return Ok(true);
            }
            if self.ended {
                return Ok(false);
            }
            if self.input.next_block(&mut self.raw)? {
                self.take();
            } else {
                self.ended = true;
                self.alive()?;
                if let Some(report) = self.report.take() {
                    let spike = |(index, channel): (usize, &Channel)| channel.spike(index);
                    let spikes = self.channels.iter().enumerate().filter_map(spike).collect();
                    report(UnusualReadings { spikes, held: self.several.take().unwrap_or_default() });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
