//! Recordings from NumPy arrays, read block by block where they lie.
//!
//! Each block is read with the interpreter's lock held: nothing can free or resize an array meanwhile, and an array that was
//! resized since is refused. Between blocks the lock is free.

use std::{collections::HashMap, path::PathBuf};

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyUntypedArrayMethods};
use pyo3::{exceptions::PyValueError, prelude::*};
use runout_core::{
    Error, ErrorKind, Result,
    encoder::EncoderScan,
    fault::Fault,
    measurement::{self, Block, Recording, SampleStream, StationKey},
    pipeline::{Context, StageConfig},
    rig::Rig,
    stage::{Loader, Request, Source, SourceKind},
};
use schemars::JsonSchema;
use serde::Deserialize;

/// Samples of all channels that are read at a time: as many as in a block of a file with 16-bit samples. Rounding depends on it.
const BLOCK_ELEMENTS: usize = 1 << 17;

/// `plugin = "arrays"`: stands for a recording that is handed over with the pipeline.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Arrays {}

impl StageConfig for Arrays {
    type Stage = Box<dyn Loader>;
    const NAME: &'static str = "arrays";
    const ABOUT: &'static str = "a recording in memory: runout.Recording.from_arrays";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        Ok(Box::new(ArrayLoader { stations: Vec::new() }))
    }
}

/// One capture: samples in µm, `[sample, channel]`, and how turns are known.
#[pyclass(frozen, module = "runout._native")]
pub struct Capture {
    samples: Py<PyArray2<f64>>,
    shape: [usize; 2],
    marks: Vec<f64>,
    encoder: Option<(Py<PyArray1<f64>>, EncoderScan)>,
    sensors: Option<Vec<String>>,
    sample_rate_hz: Option<f64>,
    speed_rpm: Option<f64>,
}

#[pymethods]
impl Capture {
    #[new]
    #[pyo3(signature = (samples, marks = None, angle_deg = None, sensors = None, sample_rate_hz = None, speed_rpm = None))]
    fn new(
        samples: &Bound<'_, PyArray2<f64>>,
        marks: Option<PyReadonlyArray1<'_, f64>>,
        angle_deg: Option<&Bound<'_, PyArray1<f64>>>,
        sensors: Option<Vec<String>>,
        sample_rate_hz: Option<f64>,
        speed_rpm: Option<f64>,
    ) -> PyResult<Self> {
        let refuse = |problem: String| Err(PyValueError::new_err(problem));
        let [length, channels] = [samples.shape()[0], samples.shape()[1]];
        if !samples.is_c_contiguous() {
            return refuse("expected samples that are contiguous: numpy.ascontiguousarray makes them so".into());
        }
        if length == 0 || channels == 0 {
            return refuse(format!("expected samples, found an array of shape ({length}, {channels})"));
        }
        if let Some(sensors) = sensors.as_ref().filter(|sensors| sensors.len() != channels) {
            return refuse(format!("expected {} channels, one a sensor, found {channels}", sensors.len()));
        }
        for (name, value) in [("sample_rate_hz", sample_rate_hz), ("speed_rpm", speed_rpm)] {
            if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
                return refuse(format!("expected {name} above 0, found {value}"));
            }
        }
        let (marks, encoder) = match (marks, angle_deg) {
            (Some(marks), None) => (positions(marks.as_array().iter().copied(), length)?, None),
            (None, Some(angle)) => {
                let scan = scan(&angle.try_readonly()?, length)?;
                (scan.marks().to_vec(), Some((angle.clone().unbind(), scan)))
            }
            _ => {
                return refuse(
                    "expected either marks (sample positions) or angle_deg (an angle of each sample)".into(),
                );
            }
        };
        let (samples, shape) = (samples.clone().unbind(), [length, channels]);
        Ok(Self { samples, shape, marks, encoder, sensors, sample_rate_hz, speed_rpm })
    }

    /// Number of samples and of channels.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        (self.shape[0], self.shape[1])
    }

    /// The array that is read.
    #[getter]
    fn samples(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
        self.samples.clone_ref(py)
    }
}

