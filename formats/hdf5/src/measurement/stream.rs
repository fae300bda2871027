//! The samples of one capture, block after block.

use std::ops::Range;

use bytemuck::Pod;
use hdf5_metno::H5Type;
use runout_core::{
    Error, Result,
    checksum::Reader,
    encoder::EncoderScan,
    measurement::{Block, Capture, SampleStream},
    numerics::lanes::{Arithmetic, LaneWork, in_lanes},
    rig::Rig,
};

use super::{
    capture::{CaptureSource, Phase},
    rows::Rows,
    samples::SampleType,
    vector::Vector,
};
use crate::node::Place;

/// Elements in a block, about: 256 KiB of f64, which stay in a core's own cache from the file to the average.
const BLOCK: usize = 1 << 15;

/// A block never takes more elements than this, even where the file's chunks are larger.
const BLOCK_ELEMENTS: usize = 1 << 24;

/// One sensor's column, and how its codes become µm towards the surface.
#[derive(Debug)]
struct Column {
    /// Counted from the first column that is read.
    offset: usize,
    gain: f64,
    zero_um: f64,
}

/// An opened capture.
pub(super) struct Hdf5Stream {
    capture: Capture,
    rows: Rows,
    kind: SampleType,
    read_columns: usize,
    columns: Vec<Column>,
    is_plain: bool,
    encoder: Option<(Vector, EncoderScan)>,
    block_samples: usize,
    next: usize,
    samples: usize,
}

impl Hdf5Stream {
    pub(super) fn new(source: CaptureSource, rig: &Rig, setup: usize, station: &str, checksum: Reader) -> Result<Self> {
        let stored = &source.stored;
        let found = columns_of(&stored.sensors, rig, &source.samples_place)?;
        let first_column = found.iter().copied().min().unwrap_or(0);
        let last_column = found.iter().copied().max().unwrap_or(0);
        // Both factors take the sign, so that turning a sensor round changes no rounding.
        let columns: Vec<Column> = found
            .iter()
            .zip(&rig.sensors)
            .map(|(column, sensor)| Column {
                offset: column - first_column,
                gain: stored.scale[*column] * sensor.sign,
                zero_um: stored.offset[*column] * sensor.sign,
            })
            .collect();
        let converter_limits_um = stored.limits.map(|limits| {
            let limits_um = |column: &Column| {
                let [one, other] = limits.map(|code| code * column.gain + column.zero_um);
                [one.min(other), one.max(other)]
            };
            columns.iter().map(limits_um).collect()
        });
        let (marks, scan) = source.marks()?;
        let capture = Capture {
            object: source.place.to_string(),
            setup,
            station: station.to_owned(),
            z_mm: source.z_mm,
            stated_speed_rpm: source.speed_rpm,
            sample_rate_hz: stored.sample_rate_hz,
            samples: stored.samples as u64,
            sensors: (0..rig.sensors.len()).collect(),
            sensor_ids: rig.sensors.iter().map(|sensor| sensor.id.clone()).collect(),
            converter_limits_um,
            marks: marks.at,
            marks_within_samples: marks.within_samples,
            encoder: scan.is_some(),
            trimmed: Vec::new(),
            responses: Vec::new(),
        };
        let encoder = match (source.phase, scan) {
            (Phase::Angle(vector), Some(scan)) => Some((vector, scan)),
            _ => None,
        };
        let read = first_column..last_column + 1;
        let plain =
            |(index, column): (usize, &Column)| column.offset == index && (column.gain, column.zero_um) == (1.0, 0.0);
        let chunk = source.dataset.chunk().and_then(|chunk| stored.orientation.samples_of(&chunk));
        let block_samples = block_samples(chunk, read.len());
        let rows = match stored.kind {
            SampleType::F64 => Rows::new::<f64>,
            SampleType::F32 => Rows::new::<f32>,
            SampleType::I16 => Rows::new::<i16>,
            SampleType::I32 => Rows::new::<i32>,
        };
        Ok(Self {
            block_samples,
            samples: stored.samples,
            kind: stored.kind,
            capture,
            rows: rows(source.dataset, source.samples_place, stored.orientation, read.clone(), checksum)?,
            read_columns: read.len(),
            is_plain: columns.len() == read.len() && columns.iter().enumerate().all(plain),
            columns,
            encoder,
            next: 0,
        })
    }

