//! What is known of one channel so far, and the check of its next samples.

use std::ops::Range;

use super::{
    FARTHEST_UM, FLAT_RUN, LIMIT_RUN, STEEP_STEPS, STUCK_STEPS,
    rule::Rule,
    spikes::{Extents, Spike},
};
use crate::measurement::{Block, Defect, DefectKind};
use runout_numerics::lanes::{Arithmetic, LaneWork, load};

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Channel {
    last: Option<f64>,
    lowest: f64,
    highest: f64,
    /// Smallest change between two samples so far that is not 0.
    finest_step: f64,
    seen: u64,
    run: Run,
    same: Same,
    extents: Extents,
}

/// Samples in a row that repeat the one before.
#[derive(Debug, Clone, Default, PartialEq)]
struct Same {
    start: u64,
    repeats: u64,
    stuck: bool,
}

/// Samples in a row that may turn out to be clipped.
#[derive(Debug, Clone, Default, PartialEq)]
struct Run {
    start: u64,
    length: u64,
    /// At the limit, or equal at the extreme.
    suspect: bool,
    clipped: bool,
    steep: Option<bool>,
}

impl Channel {
    /// For turns of so many samples, where that is known.
    pub(super) fn new(turn_samples: Option<f64>) -> Self {
        Self {
            last: None,
            lowest: f64::INFINITY,
            highest: f64::NEG_INFINITY,
            finest_step: f64::INFINITY,
            seen: 0,
            run: Run::default(),
            same: Same::default(),
            extents: Extents::new(turn_samples),
        }
    }

    /// A reading far from all usual ones, where so many samples were looked over at once.
    pub(super) fn spike(&self, index: usize) -> Option<Spike> {
        self.extents.spike(index)
    }

    /// Where the run begins whose end must be awaited.
    pub(super) fn undecided(&self, rule: &Rule, stuck: Option<u64>) -> Option<u64> {
        let open = match rule {
            Rule::Limits(_) => self.run.length < LIMIT_RUN,
            Rule::Flat { pegged, .. } => self.run.length < *pegged,
            Rule::None => false,
        };
        let clipped = (self.run.suspect && !self.run.clipped && open).then_some(self.run.start);
        let repeats = self.same.repeats;
        let open = repeats > 0 && stuck.is_some_and(|stuck| repeats + 1 < stuck) && !self.run.clipped;
        let same = open.then_some(self.same.start);
        clipped.into_iter().chain(same).min()
    }

    /// What shows that the channel never moved.
    pub(super) fn dead(&self) -> Option<String> {
        if self.seen < 2 || self.lowest < self.highest {
            None
        } else if self.last.is_none() {
            Some(format!("none of its {} samples is a number up to 1 m", self.seen))
        } else {
            // Of −0, too, 0.
            Some(format!("all {} samples read {} µm", self.seen, self.lowest + 0.0))
        }
    }

    /// Examines `frames` of the block, one sample after the other; `past` are the frames before the block.
    pub(super) fn look(
        &mut self,
        index: usize,
        frames: Range<usize>,
        channels: usize,
        (rule, stuck): (&Rule, Option<u64>),
        block: &mut Block,
        past: &[f64],
    ) {
        let [low, high] = rule.inside(index);
        let wrapped_step = rule.wrapped_step(index);
        for frame in frames {
            let place = block.start + frame as u64;
            let at = frame * channels + index;
            let value = block.samples[at];
            self.seen += 1;
            if !value.is_finite() || value.abs() > FARTHEST_UM {
                block.samples[at] = self.last.unwrap_or(0.0);
                let kind = if value.is_finite() { DefectKind::OutOfReach } else { DefectKind::NotFinite };
                mark(&mut block.defects, index, kind, place..place + 1);
                self.run = Run::default();
                self.same = Same::default();
                continue;
            }
            let suspect = match rule {
                Rule::Limits(_) => value <= low || value >= high,
                Rule::Flat { .. } => value <= self.lowest || value >= self.highest,
                Rule::None => false,
            };
            let goes_on = match rule {
                Rule::Limits(_) => self.run.suspect && suspect,
                Rule::Flat { .. } | Rule::None => self.run.length > 0 && self.last == Some(value),
            };
            if goes_on {
                self.run.length += 1;
            } else {
                self.run = Run { start: place, length: 1, suspect, ..Run::default() };
            }
            if self.last != Some(value) {
                self.same = Same::default();
            } else if self.same.repeats == 0 {
                self.same = Same { start: place, repeats: 1, stuck: false };
            } else {
                self.same.repeats += 1;
            }
            if let Some(last) = self.last {
                let step = (value - last).abs();
                if step > 0.0 {
                    self.finest_step = self.finest_step.min(step);
                }
                if step >= wrapped_step {
                    mark(&mut block.defects, index, DefectKind::WrappedRound, place..place + 1);
                }
            }
            self.last = Some(value);
            self.lowest = self.lowest.min(value);
            self.highest = self.highest.max(value);
            if self.run.suspect {
                self.judge(index, rule, block, past, channels, value);
            }
            if !self.run.clipped && stuck.is_some_and(|stuck| self.same.repeats + 1 >= stuck) {
                self.judge_same(index, stuck, block);
            }
        }
    }

