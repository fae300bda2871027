//! The first pass over a file: how many samples, where turns begin, and how fast they were taken; and the samples themselves
//! where they are not too many.

use runout_core::{Result, encoder::EncoderScan};

use crate::{
    header::{Header, Phase},
    lines::{Line, Lines},
    row::{Role, Row},
};

/// What the first pass finds.
#[derive(Debug)]
pub(crate) struct Scan {
    pub(crate) samples: u64,
    pub(crate) marks: Vec<f64>,
    pub(crate) encoder: Option<EncoderScan>,
    /// From the column `time_s`.
    pub(crate) sample_rate_hz: Option<f64>,
    /// `.` or `,`.
    pub(crate) decimal: u8,
    /// All readings, of a file that is not too large.
    pub(crate) kept: Option<Kept>,
}

/// Readings in memory.
#[derive(Debug, Default)]
pub(crate) struct Kept {
    /// `[sample][channel]`.
    pub(crate) samples: Vec<f64>,
    /// The encoder's angle at each sample; empty without one.
    pub(crate) angle_deg: Vec<f64>,
}

impl Scan {
    /// Keeps up to so many readings.
    pub(crate) fn of(header: &Header, roles: &[Role], lines: &mut Lines, most_kept: usize) -> Result<Self> {
        let channels = header.sensors.len();
        // Where the comma delimits, it cannot be in a number.
        let mut decimal = (header.delimiter == b',').then_some(b'.');
        let mut index = IndexScan::default();
        let mut encoder = matches!(header.phase, Phase::Angle(_)).then(EncoderScan::default);
        let mut time = TimeScan::default();
        let mut samples = 0;
        let mut rows = Rows::default();
        let mut kept = Some(Kept::default());
        while let Some(line) = lines.next()? {
            if rows.ends_at(&line, header)? {
                continue;
            }
            if decimal.is_none() {
                decimal = memchr::memchr2(b',', b'.', line.bytes).map(|place| line.bytes[place]);
            }
            let row = Row { header, roles, decimal: decimal.unwrap_or(b'.') };
            kept = kept.filter(|kept| kept.samples.len() + channels <= most_kept);
            let instant = match &mut kept {
                Some(kept) => {
                    let begin = kept.samples.len();
                    kept.samples.resize(begin + channels, f64::NAN);
                    let instant = row.read(line, &mut kept.samples[begin..])?;
                    if encoder.is_some() {
                        kept.angle_deg.push(instant.phase);
                    }
                    instant
                }
                None => row.instant(line)?,
            };
            let taken = match &mut encoder {
                Some(encoder) => encoder.push(instant.phase).map_err(|fault| fault.problem),
                None => index.push(instant.phase),
            };
            taken.map_err(|problem| header.error(line.number, header.phase.column(), problem))?;
            if let Some(column) = header.time {
                time.push(instant.time_s).map_err(|problem| header.error(line.number, column, problem))?;
            }
            samples += 1;
        }
        if samples == 0 {
            return Err(runout_core::Error::new(
                "read",
                &header.shown,
                "expected samples below the header, found none",
            ));
        }
        let marks = encoder.as_ref().map_or(index.marks, |encoder| encoder.marks().to_vec());
        let decimal = decimal.unwrap_or(b'.');
        Ok(Self { samples, marks, encoder, sample_rate_hz: time.rate_hz(), decimal, kept })
    }
}

/// Tells blank lines at the end from gaps.
#[derive(Debug, Default)]
pub(crate) struct Rows {
    blank: Option<u64>,
}

impl Rows {
    /// Whether a line is blank; only blank lines may follow it.
    pub(crate) fn ends_at(&mut self, line: &Line, header: &Header) -> Result<bool> {
        // A row begins with a digit, a sign or a quote as a rule: a look at the first byte spares the whole line.
        let blank = line.bytes.first().is_none_or(u8::is_ascii_whitespace) && line.is_blank();
        match self.blank {
            _ if blank => {
                self.blank.get_or_insert(line.number);
                Ok(true)
            }
            Some(number) => Err(header.line_error(number, "expected a row, found a blank line between rows")),
            None => Ok(false),
        }
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

/// Finds the sampling rate and whether it holds.
#[derive(Debug, Default)]
struct TimeScan {
    samples: u64,
    first_s: f64,
    last_s: f64,
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
        self.last_s = time_s;
        self.samples += 1;
        Ok(())
    }

    fn rate_hz(&self) -> Option<f64> {
        (self.samples > 1).then(|| (self.samples - 1) as f64 / (self.last_s - self.first_s))
    }
}
