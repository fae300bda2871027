//! Numbers that lie in a file at equal distances, as most binary formats have them.

use std::{
    fs::File,
    io::{Read, Seek, SeekFrom},
    sync::Arc,
};

use runout_core::{Error, ErrorKind, Result};

use crate::{
    channel::{Kind, Samples},
    source::Source,
};

/// Bytes that are read at a time.
const WINDOW: usize = 1 << 18;

/// Numbers at equal distances, and such runs at equal distances: number i of run r is at `offset + r · period + i · stride`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Run {
    pub(crate) offset: u64,
    /// Numbers of a run.
    pub(crate) count: u64,
    pub(crate) stride: u64,
    pub(crate) repeats: u64,
    pub(crate) period: u64,
    pub(crate) kind: Kind,
    pub(crate) is_big_endian: bool,
}

impl Run {
    /// Numbers side by side.
    pub(crate) fn dense(offset: u64, count: u64, kind: Kind, is_big_endian: bool) -> Self {
        Self::spaced(offset, count, kind.bytes() as u64, kind, is_big_endian)
    }

    /// Numbers at a distance in bytes.
    pub(crate) fn spaced(offset: u64, count: u64, stride: u64, kind: Kind, is_big_endian: bool) -> Self {
        Self { offset, count, stride, repeats: 1, period: 0, kind, is_big_endian }
    }

    pub(crate) fn samples(&self) -> u64 {
        self.count.saturating_mul(self.repeats)
    }
}

/// From stored numbers to those of the channel.
pub(crate) trait Scaling: Send + Sync {
    fn apply(&self, values: &mut [f64]);
}

/// gain · number + offset.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Linear {
    pub(crate) gain: f64,
    pub(crate) offset: f64,
}

impl Scaling for Linear {
    fn apply(&self, values: &mut [f64]) {
        for value in values {
            *value = *value * self.gain + self.offset;
        }
    }
}

/// One channel: its runs in the order of time, and how its numbers are scaled.
pub(crate) struct Column {
    pub(crate) runs: Vec<Run>,
    pub(crate) scaling: Option<Arc<dyn Scaling>>,
}

/// Reads channels whose numbers lie at equal distances.
pub(crate) struct StridedSamples {
    source: Windows,
    columns: Vec<Cursor>,
}

/// Where a column goes on.
struct Cursor {
    column: Column,
    /// Which of the windows it reads through.
    window: usize,
    run: usize,
    repeat: u64,
    index: u64,
}

/// A file, seen through windows.
struct Windows {
    file: File,
    shown: String,
    bytes: u64,
    views: Vec<Window>,
}

#[derive(Default)]
struct Window {
    start: u64,
    bytes: Vec<u8>,
}

impl StridedSamples {
    pub(crate) fn open(source: &Source, columns: Vec<Column>) -> Result<Self> {
        let mut cursors: Vec<Cursor> = Vec::with_capacity(columns.len());
        let mut firsts: Vec<Run> = Vec::new();
        for column in columns {
            // Channels of one instant side by side are read together.
            let same = |run: &Run| {
                firsts.iter().position(|other| {
                    other.stride == run.stride && other.offset.abs_diff(run.offset) < run.stride.min(WINDOW as u64)
                })
            };
            let window = match column.runs.first() {
                Some(run) => same(run).unwrap_or_else(|| {
                    firsts.push(*run);
                    firsts.len() - 1
                }),
                None => 0,
            };
            cursors.push(Cursor { column, window, run: 0, repeat: 0, index: 0 });
        }
        let views = (0..firsts.len().max(1)).map(|_| Window::default()).collect();
        let source = Windows { file: source.open()?, shown: source.shown(), bytes: source.bytes(), views };
        Ok(Self { source, columns: cursors })
    }
}

impl Samples for StridedSamples {
    fn next(&mut self, most: usize, columns: &mut [Vec<f64>]) -> Result<usize> {
        let mut longest = 0;
        // Piece by piece, so that columns of one window move through it together.
        let mut left = most;
        while left > 0 {
            let piece = left.min(self.piece());
            let mut taken = 0;
            for (cursor, to) in self.columns.iter_mut().zip(columns.iter_mut()) {
                taken = taken.max(cursor.take(&mut self.source, piece, to)?);
            }
            longest += taken;
            left -= piece;
            if taken == 0 {
                break;
            }
        }
        Ok(longest)
    }
}

impl StridedSamples {
    /// Samples that a window holds, of the columns as they are now.
    fn piece(&self) -> usize {
        let stride = |cursor: &Cursor| cursor.column.runs.get(cursor.run).map_or(1, |run| run.stride.max(1));
        let widest = self.columns.iter().map(stride).max().unwrap_or(1);
        (WINDOW as u64 / widest).max(1) as usize
    }
}

impl Cursor {
    fn take(&mut self, source: &mut Windows, most: usize, to: &mut Vec<f64>) -> Result<usize> {
        let first = to.len();
        while to.len() - first < most {
            let Some(run) = self.column.runs.get(self.run).copied() else { break };
            if self.repeat >= run.repeats || run.count == 0 {
                (self.run, self.repeat, self.index) = (self.run + 1, 0, 0);
                continue;
            }
            let wanted = (run.count - self.index).min((most - (to.len() - first)) as u64);
            let start = run.offset.saturating_add(self.repeat.saturating_mul(run.period));
            let taken = source.numbers(self.window, &run, start, self.index, wanted, to)?;
            self.index += taken;
            if self.index >= run.count {
                (self.repeat, self.index) = (self.repeat + 1, 0);
            }
        }
        if let Some(scaling) = &self.column.scaling {
            scaling.apply(&mut to[first..]);
        }
        Ok(to.len() - first)
    }
}

