//! The recording that the channels make: stations, setups, and their samples block after block.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use runout_core::{
    Error, ErrorKind, Result,
    input_file::InputFile,
    measurement::{Block, Capture, Recording, SampleStream, StationKey},
    rig::Rig,
};

use crate::{
    capture::{Conversion, Place, Signal, Signals},
    channel::Samples,
    config::ChannelsConfig,
    files::Files,
    turns::{AngleReader, Angles, Pulses, Turns},
};

/// What marks of two values leave open between setups.
const MARKS_AT_WHOLE_SAMPLES: &str = "marks of a channel of two values are at whole samples: half a sample is not known of the angle between \
    two setups. The stated uncertainties include it; an encoder's angle or a trace of the mark make them smaller";

/// The captures of a measurement.
pub(crate) struct ChannelRecording {
    rig: Rig,
    config: ChannelsConfig,
    stations: Vec<StationKey>,
    files: Files,
    remarks: Vec<String>,
}

impl ChannelRecording {
    /// Looks for the channels of every station and setup.
    pub(crate) fn open(rig: &Rig, config: ChannelsConfig, folder: &Path, stations: Vec<StationKey>) -> Result<Self> {
        let mut recording = Self { rig: rig.clone(), config, stations, files: Files::new(folder), remarks: Vec::new() };
        let mut remarks: Vec<String> = Vec::new();
        for station in 0..recording.stations.len() {
            for setup in 0..rig.setups.len() {
                let place = recording.place(station, setup)?;
                for remark in place.signals()?.remarks {
                    if !remarks.contains(&remark) {
                        remarks.push(remark);
                    }
                }
            }
        }
        let place = recording.place(0, 0)?;
        let is_digital = |place: &Place| Ok::<bool, Error>(Turns::of(place, &place.signals()?)?.within_samples > 0.0);
        if rig.setups.len() > 1 && is_digital(&place)? {
            remarks.push(MARKS_AT_WHOLE_SAMPLES.into());
        }
        recording.remarks = remarks;
        Ok(recording)
    }

    fn place(&self, station: usize, setup: usize) -> Result<Place<'_>> {
        match (self.stations.get(station), self.rig.setups.get(setup)) {
            (Some(key), Some(_)) => {
                Ok(Place { config: &self.config, files: &self.files, rig: &self.rig, setup, station: key })
            }
            _ => Err(Error::new("open", format!("station {station} in setup {setup}"), "there is no such capture")
                .of(ErrorKind::MissingFile)),
        }
    }
}

impl Recording for ChannelRecording {
    fn stations(&self) -> &[StationKey] {
        &self.stations
    }

    fn open(&self, station: usize, setup: usize) -> Result<Box<dyn SampleStream + '_>> {
        let place = self.place(station, setup)?;
        let signals = place.signals()?;
        let turns = Turns::of(&place, &signals)?;
        let signs: Vec<f64> = self.rig.sensors.iter().map(|sensor| sensor.sign).collect();
        let Signals { sensors, samples, rate_hz, .. } = signals;
        // Both factors take the sign, so that turning a sensor round changes no rounding.
        let sensors: Vec<(Signal, Conversion)> = sensors
            .into_iter()
            .zip(&signs)
            .map(|((signal, Conversion { gain, offset }), sign)| {
                (signal, Conversion { gain: gain * sign, offset: offset * sign })
            })
            .collect();
        let capture = Capture {
            object: sensors.first().map_or_else(String::new, |(signal, _)| signal.shown.clone()),
            setup,
            station: place.station.name.clone(),
            z_mm: place.station.z_mm,
            stated_speed_rpm: self.config.speed_rpm,
            sample_rate_hz: rate_hz,
            samples,
            sensors: (0..self.rig.sensors.len()).collect(),
            sensor_ids: self.rig.sensors.iter().map(|sensor| sensor.id.clone()).collect(),
            converter_limits_um: limits(&sensors),
            marks: turns.marks,
            marks_within_samples: turns.within_samples,
            encoder: turns.angles.is_some(),
            trimmed: Vec::new(),
            responses: Vec::new(),
        };
        Ok(Box::new(ChannelStream::open(capture, sensors, turns.angles)?))
    }

    fn inputs(&self) -> Vec<PathBuf> {
        self.files.inputs().iter().map(|input| input.path().to_owned()).collect()
    }

    fn opened(&self) -> Result<Vec<InputFile>> {
        Ok(self.files.inputs())
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }
}

/// Lowest and highest reading of each sensor, where they are known of all.
fn limits(sensors: &[(Signal, Conversion)]) -> Option<Vec<[f64; 2]>> {
    let of = |(signal, Conversion { gain, offset }): &(Signal, Conversion)| {
        let [one, other] = signal.channel().limits?.map(|limit| limit * gain + offset);
        Some([one.min(other), one.max(other)])
    };
    sensors.iter().map(of).collect()
}

/// Elements in a block, about: 256 KiB of f64, which stay in a core's own cache from the file to the average.
const BLOCK_ELEMENTS: usize = 1 << 15;

/// The samples of a capture.
struct ChannelStream {
    capture: Capture,
    readers: Readers,
    conversions: Vec<Conversion>,
    angles: Option<AngleSource>,
    next: u64,
}

enum AngleSource {
    Channel(Box<AngleReader>),
    Pulses(Pulses),
}

impl ChannelStream {
    fn open(capture: Capture, sensors: Vec<(Signal, Conversion)>, angles: Option<Angles>) -> Result<Self> {
        let angles = match angles {
            None => None,
            Some(Angles::Channel(signal)) => Some(AngleSource::Channel(Box::new(signal.reader()?))),
            Some(Angles::Pulses(pulses)) => Some(AngleSource::Pulses(pulses)),
        };
        let readers = Readers::open(&sensors)?;
        let conversions = sensors.into_iter().map(|(_, conversion)| conversion).collect();
        Ok(Self { capture, readers, conversions, angles, next: 0 })
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
        for sample in self.next..self.next + count as u64 {
            match &mut self.angles {
                None => break,
                Some(AngleSource::Channel(reader)) => block.angle_rev.push(reader.turns_at(sample)?),
                Some(AngleSource::Pulses(pulses)) => block.angle_rev.push(pulses.turns_at(sample)),
            }
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
