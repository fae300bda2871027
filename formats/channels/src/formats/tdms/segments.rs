//! The segments of a file, and the runs of numbers that they add to each object.

use std::collections::HashMap;

use runout_core::{Result, input_file::InputFile};

use super::{
    Properties,
    metadata::{Daqmx, Index, Scaler, Stated, Value},
};
use crate::{
    bytes::{Bytes, text},
    channel::Kind,
    strided::Run,
};

/// Bytes of a lead-in.
const LEAD_IN: u64 = 28;
/// The length of a segment whose writing was interrupted.
const UNFINISHED: u64 = u64::MAX;

/// Bits of the table of contents.
const HAS_METADATA: u32 = 1 << 1;
const NEW_LIST: u32 = 1 << 2;
const HAS_RAW_DATA: u32 = 1 << 3;
const IS_INTERLEAVED: u32 = 1 << 5;
const IS_BIG_ENDIAN: u32 = 1 << 6;

/// A group or a channel.
#[derive(Default)]
pub(super) struct Object {
    pub(super) path: String,
    pub(super) properties: Properties,
    pub(super) kind: Kind,
    pub(super) runs: Vec<Run>,
    pub(super) scalers: Vec<Scaler>,
    /// Of texts, whose lengths are not followed.
    texts: u64,
    /// What the last segment that said something said of its raw data.
    index: Option<Index>,
}

impl Object {
    pub(super) fn samples(&self) -> u64 {
        self.runs.iter().fold(self.texts, |sum, run| sum.saturating_add(run.samples()))
    }

    /// Adds a run; one that goes on as those before it is one more of them.
    fn push(&mut self, run: Run) {
        if run.samples() == 0 {
            return;
        }
        if let Some(last) = self.runs.last_mut() {
            let same = Run { offset: last.offset, repeats: last.repeats, period: last.period, ..run } == *last;
            let distance = run.offset.saturating_sub(last.offset);
            let fits = last.repeats == 1 || last.repeats.checked_mul(last.period) == Some(distance);
            if same && run.repeats == 1 && distance > 0 && fits {
                if last.repeats == 1 {
                    last.period = distance;
                }
                last.repeats += 1;
                return;
            }
        }
        self.runs.push(run);
    }
}

/// All segments of a file.
pub(super) struct Segments {
    pub(super) objects: Vec<Object>,
    pub(super) remarks: Vec<String>,
    by_path: HashMap<String, usize>,
    /// The objects of the last segment, and whether they have data in it.
    list: Vec<(usize, bool)>,
    has_list: bool,
}

impl Segments {
    pub(super) fn read(input: &InputFile) -> Result<Self> {
        let mut all = Self {
            objects: Vec::new(),
            remarks: Vec::new(),
            by_path: HashMap::new(),
            list: Vec::new(),
            has_list: false,
        };
        let mut bytes = Bytes::open(&input.into())?;
        let shown = input.path().display();
        while bytes.rest() > 0 {
            let begin = bytes.place();
            if bytes.rest() < LEAD_IN {
                all.remarks.push(format!("{shown}: its last {} bytes are no segment: they are not used", bytes.rest()));
                break;
            }
            if bytes.array()? != *b"TDSm" {
                return Err(bytes.damaged("expected a segment to begin with `TDSm`"));
            }
            bytes.is_big_endian = false;
            let contents = bytes.u32()?;
            bytes.is_big_endian = contents & IS_BIG_ENDIAN != 0;
            bytes.skip(4)?;
            let (length, metadata) = (bytes.u64()?, bytes.u64()?);
            let first = begin + LEAD_IN;
            let data = first.saturating_add(metadata);
            let stated_end = if length == UNFINISHED { u64::MAX } else { first.saturating_add(length) };
            let end = stated_end.min(bytes.length());
            let is_cut = stated_end > bytes.length();
            if is_cut {
                if data > end {
                    all.remarks
                        .push(format!("{shown}: its last segment was interrupted in its metadata: it is not used"));
                    break;
                }
                all.remarks.push(format!("{shown}: its last segment was interrupted: what is there of it is used"));
            } else if data > end {
                return Err(bytes.damaged("expected the raw data of a segment inside it"));
            }
            if contents & HAS_METADATA != 0 {
                all.metadata(&mut bytes, contents & NEW_LIST != 0)?;
            } else if !all.has_list {
                return Err(bytes.damaged("expected metadata in the first segment, found none"));
            }
            if contents & HAS_RAW_DATA != 0 && end > data {
                let raw = Raw { bytes: &bytes, data, end, is_cut, is_interleaved: contents & IS_INTERLEAVED != 0 };
                all.raw_data(&raw)?;
            }
            bytes.seek(end)?;
        }
        Ok(all)
    }

