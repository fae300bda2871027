//! Where turns begin: marks and encoders, brought to the samples of the sensors.

use std::cmp::Ordering;

use runout_core::{
    Error, Result,
    encoder::EncoderScan,
    marker::{Marker, MarkerScan},
    numerics::statistics::median,
};

use crate::{
    capture::{Place, Signals},
    channel::Samples,
    clock::Instants,
    config::{AngleConfig, MarkConfig},
    signal::{BLOCK, Signal},
    unit::{self, Known},
};

/// Pulses whose distance differs by this factor from the one before are not next to each other.
const LOST_PULSE: f64 = 1.7;
/// Share of 2^n counts from which on a range is that of a counter.
const FULL: f64 = 0.98;
/// What to do where a trace has no marks.
const LEVELS: &str = "set `threshold` and `hysteresis` of `marker` in [load] between its levels";
/// What a channel is named that needs no configuration.
const ANGLE: &str = "angle_deg";
const INDEX: &str = "index";

/// Where turns begin in a capture.
pub(crate) struct Turns {
    /// Sample positions of the sensors' channels.
    pub(crate) marks: Vec<f64>,
    pub(crate) within_samples: f64,
    pub(crate) angles: Option<Angles>,
}

/// Where the angle of each sample comes from.
pub(crate) enum Angles {
    /// A channel.
    Channel(AngleSignal),
    /// Pulses of an encoder.
    Pulses(Pulses),
}

/// Pulses of an encoder.
pub(crate) struct Pulses {
    /// Sample positions, ascending.
    places: Vec<f64>,
    /// Angle of the first in turns.
    first_rev: f64,
    per_turn: f64,
}

/// A channel of angles.
#[derive(Clone)]
pub(crate) struct AngleSignal {
    signal: Signal,
    /// Degrees of one unit.
    degrees: f64,
    /// Degrees after which it begins anew, where it does.
    period_deg: Option<f64>,
    scan: EncoderScan,
    /// From samples of the sensors to those of this channel.
    instants: Instants,
}

impl Turns {
    pub(crate) fn of(place: &Place, signals: &Signals) -> Result<Self> {
        let config = place.config;
        if let Some(angle) = &config.angle {
            return Self::by_angle(place, signals, angle);
        }
        if let Some(times) = &config.times {
            return Self::by_times(place, signals, times);
        }
        if let Some(mark) = &config.marker {
            return Self::by_marks(place, signals, mark);
        }
        if place.signal(ANGLE).is_ok() {
            let angle = AngleConfig { channel: ANGLE.into(), unit: None };
            return Self::by_angle(place, signals, &angle);
        }
        if place.signal(INDEX).is_ok() {
            let mark = MarkConfig { channel: INDEX.into(), threshold: None, hysteresis: None, edge: <_>::default() };
            return Self::by_marks(place, signals, &mark);
        }
        let shown = place.path("").display().to_string();
        Err(Error::new("read", shown, "expected `marker`, `angle` or `times` in [load], found none").help(
            "name the channel of the once-per-turn mark, marker = { channel = \"…\" }, or of the encoder, angle = { channel = \"…\", unit = \
             \"deg\" }; `runout inspect FILE` guesses it",
        ))
    }

    fn by_marks(place: &Place, signals: &Signals, mark: &MarkConfig) -> Result<Self> {
        let (marks, within_samples) = crossings(place, signals, mark)?;
        let marks = if place.config.pulses_per_turn.is_none() { kept(marks, signals, &mark.channel)? } else { marks };
        Self::counted(place, signals, marks, within_samples)
    }

    /// Marks, or an encoder where there are many a turn.
    fn counted(place: &Place, signals: &Signals, marks: Vec<f64>, within_samples: f64) -> Result<Self> {
        let Some(per_turn) = place.config.pulses_per_turn.filter(|count| *count > 1).map(f64::from) else {
            return Ok(Self { marks, within_samples, angles: None });
        };
        let shown = || place.path("").display().to_string();
        for (number, three) in marks.windows(3).enumerate() {
            let (before, now) = (three[1] - three[0], three[2] - three[1]);
            if !(now < LOST_PULSE * before && before < LOST_PULSE * now) {
                let problem = format!(
                    "expected even pulses, found distances of {before:.2} and {now:.2} samples at pulse {}",
                    number + 1
                );
                return Err(Error::new("read", shown(), problem).help("a pulse is missing or there is one too many"));
            }
        }
        let mut first_rev = 0.0;
        if let Some(zero) = &place.config.zero {
            let (zeros, _) = crossings(place, signals, zero)?;
            let pulses = zeros
                .windows(2)
                .map(|pair| marks.partition_point(|at| *at < pair[1]) - marks.partition_point(|at| *at < pair[0]));
            let found = median(pulses.map(|count| count as f64));
            if (found - per_turn).abs() > 1.0 {
                let problem = format!("expected {per_turn} pulses from a zero to the next, found {found}");
                let help = "set `pulses_per_turn` to the pulses of a turn of the part; a zero that comes once a turn of another shaft is none";
                return Err(Error::new("read", shown(), problem).help(help));
            }
            let inside = zeros.iter().find(|zero| marks.first() <= Some(*zero) && Some(*zero) < marks.last());
            let Some(at) = inside else {
                return Err(Error::new("read", shown(), "expected a mark of the zero between the pulses, found none"));
            };
            let pulse = position(&marks, *at) / per_turn;
            first_rev = -(pulse - pulse.floor());
        }
        let mut turns = Vec::new();
        let last = (marks.len().max(1) - 1) as f64;
        let mut pulse = -first_rev * per_turn;
        while pulse <= last {
            turns.push(at(&marks, pulse));
            pulse += per_turn;
        }
        if turns.len() < 2 {
            let problem = format!("expected two turns of {per_turn} pulses at least, found {} pulses", marks.len());
            return Err(Error::new("read", shown(), problem));
        }
        let angles = Some(Angles::Pulses(Pulses { places: marks, first_rev, per_turn }));
        Ok(Self { marks: turns, within_samples, angles })
    }

