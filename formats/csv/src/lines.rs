//! A text file, line after line, in a buffer of its own.

use std::{fs::File, io::Read, path::Path};

use runout_core::{Error, Result};

const BUFFER: usize = 1 << 18;
/// No row of readings is longer; a file without line ends is no table.
const LONGEST_LINE: usize = 1 << 20;

/// Reads lines without their ends.
pub(crate) struct Lines {
    file: File,
    shown: String,
    buffer: Vec<u8>,
    /// What is in the buffer and not yet handed on.
    start: usize,
    end: usize,
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

impl Lines {
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let shown = path.display().to_string();
        let file = File::open(path).map_err(|error| Error::new("open", &shown, error))?;
        let mut lines = Self { file, shown, buffer: vec![0; BUFFER], start: 0, end: 0, number: 0 };
        lines.fill()?;
        let begin = &lines.buffer[..lines.end];
        if begin.starts_with(&[0xFF, 0xFE]) || begin.starts_with(&[0xFE, 0xFF]) {
            let error = Error::new("read", &lines.shown, "expected text in UTF-8 or Latin-1, found UTF-16");
            return Err(error.help("save it as UTF-8"));
        }
        if begin.starts_with(&[0xEF, 0xBB, 0xBF]) {
            lines.start = 3;
        }
        Ok(lines)
    }

    /// The next line; `None` at the end.
    pub(crate) fn next(&mut self) -> Result<Option<Line<'_>>> {
        let mut searched = 0;
        let (length, ended) = loop {
            let waiting = &self.buffer[self.start..self.end];
            if let Some(place) = memchr::memchr(b'\n', &waiting[searched..]) {
                break (searched + place, 1);
            }
            searched = waiting.len();
            if searched > LONGEST_LINE {
                let object = format!("{}, line {}", self.shown, self.number + 1);
                return Err(Error::new("read", object, format!("expected a line end within {LONGEST_LINE} bytes")));
            }
            if self.fill()? == 0 {
                if searched == 0 {
                    return Ok(None);
                }
                break (searched, 0);
            }
        };
        let line = &self.buffer[self.start..self.start + length];
        self.start += length + ended;
        self.number += 1;
        Ok(Some(Line { number: self.number, bytes: line.strip_suffix(b"\r").unwrap_or(line) }))
    }

    /// What is in memory of the lines to come: often many of them, but it may end within one.
    #[inline]
    pub(crate) fn ahead(&self) -> &[u8] {
        &self.buffer[self.start..self.end]
    }

    /// Passes over a line of so many bytes, its end included.
    #[inline]
    pub(crate) fn pass(&mut self, length: usize) {
        self.start += length;
        self.number += 1;
    }

    /// The number of the line that was handed on last.
    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// Reads more, behind what is waiting; gives the number of bytes.
    fn fill(&mut self) -> Result<usize> {
        self.buffer.copy_within(self.start..self.end, 0);
        self.end -= self.start;
        self.start = 0;
        if self.end == self.buffer.len() {
            self.buffer.resize(2 * self.end, 0);
        }
        loop {
            match self.file.read(&mut self.buffer[self.end..]) {
                Ok(count) => {
                    self.end += count;
                    return Ok(count);
                }
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(error) => return Err(Error::new("read", &self.shown, error)),
            }
        }
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
