//! One capture in a file: everything but its samples, read and checked.

use hdf5_metno::{Dataset, Group};
use ndarray::s;
use runout_core::{Result, encoder::EncoderScan};

use super::{ANGLE, INDEX, SAMPLES, samples::StoredSamples};
use crate::node::{self, Place};

/// Elements that are read at a time where they pass through once.
const SCAN: usize = 65_536;

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

/// How turns are told.
#[derive(Debug)]
pub(crate) enum Phase {
    /// Sample positions of the once-per-turn mark.
    Index(Dataset, Place),
    /// Angle of each sample.
    Angle(Dataset, Place),
}

impl CaptureSource {
    /// Reads the attributes and shapes of `/<setup>/<station>`.
    pub(crate) fn open(setup: &Group, setup_place: &Place, station: &str) -> Result<Self> {
        let (group, place) = node::group(setup, setup_place, station)?;
        let z_mm = node::needed(node::number(&group, &place, "z_mm")?, &place, "z_mm")?;
        let speed_rpm = node::positive(&group, &place, "speed_rpm")?;
        let (dataset, samples_place) = node::dataset(&group, &place, SAMPLES)?;
        let stored = StoredSamples::read(&dataset, &samples_place)?;
        let phase = Phase::open(&group, &place, stored.samples)?;
        Ok(Self { place, z_mm, speed_rpm, dataset, samples_place, stored, phase })
    }
}

impl Phase {
    fn open(group: &Group, place: &Place, samples: usize) -> Result<Self> {
        let line = |name: &str| -> Result<(Dataset, Place, usize)> {
            let (dataset, place) = node::dataset(group, place, name)?;
            let found = node::element_type(&dataset, &place)?;
            if !node::is_number(&found) {
                return Err(place.error(format!("expected f64, found {}", node::type_name(&found))));
            }
            match node::written_shape(&dataset, &place)?.as_slice() {
                [length] => Ok((dataset, place, *length)),
                other => Err(place.error(format!("expected one dimension, found the shape {other:?}"))),
            }
        };
        if group.link_exists(ANGLE) {
            let (dataset, place, length) = line(ANGLE)?;
            if length != samples {
                return Err(place.error(format!("expected an angle for each of {samples} samples, found {length}")));
            }
            return Ok(Self::Angle(dataset, place));
        }
        if !group.link_exists(INDEX) {
            return Err(place.error(format!("expected a dataset `{INDEX}` or `{ANGLE}`, found neither")));
        }
        let (dataset, place, length) = line(INDEX)?;
        if length > samples {
            return Err(place.error(format!("expected fewer marks than the {samples} samples, found {length}")));
        }
        Ok(Self::Index(dataset, place))
    }

    /// Sample positions at which turns begin, and the scan that tells how to read the encoder.
    pub(crate) fn marks(&self, samples: usize) -> Result<(Vec<f64>, Option<EncoderScan>)> {
        match self {
            Self::Index(dataset, place) => {
                let mut marks: Vec<f64> = Vec::new();
                each(dataset, place, |value| {
                    let expected = match marks.last() {
                        Some(last) if value <= *last => format!("a position above {last}"),
                        _ if (-1.0..=samples as f64).contains(&value) => {
                            marks.push(value);
                            return Ok(());
                        }
                        _ => format!("a sample position from 0 to {samples}"),
                    };
                    Err(place.error(format!("mark {}: expected {expected}, found {value}", marks.len())))
                })?;
                Ok((marks, None))
            }
            Self::Angle(dataset, place) => {
                let mut scan = EncoderScan::default();
                each(dataset, place, |angle_deg| {
                    scan.push(angle_deg).map_err(|fault| place.error(format!("sample {}: {fault}", fault.sample)))
                })?;
                Ok((scan.marks().to_vec(), Some(scan)))
            }
        }
    }
}

/// Reads a line of numbers in blocks.
fn each(dataset: &Dataset, place: &Place, mut take: impl FnMut(f64) -> Result<()>) -> Result<()> {
    let length = dataset.size();
    for start in (0..length).step_by(SCAN) {
        let block = dataset.read_slice_1d::<f64, _>(s![start..length.min(start + SCAN)]);
        for value in block.map_err(|error| place.error(error))? {
            take(value)?;
        }
    }
    Ok(())
}
