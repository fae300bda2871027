//! Little-endian numbers of binary files.

use std::io::{self, Read};

/// Bytes that are decoded at a time.
const BLOCK: usize = 1 << 16;

/// A type of number in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    U8,
    U16,
    U32,
    I8,
    I16,
    I32,
    F32,
    F64,
}

impl Kind {
    /// Bytes of one.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Least and greatest number.
    pub(crate) fn range(self) -> [f64; 2] {
        match self {
            Self::U8 => [0.0, f64::from(u8::MAX)],
            Self::U16 => [0.0, f64::from(u16::MAX)],
            Self::U32 => [0.0, f64::from(u32::MAX)],
            Self::I8 => [f64::from(i8::MIN), f64::from(i8::MAX)],
            Self::I16 => [f64::from(i16::MIN), f64::from(i16::MAX)],
            Self::I32 => [f64::from(i32::MIN), f64::from(i32::MAX)],
            Self::F32 => [f64::from(f32::MIN), f64::from(f32::MAX)],
            Self::F64 => [f64::MIN, f64::MAX],
        }
    }

    /// The number at the start of these bytes; NaN where they are too few.
    pub(crate) fn decode(self, bytes: &[u8]) -> f64 {
        let mut number = Vec::with_capacity(1);
        self.append(bytes, bytes.len().max(1), &mut number);
        number.pop().unwrap_or(f64::NAN)
    }

    /// Appends the numbers at the starts of records of so many bytes.
    pub(crate) fn append(self, bytes: &[u8], record: usize, to: &mut Vec<f64>) {
        fn each<const N: usize>(bytes: &[u8], record: usize, to: &mut Vec<f64>, number: impl Fn([u8; N]) -> f64) {
            let one = |bytes: &[u8]| bytes.first_chunk().map_or(f64::NAN, |bytes| number(*bytes));
            to.extend(bytes.chunks(record).map(one));
        }
        match self {
            Self::U8 => each(bytes, record, to, |bytes| f64::from(u8::from_le_bytes(bytes))),
            Self::U16 => each(bytes, record, to, |bytes| f64::from(u16::from_le_bytes(bytes))),
            Self::U32 => each(bytes, record, to, |bytes| f64::from(u32::from_le_bytes(bytes))),
            Self::I8 => each(bytes, record, to, |bytes| f64::from(i8::from_le_bytes(bytes))),
            Self::I16 => each(bytes, record, to, |bytes| f64::from(i16::from_le_bytes(bytes))),
            Self::I32 => each(bytes, record, to, |bytes| f64::from(i32::from_le_bytes(bytes))),
            Self::F32 => each(bytes, record, to, |bytes| f64::from(f32::from_le_bytes(bytes))),
            Self::F64 => each(bytes, record, to, f64::from_le_bytes),
        }
    }
}

/// Reads records of one number each, block by block: nothing is allocated for what a header declares and the file lacks.
///
/// # Errors
/// When the file ends before.
pub(crate) fn read(source: &mut impl Read, kind: Kind, count: usize) -> io::Result<Vec<f64>> {
    let mut numbers = Vec::new();
    records(source, kind.size(), count, |records| kind.append(records, kind.size(), &mut numbers))?;
    Ok(numbers)
}

/// Gives records of so many bytes, a block of them at a time.
///
/// # Errors
/// When the file ends before.
pub(crate) fn records(
    source: &mut impl Read,
    size: usize,
    count: usize,
    mut each: impl FnMut(&[u8]),
) -> io::Result<()> {
    let at_once = (BLOCK / size.max(1)).max(1);
    let mut block = vec![0; at_once.min(count) * size];
    let mut left = count;
    while left > 0 {
        let now = left.min(at_once);
        let part = &mut block[..now * size];
        source.read_exact(part)?;
        each(part);
        left -= now;
    }
    Ok(())
}

/// Skips so many bytes.
///
/// # Errors
/// When the file ends before.
pub(crate) fn skip(source: &mut impl Read, bytes: u64) -> io::Result<()> {
    match io::copy(&mut source.by_ref().take(bytes), &mut io::sink())? {
        skipped if skipped == bytes => Ok(()),
        _ => Err(io::ErrorKind::UnexpectedEof.into()),
    }
}