    fn by_times(place: &Place, signals: &Signals, name: &str) -> Result<Self> {
        let signal = place.signal(name)?;
        let Some(rate_hz) = signals.common.clock.rate_hz else {
            return Err(signal.error("times of marks need the sampling rate").help("state `sample_rate_hz` in [load]"));
        };
        let factor = match signal.channel().unit.as_deref().and_then(unit::known) {
            Some(Known::Seconds(factor)) => factor,
            _ => 1.0,
        };
        let mut marks: Vec<f64> = Vec::new();
        signal.each(|time| {
            let position = (time * factor - signals.common.clock.start_s) * rate_hz;
            match marks.last() {
                Some(last) if position.partial_cmp(last) != Some(Ordering::Greater) => {
                    Err(signal.error(format!("mark {}: expected a time above that before, found {time}", marks.len())))
                }
                None if !position.is_finite() => Err(signal.error(format!("expected a time, found {time}"))),
                _ => {
                    marks.push(position);
                    Ok(())
                }
            }
        })?;
        let marks = if place.config.pulses_per_turn.is_none() { kept(marks, signals, name)? } else { marks };
        Self::counted(place, signals, marks, 0.0)
    }

    fn by_angle(place: &Place, signals: &Signals, angle: &AngleConfig) -> Result<Self> {
        let signal = place.signal(&angle.channel)?;
        let stated = angle.unit.as_deref().or(signal.channel().unit.as_deref());
        let degrees = match stated.and_then(unit::known) {
            Some(Known::Turns(turns)) => 360.0 * turns,
            Some(Known::Counts) => match place.config.pulses_per_turn {
                Some(count) => 360.0 / f64::from(count),
                None => return Err(signal.error("an angle in counts needs `pulses_per_turn` in [load]")),
            },
            _ => place.config.pulses_per_turn.map_or(1.0, |count| 360.0 / f64::from(count)),
        };
        let to = place.clock_beside(&signal, &signals.common)?;
        let instants = Instants::between(signals.common.clock, to);
        let instants = instants.map_err(|problem| signal.error(problem))?;
        let (low, high) = signal.range()?;
        // What stays within one turn begins anew with each; what falls back from more turns does so behind whole turns, or at the end of a counter of
        // 2^n.
        let turns = ((high - low) * degrees / 360.0).ceil().max(1.0);
        let begins_anew = turns <= 1.0 || signal.begins_anew(high - low)?;
        let counter = (high - low).log2().ceil().exp2();
        let is_counter = turns > 1.0 && high - low >= FULL * counter;
        let period_deg = begins_anew.then_some(if is_counter { degrees * counter } else { 360.0 * turns });
        let mut found = AngleSignal { signal, degrees, period_deg, scan: EncoderScan::default(), instants };
        let mut scan = EncoderScan::default();
        let mut reader = found.reader()?;
        for sample in 0..signals.common.clock.samples {
            let angle_deg = reader.at(sample)?;
            scan.push(angle_deg).map_err(|fault| {
                let error = found.signal.error(format!("sample {}: {fault}", fault.sample));
                match fault.help {
                    Some(help) => error.help(help),
                    None => error,
                }
            })?;
        }
        let marks = scan.marks().to_vec();
        found.scan = scan;
        Ok(Self { marks, within_samples: 0.0, angles: Some(Angles::Channel(found)) })
    }
}

impl AngleSignal {
    /// Reads the angle at each sample of the sensors.
    pub(crate) fn reader(&self) -> Result<AngleReader> {
        let signal = &self.signal;
        Ok(AngleReader {
            of: self.clone(),
            samples: signal.file.read(&[signal.index])?,
            column: [Vec::new()],
            next: 0,
            before: None,
            now: None,
        })
    }
}

