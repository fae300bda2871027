//! Sensors of unlike rates or starts, brought to common instants at the lowest of their rates.
//!
//! Every sensor passes one low-pass, a windowed sinc, whose values are taken at the common instants. So all have the same response, and no
//! frequency is in the result that a sensor could not record. No sensor gets more samples than it has.

use std::f64::consts::PI;

use runout_core::{
    Result,
    inspection::Inspection,
    measurement::{Block, Capture, Defect, Response, SampleStream},
};

use crate::{
    clock::{Clock, Common, Instants, MARGIN},
    signal::{Conversion, Signal},
    stream::{AngleSource, BLOCK_ELEMENTS, ChannelStream, limits},
};

/// Half the length of the kernel, in samples of the result.
const HALF: usize = MARGIN as usize;
/// Values of the kernel that are tabulated a sample: a straight line between them is right to 10⁻⁷.
const VALUES: usize = 2048;
/// Middle of the transition from what passes to what does not, as a share of the rate.
const MIDDLE: f64 = 0.45;
/// Shares of the rate up to which everything passes, and from which on nothing does, to 10⁻⁵.
const PASSED: f64 = 0.4;
const STOPPED: f64 = 0.5;
/// Shape of Kaiser's window for 100 dB: 0.1102 (100 − 8.7) (Kaiser, Proc. IEEE Int. Symp. Circuits and Systems 1974, p. 20).
const BETA: f64 = 10.061_26;
/// Share of the rate at which half of the power passes.
const HALF_POWER: f64 = 0.441_3;
/// Order of the Butterworth low-pass, applied twice, that falls off about as steeply.
const ORDER: usize = 28;

/// Says which sensors are resampled.
pub(crate) fn remark(sensors: &[(Signal, Conversion)], clocks: &[Clock], common: &Common) -> String {
    let rate_hz = common.clock.rate_hz.unwrap_or(f64::NAN);
    let each = sensors.iter().zip(clocks).map(|((signal, _), clock)| {
        format!("{} {} Hz from {} s", signal.channel().name, clock.rate_hz.unwrap_or(f64::NAN), clock.start_s)
    });
    format!(
        "the sensors were sampled at unlike rates or times ({}): they are resampled at {rate_hz} Hz by one low-pass for all, which passes \
         up to {} Hz and nothing above {} Hz; {MARGIN} samples at both ends are not used",
        each.collect::<Vec<_>>().join(", "),
        PASSED * rate_hz,
        STOPPED * rate_hz
    )
}

/// A sinc of the cutoff in Kaiser's window, at distances from its middle in samples of the result.
struct Kernel(Vec<f64>);

impl Kernel {
    fn new() -> Self {
        let value = |index: usize| {
            let distance = index as f64 / VALUES as f64;
            let angle = 2.0 * PI * MIDDLE * distance;
            let sinc = if index == 0 { 1.0 } else { angle.sin() / angle };
            let inside = 1.0 - (distance / HALF as f64).powi(2);
            if inside < 0.0 { 0.0 } else { sinc * bessel_i0(BETA * inside.sqrt()) }
        };
        Self((0..=HALF * VALUES + 1).map(value).collect())
    }

    fn at(&self, distance: f64) -> f64 {
        let place = distance.abs() * VALUES as f64;
        let index = (place as usize).min(self.0.len() - 2);
        let [below, above] = [self.0[index], self.0[index + 1]];
        below + (above - below) * (place - index as f64)
    }
}

/// The modified Bessel function of the first kind and order 0, by its series.
fn bessel_i0(argument: f64) -> f64 {
    let quarter = 0.25 * argument * argument;
    let (mut term, mut sum, mut number) = (1.0, 1.0, 1.0);
    while term > f64::EPSILON * sum {
        term *= quarter / (number * number);
        sum += term;
        number += 1.0;
    }
    sum
}

/// The sensors of one clock.
struct Part {
    /// Looked over before the low-pass, which would hide clipped readings.
    input: Inspection<'static>,
    /// Which of the capture's channels they are.
    channels: Vec<usize>,
    /// From samples of the result to its own.
    instants: Instants,
    /// Samples that are still needed, side by side, and the number of the first.
    held: Vec<f64>,
    first: u64,
    block: Block,
    weights: Vec<f64>,
}

/// Samples of a capture at common instants.
pub(crate) struct ResampledStream {
    capture: Capture,
    parts: Vec<Part>,
    angles: Option<AngleSource>,
    kernel: Kernel,
    next: u64,
}

