//! The rows of a file, piece by piece.

use std::{
    num::NonZeroUsize,
    sync::mpsc::{Receiver, SyncSender, sync_channel},
};

use runout_core::{Error, ErrorKind, Result, input_file::InputFile, marker::Marker, rig::Rig};

use crate::{
    header::Header,
    lines::{Lines, Stretch, Stretches, cells},
    number::{Eights, Reading},
    row::{Instant, Role, Row},
};

/// Stretches that each thread has to work on, or has worked on, at most.
const WAITING: usize = 2;

/// A file below its header.
pub(crate) struct Rows {
    pub(crate) format: Format,
    text: Text,
}

/// How rows are written.
pub(crate) struct Format {
    pub(crate) header: Header,
    roles: Vec<Role>,
    processor: Processor,
}

/// Where the rows come from, and what is known from those before.
struct Text {
    stretches: Stretches,
    /// The stretch that comes next, where it is read already.
    next: Option<Stretch>,
    /// `.` or `,`, once a row has shown it.
    decimal: Option<u8>,
    /// The first of the blank lines that the file seems to end with.
    blank: Option<u64>,
}

/// A stretch of the file and its rows.
#[derive(Default)]
pub(crate) struct Piece {
    stretch: Stretch,
    /// Whether more than phases and times are wanted.
    with_readings: bool,
    decimal: Option<u8>,
    /// Phase and time of each row.
    pub(crate) instants: Vec<Instant>,
    /// Readings, `[row][channel]`; `None` where they were not wanted.
    pub(crate) samples: Option<Vec<f64>>,
    /// The first of the blank lines that it ends with.
    blank: Option<u64>,
    /// Why its rows end before it does.
    error: Option<Error>,
}

impl Piece {
    /// Number of the line that holds a row: nothing is between rows.
    pub(crate) fn line(&self, row: usize) -> u64 {
        self.stretch.lines_before() + 1 + row as u64
    }

    /// The mark, 0 or 1 or its trace, or the encoder's angle in degrees, of each row.
    pub(crate) fn phases(&self) -> impl Iterator<Item = f64> {
        self.instants.iter().map(|instant| instant.phase)
    }
}

impl Rows {
    /// Opens a file and reads its header.
    pub(crate) fn open(input: &InputFile, rig: &Rig, marker: Option<&Marker>) -> Result<Self> {
        let (header, next, stretches) = Header::open(input, rig, marker)?;
        let roles = Role::of_columns(&header, rig);
        // Where the comma delimits, it cannot be in a number.
        let decimal = (header.delimiter == b',').then_some(b'.');
        let format = Format { header, roles, processor: Processor::here() };
        Ok(Self { format, text: Text { stretches, next: Some(next), decimal, blank: None } })
    }

    /// The next rows in place of others; false at the end.
    pub(crate) fn next(&mut self, piece: &mut Piece) -> Result<bool> {
        piece.with_readings = true;
        let more = self.text.read(piece)?;
        if more {
            self.format.parse(piece);
            self.text.accept(&self.format.header, piece)?;
            piece.error.take().map_or(Ok(()), Err)?;
        }
        Ok(more)
    }