/// Sample positions of marks, ascending.
fn positions(values: impl Iterator<Item = f64>, samples: usize) -> PyResult<Vec<f64>> {
    let mut marks: Vec<f64> = Vec::new();
    for value in values {
        let expected = match marks.last() {
            Some(last) if value <= *last => format!("a position above {last}"),
            _ if (-1.0..=samples as f64).contains(&value) => {
                marks.push(value);
                continue;
            }
            _ => format!("a sample position from 0 to {samples}"),
        };
        return Err(PyValueError::new_err(format!("mark {}: expected {expected}, found {value}", marks.len())));
    }
    Ok(marks)
}

/// Follows an encoder's angle.
fn scan(angle_deg: &PyReadonlyArray1<'_, f64>, samples: usize) -> PyResult<EncoderScan> {
    let found = angle_deg.as_array();
    if found.len() != samples {
        let problem = format!("expected an angle for each of {samples} samples, found {}", found.len());
        return Err(PyValueError::new_err(problem));
    }
    let mut scan = EncoderScan::default();
    for angle_deg in found {
        let pushed = scan.push(*angle_deg);
        pushed.map_err(|fault| PyValueError::new_err(format!("sample {}: {fault}", fault.sample)))?;
    }
    Ok(scan)
}

/// A station with its captures by the id of the setup.
#[derive(FromPyObject)]
pub(crate) struct Station {
    name: String,
    z_mm: f64,
    captures: HashMap<String, Py<Capture>>,
}

/// Opens arrays.
pub(crate) struct ArrayLoader {
    /// In the order in which they are to be worked on.
    pub stations: Vec<Station>,
}

impl Loader for ArrayLoader {
    fn kind(&self) -> SourceKind {
        SourceKind::Turns
    }

    fn open(&self, wanted: &Request) -> Result<Source> {
        let rig = wanted.rig.ok_or_else(|| failure("the recording", "the pipeline has no [rig]"))?;
        if self.stations.is_empty() {
            let problem = "the pipeline takes a recording in memory, and there is none";
            return Err(failure("the recording", problem).help("pass `recording=runout.Recording.from_arrays(…)`"));
        }
        let mut captures = Vec::new();
        for station in &self.stations {
            for (index, setup) in rig.setups.iter().enumerate() {
                captures.push(Opened::new(station, &setup.id, index, rig)?);
            }
        }
        let known = |id: &String| rig.setups.iter().any(|setup| setup.id == *id);
        let mut unused: Vec<&String> =
            self.stations.iter().flat_map(|station| station.captures.keys()).filter(|id| !known(id)).collect();
        unused.sort_unstable();
        unused.dedup();
        let remarks = unused.iter().map(|id| format!("the setup `{id}` of the recording is not in the rig: not used"));
        Ok(Source::Turns(Box::new(ArrayRecording {
            stations: self.stations.iter().map(|at| StationKey { name: at.name.clone(), z_mm: at.z_mm }).collect(),
            setups: rig.setups.len(),
            captures,
            remarks: remarks.collect(),
        })))
    }
}

fn failure(object: &str, problem: impl ToString) -> Error {
    Error::new("read", object, problem).of(ErrorKind::UnsuitableData)
}

struct ArrayRecording {
    stations: Vec<StationKey>,
    setups: usize,
    /// `[station][setup]`.
    captures: Vec<Opened>,
    remarks: Vec<String>,
}

impl Recording for ArrayRecording {
    fn stations(&self) -> &[StationKey] {
        &self.stations
    }

    fn open(&self, station: usize, setup: usize) -> Result<Box<dyn SampleStream + '_>> {
        let opened = self.captures.get(station * self.setups + setup);
        let opened = opened.ok_or_else(|| failure("the recording", "there is no such capture"))?;
        Ok(Box::new(ArrayStream { opened, next: 0 }))
    }

    fn inputs(&self) -> Vec<PathBuf> {
        Vec::new()
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }
}

/// A capture that fits the rig.
struct Opened {
    arrays: Py<Capture>,
    /// What is known of it.
    capture: measurement::Capture,
    /// Channel and sign of each of the rig's sensors.
    columns: Vec<(usize, f64)>,
}

