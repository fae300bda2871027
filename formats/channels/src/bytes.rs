//! Numbers and texts in the bytes of a file, none beyond its end.

use std::{
    fs::File,
    io::{BufRead, BufReader, Read, Seek, SeekFrom},
};

use runout_core::{Error, ErrorKind, Result};

use crate::source::Source;

/// Longest text or piece that is taken into memory as a whole.
pub(crate) const LONGEST: u64 = 1 << 24;

/// Reads a file's structure from place to place.
pub(crate) struct Bytes {
    file: BufReader<File>,
    shown: String,
    length: u64,
    place: u64,
    pub(crate) is_big_endian: bool,
}

impl Bytes {
    pub(crate) fn open(source: &Source) -> Result<Self> {
        let file = BufReader::with_capacity(1 << 14, source.open()?);
        Ok(Self { file, shown: source.shown(), length: source.bytes(), place: 0, is_big_endian: false })
    }

    /// The file's length.
    pub(crate) fn length(&self) -> u64 {
        self.length
    }

    /// Where the next byte is.
    pub(crate) fn place(&self) -> u64 {
        self.place
    }

    /// Bytes behind this place.
    pub(crate) fn rest(&self) -> u64 {
        self.length.saturating_sub(self.place)
    }

    pub(crate) fn seek(&mut self, place: u64) -> Result<()> {
        // Buffered bytes stay where the place is near.
        let moved = i128::from(place) - i128::from(self.place);
        let sought = match i64::try_from(moved) {
            Ok(moved) => self.file.seek_relative(moved),
            Err(_) => self.file.seek(SeekFrom::Start(place)).map(|_| ()),
        };
        sought.map_err(|error| Error::caused("read", &self.shown, error))?;
        self.place = place;
        Ok(())
    }

    pub(crate) fn skip(&mut self, bytes: u64) -> Result<()> {
        self.seek(self.place.saturating_add(bytes))
    }

    /// The error of what the file holds here.
    pub(crate) fn damaged(&self, problem: impl std::fmt::Display) -> Error {
        damaged(&self.shown, self.place, problem)
    }

    pub(crate) fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut bytes = [0; N];
        if self.rest() < N as u64 {
            return Err(self.damaged(format!("expected {N} more bytes, the file ends at byte {}", self.length)));
        }
        self.file.read_exact(&mut bytes).map_err(|error| Error::caused("read", &self.shown, error))?;
        self.place += N as u64;
        Ok(bytes)
    }

    /// So many bytes, at most [`LONGEST`].
    pub(crate) fn take(&mut self, count: u64) -> Result<Vec<u8>> {
        if self.rest() < count || count > LONGEST {
            let most = self.rest().min(LONGEST);
            return Err(self.damaged(format!("expected a length of at most {most} bytes, found {count}")));
        }
        let mut bytes = vec![0; count as usize];
        self.file.read_exact(&mut bytes).map_err(|error| Error::caused("read", &self.shown, error))?;
        self.place += count;
        Ok(bytes)
    }

    /// The next line without its end; nothing at the end of the file. A longer line is given in pieces.
    pub(crate) fn line(&mut self, longest: usize) -> Result<Option<Vec<u8>>> {
        let mut line = Vec::new();
        Ok(self.line_into(&mut line, longest)?.then_some(line))
    }

    /// Puts the next [line](Self::line) in the place of what is there; says whether there was one.
    pub(crate) fn line_into(&mut self, line: &mut Vec<u8>, longest: usize) -> Result<bool> {
        line.clear();
        let read = Read::by_ref(&mut self.file).take(longest as u64).read_until(b'\n', line);
        read.map_err(|error| Error::caused("read", &self.shown, error))?;
        self.place += line.len() as u64;
        let is_one = !line.is_empty();
        line.pop_if(|last| *last == b'\n');
        line.pop_if(|last| *last == b'\r');
        Ok(is_one)
    }

    pub(crate) fn u8(&mut self) -> Result<u8> {
        self.array::<1>().map(|[byte]| byte)
    }
}

macro_rules! numbers {
    ($($name:ident)*) => {
        impl Bytes {
            $(pub(crate) fn $name(&mut self) -> Result<$name> {
                let bytes = self.array()?;
                Ok(if self.is_big_endian { $name::from_be_bytes(bytes) } else { $name::from_le_bytes(bytes) })
            })*
        }
    };
}
numbers!(u16 u32 u64 i32 i64 f32 f64);

/// The error of a damaged file.
pub(crate) fn damaged(shown: &str, place: u64, problem: impl std::fmt::Display) -> Error {
    Error::new("read", format!("{shown}, byte {place}"), problem)
        .of(ErrorKind::DamagedData)
        .help("copy the file again from where it was recorded")
}

/// A text in UTF-8, or else in Latin-1, without what pads it.
pub(crate) fn text(bytes: &[u8]) -> String {
    let bytes = bytes.split(|byte| *byte == 0).next().unwrap_or_default();
    match std::str::from_utf8(bytes) {
        Ok(text) => text.trim().to_owned(),
        Err(_) => bytes.iter().map(|byte| char::from(*byte)).collect::<String>().trim().to_owned(),
    }
}
