//! The first pass over a file: how many samples, where turns begin, and how fast they were taken; and the samples themselves
//! where they are not too many.

use std::num::NonZeroUsize;

use runout_core::{
    Error, ErrorKind, Result,
    encoder::EncoderScan,
    marker::{Marker, MarkerScan},
    measurement::Block,
};

use crate::{
    header::{Header, Phase},
    rows::Rows,
};

const TIME_HELP: &str = "samples have to be taken at equal times: where some are missing, record anew; where the time has too few digits, write it with \
    more, or leave it out and state `sample_rate_hz` in [load]";

/// What the first pass finds.
pub(crate) struct Scan {
    pub(crate) samples: u64,
    pub(crate) marks: Vec<f64>,
    pub(crate) encoder: Option<EncoderScan>,
    /// From the column `time_s`.
    pub(crate) sample_rate_hz: Option<f64>,
    /// All samples, of a file that is not too large; the encoder's angles are in degrees.
    pub(crate) kept: Option<Vec<Block>>,
}

impl Scan {
    /// By so many threads; keeps up to so many readings.
    pub(crate) fn of(rows: Rows, marker: Option<&Marker>, threads: NonZeroUsize, most_kept: usize) -> Result<Self> {
        let Header { phase, time: time_column, ref shown, .. } = rows.format.header;
        let (shown, channels) = (shown.clone(), rows.format.header.sensors.len());
        let mut turns = Turns::new(phase, marker);
        let mut time = TimeScan::default();
        let mut samples: u64 = 0;
        let mut kept = Some(Vec::new());
        let wanted = |lines: u64| lines.saturating_mul(channels as u64) <= most_kept as u64;
        rows.each(threads, wanted, |header, piece| {
            for (row, instant) in piece.instants.iter().enumerate() {
                let taken = turns.push(instant.phase);
                let error = |column, problem| header.error(piece.line(row), column, problem);
                taken.map_err(|(problem, help)| error(phase.column(), problem).help(help.unwrap_or(phase.help())))?;
                if let Some(column) = time_column {
                    time.push(instant.time_s).map_err(|problem| error(column, problem).help(TIME_HELP))?;
                }
            }
            match (&mut kept, piece.samples.take()) {
                (Some(blocks), Some(readings)) => blocks.push(Block {
                    start: samples,
                    samples: readings,
                    angle_rev: if turns.is_encoder() { piece.phases().collect() } else { Vec::new() },
                    defects: Vec::new(),
                }),
                _ => kept = None,
            }
            samples += piece.instants.len() as u64;
            Ok(())
        })?;
        if samples == 0 {
            return Err(Error::new("read", shown, "expected samples below the header, found none")
                .of(ErrorKind::InsufficientData));
        }
        let (marks, encoder) = turns.marks().map_err(|problem| {
            Error::new("read", &shown, problem)
                .help("set `threshold` and `hysteresis` of `marker` in [load] between its levels")
        })?;
        let kept = kept.map(|blocks| blocks.into_iter().filter(|block| !block.samples.is_empty()).collect());
        let sample_rate_hz = time.rate_hz().map_err(|problem| Error::new("read", &shown, problem).help(TIME_HELP))?;
        Ok(Self { samples, marks, encoder, sample_rate_hz, kept })
    }
}

/// Finds where turns begin.
enum Turns {
    Index(IndexScan),
    Encoder(EncoderScan),
    Trace(MarkerScan),
}

impl Turns {
    fn new(phase: Phase, marker: Option<&Marker>) -> Self {
        match (phase, marker) {
            (Phase::Trace(_), Some(marker)) => Self::Trace(MarkerScan::new(marker)),
            (Phase::Angle(_), _) => Self::Encoder(EncoderScan::default()),
            _ => Self::Index(IndexScan::default()),
        }
    }

    fn is_encoder(&self) -> bool {
        matches!(self, Self::Encoder(_))
    }

    /// A fault says what is wrong and, where it is not what the column is, what to do.
    fn push(&mut self, value: f64) -> std::result::Result<(), (String, Option<&'static str>)> {
        match self {
            Self::Index(index) => index.push(value).map_err(|problem| (problem, None)),
            Self::Encoder(encoder) => encoder.push(value).map_err(|fault| (fault.problem, fault.help)),
            Self::Trace(trace) => trace.push(value).map_err(|problem| (problem, None)),
        }
    }