    /// Decides on samples that have just become too many equal ones, and follows those that were.
    fn judge_same(&mut self, index: usize, stuck: Option<u64>, block: &mut Block) {
        let Same { start, repeats, .. } = self.same;
        let end = start + repeats;
        if self.same.stuck {
            mark(&mut block.defects, index, DefectKind::Stuck, end - 1..end);
        } else if stuck == Some(repeats + 1) {
            let swing = self.highest - self.lowest;
            self.same.stuck = swing == 0.0 || swing > STUCK_STEPS * self.finest_step;
            if self.same.stuck {
                // Undecided repeats were held back, so that they still begin in this block.
                mark(&mut block.defects, index, DefectKind::Stuck, start..end);
            }
        }
    }

    /// Decides on the run so far.
    fn judge(&mut self, index: usize, rule: &Rule, block: &mut Block, past: &[f64], channels: usize, value: f64) {
        let end = self.run.start + self.run.length;
        if self.run.clipped {
            mark(&mut block.defects, index, DefectKind::Clipped, end - 1..end);
            return;
        }
        self.run.clipped = match rule {
            Rule::Limits(_) => self.run.length >= LIMIT_RUN,
            Rule::Flat { shortest, pegged, approach } => {
                if self.run.length >= *shortest && self.run.steep.is_none() {
                    let before = self.run.start.checked_sub(*approach);
                    let reading = before.and_then(|place| reading(place, index, block, past, channels));
                    let rise = reading.map_or(0.0, |reading| (value - reading).abs());
                    self.run.steep = Some(rise > STEEP_STEPS * self.finest_step);
                }
                self.run.steep == Some(true) || self.run.length >= *pegged
            }
            Rule::None => false,
        };
        if self.run.clipped {
            // An undecided run was held back, so that it still begins in this block.
            mark(&mut block.defects, index, DefectKind::Clipped, self.run.start..end);
        }
    }
}

/// One channel's reading at a place in the capture, in the block or the frames before it.
fn reading(place: u64, channel: usize, block: &Block, past: &[f64], channels: usize) -> Option<f64> {
    if let Some(frame) = place.checked_sub(block.start) {
        return block.samples.get(frame as usize * channels + channel).copied();
    }
    let frame = (past.len() / channels).checked_sub((block.start - place) as usize)?;
    past.get(frame * channels + channel).copied()
}

/// Adds a run of bad samples, or lengthens the channel's last one.
fn mark(defects: &mut Vec<Defect>, channel: usize, kind: DefectKind, samples: Range<u64>) {
    match defects.iter_mut().rev().find(|defect| defect.channel == channel) {
        Some(last) if last.kind == kind && last.samples.end == samples.start => last.samples.end = samples.end,
        _ => defects.push(Defect { samples, channel, kind }),
    }
}

/// The check of frames of a block, by all channels.
pub(super) struct Look<'a> {
    pub(super) channels: &'a mut [Channel],
    pub(super) rule: &'a Rule,
    /// Equal samples in a row that are stuck.
    pub(super) stuck: Option<u64>,
    pub(super) block: &'a mut Block,
    /// The frames before the block.
    pub(super) past: &'a [f64],
    pub(super) frames: Range<usize>,
}

impl LaneWork for Look<'_> {
    /// Nearly always the extremes of all frames are enough: no value that is not finite, at a limit, or
    /// equal to the one before (integers: to many before). Only where it is not, each channel is examined sample by sample.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "see LaneWork")]
    fn lanes<A: Arithmetic, const C: usize>(&mut self, offset: usize) {
        let count = self.channels.len();
        let group = &mut self.channels[offset..offset + C];
        let frames = &self.block.samples[self.frames.start * count..self.frames.end * count];
        let before: [f64; C] = std::array::from_fn(|lane| group[lane].last.unwrap_or(f64::NAN));
        let Extremes { lowest, highest, finest, zero, last } = extremes(frames, count, offset, before);
        let (mut finest, mut repeats, mut most) = (finest, [0.0; C], [0.0; C]);
        if finest.contains(&0.0) {
            repeats = std::array::from_fn(|lane| group[lane].same.repeats as f64);
            (finest, most) = repetitions(frames, count, offset, before, &mut repeats);
        }
        let flat = matches!(self.rule, Rule::Flat { .. });
        // Fewer equal samples than these can be neither clipped nor stuck.
        let few = if flat { 1.0 } else { FLAT_RUN - 1.0 };
        let wraps = |lane: usize| {
            let wrapped_step = self.rule.wrapped_step(offset + lane);
            // Only readings that lie so far apart can be a step of this size.
            let swing = highest[lane].max(before[lane]) - lowest[lane].min(before[lane]);
            swing >= wrapped_step && {
                let readings = std::iter::once(&before[lane]).chain(frames.iter().skip(offset + lane).step_by(count));
                let next = readings.clone().skip(1);
                readings.zip(next).any(|(one, next)| (next - one).abs() >= wrapped_step)
            }
        };
        let quiet = (0..C).all(|lane| {
            let [low, high] = self.rule.inside(offset + lane);
            zero[lane] == 0.0 && lowest[lane] > low && highest[lane] < high && most[lane] < few && !wraps(lane)
        });
        if !quiet {
            for (lane, channel) in group.iter_mut().enumerate() {
                channel.look(offset + lane, self.frames.clone(), count, (self.rule, self.stuck), self.block, self.past);
                // What could not be used is replaced by now.
                let samples = &self.block.samples[self.frames.start * count..self.frames.end * count];
                let readings = || samples.iter().skip(offset + lane).step_by(count);
                let (low, high) = readings().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), reading| {
                    (low.min(*reading), high.max(*reading))
                });
                let place = [self.block.start + self.frames.start as u64, self.frames.len() as u64];
                channel.extents.note([low, high], place, || Box::new(readings()));
            }
            return;
        }
        for (lane, channel) in group.iter_mut().enumerate() {
            channel.last = Some(last[lane]);
            channel.lowest = channel.lowest.min(lowest[lane]);
            channel.highest = channel.highest.max(highest[lane]);
            channel.finest_step = channel.finest_step.min(finest[lane]);
            channel.seen += self.frames.len() as u64;
            let end = self.block.start + self.frames.end as u64;
            let place = [self.block.start + self.frames.start as u64, self.frames.len() as u64];
            let readings = || frames.iter().skip(offset + lane).step_by(count);
            channel.extents.note([lowest[lane], highest[lane]], place, || Box::new(readings()));
            let repeated = repeats[lane] as u64;
            channel.same = Same { start: end - repeated, repeats: repeated, stuck: false };
            channel.run = Run {
                start: end - 1,
                length: 1,
                suspect: flat && (last[lane] <= channel.lowest || last[lane] >= channel.highest),
                ..Run::default()
            };
        }
    }
}

