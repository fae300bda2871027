//! Zero-phase low-pass: a Butterworth filter run over the capture forward and then backward.
//!
//! Both ends are continued by an odd reflection, 2x₀ − xₖ, of 3·(order + 1) samples, and each pass begins in the steady
//! state of its first value: what `scipy.signal.sosfiltfilt` does by default (Gustafsson, IEEE Trans. Signal Process. 44(4), 1996, discusses the
//! choice). The capture is worked on in pieces: the forward pass carries its state on, and the backward pass of each
//! piece begins so far beyond its end that what it did not see has died away below rounding.

use runout_core::{
    Error, ErrorKind, Result,
    fault::Fault,
    measurement::{Block, Capture, Defect, Response, SampleStream},
    pipeline::{Context, StageConfig},
    rig::Rig,
    stage::{Conditioner, Preprocessor, sample_rate_hz},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    butterworth::{sections, settling_samples, two_pass_half_power_hz},
    cascade::{Cascade, Direction},
    interruptions,
};

/// What the backward pass leaves of what lies beyond the samples it begins at: below rounding, with room for the
/// overshoot of several sections.
const FORGOTTEN: f64 = 1e-18;
/// What a bad sample leaves at the ends of the range that counts as bad with it.
const DEFECT_SHARE: f64 = 1e-6;
/// Frames that are handed on at once, at least.
const PIECE: usize = 4096;
/// Frames that are handed on at once, at least, as a multiple of the backward pass's lookahead, which is filtered for nothing.
const PIECE_LOOKAHEADS: usize = 4;
/// Share of the sampling rate below which the sections' own rounding would show.
const LOWEST_SHARE: f64 = 1e-5;
/// Above, sections are steeper than any measurement asks for.
const HIGHEST_ORDER: usize = 8;

/// Zero-phase Butterworth low-pass, forward and backward.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LowPassConfig {
    /// −3 dB frequency of one pass, in Hz; the two passes together are −3 dB somewhat below, as the result says.
    pub cutoff_hz: f64,
    /// Order of one pass, 1 to 8.
    #[serde(default = "default_order")]
    pub order: usize,
}

fn default_order() -> usize {
    4
}

impl StageConfig for LowPassConfig {
    type Stage = Preprocessor;

    const NAME: &'static str = "low-pass";
    const ABOUT: &'static str = "zero-phase Butterworth low-pass, forward and backward";

    fn check(self, context: &Context) -> std::result::Result<Preprocessor, Fault> {
        if !(self.cutoff_hz > 0.0 && self.cutoff_hz.is_finite()) {
            return Err(Fault::at("cutoff_hz", format!("expected a frequency above 0 Hz, found {}", self.cutoff_hz)));
        }
        if !(1..=HIGHEST_ORDER).contains(&self.order) {
            return Err(Fault::at("order", format!("expected 1 to {HIGHEST_ORDER}, found {}", self.order)));
        }
        let rig = interruptions::interrupted(context.rig);
        Ok(Preprocessor::Conditioner(Box::new(LowPass { cutoff_hz: self.cutoff_hz, order: self.order, rig })))
    }
}

/// The checked low-pass.
#[derive(Debug, Clone, PartialEq)]
pub struct LowPass {
    cutoff_hz: f64,
    order: usize,
    /// Where the part's surface is interrupted somewhere: readings there are bridged before the filter.
    rig: Option<Rig>,
}

