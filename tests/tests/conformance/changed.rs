//! Stages around those of a pipeline: a loader that changes what it loads, an exporter that takes rows in pieces.

use std::{
    num::NonZeroUsize,
    path::PathBuf,
    sync::{Arc, Mutex},
};

use runout_core::{
    Error, Result,
    atomic_file::PendingFile,
    measurement::{Block, Capture, Recording, SampleStream, StationKey, StationTruth},
    points::{Points, Trace},
    stage::{Completed, Export, Exporter, Loader, Request, ResultInfo, Source, SourceKind, Takes},
    table::{RecordBatch, TableSpec},
};

/// What is done to a campaign's data on their way into the pipeline.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Change {
    /// Factor of the readings.
    pub(crate) scale: f64,
    /// Factor of the noise; 0 for none.
    pub(crate) noise: f64,
    /// Which noise.
    pub(crate) seed: u64,
    /// Rows, traces and stations come in reverse.
    pub(crate) reversed: bool,
    /// Samples of a block.
    pub(crate) block: Option<usize>,
    /// What is wrong with them.
    pub(crate) damage: Option<Damage>,
}

impl Default for Change {
    fn default() -> Self {
        Self { scale: 1.0, noise: 1.0, seed: 1, reversed: false, block: None, damage: None }
    }
}

/// Something wrong with data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Damage {
    /// Only the first so many points, or turns' marks.
    Only(usize),
    /// Every reading is this.
    Constant(f64),
}

/// Columns of points that are readings, the reading that is 0, and the standard deviation of the noise that the suite adds.
#[derive(Debug, Clone, Default)]
pub(crate) struct Readings {
    pub(crate) columns: Vec<String>,
    pub(crate) zero: f64,
    pub(crate) noise: f64,
}

/// A loader whose data are changed.
pub(crate) struct ChangedLoader {
    pub(crate) inner: Box<dyn Loader>,
    pub(crate) change: Change,
    pub(crate) readings: Readings,
}

impl Loader for ChangedLoader {
    fn kind(&self) -> SourceKind {
        self.inner.kind()
    }

    fn open(&self, wanted: &Request) -> Result<Source> {
        Ok(match self.inner.open(wanted)? {
            Source::Points(points) => {
                if let Some(name) = self.readings.columns.iter().find(|name| points.column(name).is_err()) {
                    return Err(Error::new("change", name, "the campaign has no such column"));
                }
                Source::Points(self.points(points))
            }
            Source::Turns(inner) => {
                let mut stations = inner.stations().to_vec();
                if self.change.reversed {
                    stations.reverse();
                }
                Source::Turns(Box::new(ChangedRecording { inner, stations, change: self.change.clone() }))
            }
        })
    }
}

impl ChangedLoader {
    fn points(&self, mut points: Points) -> Points {
        let (change, readings) = (&self.change, &self.readings);
        let mut number = change.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let mut noise = || (0..12).map(|_| uniform(&mut number)).sum::<f64>() - 6.0;
        for name in &readings.columns {
            let Some(column) = points.columns.iter_mut().find(|column| column.name == *name) else { continue };
            for value in &mut column.values {
                *value = match change.damage {
                    Some(Damage::Constant(constant)) => constant,
                    _ => {
                        readings.zero
                            + change.scale * (*value - readings.zero + change.noise * readings.noise * noise())
                    }
                };
            }
        }
        if let Some(Damage::Only(count)) = change.damage {
            points.columns.iter_mut().for_each(|column| column.values.truncate(count));
            points.labels.iter_mut().for_each(|labels| labels.values.truncate(count));
            points.traces.retain_mut(|trace| {
                trace.points.end = trace.points.end.min(count);
                !trace.points.is_empty()
            });
        }
        if change.reversed {
            let count = points.columns.first().map_or(0, |column| column.values.len());
            points.columns.iter_mut().for_each(|column| column.values.reverse());
            points.labels.iter_mut().for_each(|labels| labels.values.reverse());
            let back =
                |trace: &Trace| Trace { points: count - trace.points.end..count - trace.points.start, ..trace.clone() };
            points.traces = points.traces.iter().rev().map(back).collect();
        }
        points
    }
}

/// A number from 0 to 1 (xorshift64*).
fn uniform(state: &mut u64) -> f64 {
    *state ^= *state >> 12;
    *state ^= *state << 25;
    *state ^= *state >> 27;
    (state.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1_u64 << 53) as f64
}

struct ChangedRecording {
    inner: Box<dyn Recording>,
    stations: Vec<StationKey>,
    change: Change,
}

impl ChangedRecording {
    fn inner_index(&self, station: usize) -> usize {
        if self.change.reversed { self.stations.len() - 1 - station } else { station }
    }
}

impl Recording for ChangedRecording {
    fn stations(&self) -> &[StationKey] {
        &self.stations
    }

    fn open(&self, station: usize, setup: usize) -> Result<Box<dyn SampleStream + '_>> {
        self.open_with(NonZeroUsize::MIN, station, setup)
    }

    fn open_with(&self, threads: NonZeroUsize, station: usize, setup: usize) -> Result<Box<dyn SampleStream + '_>> {
        let inner = self.inner.open_with(threads, self.inner_index(station), setup)?;
        Ok(changed_stream(inner, &self.change))
    }

    fn inputs(&self) -> Vec<PathBuf> {
        self.inner.inputs()
    }

    fn truth(&self, station: usize) -> Result<Option<StationTruth>> {
        self.inner.truth(self.inner_index(station))
    }
}