/// What one glance over frames shows.
struct Extremes<const C: usize> {
    lowest: [f64; C],
    highest: [f64; C],
    /// Smallest change between two samples.
    finest: [f64; C],
    /// 0 · value is 0 for finite values only.
    zero: [f64; C],
    last: [f64; C],
}

#[inline(always)]
#[allow(clippy::inline_always, reason = "see LaneWork")]
fn extremes<const C: usize>(frames: &[f64], channels: usize, offset: usize, before: [f64; C]) -> Extremes<C> {
    if channels == C {
        // A distance between frames that the compiler knows spares the checks of every access.
        return extremes_of(frames.as_chunks::<C>().0.iter().copied(), before);
    }
    extremes_of(frames.chunks_exact(channels).map(|frame| load(frame, offset)), before)
}

/// One loop an operation, so that each becomes one of all lanes.
#[inline(always)]
#[allow(clippy::inline_always, reason = "see LaneWork")]
fn extremes_of<const C: usize>(frames: impl Iterator<Item = [f64; C]>, before: [f64; C]) -> Extremes<C> {
    let (mut lowest, mut highest) = ([f64::INFINITY; C], [f64::NEG_INFINITY; C]);
    let (mut finest, mut zero, mut last) = ([f64::INFINITY; C], [0.0; C], before);
    for value in frames {
        for lane in 0..C {
            lowest[lane] = lowest[lane].min(value[lane]);
        }
        for lane in 0..C {
            highest[lane] = highest[lane].max(value[lane]);
        }
        for lane in 0..C {
            last[lane] = (value[lane] - last[lane]).abs();
        }
        for lane in 0..C {
            finest[lane] = finest[lane].min(last[lane]);
        }
        for lane in 0..C {
            zero[lane] += 0.0 * value[lane];
        }
        last = value;
    }
    Extremes { lowest, highest, finest, zero, last }
}

/// The smallest change that is none of 0, and the most equal samples in a row; `repeats` counts those at the end.
#[inline(always)]
#[allow(clippy::inline_always, reason = "see LaneWork")]
fn repetitions<const C: usize>(
    frames: &[f64],
    channels: usize,
    offset: usize,
    mut last: [f64; C],
    repeats: &mut [f64; C],
) -> ([f64; C], [f64; C]) {
    let (mut finest, mut most) = ([f64::INFINITY; C], [0.0; C]);
    for frame in frames.chunks_exact(channels) {
        let value: [f64; C] = load(frame, offset);
        let (mut step, mut change, mut longer) = ([0.0; C], [0.0; C], [0.0; C]);
        for lane in 0..C {
            step[lane] = (value[lane] - last[lane]).abs();
        }
        for lane in 0..C {
            change[lane] = if step[lane] > 0.0 { step[lane] } else { f64::INFINITY };
        }
        for lane in 0..C {
            finest[lane] = if change[lane] < finest[lane] { change[lane] } else { finest[lane] };
        }
        for lane in 0..C {
            longer[lane] = repeats[lane] + 1.0;
        }
        for lane in 0..C {
            repeats[lane] = if step[lane] == 0.0 { longer[lane] } else { 0.0 };
        }
        for lane in 0..C {
            most[lane] = if repeats[lane] > most[lane] { repeats[lane] } else { most[lane] };
        }
        last = value;
    }
    (finest, most)
}
