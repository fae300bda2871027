//! Writing measurement files.

use std::path::{Path, PathBuf};

use hdf5_metno::{Dataset, File, Group, H5Type};
use ndarray::{ArrayView1, ArrayView2, s};
use runout_core::{
    Error, ErrorKind, Result,
    atomic_file::PendingFile,
    measurement::{Block, Capture, Recording, SampleStream},
    provenance,
    rig::Rig,
};

use super::{
    ANGLE, INDEX, SAMPLES, TRUTH,
    coding::{Code, Coding},
    samples::{SampleFormat, SampleType},
    truth,
};
use crate::{MEASUREMENT_FORMAT, VERSION, node};

/// How a measurement file is to be written.
#[derive(Debug, Clone, Copy)]
pub struct WriteOptions<'a> {
    /// Type of the samples.
    pub samples: SampleFormat,
    /// Level of deflate from 0 to 9, after a shuffle of bytes; `None` writes contiguous samples.
    pub deflate: Option<u8>,
    /// For people.
    pub title: &'a str,
    /// The scenario of a simulation in full, kept with the truth.
    pub scenario: Option<&'a str>,
}

impl Default for WriteOptions<'_> {
    fn default() -> Self {
        Self { samples: SampleFormat::F64, deflate: Some(4), title: "", scenario: None }
    }
}

/// Elements of a chunk of samples, at most: 256 KiB of f64.
const CHUNK_ELEMENTS: usize = 32_768;
/// Angles or marks of a chunk.
const CHUNK_LINE: usize = 32_768;

/// Writes a recording to a measurement file of version 1, block after block, whole or not at all.
///
/// Readings get back the sign that their sensor has in the rig. `on_capture` hears `<setup>/<station>` of each capture
/// that is done.
///
/// # Errors
/// When the recording or the file system fails, or a reading has no code in an integer type.
pub fn write_measurement(
    recording: &dyn Recording,
    rig: &Rig,
    path: &Path,
    options: &WriteOptions,
    on_capture: &mut dyn FnMut(&str),
) -> Result<PathBuf> {
    if options.deflate.is_some_and(|level| level > 9) {
        return Err(Error::new("write", path.display().to_string(), "expected a deflate level from 0 to 9")
            .of(ErrorKind::Configuration));
    }
    let pending = PendingFile::new(path)?;
    pending.room_for(largest(recording, rig, options)?)?;
    {
        let failure = |error: hdf5_metno::Error| pending.caused(error);
        let file = node::create_file(pending.path()).map_err(failure)?;
        describe(&file, options).map_err(failure)?;
        for (index, station) in recording.stations().iter().enumerate() {
            if station.name.is_empty() || station.name.contains(['/', '\0']) || station.name.starts_with('.') {
                return Err(pending.failure(format!("`{}` cannot name a station in HDF5", station.name)));
            }
            for (setup, at) in rig.setups.iter().enumerate() {
                let mut stream = recording.open(index, setup)?;
                let name = format!("{}/{}", at.id, station.name);
                let group = node::create_group(&file, &name).map_err(failure)?;
                node::put(&group, "z_mm", &station.z_mm).map_err(failure)?;
                let writer = CaptureWriter { pending: &pending, group: &group, name: &name, rig, options };
                writer.write(&mut *stream)?;
                on_capture(&name);
            }
            if let Some(found) = recording.truth(index)? {
                truth::write(&file, rig, &station.name, &found).map_err(failure)?;
            }
        }
        if let Some(scenario) = options.scenario {
            let group = if file.link_exists(TRUTH) { file.group(TRUTH) } else { node::create_group(&file, TRUTH) };
            group.and_then(|group| node::put_text(&group, "scenario", scenario)).map_err(failure)?;
        }
        // What the disk refuses comes out here, and not when the file is closed.
        file.flush().map_err(failure)?;
    }
    pending.commit()
}

/// Bytes of a file besides samples, about.
const HEAD_BYTES: u64 = 1 << 20;

