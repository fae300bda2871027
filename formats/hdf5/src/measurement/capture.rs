//! One capture in a file: everything but its samples, read and checked.

use hdf5_metno::{Dataset, Group};
use runout_core::{
    Result,
    encoder::EncoderScan,
    marker::{Marker, MarkerScan, Marks},
};

use super::{
    ANGLE, INDEX, SAMPLES,
    extent::Extent,
    samples::StoredSamples,
    vector::{Vector, each},
};
use crate::node::{self, Place};

/// One capture, opened.
#[derive(Debug)]
pub(crate) struct CaptureSource {
    pub(crate) place: Place,
    pub(crate) z_mm: f64,
    pub(crate) speed_rpm: Option<f64>,
    pub(crate) dataset: Dataset,
    pub(crate) samples_place: Place,
    pub(crate) stored: StoredSamples,
    pub(crate) phase: Phase,
}

/// How turns are known.
#[derive(Debug)]
pub(crate) enum Phase {
    /// Sample positions of the once-per-turn mark.
    Index(Vector),
    /// Angle of each sample.
    Angle(Vector),
    /// The mark as an analogue trace.
    Trace(Trace, Marker),
    /// Nothing that was asked for.
    Unknown(Place),
}

/// Where the trace of the mark is.
#[derive(Debug)]
pub(crate) enum Trace {
    /// A channel of the samples.
    Channel(usize),
    /// A dataset of its own.
    Vector(Vector),
}

impl CaptureSource {
    /// Reads the attributes and shapes of `/<setup>/<station>`; turns are known by the trace of a marker where one is named.
    pub(crate) fn open(setup: &Group, setup_place: &Place, station: &str, marker: Option<&Marker>) -> Result<Self> {
        let (group, place) = node::group(setup, setup_place, station)?;
        let z_mm = node::needed(node::number(&group, &place, "z_mm")?, &place, "z_mm")?;
        let speed_rpm = node::positive(&group, &place, "speed_rpm")?;
        let (dataset, samples_place) = node::dataset(&group, &place, SAMPLES)?;
        let stored = StoredSamples::read(&group, &dataset, &samples_place)?;
        let phase = match marker {
            Some(marker) => Phase::Trace(Trace::open(&group, &place, &stored, marker)?, marker.clone()),
            None => Phase::open(&group, &place, stored.samples)?,
        };
        Ok(Self { place, z_mm, speed_rpm, dataset, samples_place, stored, phase })
    }

    /// The bytes of the file that its numbers take, those in chunks `with_chunks` only.
    pub(super) fn extents(&self, with_chunks: bool) -> impl Iterator<Item = Extent> {
        let vector = match &self.phase {
            Phase::Index(vector) | Phase::Angle(vector) | Phase::Trace(Trace::Vector(vector), _) => {
                vector.extents(with_chunks)
            }
            Phase::Trace(Trace::Channel(_), _) | Phase::Unknown(_) => Vec::new(),
        };
        Extent::of(&self.dataset, &self.samples_place, with_chunks).into_iter().chain(vector)
    }

    /// Sample positions at which turns begin, and the scan that says how to read the encoder.
    pub(crate) fn marks(&self) -> Result<(Marks, Option<EncoderScan>)> {
        let timed = |at: Vec<f64>| Marks { at, within_samples: 0.0 };
        match &self.phase {
            Phase::Index(vector) => Ok((timed(positions(vector, self.stored.samples)?), None)),
            Phase::Angle(vector) => {
                let mut scan = EncoderScan::default();
                vector.each(|angle_deg| {
                    scan.push(angle_deg).map_err(|fault| {
                        let error = vector.place().error(format!("sample {}: {fault}", fault.sample));
                        match fault.help {
                            Some(help) => error.help(help),
                            None => error,
                        }
                    })
                })?;
                Ok((timed(scan.marks().to_vec()), Some(scan)))
            }
            Phase::Trace(trace, marker) => Ok((self.crossings(trace, marker)?, None)),
            Phase::Unknown(place) => Err(neither(place)),
        }
    }

