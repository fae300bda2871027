//! A text file in stretches of whole lines, and their lines and cells.

use std::io::{Cursor, Read};

use flate2::read::MultiGzDecoder;

use runout_core::{Error, ErrorKind, Result, input_file::InputFile};

/// Text that is read at a time: what it holds, as numbers, stays in a core's own cache.
const STRETCH: usize = 1 << 18;
/// No row of readings is longer; a file without line ends is no table.
const LONGEST_LINE: usize = 1 << 20;
/// What a file packed by gzip begins with (RFC 1952).
const GZIP: [u8; 2] = [0x1F, 0x8B];

/// Reads a file stretch by stretch.
pub(crate) struct Stretches {
    text: Box<dyn Read + Send>,
    shown: String,
    /// The beginning of a line whose end is still to be read.
    rest: Vec<u8>,
    /// Lines handed on.
    lines: u64,
}

/// Lines of a file, whole ones.
#[derive(Debug, Default)]
pub(crate) struct Stretch {
    buffer: Vec<u8>,
    /// What of the buffer it is.
    start: usize,
    end: usize,
    /// Number of the line before it.
    lines_before: u64,
    /// Line ends in it.
    ends: usize,
}

impl Stretches {
    pub(crate) fn open(input: &InputFile) -> Result<Self> {
        let shown = input.path().display().to_string();
        let mut file = input.open()?;
        let open = || {
            let mut first = Vec::new();
            Read::by_ref(&mut file).take(GZIP.len() as u64).read_to_end(&mut first)?;
            let is_packed = first == GZIP;
            let whole = Cursor::new(first).chain(file);
            Ok(if is_packed { Box::new(MultiGzDecoder::new(whole)) as Box<dyn Read + Send> } else { Box::new(whole) })
        };
        let text = open().map_err(|error: std::io::Error| Error::caused("open", &shown, error))?;
        Ok(Self { text, shown, rest: Vec::new(), lines: 0 })
    }

    /// Reads the next stretch in place of another one; false at the end.
    pub(crate) fn next(&mut self, stretch: &mut Stretch) -> Result<bool> {
        let Stretch { buffer, start, end, .. } = stretch;
        buffer.resize(buffer.len().max(self.rest.len() + STRETCH), 0);
        buffer[..self.rest.len()].copy_from_slice(&self.rest);
        (*start, *end) = (0, self.rest.len());
        self.rest.clear();
        loop {
            if *end == buffer.len() {
                buffer.resize(2 * *end, 0);
            }
            let count = self.read(&mut buffer[*end..])?;
            let searched = *end;
            *end += count;
            if let Some(place) = memchr::memrchr(b'\n', &buffer[searched..*end]) {
                let whole = searched + place + 1;
                self.rest.extend_from_slice(&buffer[whole..*end]);
                *end = whole;
                break;
            }
            if count == 0 {
                break;
            }
            if *end > LONGEST_LINE {
                let object = format!("{}, line {}", self.shown, self.lines + 1);
                return Err(Error::new("read", object, format!("expected a line end within {LONGEST_LINE} bytes"))
                    .of(ErrorKind::DamagedData));
            }
        }
        if self.lines == 0 {
            let begin = &buffer[..*end];
            if begin.starts_with(&[0xFF, 0xFE]) || begin.starts_with(&[0xFE, 0xFF]) {
                let error = Error::new("read", &self.shown, "expected text in UTF-8 or Latin-1, found UTF-16");
                return Err(error.of(ErrorKind::DamagedData).help("save it as UTF-8"));
            }
            if begin.starts_with(b"PK\x03\x04") {
                let error = Error::new("read", &self.shown, "expected text, found a ZIP archive or a workbook");
                return Err(error.of(ErrorKind::DamagedData).help("unpack it, or save the sheet as CSV"));
            }
            if begin.starts_with(&[0xEF, 0xBB, 0xBF]) {
                *start = 3;
            }
        }
        stretch.lines_before = self.lines;
        stretch.ends = memchr::memchr_iter(b'\n', &stretch.buffer[stretch.start..stretch.end]).count();
        self.lines += stretch.ends as u64;
        Ok(stretch.start < stretch.end)
    }

    fn read(&mut self, into: &mut [u8]) -> Result<usize> {
        loop {
            match self.text.read(into) {
                Ok(count) => return Ok(count),
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(error) => {
                    // So the decompressor reports a damaged stream.
                    let damaged = error.kind() == std::io::ErrorKind::InvalidInput;
                    let error = Error::caused("read", &self.shown, error);
                    return Err(if damaged { error.of(ErrorKind::DamagedData) } else { error });
                }
            }
        }
    }
}