impl Conditioner for LowPass {
    fn attach<'a>(&'a self, input: Box<dyn SampleStream + 'a>) -> Result<Box<dyn SampleStream + 'a>> {
        let mut capture = input.capture().clone();
        let rate_hz = sample_rate_hz(&capture, "low-pass")?;
        if self.cutoff_hz >= 0.5 * rate_hz || !rate_hz.is_finite() {
            let problem =
                format!("cutoff_hz = {} is not below half of the sampling rate, {rate_hz} Hz", self.cutoff_hz);
            let help = "lower cutoff_hz, or leave the low-pass out";
            return Err(Error::new("low-pass", &capture.object, problem).of(ErrorKind::Configuration).help(help));
        }
        if self.cutoff_hz < LOWEST_SHARE * rate_hz {
            let problem = format!("cutoff_hz = {} is too far below the sampling rate, {rate_hz} Hz", self.cutoff_hz);
            return Err(Error::new("low-pass", &capture.object, problem)
                .of(ErrorKind::Configuration)
                .help("raise cutoff_hz"));
        }
        let half_power_hz = two_pass_half_power_hz(self.order, self.cutoff_hz, rate_hz);
        capture.responses.push(Response {
            description: format!(
                "low-pass, zero-phase Butterworth, order {} at {} Hz twice, −3 dB at {} Hz",
                self.order,
                significant(self.cutoff_hz, 4),
                significant(half_power_hz, 4)
            ),
            half_power_hz,
            order: self.order,
            sample_rate_hz: rate_hz,
        });
        let sections = sections(self.order, self.cutoff_hz, rate_hz);
        let lookahead = settling_samples(&sections, FORGOTTEN);
        let channels = capture.channels();
        Ok(Box::new(LowPassStream {
            input: interruptions::bridged(input, self.rig.as_ref()),
            capture,
            pad: 3 * (self.order + 1),
            lookahead,
            piece: PIECE.max(PIECE_LOOKAHEADS * lookahead),
            spread: settling_samples(&sections, DEFECT_SHARE) as u64,
            forward: Cascade::new(&sections, channels),
            backward: Cascade::new(&sections, channels),
            raw: Block::default(),
            held: Block::default(),
            next: Block::default(),
            tail: Vec::new(),
            scratch: Vec::new(),
            stage: Stage::Filling,
        }))
    }
}

/// A number in so many significant digits.
pub(crate) fn significant(value: f64, digits: u8) -> String {
    let decimals = (f64::from(digits) - 1.0 - value.abs().log10().floor()).clamp(0.0, 12.0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// How far the stream is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// The frames for the continuation before the first are not all there.
    Filling,
    /// In the middle.
    Running,
    /// Everything was handed on.
    Done,
}

struct LowPassStream<'a> {
    input: Box<dyn SampleStream + 'a>,
    capture: Capture,
    /// Frames of the continuation at each end.
    pad: usize,
    lookahead: usize,
    /// Frames that are handed on at once, at least.
    piece: usize,
    /// Samples by which a bad range grows at each end.
    spread: u64,
    forward: Cascade,
    backward: Cascade,
    raw: Block,
    /// Filtered forward (unless still gathering), to be handed on.
    held: Block,
    /// Filtered forward, behind it.
    next: Block,
    /// The last unfiltered frames, for the continuation after the last.
    tail: Vec<f64>,
    scratch: Vec<f64>,
    stage: Stage,
}