/// Bytes that the file may take, judged by its first capture.
fn largest(recording: &dyn Recording, rig: &Rig, options: &WriteOptions) -> Result<u64> {
    let captures = (recording.stations().len() * rig.setups.len()) as u64;
    if captures == 0 {
        return Ok(HEAD_BYTES);
    }
    let stream = recording.open(0, 0)?;
    let capture = stream.capture();
    let bytes = match options.samples {
        SampleFormat::F64 => 8,
        SampleFormat::F32 | SampleFormat::I32(_) => 4,
        SampleFormat::I16(_) => 2,
    };
    Ok(HEAD_BYTES + captures * capture.samples * (capture.channels() * bytes) as u64)
}

fn describe(file: &File, options: &WriteOptions) -> hdf5_metno::Result<()> {
    node::put_text(file, "format", MEASUREMENT_FORMAT)?;
    node::put(file, "version", &VERSION)?;
    node::put_text(file, "length_unit", "um")?;
    node::put_text(file, "program", &format!("runout {}", provenance::VERSION))?;
    node::put_text(file, "title", options.title)
}

struct CaptureWriter<'a> {
    pending: &'a PendingFile,
    group: &'a Group,
    name: &'a str,
    rig: &'a Rig,
    options: &'a WriteOptions<'a>,
}

