//! When the samples of channels were taken.

use std::sync::Arc;

use runout_core::{Error, ErrorKind, Result, clock::ClockScan};

use crate::{
    channel::Channel,
    hints::is_time,
    signal::Signal,
    unit::{self, Known},
};

/// Sampling rates that differ by a smaller share are the same: rounding of a time column.
pub(crate) const SAME_RATE: f64 = 1e-3;
/// Instants that differ by a smaller share of a sample are the same.
const SAME_INSTANT: f64 = 0.01;

/// Samples at both ends that resampling needs around the first and the last one that it computes.
pub(crate) const MARGIN: u64 = 32;
/// Highest ratio of sampling rates of sensors that are brought together; a larger one is a mistake, and would take much memory.
const HIGHEST_RATIO: f64 = 1000.0;

/// When the samples of a channel were taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Clock {
    pub(crate) rate_hz: Option<f64>,
    /// Time of the first sample.
    pub(crate) start_s: f64,
    pub(crate) samples: u64,
}

impl Clock {
    /// What a file says of a channel; without a start it begins at `begin_s`.
    pub(crate) fn stated(channel: &Channel, begin_s: f64) -> Self {
        Self { rate_hz: channel.rate_hz, start_s: channel.start_s.unwrap_or(begin_s), samples: channel.samples }
    }

    /// Whether samples of one number are of one instant; where no rate is known, nothing contradicts that.
    pub(crate) fn is_that_of(&self, other: &Self) -> bool {
        let (Some(one), Some(another)) = (self.rate_hz, other.rate_hz) else { return true };
        (one / another - 1.0).abs() <= SAME_RATE && (self.start_s - other.start_s).abs() * one <= SAME_INSTANT
    }
}

/// From the samples of one clock to those of another: position · ratio + shift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Instants {
    pub(crate) ratio: f64,
    pub(crate) shift: f64,
}

impl Instants {
    pub(crate) fn of(&self, position: f64) -> f64 {
        position * self.ratio + self.shift
    }

    /// From samples of `from` to those of `to`.
    ///
    /// # Errors
    /// What is not known of them.
    pub(crate) fn between(from: Clock, to: Clock) -> std::result::Result<Self, String> {
        match (from.rate_hz, to.rate_hz) {
            (Some(one), Some(other)) => Ok(Self { ratio: other / one, shift: (from.start_s - to.start_s) * other }),
            _ if from.samples == to.samples => Ok(Self { ratio: 1.0, shift: 0.0 }),
            _ => Err(format!(
                "it has {} samples, the sensors {}, and the sampling rates of both are not known",
                from.samples, to.samples
            )),
        }
    }
}

/// A channel of times that was looked through.
pub(crate) struct Scan {
    pub(crate) time: Signal,
    pub(crate) rate_hz: Option<f64>,
    pub(crate) start_s: f64,
}

impl Scan {
    pub(crate) fn of(time: Signal) -> Result<Self> {
        let factor = match time.channel().unit.as_deref().and_then(unit::known) {
            Some(Known::Seconds(factor)) => factor,
            _ => 1.0,
        };
        let (mut scan, mut start_s) = (ClockScan::default(), None);
        let (mut sample, help) = (0_u64, "state `sample_rate_hz` in [load] where the times have too few digits");
        time.each(|value| {
            let failed = |problem: String| time.error(format!("sample {sample}: {problem}")).help(help);
            if !value.is_finite() {
                return Err(failed(format!("expected a time, found {value}")));
            }
            start_s.get_or_insert(value * factor);
            scan.push(value * factor).map_err(failed)?;
            sample += 1;
            Ok(())
        })?;
        let rate_hz = scan.rate_hz().map_err(|problem| time.error(problem).help(help))?;
        Ok(Self { time, rate_hz, start_s: start_s.unwrap_or(0.0) })
    }
}

/// A channel of times in the same group, as long as another one.
pub(crate) fn time_beside(beside: &Signal) -> Option<Signal> {
    let channels = beside.file.channels();
    let own = beside.channel();
    let index = channels
        .iter()
        .position(|channel| is_time(channel) && channel.group == own.group && channel.samples == own.samples)?;
    let shown = beside.shown.replace(&own.path(), &channels[index].path());
    Some(Signal { file: Arc::clone(&beside.file), index, shown })
}

/// What the sensors have in common.
pub(crate) struct Common {
    /// The clock to which their samples are brought.
    pub(crate) clock: Clock,
    /// Where the recording begins, for channels that do not say it.
    pub(crate) begin_s: f64,
    /// Whether the clocks are unlike, so that samples have to be computed.
    pub(crate) is_resampled: bool,
}

impl Common {
    /// The clock of all sensors, or the lowest rate of theirs where they are unlike, from the last start to the first end, without
    /// [`MARGIN`] samples at both.
    ///
    /// # Errors
    /// When unlike clocks do not overlap, or a rate is not known.
    pub(crate) fn of(sensors: &[&Signal], clocks: &[Clock]) -> Result<Self> {
        // Any of them may state the rate.
        let known = clocks.iter().find(|clock| clock.rate_hz.is_some()).or(clocks.first());
        let first = known.copied().unwrap_or(Clock { rate_hz: None, start_s: 0.0, samples: 0 });
        if clocks.iter().all(|clock| clock.is_that_of(&first)) {
            let samples = clocks.iter().map(|clock| clock.samples).min().unwrap_or(0);
            return Ok(Self { clock: Clock { samples, ..first }, begin_s: first.start_s, is_resampled: false });
        }
        let (mut rate_hz, mut highest_hz) = (f64::INFINITY, 0.0_f64);
        let (mut from_s, mut to_s) = (f64::NEG_INFINITY, f64::INFINITY);
        for (signal, clock) in sensors.iter().zip(clocks) {
            let Some(own_hz) = clock.rate_hz else {
                let problem = "its sampling rate is not known, and those of other sensors are unlike";
                return Err(signal.error(problem).help("name its channel of times, or record it beside the others"));
            };
            rate_hz = rate_hz.min(own_hz);
            highest_hz = highest_hz.max(own_hz);
            from_s = from_s.max(clock.start_s);
            to_s = to_s.min(clock.start_s + clock.samples.saturating_sub(1) as f64 / own_hz);
        }
        let shown = sensors.first().map_or("the channels", |signal| signal.shown.as_str());
        if highest_hz > HIGHEST_RATIO * rate_hz {
            let problem = format!("the sensors' sampling rates go from {rate_hz} to {highest_hz} Hz");
            let help = format!("rates up to a factor of {HIGHEST_RATIO} apart are resampled: state the right ones");
            return Err(Error::new("resample", shown, problem).help(help));
        }
        let both = ((to_s - from_s) * rate_hz * (1.0 + f64::EPSILON)).floor() + 1.0 - 2.0 * MARGIN as f64;
        if both.is_nan() || both < 1.0 {
            let problem = format!(
                "the sensors' unlike samples have from {from_s} to {to_s} s in common; expected more than {} s to compute those at {rate_hz} Hz",
                2.0 * MARGIN as f64 / rate_hz
            );
            return Err(Error::new("resample", shown, problem).of(ErrorKind::InsufficientData));
        }
        Ok(Self {
            clock: Clock { rate_hz: Some(rate_hz), start_s: from_s + MARGIN as f64 / rate_hz, samples: both as u64 },
            begin_s: clocks.iter().map(|clock| clock.start_s).fold(f64::INFINITY, f64::min),
            is_resampled: true,
        })
    }
}