impl Windows {
    /// Appends up to `wanted` numbers of a run that begins at `start`, from number `index` on; at least one.
    fn numbers(
        &mut self,
        window: usize,
        run: &Run,
        start: u64,
        index: u64,
        wanted: u64,
        to: &mut Vec<f64>,
    ) -> Result<u64> {
        let width = run.kind.bytes() as u64;
        let place = start.saturating_add(index.saturating_mul(run.stride));
        let fitting = if run.stride <= WINDOW as u64 {
            ((WINDOW as u64).saturating_sub(width) / run.stride.max(1)) + 1
        } else {
            1
        };
        let count = wanted.min(fitting).max(1);
        let length = (count - 1) * run.stride + width;
        let bytes = self.bytes(window, place, length as usize, run.stride <= WINDOW as u64)?;
        append(run, bytes, count as usize, to);
        Ok(count)
    }

    /// Bytes of the file, through a window; `ahead` reads on behind them.
    fn bytes(&mut self, window: usize, place: u64, length: usize, ahead: bool) -> Result<&[u8]> {
        let Window { start, bytes } = &mut self.views[window];
        let is_inside = place >= *start && place.saturating_add(length as u64) <= *start + bytes.len() as u64;
        if !is_inside {
            let rest = self.bytes.saturating_sub(place);
            let wanted = if ahead { (WINDOW.max(length) as u64).min(rest) as usize } else { length };
            if rest < length as u64 {
                let problem = format!("expected {length} bytes at byte {place}, the file ends at {}", self.bytes);
                return Err(Error::new("read", &self.shown, problem).of(ErrorKind::DamagedData));
            }
            bytes.resize(wanted, 0);
            *start = place;
            let read = self.file.seek(SeekFrom::Start(place)).and_then(|_| self.file.read_exact(bytes));
            read.map_err(|error| {
                bytes.clear();
                Error::caused("read", &self.shown, error)
            })?;
        }
        let from = (place - *start) as usize;
        Ok(&bytes[from..from + length])
    }
}

/// Appends numbers that begin at each stride.
fn append(run: &Run, bytes: &[u8], count: usize, to: &mut Vec<f64>) {
    macro_rules! each {
        ($type:ty) => {
            each!($type, f64::from)
        };
        ($type:ty, $convert:expr) => {{
            const WIDTH: usize = size_of::<$type>();
            // One loop for each order of bytes, without a branch in it.
            if run.is_big_endian {
                spaced::<WIDTH>(run.stride, bytes, count, to, |bytes| $convert(<$type>::from_be_bytes(bytes)));
            } else {
                spaced::<WIDTH>(run.stride, bytes, count, to, |bytes| $convert(<$type>::from_le_bytes(bytes)));
            }
        }};
    }
    if run.stride == 0 {
        // Nothing writes this; a file that says so repeats its number.
        let once = Run { stride: run.kind.bytes() as u64, ..*run };
        for _ in 0..count {
            append(&once, bytes, 1, to);
        }
        return;
    }
    match run.kind {
        Kind::U8 => each!(u8),
        Kind::Bool => each!(u8, |code: u8| f64::from(u8::from(code != 0))),
        Kind::I8 => each!(i8),
        Kind::U16 => each!(u16),
        Kind::I16 => each!(i16),
        Kind::U32 => each!(u32),
        Kind::I32 => each!(i32),
        Kind::F32 => each!(f32),
        Kind::F64 | Kind::Decimal | Kind::Text | Kind::Other => each!(f64),
        Kind::U64 => each!(u64, |code: u64| code as f64),
        Kind::I64 | Kind::Time => each!(i64, |code: i64| code as f64),
        Kind::F16 => each!(u16, half),
        Kind::I24 => {
            let convert = |[low, middle, high]: [u8; 3]| f64::from(i32::from_le_bytes([0, low, middle, high]) >> 8);
            if run.is_big_endian {
                spaced(run.stride, bytes, count, to, |[high, middle, low]| convert([low, middle, high]));
            } else {
                spaced(run.stride, bytes, count, to, convert);
            }
        }
    }
}

/// Appends so many numbers, one at each stride; behind the last there is nothing.
fn spaced<const WIDTH: usize>(
    stride: u64,
    bytes: &[u8],
    count: usize,
    to: &mut Vec<f64>,
    convert: impl Fn([u8; WIDTH]) -> f64,
) {
    let of = |bytes: &[u8]| convert(bytes.first_chunk().copied().unwrap_or([0; WIDTH]));
    if stride == WIDTH as u64 {
        to.extend(bytes.as_chunks().0.iter().map(|bytes| convert(*bytes)));
        return;
    }
    let whole = bytes.chunks_exact(stride as usize);
    let last = (whole.len() < count).then(|| of(whole.remainder()));
    to.extend(whole.take(count).map(of));
    to.extend(last);
}

/// A number of 16 bits (IEEE 754, binary16).
pub(crate) fn half(bits: u16) -> f64 {
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    let fraction = f64::from(bits & 0x03FF);
    match (bits >> 10) & 0x1F {
        0 => sign * fraction * 2f64.powi(-24),
        31 if fraction == 0.0 => sign * f64::INFINITY,
        31 => f64::NAN,
        exponent => sign * (1.0 + fraction / 1024.0) * 2f64.powi(i32::from(exponent) - 15),
    }
}