impl Opened {
    fn new(station: &Station, setup: &str, index: usize, rig: &Rig) -> Result<Self> {
        let object = format!("arrays:/{setup}/{}", station.name);
        let arrays = station.captures.get(setup).ok_or_else(|| {
            let mut there: Vec<&str> = station.captures.keys().map(String::as_str).collect();
            there.sort_unstable();
            failure(&object, format!("there is no such capture; the station has {}", there.join(", ")))
        })?;
        // The one who reads shares the object: a reference needs the interpreter.
        let arrays = Python::try_attach(|py| arrays.clone_ref(py)).ok_or_else(|| ended(&object))?;
        let source = arrays.get();
        let columns: Result<Vec<(usize, f64)>> = match &source.sensors {
            None if source.shape[1] == rig.sensors.len() => {
                Ok(rig.sensors.iter().enumerate().map(|(channel, sensor)| (channel, sensor.sign)).collect())
            }
            None => {
                let problem =
                    format!("expected {} channels, one a sensor, found {}", rig.sensors.len(), source.shape[1]);
                Err(failure(&object, problem).help("name the channels: sensors=[…]"))
            }
            Some(names) => rig
                .sensors
                .iter()
                .map(|sensor| {
                    let mut found = names.iter().enumerate().filter(|(_, name)| **name == sensor.id);
                    match (found.next(), found.next()) {
                        (Some((channel, _)), None) => Ok((channel, sensor.sign)),
                        (Some(_), Some(_)) => {
                            Err(failure(&object, format!("the channel `{}` is there twice", sensor.id)))
                        }
                        (None, _) => {
                            let problem = format!(
                                "expected a channel for the sensor `{}`, found {}",
                                sensor.id,
                                names.join(", ")
                            );
                            Err(failure(&object, problem).help("`sensors` has to name the rig's sensor ids"))
                        }
                    }
                })
                .collect(),
        };
        let capture = measurement::Capture {
            object,
            setup: index,
            station: station.name.clone(),
            z_mm: station.z_mm,
            stated_speed_rpm: source.speed_rpm,
            sample_rate_hz: source.sample_rate_hz,
            samples: source.shape[0] as u64,
            sensors: (0..rig.sensors.len()).collect(),
            sensor_ids: rig.sensors.iter().map(|sensor| sensor.id.clone()).collect(),
            converter_limits_um: None,
            marks: source.marks.clone(),
            marks_within_samples: 0.0,
            encoder: source.encoder.is_some(),
            trimmed: Vec::new(),
            responses: Vec::new(),
        };
        Ok(Self { columns: columns?, arrays, capture })
    }

    /// Reads rows into a block; the interpreter's lock is held.
    fn read(&self, py: Python<'_>, rows: std::ops::Range<usize>, block: &mut Block) -> Result<()> {
        let source = self.arrays.get();
        let changed =
            || failure(&self.capture.object, "the array was resized, or is being written to, while it is read");
        let samples = source.samples.bind(py).try_readonly().map_err(|_| changed())?;
        let [length, channels] = source.shape;
        let values = samples.as_slice().map_err(|_| changed())?;
        if values.len() != length * channels {
            return Err(changed());
        }
        let values = &values[rows.start * channels..rows.end * channels];
        let plain = |(sensor, column): (usize, &(usize, f64))| *column == (sensor, 1.0);
        if self.columns.len() == channels && self.columns.iter().enumerate().all(plain) {
            block.samples.extend_from_slice(values);
        } else {
            for row in values.chunks_exact(channels) {
                block.samples.extend(self.columns.iter().map(|(channel, sign)| row[*channel] * sign));
            }
        }
        if let Some((angle, scan)) = &source.encoder {
            let angle = angle.bind(py).try_readonly().map_err(|_| changed())?;
            let angle = angle.as_array();
            if angle.len() != length {
                return Err(changed());
            }
            block.angle_rev.extend(rows.map(|row| scan.turns(angle[row])));
        }
        Ok(())
    }
}

fn ended(object: &str) -> Error {
    Error::new("read", object, "Python ends").of(ErrorKind::Interrupted)
}

struct ArrayStream<'a> {
    opened: &'a Opened,
    next: usize,
}

impl SampleStream for ArrayStream<'_> {
    fn capture(&self) -> &measurement::Capture {
        &self.opened.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        block.clear();
        block.start = self.next as u64;
        let [length, channels] = self.opened.arrays.get().shape;
        let rows = self.next..length.min(self.next + (BLOCK_ELEMENTS / channels).max(1));
        if rows.is_empty() {
            return Ok(false);
        }
        self.next = rows.end;
        let read = Python::try_attach(|py| self.opened.read(py, rows, block));
        read.unwrap_or_else(|| Err(ended(&self.opened.capture.object)))?;
        Ok(true)
    }
}