/// Reads a channel of angles from sample to sample.
pub(crate) struct AngleReader {
    of: AngleSignal,
    samples: Box<dyn Samples>,
    column: [Vec<f64>; 1],
    /// In the column.
    next: usize,
    /// Index and unwrapped angle in degrees of the last two samples that were read.
    before: Option<(u64, f64)>,
    now: Option<(u64, f64)>,
}

impl AngleReader {
    /// The angle at a sample of the sensors, in degrees; samples are asked for one after the other.
    pub(crate) fn at(&mut self, sample: u64) -> Result<f64> {
        let position = self.of.instants.of(sample as f64).max(0.0);
        while self.now.is_none_or(|(index, _)| (index as f64) < position) {
            if !self.step()? {
                break;
            }
        }
        match (self.before, self.now) {
            (Some((index, before)), Some((_, now))) => Ok(before + (now - before) * (position - index as f64)),
            (None, Some((_, now))) => Ok(now),
            _ => Err(self.of.signal.error("expected angles, found none")),
        }
    }

    /// In turns, rising with time.
    pub(crate) fn turns_at(&mut self, sample: u64) -> Result<f64> {
        let angle_deg = self.at(sample)?;
        Ok(self.of.scan.turns(angle_deg))
    }

    fn step(&mut self) -> Result<bool> {
        if self.next == self.column[0].len() {
            self.column[0].clear();
            self.next = 0;
            if self.samples.next(BLOCK, &mut self.column)? == 0 {
                return Ok(false);
            }
        }
        let mut angle_deg = self.column[0][self.next] * self.of.degrees;
        self.next += 1;
        self.before = self.now;
        if let (Some((_, last)), Some(period)) = (self.before, self.of.period_deg) {
            angle_deg += ((last - angle_deg) / period).round() * period;
        }
        self.now = Some((self.before.map_or(0, |(index, _)| index + 1), angle_deg));
        Ok(true)
    }
}

impl Pulses {
    /// The angle at a sample, in turns.
    pub(crate) fn turns_at(&self, sample: u64) -> f64 {
        self.first_rev + position(&self.places, sample as f64) / self.per_turn
    }
}

/// The number of a pulse at a sample position, between pulses and beyond them along a straight line.
fn position(pulses: &[f64], sample: f64) -> f64 {
    let last = pulses.len().saturating_sub(2);
    let pulse = pulses.partition_point(|place| *place <= sample).saturating_sub(1).min(last);
    match pulses.get(pulse..pulse + 2) {
        Some([from, to]) => pulse as f64 + (sample - from) / (to - from),
        _ => 0.0,
    }
}

/// The sample position of a pulse, whose number need not be whole.
fn at(pulses: &[f64], pulse: f64) -> f64 {
    let before = (pulse.max(0.0) as usize).min(pulses.len().saturating_sub(2));
    match pulses.get(before..before + 2) {
        Some([from, to]) => from + (to - from) * (pulse - before as f64),
        _ => f64::NAN,
    }
}

/// Marks in the samples of the sensors, and within how many samples they lie.
fn crossings(place: &Place, signals: &Signals, mark: &MarkConfig) -> Result<(Vec<f64>, f64)> {
    let signal = place.signal(&mark.channel)?;
    let instants = Instants::between(place.clock_beside(&signal, &signals.common)?, signals.common.clock);
    let instants = instants.map_err(|problem| signal.error(problem))?;
    let (low, high) = signal.range()?;
    let marker = Marker {
        channel: mark.channel.clone(),
        threshold: mark.threshold.unwrap_or(low + 0.5 * (high - low)),
        hysteresis: mark.hysteresis.unwrap_or(0.25 * (high - low)),
        edge: mark.edge,
    };
    let mut scan = MarkerScan::new(&marker);
    let mut sample = 0_u64;
    signal.each(|value| {
        scan.push(value).map_err(|problem| signal.error(format!("sample {sample}: {problem}")))?;
        sample += 1;
        Ok(())
    })?;
    let found = scan.marks().map_err(|problem| signal.error(problem).help(LEVELS))?;
    Ok((found.at.into_iter().map(|mark| instants.of(mark)).collect(), found.within_samples * instants.ratio))
}

/// Marks among the samples.
fn kept(mut marks: Vec<f64>, signals: &Signals, name: &str) -> Result<Vec<f64>> {
    let range = -1.0..=signals.common.clock.samples as f64;
    marks.retain(|mark| range.contains(mark));
    if marks.len() < 2 {
        let problem = format!(
            "expected a mark each turn during its {} samples, found {}",
            signals.common.clock.samples,
            marks.len()
        );
        return Err(Error::new("read", name, problem));
    }
    Ok(marks)
}
