//! The first pass over a file: how many samples, where turns begin, and how fast they were taken; and the samples themselves
//! where they are not too many.

use runout_core::{Error, Result, encoder::EncoderScan, measurement::Block};

use crate::{header::Phase, rows::Rows};

/// Instants in a block: four channels of f64 then take 512 KiB, which a core's own cache holds.
pub(crate) const BLOCK_SAMPLES: usize = 16_384;

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
    /// Keeps up to so many readings.
    pub(crate) fn of(rows: &mut Rows, most_kept: usize) -> Result<Self> {
        let channels = rows.header.sensors.len();
        let phase = rows.header.phase;
        let mut index = IndexScan::default();
        let mut encoder = matches!(phase, Phase::Angle(_)).then(EncoderScan::default);
        let mut time = TimeScan::default();
        let mut samples: usize = 0;
        let mut kept = Keeping { channels, most: most_kept, blocks: Some(Vec::new()) };
        while let Some(instant) = match kept.next(samples) {
            Some(frame) => rows.next(frame)?,
            None => rows.next_instant()?,
        } {
            let taken = match &mut encoder {
                Some(encoder) => encoder.push(instant.phase).map_err(|fault| fault.problem),
                None => index.push(instant.phase),
            };
            taken.map_err(|problem| rows.error(phase.column(), problem).help(phase.help()))?;
            if let Some(column) = rows.header.time {
                time.push(instant.time_s).map_err(|problem| rows.error(column, problem).help(TIME_HELP))?;
            }
            if encoder.is_some() {
                kept.angle(instant.phase);
            }
            samples += 1;
        }
        if samples == 0 {
            let shown = &rows.header.shown;
            return Err(Error::new("read", shown, "expected samples below the header, found none"));
        }
        let marks = encoder.as_ref().map_or(index.marks, |encoder| encoder.marks().to_vec());
        let (sample_rate_hz, kept) = (time.rate_hz(), kept.blocks(samples));
        Ok(Self { samples: samples as u64, marks, encoder, sample_rate_hz, kept })
    }
}

/// Samples on their way into blocks.
struct Keeping {
    channels: usize,
    /// Readings that are kept, at most.
    most: usize,
    /// `None` where there are more.
    blocks: Option<Vec<Block>>,
}

impl Keeping {
    /// Where the next frame, of this number, is to be put.
    #[inline]
    fn next(&mut self, sample: usize) -> Option<&mut [f64]> {
        if (sample + 1) * self.channels > self.most {
            self.blocks = None;
        }
        let blocks = self.blocks.as_mut()?;
        let place = sample % BLOCK_SAMPLES;
        if place == 0 {
            let samples = vec![0.0; BLOCK_SAMPLES * self.channels];
            blocks.push(Block { start: sample as u64, samples, ..Block::default() });
        }
        blocks.last_mut()?.samples.get_mut(place * self.channels..(place + 1) * self.channels)
    }

    fn angle(&mut self, angle_deg: f64) {
        if let Some(block) = self.blocks.as_mut().and_then(|blocks| blocks.last_mut()) {
            block.angle_rev.push(angle_deg);
        }
    }

    /// All blocks, with the last one's room taken back.
    fn blocks(self, samples: usize) -> Option<Vec<Block>> {
        let mut blocks = self.blocks?;
        for block in &mut blocks {
            let frames = (samples - block.start as usize).min(BLOCK_SAMPLES);
            block.samples.truncate(frames * self.channels);
        }
        blocks.retain(|block| !block.samples.is_empty());
        Some(blocks)
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