    /// Takes all rows, in order, as so many threads read them: with their readings as long as `wanted` says so of the number
    /// of lines.
    pub(crate) fn each(
        self,
        threads: NonZeroUsize,
        wanted: impl Fn(u64) -> bool,
        mut take: impl FnMut(&Header, &mut Piece) -> Result<()>,
    ) -> Result<()> {
        let Self { format, mut text } = self;
        let read = |text: &mut Text, piece: &mut Piece| {
            let more = text.read(piece)?;
            piece.with_readings = wanted(piece.stretch.lines_so_far());
            Ok(more)
        };
        let mut accept = |text: &mut Text, piece: &mut Piece| {
            text.accept(&format.header, piece)?;
            take(&format.header, piece)?;
            piece.error.take().map_or(Ok(()), Err)
        };
        let mut spare = vec![Piece::default()];
        let threads = threads.get();
        // The first rows decide how the others are to be read.
        while threads == 1 || text.decimal.is_none() {
            let piece = &mut spare[0];
            if !read(&mut text, piece)? {
                return Ok(());
            }
            format.parse(piece);
            accept(&mut text, piece)?;
        }
        let stopped =
            || Error::new("read", &format.header.shown, "a thread that read it stopped").of(ErrorKind::Interrupted);
        std::thread::scope(|scope| {
            let parse = |_| {
                let (sender, pieces) = sync_channel::<Piece>(WAITING);
                let (done, parsed) = sync_channel(WAITING);
                let format = &format;
                scope.spawn(move || {
                    for mut piece in pieces {
                        format.parse(&mut piece);
                        // Nobody takes it behind an error.
                        let _ = done.send(piece);
                    }
                });
                (sender, parsed)
            };
            let parsers: Vec<(SyncSender<Piece>, Receiver<Piece>)> = (0..threads).map(parse).collect();
            let (mut given, mut taken) = (0, 0);
            // What stops the reading is reported behind what was read before.
            let mut end = None;
            loop {
                while end.is_none() && given < taken + WAITING * threads {
                    let mut piece = spare.pop().unwrap_or_default();
                    match read(&mut text, &mut piece) {
                        Ok(true) => {
                            parsers[given % threads].0.send(piece).map_err(|_| stopped())?;
                            given += 1;
                        }
                        Ok(false) => end = Some(Ok(())),
                        Err(error) => end = Some(Err(error)),
                    }
                }
                if taken == given {
                    return end.unwrap_or(Ok(()));
                }
                let mut piece = parsers[taken % threads].1.recv().map_err(|_| stopped())?;
                taken += 1;
                accept(&mut text, &mut piece)?;
                spare.push(piece);
            }
        })
    }
}

impl Text {
    /// Reads the next piece; false at the end.
    fn read(&mut self, piece: &mut Piece) -> Result<bool> {
        piece.decimal = self.decimal;
        match self.next.take() {
            Some(next) => {
                piece.stretch = next;
                Ok(true)
            }
            None => self.stretches.next(&mut piece.stretch),
        }
    }

    /// Takes note of what a piece shows, once those before it are taken.
    fn accept(&mut self, header: &Header, piece: &Piece) -> Result<()> {
        let goes_on = !piece.instants.is_empty() || piece.error.is_some();
        if let Some(number) = self.blank.filter(|_| goes_on) {
            return Err(blank_between(header, number));
        }
        self.blank = self.blank.or(piece.blank);
        self.decimal = piece.decimal;
        Ok(())
    }
}

impl Format {
    /// Reads a piece's rows.
    fn parse(&self, piece: &mut Piece) {
        let Piece { stretch, with_readings, decimal, instants, samples, blank, error } = piece;
        let channels = self.header.sensors.len();
        let mut readings = samples.take().filter(|_| *with_readings).unwrap_or_default();
        if *with_readings {
            readings.resize(stretch.most_lines() * channels, 0.0);
        }
        instants.clear();
        instants.reserve(stretch.most_lines());
        (*blank, *error) = (None, None);
        let mut lines = stretch.lines();
        loop {
            if let (true, None, Some(decimal)) = (*with_readings, &blank, *decimal) {
                let row = Row { header: &self.header, roles: &self.roles, decimal };
                let (before, rest) = (instants.len(), &mut readings[instants.len() * channels..]);
                let length = self.processor.plain(PlainRows { row, text: lines.ahead(), readings: rest, instants });
                lines.pass(length, instants.len() - before);
            }
            let frame = readings.chunks_exact_mut(channels.max(1)).nth(instants.len());
            match self.row(&mut lines, frame, decimal, blank) {
                Ok(Some(instant)) => instants.push(instant),
                Ok(None) => break,
                Err(found) => {
                    *error = Some(found);
                    break;
                }
            }
        }
        readings.truncate(instants.len() * channels);
        *samples = with_readings.then_some(readings);
    }