impl LowPassStream<'_> {
    fn channels(&self) -> usize {
        self.capture.channels()
    }

    /// Takes the block in `raw`.
    fn take(&mut self) {
        let channels = self.channels();
        let kept = (self.pad + 1) * channels;
        let new = &self.raw.samples[self.raw.samples.len().saturating_sub(kept)..];
        self.tail.drain(..(self.tail.len() + new.len()).saturating_sub(kept).min(self.tail.len()));
        self.tail.extend_from_slice(new);

        // A bad sample behind what is handed on may spoil its end: it is said with it.
        let spread = self.spread;
        self.held.defects.extend(self.raw.defects.drain(..).map(|defect| Defect {
            samples: defect.samples.start.saturating_sub(spread)..defect.samples.end.saturating_add(spread),
            ..defect
        }));
        if self.stage == Stage::Filling {
            join(&mut self.held, &mut self.raw);
            if self.held.samples.len() >= kept {
                self.scratch.clear();
                reflect(&self.held.samples[..kept], channels, End::First, &mut self.scratch);
                self.forward.settle(&self.scratch[..channels]);
                self.forward.run(&mut self.scratch, Direction::Forward);
                self.forward.run(&mut self.held.samples, Direction::Forward);
                self.stage = Stage::Running;
            }
        } else {
            self.forward.run(&mut self.raw.samples, Direction::Forward);
            let full = self.held.samples.len() >= self.piece * channels;
            join(if full { &mut self.next } else { &mut self.held }, &mut self.raw);
        }
    }

    /// Filters what is held backward, beginning in what comes behind it, and hands it on.
    fn hand_on(&mut self, block: &mut Block) {
        let lookahead = self.lookahead * self.channels();
        self.scratch.clear();
        self.scratch.extend_from_slice(&self.next.samples[..lookahead]);
        self.backward_over_scratch();
        self.backward.run(&mut self.held.samples, Direction::Backward);
        // What the block was is read into next; not cleared, it needs no zeros.
        std::mem::swap(block, &mut self.held);
        std::mem::swap(&mut self.held, &mut self.raw);
        std::mem::swap(&mut self.held, &mut self.next);
    }

    /// Runs the backward pass from its beginning over what is in `scratch`, for its state only.
    fn backward_over_scratch(&mut self) {
        let channels = self.channels();
        self.backward.settle(&self.scratch[self.scratch.len().saturating_sub(channels)..]);
        self.backward.run(&mut self.scratch, Direction::Backward);
    }

    /// Filters and hands on everything that is left, with the continuation after the last sample.
    fn finish(&mut self, block: &mut Block) -> Result<bool> {
        if self.stage == Stage::Filling {
            let frames = self.held.samples.len() / self.channels().max(1);
            let problem = format!("it has {frames} samples, the filter needs more than {}", self.pad);
            return Err(Error::new("low-pass", &self.capture.object, problem).of(ErrorKind::InsufficientData));
        }
        self.stage = Stage::Done;
        let channels = self.channels();
        self.scratch.clear();
        reflect(&self.tail, channels, End::Last, &mut self.scratch);
        self.forward.run(&mut self.scratch, Direction::Forward);
        self.backward_over_scratch();
        join(&mut self.held, &mut self.next);
        self.backward.run(&mut self.held.samples, Direction::Backward);
        std::mem::swap(block, &mut self.held);
        self.held.clear();
        Ok(!block.samples.is_empty())
    }
}

/// Puts a block behind another one, and leaves it empty.
fn join(first: &mut Block, second: &mut Block) {
    if first.samples.is_empty() {
        second.defects.append(&mut first.defects);
        std::mem::swap(first, second);
        second.clear();
    } else {
        first.samples.append(&mut second.samples);
        first.angle_rev.append(&mut second.angle_rev);
        first.defects.append(&mut second.defects);
    }
}

/// Which end of the capture is continued.
#[derive(Debug, Clone, Copy, PartialEq)]
enum End {
    First,
    Last,
}

/// Adds the odd reflection of all frames but the outermost at that one, in the order of time.
fn reflect(frames: &[f64], channels: usize, end: End, continued: &mut Vec<f64>) {
    let (edge, others) = match end {
        End::First => frames.split_at(channels),
        End::Last => {
            let (others, edge) = frames.split_at(frames.len() - channels);
            (edge, others)
        }
    };
    for frame in others.chunks_exact(channels).rev() {
        continued.extend(edge.iter().zip(frame).map(|(edge, value)| 2.0 * edge - value));
    }
}

impl SampleStream for LowPassStream<'_> {
    fn capture(&self) -> &Capture {
        &self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        if self.channels() == 0 {
            return self.input.next_block(block);
        }
        while self.stage != Stage::Done {
            let behind = self.next.samples.len() / self.channels();
            if behind > 0 && behind >= self.lookahead {
                self.hand_on(block);
                return Ok(true);
            }
            if self.input.next_block(&mut self.raw)? {
                self.take();
            } else {
                return self.finish(block);
            }
        }
        block.clear();
        Ok(false)
    }
}

#[cfg(test)]
mod tests;