    /// Rows in µm.
    fn read<T: H5Type + Pod + Into<f64>>(&mut self, rows: &Range<usize>, to: &mut Vec<f64>) -> Result<()> {
        let mut codes = Vec::<T>::new();
        self.rows.read(rows, &mut codes)?;
        to.resize(rows.len() * self.columns.len(), 0.0);
        let mut scaling = Scaling { codes: &codes, read_columns: self.read_columns, columns: &self.columns, to };
        in_lanes(self.columns.len(), &mut scaling);
        Ok(())
    }
}

/// Codes on their way to µm.
struct Scaling<'a, T> {
    /// `[row][column]`.
    codes: &'a [T],
    read_columns: usize,
    columns: &'a [Column],
    /// `[row][channel]`.
    to: &'a mut [f64],
}

impl<T: Copy + Into<f64>> LaneWork for Scaling<'_, T> {
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "see LaneWork")]
    fn lanes<A: Arithmetic, const C: usize>(&mut self, offset: usize) {
        let columns: [&Column; C] = std::array::from_fn(|lane| &self.columns[offset + lane]);
        let (gain, zero_um) = (columns.map(|column| column.gain), columns.map(|column| column.zero_um));
        let first = columns[0].offset;
        let side_by_side = columns.iter().enumerate().all(|(lane, column)| column.offset == first + lane);
        let rows = self.codes.chunks_exact(self.read_columns).zip(self.to.chunks_exact_mut(self.columns.len()));
        for (row, to) in rows {
            let mut codes = [0.0; C];
            if side_by_side {
                for (code, stored) in codes.iter_mut().zip(&row[first..first + C]) {
                    *code = (*stored).into();
                }
            } else {
                codes = columns.map(|column| row[column.offset].into());
            }
            for (lane, to) in to[offset..offset + C].iter_mut().enumerate() {
                *to = codes[lane] * gain[lane] + zero_um[lane];
            }
        }
    }
}

impl SampleStream for Hdf5Stream {
    fn capture(&self) -> &Capture {
        &self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        // Not cleared: what is read over needs no zeros.
        let mut samples = std::mem::take(&mut block.samples);
        block.clear();
        block.start = self.next as u64;
        let rows = self.next..self.samples.min(self.next + self.block_samples);
        if rows.is_empty() {
            return Ok(false);
        }
        match self.kind {
            SampleType::F64 if self.is_plain => self.rows.read(&rows, &mut samples)?,
            SampleType::F64 => self.read::<f64>(&rows, &mut samples)?,
            SampleType::F32 => self.read::<f32>(&rows, &mut samples)?,
            SampleType::I16 => self.read::<i16>(&rows, &mut samples)?,
            SampleType::I32 => self.read::<i32>(&rows, &mut samples)?,
        }
        block.samples = samples;
        if let Some((vector, scan)) = &self.encoder {
            block.angle_rev.extend(vector.read(rows.clone())?.into_iter().map(|angle_deg| scan.turns(angle_deg)));
        }
        self.next = rows.end;
        Ok(true)
    }
}

/// The file's column of each of the rig's sensors.
pub(super) fn columns_of(sensors: &[String], rig: &Rig, place: &Place) -> Result<Vec<usize>> {
    rig.sensors
        .iter()
        .map(|sensor| {
            let mut found = sensors.iter().enumerate().filter(|(_, id)| **id == sensor.id).map(|(column, _)| column);
            match (found.next(), found.next()) {
                (Some(column), None) => Ok(column),
                (Some(_), Some(_)) => Err(place.error(format!("the channel `{}` is there twice", sensor.id))),
                (None, _) => Err(missing(&sensor.id, sensors, place)),
            }
        })
        .collect()
}

fn missing(id: &str, sensors: &[String], place: &Place) -> Error {
    place
        .error(format!("expected a channel for the sensor `{id}`, found {}", sensors.join(", ")))
        .help("the rig's sensor ids have to be the names in the attribute `sensors`")
}

/// Whole chunks at a time, so that none is unpacked twice.
fn block_samples(chunk: Option<usize>, columns: usize) -> usize {
    let columns = columns.max(1);
    let [usual, longest] = [BLOCK, BLOCK_ELEMENTS].map(|elements| (elements / columns).max(1));
    match chunk {
        Some(rows) if rows >= usual => rows.min(longest),
        Some(rows) if rows > 0 => usual - usual % rows,
        _ => usual,
    }
}