impl ResampledStream {
    pub(crate) fn open(
        mut capture: Capture,
        sensors: &[(Signal, Conversion)],
        clocks: &[Clock],
        common: &Common,
        angles: Option<AngleSource>,
    ) -> Result<Self> {
        let mut groups: Vec<(Clock, Vec<usize>)> = Vec::new();
        for (channel, clock) in clocks.iter().enumerate() {
            match groups.iter_mut().find(|(other, _)| clock.is_that_of(other)) {
                Some((other, channels)) => {
                    other.samples = other.samples.min(clock.samples);
                    channels.push(channel);
                }
                None => groups.push((*clock, vec![channel])),
            }
        }
        let part = |(clock, channels): (Clock, Vec<usize>)| {
            let own: Vec<(Signal, Conversion)> = channels.iter().map(|channel| sensors[*channel].clone()).collect();
            let instants = Instants::between(common.clock, clock).map_err(|problem| own[0].0.error(problem))?;
            let of_part = Capture {
                object: own[0].0.shown.clone(),
                sample_rate_hz: clock.rate_hz,
                samples: clock.samples,
                sensors: channels.iter().map(|channel| capture.sensors[*channel]).collect(),
                sensor_ids: channels.iter().map(|channel| capture.sensor_ids[*channel].clone()).collect(),
                converter_limits_um: limits(&own),
                marks: capture.marks.iter().map(|mark| instants.of(*mark)).collect(),
                encoder: false,
                ..capture.clone()
            };
            let input = Inspection::new(Box::new(ChannelStream::open(of_part, &own, None)?));
            let (block, held, weights) = (Block::default(), Vec::new(), Vec::new());
            Ok(Part { input, channels, instants, held, first: 0, block, weights })
        };
        let parts = groups.into_iter().map(part).collect::<Result<_>>()?;
        let rate_hz = common.clock.rate_hz.unwrap_or(f64::NAN);
        capture.converter_limits_um = None;
        capture.responses.push(Response {
            description: format!(
                "resampling of sensors of unlike rates or starts at {rate_hz} Hz, windowed sinc, −3 dB at {:.4} Hz",
                HALF_POWER * rate_hz
            ),
            half_power_hz: HALF_POWER * rate_hz,
            order: ORDER,
            sample_rate_hz: f64::INFINITY,
        });
        Ok(Self { capture, parts, angles, kernel: Kernel::new(), next: 0 })
    }
}

impl Part {
    /// Computes the samples `from..from + count` of the result into the columns of a block.
    fn compute(&mut self, kernel: &Kernel, from: u64, count: usize, channels: usize, to: &mut Block) -> Result<()> {
        let own = self.channels.len();
        let reach = HALF as f64 * self.instants.ratio;
        for frame in 0..count {
            let middle = self.instants.of((from + frame as u64) as f64);
            let (low, high) = ((middle - reach).ceil().max(0.0) as u64, (middle + reach).floor().max(0.0) as u64);
            while self.first + (self.held.len() / own) as u64 <= high && self.step(from, to)? {}
            let behind = self.first + (self.held.len() / own) as u64;
            let used = low.max(self.first)..(high + 1).min(behind);
            self.weights.clear();
            let weight = |sample: u64| kernel.at((sample as f64 - middle) / self.instants.ratio);
            self.weights.extend(used.clone().map(weight));
            let whole: f64 = self.weights.iter().sum();
            let held = self.held.get((used.start - self.first) as usize * own..).unwrap_or_default();
            for (place, channel) in self.channels.iter().enumerate() {
                let values = held.iter().skip(place).step_by(own);
                let sum: f64 = self.weights.iter().zip(values).map(|(weight, value)| weight * value).sum();
                to.samples[frame * channels + channel] = sum / whole;
            }
        }
        let next = (self.instants.of((from + count as u64) as f64) - reach).max(0.0) as u64;
        let unneeded = (next.saturating_sub(self.first) as usize * own).min(self.held.len());
        self.held.drain(..unneeded);
        self.first += (unneeded / own) as u64;
        Ok(())
    }

    /// Reads on, and marks what of the result defects reach.
    fn step(&mut self, from: u64, to: &mut Block) -> Result<bool> {
        let is_more = self.input.next_block(&mut self.block)?;
        self.held.append(&mut self.block.samples);
        let Instants { ratio, shift } = self.instants;
        for defect in self.block.defects.drain(..) {
            let [first, last] = [defect.samples.start, defect.samples.end.saturating_sub(1)];
            let start = ((first as f64 - shift) / ratio - HALF as f64).ceil().max(0.0) as u64;
            let end = ((last as f64 - shift) / ratio + HALF as f64).floor().max(0.0) as u64 + 1;
            let channel = self.channels[defect.channel];
            to.defects.push(Defect { samples: start.max(from)..end.max(from), channel, ..defect });
        }
        Ok(is_more)
    }
}

impl SampleStream for ResampledStream {
    fn capture(&self) -> &Capture {
        &self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        block.clear();
        block.start = self.next;
        let channels = self.capture.channels().max(1);
        let count = (BLOCK_ELEMENTS / channels).max(1).min((self.capture.samples - self.next) as usize);
        if count == 0 {
            return Ok(false);
        }
        block.samples.resize(count * channels, 0.0);
        for part in &mut self.parts {
            part.compute(&self.kernel, self.next, count, channels, block)?;
        }
        block.defects.retain(|defect| !defect.samples.is_empty());
        if let Some(angles) = &mut self.angles {
            angles.append(self.next..self.next + count as u64, &mut block.angle_rev)?;
        }
        self.next += count as u64;
        Ok(true)
    }
}