    fn metadata(&mut self, bytes: &mut Bytes, is_new_list: bool) -> Result<()> {
        if is_new_list || !self.has_list {
            self.list.clear();
        }
        self.has_list = true;
        for _ in 0..bytes.u32()? {
            let length = bytes.u32()?;
            let path = text(&bytes.take(length.into())?);
            let number = *self.by_path.entry(path.clone()).or_insert_with(|| {
                self.objects.push(Object { path, kind: Kind::Other, ..Object::default() });
                self.objects.len() - 1
            });
            let object = &mut self.objects[number];
            let has_data = match Stated::read(bytes)? {
                Stated::None => false,
                Stated::AsBefore if object.index.is_none() => {
                    return Err(bytes.damaged(format!("`{}` is to be as before, and was not before", object.path)));
                }
                Stated::AsBefore => true,
                Stated::Index(index) => {
                    object.kind = index.kind;
                    if let Some(daqmx) = &index.daqmx {
                        object.scalers.clone_from(&daqmx.scalers);
                    }
                    object.index = Some(index);
                    true
                }
            };
            match self.list.iter_mut().find(|(known, _)| *known == number) {
                Some(known) => known.1 = has_data,
                None => self.list.push((number, has_data)),
            }
            for _ in 0..bytes.u32()? {
                let length = bytes.u32()?;
                let name = text(&bytes.take(length.into())?);
                let value = Value::read(bytes)?;
                object.properties.insert(name, value);
            }
        }
        Ok(())
    }

    /// Adds what a segment holds to its objects.
    fn raw_data(&mut self, raw: &Raw) -> Result<()> {
        let active: Vec<usize> =
            self.list.iter().filter(|(_, has_data)| *has_data).map(|(number, _)| *number).collect();
        let indices: Vec<Index> = active.iter().filter_map(|number| self.objects[*number].index.clone()).collect();
        let with_daqmx = indices.iter().filter(|index| index.daqmx.is_some()).count();
        if with_daqmx > 0 && with_daqmx < indices.len() {
            return Err(raw.bytes.damaged("DAQmx data and others are in one segment"));
        }
        let runs = if with_daqmx > 0 { raw.daqmx(&indices)? } else { raw.plain(&indices)? };
        for ((number, index), runs) in active.into_iter().zip(&indices).zip(runs) {
            let object = &mut self.objects[number];
            if index.kind == Kind::Text {
                object.texts = object.texts.saturating_add(runs.iter().fold(0, |sum, run| sum + run.samples()));
            } else {
                runs.into_iter().for_each(|run| object.push(run));
            }
        }
        Ok(())
    }
}

/// The raw data of a segment.
struct Raw<'a> {
    bytes: &'a Bytes,
    data: u64,
    end: u64,
    /// Whether the file ends before the segment.
    is_cut: bool,
    is_interleaved: bool,
}

