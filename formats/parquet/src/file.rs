//! A Parquet file of which damaged headers are refused before the library reads them.
//!
//! The library skips a field that it does not know element by element, and neither a flag in a list nor a number behind the end of the file takes it further:
//! a few damaged bytes let it run through 2³¹ elements. Here every header is walked through first (Thrift, compact protocol).

use std::{
    fs::File,
    io::{self, BufReader, Read, Seek, SeekFrom},
};

use bytes::Bytes;
use parquet::{
    errors::{ParquetError, Result},
    file::reader::{ChunkReader, Length},
};

/// What the library reads a file from.
#[derive(Debug)]
pub struct ParquetFile {
    file: File,
    length: u64,
}

/// Bytes at the end of a file: the length of the metadata before them, and `PAR1`.
const FOOTER: u64 = 8;
/// Structures in each other, as many as the library takes.
const DEEPEST: u32 = 64;

impl ParquetFile {
    /// # Errors
    /// When the length of the file is not known.
    pub fn new(file: File) -> io::Result<Self> {
        let length = file.metadata()?.len();
        Ok(Self { file, length })
    }
}

impl Length for ParquetFile {
    fn len(&self) -> u64 {
        self.length
    }
}

impl ChunkReader for ParquetFile {
    type T = BufReader<File>;

    /// Reads the header of a page, or the footer.
    fn get_read(&self, start: u64) -> Result<Self::T> {
        let mut reader = self.file.get_read(start)?;
        if start.saturating_add(FOOTER) < self.length {
            check(&mut reader)?;
            reader.seek(SeekFrom::Start(start))?;
        }
        Ok(reader)
    }

    /// Reads what a page holds, or the metadata, which are before the footer.
    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes> {
        let end = start.saturating_add(length as u64);
        if end > self.length {
            return Err(ParquetError::EOF(format!("{length} bytes at {start}, the file has {}", self.length)));
        }
        let bytes = self.file.get_bytes(start, length)?;
        if end.saturating_add(FOOTER) == self.length {
            check(&mut &bytes[..])?;
        }
        Ok(bytes)
    }
}

fn check(reader: &mut impl Read) -> Result<()> {
    structure(reader, DEEPEST).map_err(|error| ParquetError::General(format!("a header is damaged: {error}")))
}

fn structure(reader: &mut impl Read, depth: u32) -> io::Result<()> {
    loop {
        let head = byte(reader)?;
        let kind = head & 0x0f;
        if kind == 0 {
            return Ok(());
        }
        if head >> 4 == 0 {
            varint(reader)?;
        }
        value(reader, kind, depth)?;
    }
}

/// Goes past a value. All but a flag of a structure take a byte at least, so that the file bounds the time.
fn value(reader: &mut impl Read, kind: u8, depth: u32) -> io::Result<()> {
    let depth = depth.checked_sub(1).ok_or_else(|| invalid("too many structures in each other"))?;
    match kind {
        1 | 2 => Ok(()),
        3 => skip(reader, 1),
        4..=6 => varint(reader).map(drop),
        7 => skip(reader, 8),
        8 => {
            let length = varint(reader)?;
            skip(reader, length)
        }
        9 | 10 => {
            let head = byte(reader)?;
            let count = if head >> 4 == 15 { varint(reader)? } else { u64::from(head >> 4) };
            elements(reader, count, &[head & 0x0f], depth)
        }
        11 => {
            let count = varint(reader)?;
            let kinds = if count > 0 { byte(reader)? } else { 0 };
            elements(reader, count, &[kinds >> 4, kinds & 0x0f], depth)
        }
        12 => structure(reader, depth),
        13 => skip(reader, 16),
        _ => Err(invalid("a type that does not exist")),
    }
}

fn elements(reader: &mut impl Read, count: u64, kinds: &[u8], depth: u32) -> io::Result<()> {
    if count > 0 && kinds.iter().any(|kind| matches!(kind, 1 | 2)) {
        return Err(invalid("a list of flags, which no header of Parquet has"));
    }
    (0..count).try_for_each(|_| kinds.iter().try_for_each(|kind| value(reader, *kind, depth)))
}

fn varint(reader: &mut impl Read) -> io::Result<u64> {
    let mut number = 0;
    for shift in (0..64).step_by(7) {
        let byte = byte(reader)?;
        number |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Ok(number);
        }
    }
    Err(invalid("a number of more than ten bytes"))
}

fn byte(reader: &mut impl Read) -> io::Result<u8> {
    let mut byte = [0];
    reader.read_exact(&mut byte)?;
    Ok(byte[0])
}

fn skip(reader: &mut impl Read, count: u64) -> io::Result<()> {
    if io::copy(&mut reader.take(count), &mut io::sink())? < count {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    Ok(())
}

fn invalid(problem: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, problem)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A structure with one field of this type, and its value.
    fn refused(kind: u8, value: &[u8]) -> String {
        let bytes = [&[0xf0 | kind], value, &[0]].concat();
        check(&mut &bytes[..]).map_or_else(|error| error.to_string(), |()| String::new())
    }

    #[test]
    fn values_of_all_types_are_passed() {
        let values: [(u8, &[u8]); 12] = [
            (1, &[]),
            (2, &[]),
            (3, &[9]),
            (4, &[0x80, 1]),
            (6, &[0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1]),
            (7, &[0; 8]),
            (8, &[2, b'a', b'b']),
            (9, &[0x25, 1, 2]),
            (10, &[0xf8, 1, 1, b'a']),
            (11, &[1, 0x58, 1, 1, b'a']),
            (12, &[0x15, 2, 0]),
            (13, &[7; 16]),
        ];
        assert!(values.iter().all(|(kind, value)| refused(*kind, value).is_empty()));
    }

    #[test]
    fn what_is_not_there_is_refused_at_once() {
        let most = [0xff, 0xff, 0xff, 0xff, 7];
        for kind in [1, 2] {
            assert!(refused(9, &[&[0xf0 | kind], &most[..]].concat()).contains("flags"));
            assert!(refused(11, &[&most[..], &[0x50 | kind]].concat()).contains("flags"));
        }
        for kind in [3, 5, 7, 8, 12, 13] {
            let error = refused(9, &[&[0xf0 | kind], &most[..]].concat());
            assert!(error.contains("fill whole buffer") || error.contains("end of file"), "{kind}: {error}");
        }
        assert!(refused(8, &most).contains("end of file"));
        assert!(refused(5, &[0xff; 12]).contains("ten bytes"));
        assert!(refused(14, &[]).contains("does not exist"));
        assert!(refused(12, &[0x1c; 100]).contains("in each other"));
    }
}