    /// The next row that is not blank, its readings into a frame where there is one; only blank lines may follow one that is.
    fn row(
        &self,
        lines: &mut Lines,
        frame: Option<&mut [f64]>,
        decimal: &mut Option<u8>,
        blank: &mut Option<u64>,
    ) -> Result<Option<Instant>> {
        while let Some(line) = lines.next() {
            if line.is_blank() {
                blank.get_or_insert(line.number);
                continue;
            }
            if let Some(number) = *blank {
                return Err(blank_between(&self.header, number));
            }
            *decimal = decimal.or_else(|| decimal_of(&self.roles, line.bytes, self.header.delimiter));
            let row = Row { header: &self.header, roles: &self.roles, decimal: decimal.unwrap_or(b'.') };
            return match frame {
                Some(frame) => row.cell_by_cell(line, frame),
                None => row.instant(line),
            }
            .map(Some);
        }
        Ok(None)
    }
}

fn blank_between(header: &Header, number: u64) -> Error {
    header.line_error(number, "expected a row, found a blank line between rows")
}

/// What this processor can do.
#[derive(Clone, Copy)]
struct Processor {
    /// With AVX2.
    #[cfg(target_arch = "x86_64")]
    wide: Option<pulp::x86::V3>,
}

impl Processor {
    fn here() -> Self {
        Self {
            #[cfg(target_arch = "x86_64")]
            wide: pulp::x86::V3::try_new(),
        }
    }

    /// Reads plain rows, as far as they go on without another one; gives their length.
    fn plain(self, rows: PlainRows) -> usize {
        #[cfg(target_arch = "x86_64")]
        if let Some(wide) = self.wide {
            return wide.vectorize(Wide(wide, rows));
        }
        rows.read(Eights)
    }
}

/// Rows of plain numbers that are to be read one after the other.
struct PlainRows<'a> {
    row: Row<'a>,
    text: &'a [u8],
    /// `[row][channel]`, room for them.
    readings: &'a mut [f64],
    instants: &'a mut Vec<Instant>,
}

impl PlainRows<'_> {
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "what is not inlined leaves wide registers")]
    fn read(self, reading: impl Reading) -> usize {
        let Self { row, text, readings, instants } = self;
        let mut read = 0;
        for frame in readings.chunks_exact_mut(row.header.sensors.len().max(1)) {
            let Some((instant, length)) = row.plain(reading, &text[read..], frame) else { break };
            instants.push(instant);
            read += length;
        }
        read
    }
}

/// Reads plain rows in wide registers. (A closure would not be inlined.)
#[cfg(target_arch = "x86_64")]
struct Wide<'a>(pulp::x86::V3, PlainRows<'a>);

#[cfg(target_arch = "x86_64")]
impl pulp::NullaryFnOnce for Wide<'_> {
    type Output = usize;

    #[inline(always)]
    #[allow(clippy::inline_always, reason = "what is not inlined leaves wide registers")]
    fn call(self) -> usize {
        self.1.read(self.0)
    }
}

/// The decimal mark of a line's numbers, where one has it; other columns may hold dates and sentences.
fn decimal_of(roles: &[Role], line: &[u8], delimiter: u8) -> Option<u8> {
    let mut numbers =
        cells(line, delimiter).zip(roles).filter(|(_, role)| !matches!(role, Role::Skip)).map(|(cell, _)| cell);
    let mark = |cell: &[u8]| memchr::memchr2(b',', b'.', cell).map(|place| cell[place]);
    numbers.find_map(mark)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_decimal_mark_is_that_of_the_numbers() {
        let roles = [Role::Skip, Role::Phase, Role::Sensor { channel: 0, sign: 1.0 }, Role::Skip];
        for (line, mark) in [
            ("01.02.2024 12:00:00;0;5,58606;3.5", Some(b',')),
            ("12:00:00,123;0;5.58606;a, b", Some(b'.')),
            ("12:00:00,123;0;5;\"a; b.\"", None),
            ("\"1.5;2\";0;-0,25;", Some(b',')),
        ] {
            assert_eq!(decimal_of(&roles, line.as_bytes(), b';'), mark, "{line}");
        }
    }
}