/// A stream whose samples are changed, and whose blocks have another length.
pub(crate) fn changed_stream<'a>(inner: Box<dyn SampleStream + 'a>, change: &Change) -> Box<dyn SampleStream + 'a> {
    let mut capture = inner.capture().clone();
    if let Some(Damage::Only(marks)) = change.damage {
        capture.marks.truncate(marks);
    }
    for limits in capture.converter_limits_um.iter_mut().flatten() {
        *limits = limits.map(|limit| limit * change.scale);
    }
    Box::new(ChangedStream {
        inner,
        capture,
        change: change.clone(),
        waiting: Block::default(),
        taken: 0,
        ended: false,
    })
}

struct ChangedStream<'a> {
    inner: Box<dyn SampleStream + 'a>,
    capture: Capture,
    change: Change,
    waiting: Block,
    /// Samples of `waiting` that were handed on.
    taken: usize,
    ended: bool,
}

impl SampleStream for ChangedStream<'_> {
    fn capture(&self) -> &Capture {
        &self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        block.clear();
        let channels = self.capture.channels().max(1);
        let wanted = self.change.block;
        while wanted.is_none_or(|wanted| block.samples.len() / channels < wanted) && !self.ended {
            if self.taken * channels >= self.waiting.samples.len() {
                self.taken = 0;
                self.ended = !self.inner.next_block(&mut self.waiting)?;
                block.defects.append(&mut self.waiting.defects);
                continue;
            }
            let there = self.waiting.samples.len() / channels;
            let missing = wanted.map_or(there, |wanted| wanted - block.samples.len() / channels);
            let end = there.min(self.taken + missing);
            if block.samples.is_empty() {
                block.start = self.waiting.start + self.taken as u64;
            }
            block.samples.extend(&self.waiting.samples[self.taken * channels..end * channels]);
            block.angle_rev.extend(self.waiting.angle_rev.get(self.taken..end).unwrap_or_default());
            self.taken = end;
            if wanted.is_none() {
                break;
            }
        }
        for sample in &mut block.samples {
            *sample = match self.change.damage {
                Some(Damage::Constant(constant)) => constant,
                _ => *sample * self.change.scale,
            };
        }
        Ok(!block.samples.is_empty())
    }
}

/// The tables that an export was given, one entry a batch.
pub(crate) type Taken = Arc<Mutex<Vec<(TableSpec, RecordBatch)>>>;

/// An exporter that keeps what it is given, and hands it to another one in pieces.
pub(crate) struct Between {
    pub(crate) inner: Option<Box<dyn Exporter>>,
    pub(crate) taken: Taken,
    /// Rows of a piece.
    pub(crate) piece: Option<usize>,
    /// Whether it fails at the end.
    pub(crate) fails: bool,
}

impl Exporter for Between {
    fn takes(&self) -> Takes {
        self.inner.as_ref().map_or(Takes::Tables, |inner| inner.takes())
    }

    fn needs(&self) -> Option<(&'static str, &'static str)> {
        self.inner.as_ref().and_then(|inner| inner.needs())
    }

    fn outputs(&self, tables: &[TableSpec]) -> Vec<PathBuf> {
        self.inner.as_ref().map_or_else(Vec::new, |inner| inner.outputs(tables))
    }

    fn begin(&self, result: &ResultInfo) -> Result<Box<dyn Export>> {
        let inner = self.inner.as_ref().map(|inner| inner.begin(result)).transpose()?;
        let (taken, announced) = (Arc::clone(&self.taken), result.tables.clone());
        Ok(Box::new(ExportBetween { inner, taken, announced, piece: self.piece, fails: self.fails }))
    }
}

struct ExportBetween {
    inner: Option<Box<dyn Export>>,
    taken: Taken,
    announced: Vec<TableSpec>,
    piece: Option<usize>,
    fails: bool,
}

impl Export for ExportBetween {
    fn rows(&mut self, table: &TableSpec, rows: &RecordBatch) -> Result<()> {
        let error = |problem: &str| Err(Error::new("take rows of", &table.name, problem));
        if !self.announced.iter().any(|known| known.name == table.name && known.schema() == table.schema()) {
            return error("the table was not declared before the run, or with other columns");
        }
        if rows.schema() != table.schema() {
            return error("the rows do not fit the table as it is declared");
        }
        if let Ok(mut taken) = self.taken.lock() {
            taken.push((table.clone(), rows.clone()));
        }
        let Some(inner) = &mut self.inner else { return Ok(()) };
        let piece = self.piece.unwrap_or(rows.num_rows()).max(1);
        (0..rows.num_rows())
            .step_by(piece)
            .try_for_each(|start| inner.rows(table, &rows.slice(start, piece.min(rows.num_rows() - start))))
    }

    fn finish(self: Box<Self>, result: &Completed) -> Result<Vec<PendingFile>> {
        let files = self.inner.map_or_else(|| Ok(Vec::new()), |inner| inner.finish(result))?;
        if self.fails { Err(Error::new("finish", "the result", "this exporter fails on purpose")) } else { Ok(files) }
    }
}