    fn crossings(&self, trace: &Trace, marker: &Marker) -> Result<Marks> {
        let mut scan = MarkerScan::new(marker);
        let mut sample = 0;
        let place = match trace {
            Trace::Channel(_) => &self.samples_place,
            Trace::Vector(vector) => vector.place(),
        };
        let mut take = |value: f64| {
            sample += 1;
            scan.push(value).map_err(|problem| place.error(format!("sample {}: {problem}", sample - 1)))
        };
        match trace {
            Trace::Channel(channel) => {
                let (gain, zero) = (self.stored.scale[*channel], self.stored.offset[*channel]);
                let read = |range| self.stored.orientation.channel(&self.dataset, range, *channel);
                each(
                    self.stored.samples,
                    |range| read(range).map_err(|error| place.error(error)),
                    |code| take(code * gain + zero),
                )?;
            }
            Trace::Vector(vector) => vector.each(take)?,
        }
        let help = "set `threshold` and `hysteresis` of `marker` in [load] between its levels";
        scan.marks().map_err(|problem| place.error(problem).help(help))
    }
}

/// Neither marks nor angles.
fn neither(place: &Place) -> runout_core::Error {
    place.error(format!("expected a dataset `{INDEX}` or `{ANGLE}`, found neither")).help(
        "where a channel has the mark as a voltage, name it in [load]: marker = { channel = \"…\", threshold = …, hysteresis = … }",
    )
}

impl Phase {
    fn open(group: &Group, place: &Place, samples: usize) -> Result<Self> {
        if group.link_exists(ANGLE) {
            let vector = Vector::open(group, place, ANGLE)?;
            if vector.length() != samples {
                let problem = format!("expected an angle for each of {samples} samples, found {}", vector.length());
                return Err(vector.place().error(problem));
            }
            return Ok(Self::Angle(vector));
        }
        if !group.link_exists(INDEX) {
            return Ok(Self::Unknown(place.clone()));
        }
        let vector = Vector::open(group, place, INDEX)?;
        if vector.length() > samples {
            let problem = format!("expected fewer marks than the {samples} samples, found {}", vector.length());
            return Err(vector.place().error(problem));
        }
        Ok(Self::Index(vector))
    }

    /// Refuses a capture whose turns are not known.
    pub(crate) fn check(&self) -> Result<()> {
        match self {
            Self::Unknown(place) => Err(neither(place)),
            _ => Ok(()),
        }
    }
}

impl Trace {
    fn open(group: &Group, place: &Place, stored: &StoredSamples, marker: &Marker) -> Result<Self> {
        if let Some(channel) = stored.sensors.iter().position(|name| *name == marker.channel) {
            return Ok(Self::Channel(channel));
        }
        if !group.link_exists(&marker.channel) {
            let problem = format!(
                "expected a channel or a dataset `{}` with the mark, found the channels {}",
                marker.channel,
                stored.sensors.join(", ")
            );
            return Err(place.error(problem).help("correct `channel` of `marker` in [load]"));
        }
        let vector = Vector::open(group, place, &marker.channel)?;
        if vector.length() != stored.samples {
            let problem = format!("expected a value for each of {} samples, found {}", stored.samples, vector.length());
            return Err(vector.place().error(problem));
        }
        Ok(Self::Vector(vector))
    }
}

/// Sample positions of marks.
fn positions(vector: &Vector, samples: usize) -> Result<Vec<f64>> {
    let mut marks: Vec<f64> = Vec::new();
    vector.each(|value| {
        let expected = match marks.last() {
            Some(last) if value <= *last => format!("a position above {last}"),
            _ if (-1.0..=samples as f64).contains(&value) => {
                marks.push(value);
                return Ok(());
            }
            _ => format!("a sample position from 0 to {samples}"),
        };
        let error = vector.place().error(format!("mark {}: expected {expected}, found {value}", marks.len()));
        // A signal of 0 and 1 has a value a sample.
        let is_signal = vector.length() == samples && [0.0, 1.0].contains(&value);
        Err(if is_signal {
            error.help("`index` has sample positions, one a turn; a marker's signal is named by `marker` in [load]")
        } else {
            error
        })
    })?;
    Ok(marks)
}