impl CaptureWriter<'_> {
    fn failure(&self, problem: impl ToString) -> Error {
        let shown = format!("{}:/{}", self.pending.destination().display(), self.name);
        Error::new("write", shown, problem)
    }

    fn write(&self, stream: &mut dyn SampleStream) -> Result<()> {
        let capture = stream.capture().clone();
        let sensors: Option<Vec<_>> = capture.sensors.iter().map(|sensor| self.rig.sensors.get(*sensor)).collect();
        let sensors = sensors.ok_or_else(|| self.failure("a channel belongs to no sensor of the rig"))?;
        if sensors.is_empty() || capture.samples == 0 {
            return Err(self.failure("there are no samples"));
        }
        let signs: Vec<f64> = sensors.iter().map(|sensor| sensor.sign).collect();
        let coding = Coding::new(self.options.samples, &capture, &signs)?;
        let shape = (capture.samples as usize, sensors.len());
        let failure = |error: hdf5_metno::Error| self.failure(error);
        let dataset = match coding.kind {
            SampleType::F64 => self.dataset::<f64>(shape),
            SampleType::F32 => self.dataset::<f32>(shape),
            SampleType::I16 => self.dataset::<i16>(shape),
            SampleType::I32 => self.dataset::<i32>(shape),
        }
        .map_err(failure)?;
        let ids: Vec<&str> = sensors.iter().map(|sensor| sensor.id.as_str()).collect();
        self.describe(&dataset, &capture, &ids, &coding).map_err(failure)?;
        let angles = if capture.encoder {
            Some(self.line(ANGLE, shape.0).map_err(failure)?)
        } else {
            let index = self.line(INDEX, capture.marks.len()).map_err(failure)?;
            index.write(capture.marks.as_slice()).map_err(failure)?;
            None
        };
        let target = Target { dataset: &dataset, angles: angles.as_ref(), ids: &ids, signs: &signs, coding: &coding };
        match coding.kind {
            SampleType::F64 => self.pour::<f64>(stream, &target),
            SampleType::F32 => self.pour::<f32>(stream, &target),
            SampleType::I16 => self.pour::<i16>(stream, &target),
            SampleType::I32 => self.pour::<i32>(stream, &target),
        }
    }

    fn dataset<T: H5Type>(&self, (samples, channels): (usize, usize)) -> hdf5_metno::Result<Dataset> {
        let builder = self.group.new_dataset_builder();
        let builder = match self.options.deflate {
            None => builder,
            Some(level) => {
                let bytes = std::mem::size_of::<T>();
                let rows = (CHUNK_ELEMENTS * 8 / bytes / channels).clamp(1, samples);
                builder.chunk((rows, channels)).shuffle().deflate(level)
            }
        };
        builder.empty::<T>().shape((samples, channels)).create(SAMPLES)
    }

    /// Numbers that nobody maps into memory: always in chunks with a checksum, where there are any.
    fn line(&self, name: &str, length: usize) -> hdf5_metno::Result<Dataset> {
        let builder = self.group.new_dataset_builder();
        let builder = match self.options.deflate {
            _ if length == 0 => builder,
            None => builder.chunk(CHUNK_LINE.min(length)).fletcher32(),
            Some(level) => builder.chunk(CHUNK_LINE.min(length)).shuffle().deflate(level),
        };
        builder.empty::<f64>().shape(length).create(name)
    }

    fn describe(&self, dataset: &Dataset, capture: &Capture, ids: &[&str], coding: &Coding) -> hdf5_metno::Result<()> {
        if let Some(speed_rpm) = capture.stated_speed_rpm {
            node::put(self.group, "speed_rpm", &speed_rpm)?;
        }
        let names: hdf5_metno::Result<Vec<_>> = ids.iter().map(|id| node::unicode(id)).collect();
        node::put_list(dataset, "sensors", &names?)?;
        if let Some(sample_rate_hz) = capture.sample_rate_hz {
            node::put(dataset, "sample_rate_hz", &sample_rate_hz)?;
        }
        if coding.kind.code_range().is_some() {
            for (name, values) in [("scale", &coding.scale), ("offset", &coding.offset)] {
                match values.as_slice() {
                    [first, rest @ ..] if rest.iter().all(|other| other.to_bits() == first.to_bits()) => {
                        node::put(dataset, name, first)?;
                    }
                    all => node::put_list(dataset, name, all)?,
                }
            }
        }
        if let Some(limits) = coding.limits {
            node::put_list(dataset, "converter_limits", &limits)?;
        }
        Ok(())
    }

    fn pour<T: Code>(&self, stream: &mut dyn SampleStream, to: &Target) -> Result<()> {
        let channels = to.ids.len();
        let total = to.dataset.shape().first().copied().unwrap_or(0);
        let (mut block, mut codes, mut angles_deg) = (Block::default(), Vec::<T>::new(), Vec::new());
        let mut written = 0;
        while stream.next_block(&mut block)? {
            let rows = block.samples.len() / channels;
            if block.start != written as u64 || block.samples.len() % channels != 0 || written + rows > total {
                return Err(self.failure(format!("the recording's blocks do not add up to {total} samples")));
            }
            codes.clear();
            for (row, samples) in block.samples.chunks_exact(channels).enumerate() {
                for (channel, value_um) in samples.iter().enumerate() {
                    codes.push(to.code(*value_um, channel).ok_or_else(|| {
                        self.failure(format!(
                            "sample {}, {}: {value_um} µm has no {} code",
                            written + row,
                            to.ids[channel],
                            to.coding.kind.name()
                        ))
                        .help("give a larger scale, or write f64")
                    })?);
                }
            }
            let view = ArrayView2::from_shape((rows, channels), &codes).map_err(|error| self.failure(error))?;
            to.dataset.write_slice(view, s![written..written + rows, ..]).map_err(|error| self.failure(error))?;
            if let Some(dataset) = to.angles {
                if block.angle_rev.len() != rows {
                    return Err(self.failure("a block lacks the encoder's angles"));
                }
                angles_deg.clear();
                angles_deg.extend(block.angle_rev.iter().map(|turns| turns * 360.0));
                let view = ArrayView1::from(&angles_deg);
                dataset.write_slice(view, s![written..written + rows]).map_err(|error| self.failure(error))?;
            }
            written += rows;
        }
        if written != total {
            return Err(self.failure(format!("the recording ended after {written} of {total} samples")));
        }
        Ok(())
    }
}

/// Where one capture's samples go.
struct Target<'a> {
    dataset: &'a Dataset,
    angles: Option<&'a Dataset>,
    ids: &'a [&'a str],
    signs: &'a [f64],
    coding: &'a Coding,
}

impl Target<'_> {
    fn code<T: Code>(&self, value_um: f64, channel: usize) -> Option<T> {
        T::of(self.coding.code(value_um * self.signs[channel], channel))
    }
}