    fn marks(self) -> std::result::Result<(Vec<f64>, Option<EncoderScan>), String> {
        Ok(match self {
            Self::Index(index) => (index.marks, None),
            Self::Encoder(encoder) => (encoder.marks().to_vec(), Some(encoder)),
            Self::Trace(trace) => (trace.marks()?, None),
        })
    }
}

/// Finds the rising edges of the mark.
#[derive(Debug, Default)]
struct IndexScan {
    samples: u64,
    high: bool,
    marks: Vec<f64>,
}

impl IndexScan {
    fn push(&mut self, value: f64) -> std::result::Result<(), String> {
        let high = match value {
            0.0 => false,
            1.0 => true,
            other => return Err(format!("expected 0 or 1, found {other}")),
        };
        // A mark that is up from the start began nobody knows when.
        if high && !self.high && self.samples > 0 {
            self.marks.push(self.samples as f64 - 0.5);
        }
        self.high = high;
        self.samples += 1;
        Ok(())
    }
}

/// Times that are kept, to see at the end whether the rate held: at least half as many.
const MOST_PLACES: usize = 256;

/// Share of the duration by which a time may be off the line from the first to the last: clocks are better by far.
const LARGEST_DRIFT: f64 = 1e-3;

/// Finds the sampling rate and whether it holds.
#[derive(Debug)]
struct TimeScan {
    samples: u64,
    first_s: f64,
    last_s: f64,
    /// Of each so many samples one time is kept.
    stride: u64,
    /// Samples and their times.
    places: Vec<(u64, f64)>,
}

impl Default for TimeScan {
    fn default() -> Self {
        Self { samples: 0, first_s: 0.0, last_s: 0.0, stride: 1, places: Vec::with_capacity(MOST_PLACES) }
    }
}

impl TimeScan {
    /// Each time has to be where those before it lead, to half a step: rounding stays below, a lost sample does not.
    fn push(&mut self, time_s: f64) -> std::result::Result<(), String> {
        if self.samples == 0 {
            self.first_s = time_s;
        } else {
            if time_s <= self.last_s {
                return Err(format!("expected a time above {} s, found {time_s} s", self.last_s));
            }
            if self.samples > 1 {
                let step_s = (self.last_s - self.first_s) / (self.samples - 1) as f64;
                let expected_s = self.first_s + step_s * self.samples as f64;
                if (time_s - expected_s).abs() > 0.5 * step_s {
                    return Err(format!("expected even steps, the next at {expected_s} s, found {time_s} s"));
                }
            }
        }
        if self.samples.is_multiple_of(self.stride) {
            if self.places.len() == MOST_PLACES {
                self.stride *= 2;
                self.places.retain(|(sample, _)| sample.is_multiple_of(self.stride));
            }
            if self.samples.is_multiple_of(self.stride) {
                self.places.push((self.samples, time_s));
            }
        }
        self.last_s = time_s;
        self.samples += 1;
        Ok(())
    }

    /// The mean rate, where all times are where it leads: a rate that changes slowly has each time where those before it lead.
    fn rate_hz(&self) -> std::result::Result<Option<f64>, String> {
        if self.samples < 2 {
            return Ok(None);
        }
        let duration_s = self.last_s - self.first_s;
        let step_s = duration_s / (self.samples - 1) as f64;
        let drift_s = |(sample, time_s): &(u64, f64)| time_s - self.first_s - step_s * *sample as f64;
        let largest = self.places.iter().max_by(|one, other| drift_s(one).abs().total_cmp(&drift_s(other).abs()));
        match largest.map(|place| (place.0, drift_s(place))) {
            Some((sample, drift_s)) if drift_s.abs() > step_s.max(LARGEST_DRIFT * duration_s) => Err(format!(
                "expected even steps, found sample {sample} {} s {} where steps of {step_s:.6e} s lead: the sampling rate changes",
                (drift_s.abs() * 1e6).round() / 1e6,
                if drift_s > 0.0 { "after" } else { "before" },
            )),
            _ => Ok(Some(1.0 / step_s)),
        }
    }
}
