//! The samples of a capture whose channels are all of the same instants.

use std::{ops::Range, sync::Arc};

use runout_core::{
    Error, ErrorKind, Result,
    measurement::{Block, Capture, SampleStream},
};

use crate::{
    channel::Samples,
    signal::{Conversion, Signal},
    turns::{AngleReader, Angles, Pulses},
};

/// Lowest and highest reading of each sensor, where they are known of all.
pub(crate) fn limits(sensors: &[(Signal, Conversion)]) -> Option<Vec<[f64; 2]>> {
    let of = |(signal, Conversion { gain, offset }): &(Signal, Conversion)| {
        let [one, other] = signal.channel().limits?.map(|limit| limit * gain + offset);
        Some([one.min(other), one.max(other)])
    };
    sensors.iter().map(of).collect()
}

/// Elements in a block, about: 256 KiB of f64, which stay in a core's own cache from the file to the average.
pub(crate) const BLOCK_ELEMENTS: usize = 1 << 15;

/// The samples of a capture.
pub(crate) struct ChannelStream {
    capture: Capture,
    readers: Readers,
    conversions: Vec<Conversion>,
    angles: Option<AngleSource>,
    next: u64,
}

/// Gives the angles of samples that follow each other.
pub(crate) enum AngleSource {
    Channel(Box<AngleReader>),
    Pulses(Pulses),
}

impl AngleSource {
    pub(crate) fn open(angles: Angles) -> Result<Self> {
        Ok(match angles {
            Angles::Channel(signal) => Self::Channel(Box::new(signal.reader()?)),
            Angles::Pulses(pulses) => Self::Pulses(pulses),
        })
    }

    /// Appends the angles of these samples, in turns.
    pub(crate) fn append(&mut self, samples: Range<u64>, angle_rev: &mut Vec<f64>) -> Result<()> {
        for sample in samples {
            angle_rev.push(match self {
                Self::Channel(reader) => reader.turns_at(sample)?,
                Self::Pulses(pulses) => pulses.turns_at(sample),
            });
        }
        Ok(())
    }
}

impl ChannelStream {
    pub(crate) fn open(
        capture: Capture,
        sensors: &[(Signal, Conversion)],
        angles: Option<AngleSource>,
    ) -> Result<Self> {
        let conversions = sensors.iter().map(|(_, conversion)| *conversion).collect();
        Ok(Self { capture, readers: Readers::open(sensors)?, conversions, angles, next: 0 })
    }
}

impl SampleStream for ChannelStream {
    fn capture(&self) -> &Capture {
        &self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        block.clear();
        block.start = self.next;
        let channels = self.conversions.len().max(1);
        let left = self.capture.samples - self.next;
        let count = (BLOCK_ELEMENTS / channels).max(1).min(left as usize);
        if count == 0 {
            return Ok(false);
        }
        block.samples.resize(count * channels, 0.0);
        let (conversions, samples) = (&self.conversions, &mut block.samples);
        let mut is_complete = true;
        self.readers.next(count, |number, column| {
            is_complete &= column.len() == count;
            let Conversion { gain, offset } = conversions[number];
            let to = samples.iter_mut().skip(number).step_by(channels);
            if (gain, offset) == (1.0, 0.0) {
                to.zip(column).for_each(|(to, value)| *to = *value);
            } else {
                to.zip(column).for_each(|(to, value)| *to = value * gain + offset);
            }
        })?;
        if !is_complete {
            let problem = format!("expected {} samples, found fewer", self.capture.samples);
            return Err(Error::new("read", &self.capture.object, problem).of(ErrorKind::DamagedData));
        }
        if let Some(angles) = &mut self.angles {
            angles.append(self.next..self.next + count as u64, &mut block.angle_rev)?;
        }
        self.next += count as u64;
        Ok(true)
    }
}

/// Reads the signals of one capture side by side.
pub(crate) struct Readers {
    parts: Vec<Part>,
}

/// What is read of one file.
struct Part {
    samples: Box<dyn Samples>,
    /// Which of the signals.
    signals: Vec<usize>,
    columns: Vec<Vec<f64>>,
}

impl Readers {
    pub(crate) fn open(signals: &[(Signal, Conversion)]) -> Result<Self> {
        let mut parts: Vec<(&Signal, Vec<usize>)> = Vec::new();
        for (number, (signal, _)) in signals.iter().enumerate() {
            match parts.iter_mut().find(|(other, _)| Arc::ptr_eq(&other.file, &signal.file)) {
                Some((_, numbers)) => numbers.push(number),
                None => parts.push((signal, vec![number])),
            }
        }
        let open = |(signal, numbers): (&Signal, Vec<usize>)| {
            let channels: Vec<usize> = numbers.iter().map(|number| signals[*number].0.index).collect();
            let samples = signal.file.read(&channels)?;
            Ok(Part { samples, columns: vec![Vec::new(); numbers.len()], signals: numbers })
        };
        Ok(Self { parts: parts.into_iter().map(open).collect::<Result<_>>()? })
    }

    /// Hands on up to `most` samples of each signal: its number and they.
    pub(crate) fn next(&mut self, most: usize, mut take: impl FnMut(usize, &[f64])) -> Result<()> {
        for Part { samples, signals, columns } in &mut self.parts {
            columns.iter_mut().for_each(Vec::clear);
            // A reader may give fewer at a time.
            let mut left = most;
            while left > 0 {
                match samples.next(left, columns)? {
                    0 => break,
                    taken => left = left.saturating_sub(taken),
                }
            }
            for (signal, column) in signals.iter().zip(&*columns) {
                take(*signal, column);
            }
        }
        Ok(())
    }
}
