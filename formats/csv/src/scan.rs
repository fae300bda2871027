//! The first pass over a file: how many samples, where turns begin, and how fast they were taken; and the samples themselves
//! where they are not too many.

use std::num::NonZeroUsize;

use runout_core::{
    Error, ErrorKind, Result,
    clock::ClockScan,
    encoder::EncoderScan,
    marker::{Marker, MarkerScan, Marks},
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
    /// To how many samples each mark is known.
    pub(crate) within_samples: f64,
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
        let mut time = ClockScan::default();
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
        let (Marks { at: marks, within_samples }, encoder) = turns.marks().map_err(|problem| {
            Error::new("read", &shown, problem)
                .help("set `threshold` and `hysteresis` of `marker` in [load] between its levels")
        })?;
        let kept = kept.map(|blocks| blocks.into_iter().filter(|block| !block.samples.is_empty()).collect());
        let sample_rate_hz = time.rate_hz().map_err(|problem| Error::new("read", &shown, problem).help(TIME_HELP))?;
        Ok(Self { samples, marks, within_samples, encoder, sample_rate_hz, kept })
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

    fn marks(self) -> std::result::Result<(Marks, Option<EncoderScan>), String> {
        Ok(match self {
            // A mark of 0 and 1 is somewhere between a sample and the next.
            Self::Index(index) => (Marks { at: index.marks, within_samples: 0.5 }, None),
            Self::Encoder(encoder) => (Marks { at: encoder.marks().to_vec(), within_samples: 0.0 }, Some(encoder)),
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