impl Stretch {
    /// Its lines.
    pub(crate) fn lines(&self) -> Lines<'_> {
        Lines { text: &self.buffer[self.start..self.end], number: self.lines_before }
    }

    /// Number of the line before it.
    pub(crate) fn lines_before(&self) -> u64 {
        self.lines_before
    }

    /// Lines to its end, counted from the beginning of the file.
    pub(crate) fn lines_so_far(&self) -> u64 {
        self.lines_before + self.most_lines() as u64
    }

    /// How many lines it has, or one more: the last one of a file may lack its end.
    pub(crate) fn most_lines(&self) -> usize {
        self.ends + 1
    }

    /// Leaves out what was read of its lines.
    pub(crate) fn pass(&mut self, length: usize, lines: u64) {
        self.start += length;
        self.ends = self.ends.saturating_sub((lines - self.lines_before) as usize);
        self.lines_before = lines;
    }
}

/// Lines without their ends.
pub(crate) struct Lines<'a> {
    text: &'a [u8],
    number: u64,
}

/// A line, and its number from 1.
#[derive(Clone, Copy)]
pub(crate) struct Line<'a> {
    pub(crate) number: u64,
    pub(crate) bytes: &'a [u8],
}

impl Line<'_> {
    pub(crate) fn is_blank(&self) -> bool {
        self.bytes.iter().all(u8::is_ascii_whitespace)
    }
}

impl<'a> Lines<'a> {
    /// The next line; `None` at the end.
    pub(crate) fn next(&mut self) -> Option<Line<'a>> {
        if self.text.is_empty() {
            return None;
        }
        let (bytes, rest) = match memchr::memchr(b'\n', self.text) {
            Some(end) => (&self.text[..end], &self.text[end + 1..]),
            None => (self.text, &[][..]),
        };
        self.text = rest;
        self.number += 1;
        Some(Line { number: self.number, bytes: bytes.strip_suffix(b"\r").unwrap_or(bytes) })
    }

    /// The text of the lines to come.
    pub(crate) fn ahead(&self) -> &'a [u8] {
        self.text
    }

    /// Passes over so many lines of so many bytes, their ends included.
    pub(crate) fn pass(&mut self, length: usize, lines: usize) {
        self.text = &self.text[length..];
        self.number += lines as u64;
    }

    /// The number of the line that was handed on last.
    pub(crate) fn number(&self) -> u64 {
        self.number
    }
}

/// The cells of a line, without quotes and surrounding blanks.
pub(crate) fn cells(line: &[u8], delimiter: u8) -> impl Iterator<Item = &[u8]> {
    let mut rest = Some(line);
    std::iter::from_fn(move || {
        let (cell, after) = split(rest?, delimiter);
        rest = after;
        Some(cell)
    })
}

/// The first cell, and what follows its delimiter, where there is one.
pub(crate) fn split(line: &[u8], delimiter: u8) -> (&[u8], Option<&[u8]>) {
    // A tab may be the delimiter.
    let behind_blanks = |bytes: &[u8]| bytes.iter().take_while(|byte| **byte == b' ').count();
    let quoted = line[behind_blanks(line)..].strip_prefix(b"\"").and_then(|inner| {
        let (cell, after) = inner.split_at(memchr::memchr(b'"', inner)?);
        let end = 1 + behind_blanks(&after[1..]);
        match after.get(end) {
            None => Some((cell, None)),
            Some(next) if *next == delimiter => Some((cell, Some(&after[end + 1..]))),
            Some(_) => None,
        }
    });
    let (cell, rest) = quoted.unwrap_or_else(|| match memchr::memchr(delimiter, line) {
        Some(end) => (&line[..end], Some(&line[end + 1..])),
        None => (line, None),
    });
    (cell.trim_ascii(), rest)
}

/// A column's cell, and what follows its delimiter, from what is left of a line (the column that this begins with, and it);
/// the number of cells where there are too few.
pub(crate) fn cell_at(
    (first, rest): (usize, Option<&[u8]>),
    delimiter: u8,
    column: usize,
) -> std::result::Result<(&[u8], Option<&[u8]>), usize> {
    let mut rest = rest.ok_or(first)?;
    if memchr::memchr(b'"', rest).is_none() && column > first {
        let before = memchr::memchr_iter(delimiter, rest).nth(column - first - 1);
        let before = before.ok_or_else(|| first + memchr::memchr_iter(delimiter, rest).count() + 1)?;
        return Ok(split(&rest[before + 1..], delimiter));
    }
    for passed in first..column {
        rest = split(rest, delimiter).1.ok_or(passed + 1)?;
    }
    Ok(split(rest, delimiter))
}