impl Raw<'_> {
    fn length(&self) -> u64 {
        self.end - self.data
    }

    fn run(&self, offset: u64, count: u64, stride: u64, kind: Kind) -> Run {
        Run::spaced(offset, count, stride, kind, self.bytes.is_big_endian)
    }

    /// Whole chunks and the bytes behind them.
    fn chunks(&self, chunk: Option<u64>) -> Result<(u64, u64, u64)> {
        match chunk {
            Some(chunk) if chunk > 0 => Ok((chunk, self.length() / chunk, self.length() % chunk)),
            _ => Err(self.bytes.damaged(format!("a segment has {} bytes of data of no channel", self.length()))),
        }
    }

    /// Runs of each object with data, whose numbers are side by side or, interleaved, one of each object after the other.
    fn plain(&self, indices: &[Index]) -> Result<Vec<Vec<Run>>> {
        let sizes: Option<Vec<u64>> = indices.iter().map(Index::chunk_bytes).collect();
        let sizes = sizes.unwrap_or_default();
        let chunk = sizes.iter().try_fold(0_u64, |sum, size| sum.checked_add(*size));
        let (chunk, whole, rest) = self.chunks(chunk)?;
        let mut runs = Vec::with_capacity(indices.len());
        if self.is_interleaved {
            let row: u64 = indices.iter().map(|index| index.width).sum();
            let values = indices.first().map_or(0, |index| index.values);
            if row == 0 || indices.iter().any(|index| index.values != values || index.width == 0) {
                return Err(self.bytes.damaged("expected as many numbers of each interleaved channel"));
            }
            let mut place = self.data;
            for index in indices {
                runs.push(vec![self.run(place, self.length() / row, row, index.kind)]);
                place += index.width;
            }
            return Ok(runs);
        }
        let (mut place, mut left, mut partial) = (self.data, rest, self.data + whole * chunk);
        for (index, size) in indices.iter().zip(sizes) {
            let (stride, kind) = (index.width, index.kind);
            let mut of_object = Vec::with_capacity(2);
            if whole > 0 {
                of_object.push(Run { repeats: whole, period: chunk, ..self.run(place, index.values, stride, kind) });
            }
            if rest > 0 && kind != Kind::Text {
                // A segment that the file ends in has the first channels whole; another one has a part of each.
                let part = if self.is_cut {
                    left.min(size) / stride.max(1)
                } else {
                    (u128::from(index.values) * u128::from(rest) / u128::from(chunk)) as u64
                };
                of_object.push(self.run(partial, part, stride, kind));
                partial += part * stride;
                left = left.saturating_sub(size);
            }
            place += size;
            runs.push(of_object);
        }
        Ok(runs)
    }

    /// Runs of each object, whose scalers pick their bytes from raw buffers, one after the other in a chunk.
    fn daqmx(&self, indices: &[Index]) -> Result<Vec<Vec<Run>>> {
        let all: Vec<&Daqmx> = indices.iter().filter_map(|index| index.daqmx.as_ref()).collect();
        let widths = all.first().map_or(&[][..], |daqmx| &daqmx.widths);
        if all.iter().any(|daqmx| daqmx.widths != widths) {
            return Err(self.bytes.damaged("expected the same raw buffers for all DAQmx channels of a segment"));
        }
        let mut rows = vec![0; widths.len()];
        for (index, daqmx) in indices.iter().zip(&all) {
            for scaler in &daqmx.scalers {
                rows[scaler.buffer] = index.values.max(rows[scaler.buffer]);
            }
        }
        let sizes: Option<Vec<u64>> = rows.iter().zip(widths).map(|(rows, width)| rows.checked_mul(*width)).collect();
        let sizes = sizes.unwrap_or_default();
        let (chunk, whole, rest) = self.chunks(sizes.iter().try_fold(0_u64, |sum, size| sum.checked_add(*size)))?;
        let mut runs = Vec::with_capacity(indices.len());
        for (index, daqmx) in indices.iter().zip(&all) {
            // The chain of scales takes the first scaler; several are refused there.
            let scaler = daqmx.scalers[0];
            let before: u64 = sizes[..scaler.buffer].iter().sum();
            let width = widths[scaler.buffer];
            let place = self.data + before + scaler.byte;
            let mut of_object = Vec::with_capacity(2);
            if whole > 0 {
                of_object.push(Run {
                    repeats: whole,
                    period: chunk,
                    ..self.run(place, index.values, width, scaler.kind)
                });
            }
            let part = (rest.saturating_sub(before) / width.max(1)).min(index.values);
            of_object.push(self.run(place + whole * chunk, part, width, scaler.kind));
            runs.push(of_object);
        }
        Ok(runs)
    }
}
