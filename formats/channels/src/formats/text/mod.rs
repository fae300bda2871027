//! Text: tables with a preamble, a row of names and one of units, as loggers and scopes export them, and LVM of LabVIEW.

mod cells;
mod lvm;
mod rows;
mod table;

use std::io::Read;

use flate2::read::MultiGzDecoder;
use runout_core::{Error, ErrorKind, Result, input_file::InputFile};

use self::{rows::RowSamples, table::Table};
use super::Format;
use crate::{
    bytes::Bytes,
    channel::{Channel, ChannelFile, Samples, checked},
    source::{Source, Unpacking},
};

pub(super) const FORMAT: Format = Format {
    name: "text",
    about: "text: CSV of scopes and loggers, LVM (LabVIEW)",
    recognises: |head| {
        let is_utf16 = head.starts_with(&[0xFF, 0xFE]) || head.starts_with(&[0xFE, 0xFF]);
        let is_character = |byte: &u8| !byte.is_ascii_control() || byte.is_ascii_whitespace();
        let has_digits = head.iter().any(u8::is_ascii_digit) || head.starts_with(GZIP);
        // JSON is no table.
        let is_json = matches!(head.trim_ascii_start().first(), Some(b'{' | b'['));
        head.starts_with(GZIP)
            || lvm::is_beginning(head)
            || is_utf16
            || (has_digits && !is_json && head.iter().all(is_character))
    },
    open: |input| Text::open(input).map(|file| Box::new(file) as Box<dyn ChannelFile>),
};

/// What a file packed by gzip begins with (RFC 1952).
const GZIP: &[u8] = &[0x1F, 0x8B];
/// Longest line.
const LONGEST_LINE: usize = 1 << 16;

struct Text {
    source: Source,
    channels: Vec<Channel>,
    /// Table and column of each channel.
    places: Vec<(usize, usize)>,
    tables: Vec<Table>,
    remarks: Vec<String>,
}

impl Text {
    fn open(input: &InputFile) -> Result<Self> {
        let source = plain(input)?;
        let mut bytes = Bytes::open(&source)?;
        let mut file =
            Self { source, channels: Vec::new(), places: Vec::new(), tables: Vec::new(), remarks: Vec::new() };
        let tables = if lvm::is_lvm(&mut bytes)? { lvm::tables(&mut bytes)? } else { vec![Table::found(&mut bytes)?] };
        let several = tables.len() > 1;
        for (number, mut table) in tables.into_iter().enumerate() {
            let group = if several { format!("Run {number}") } else { String::new() };
            file.remarks.extend(table.remarks.iter().map(|remark| format!("{}: {remark}", input.path().display())));
            for (column, channel) in std::mem::take(&mut table.channels) {
                file.channels.push(Channel { group: group.clone(), samples: table.rows, ..channel });
                file.places.push((number, column));
            }
            file.tables.push(table);
        }
        if file.channels.iter().all(|channel| !channel.kind.is_number()) {
            let error = Error::new("read", input.path().display().to_string(), "expected rows of numbers, found none");
            return Err(error.of(ErrorKind::DamagedData));
        }
        Ok(file)
    }
}

impl ChannelFile for Text {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn read(&self, channels: &[usize]) -> Result<Box<dyn Samples>> {
        checked(&self.source.shown(), &self.channels, channels)?;
        // Each table is read by itself.
        let mut readers: Vec<(usize, Vec<usize>, Vec<usize>)> = Vec::new();
        for (number, channel) in channels.iter().enumerate() {
            let (table, column) = self.places[*channel];
            match readers.iter_mut().find(|(known, ..)| *known == table) {
                Some((_, columns, numbers)) => {
                    columns.push(column);
                    numbers.push(number);
                }
                None => readers.push((table, vec![column], vec![number])),
            }
        }
        let open = |(table, columns, numbers): (usize, Vec<usize>, Vec<usize>)| {
            Ok((RowSamples::open(&self.source, &self.tables[table], &columns)?, numbers))
        };
        Ok(Box::new(TableSamples(readers.into_iter().map(open).collect::<Result<_>>()?)))
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }
}

/// Readers of tables, and which of the wanted columns each fills.
struct TableSamples(Vec<(RowSamples, Vec<usize>)>);

impl Samples for TableSamples {
    fn next(&mut self, most: usize, columns: &mut [Vec<f64>]) -> Result<usize> {
        let mut longest = 0;
        for (rows, numbers) in &mut self.0 {
            longest = longest.max(rows.next(most, numbers, columns)?);
        }
        Ok(longest)
    }
}

/// The file itself, or as text of 8 bits where it is packed or of 16 bits.
fn plain(input: &InputFile) -> Result<Source> {
    let shown = input.path().display().to_string();
    let mut file = input.open()?;
    let mut head = Vec::new();
    Read::by_ref(&mut file).take(4).read_to_end(&mut head).map_err(|error| Error::caused("read", &shown, error))?;
    let whole = std::io::Cursor::new(head.clone()).chain(file);
    if head.starts_with(GZIP) {
        let mut unpacking = Unpacking::of(&shown)?;
        unpacking.append(&mut MultiGzDecoder::new(whole))?;
        return unpacking.finish();
    }
    let is_big_endian = head.starts_with(&[0xFE, 0xFF]);
    if !is_big_endian && !head.starts_with(&[0xFF, 0xFE]) {
        return Ok(input.into());
    }
    let mut unpacking = Unpacking::of(&shown)?;
    unpacking.append(&mut Utf16 { units: whole, is_big_endian, high: None, characters: Vec::new(), used: 0 })?;
    unpacking.finish()
}

/// Text of 16 bits as UTF-8.
struct Utf16<R> {
    units: R,
    is_big_endian: bool,
    /// The first half of a character of two.
    high: Option<u16>,
    characters: Vec<u8>,
    used: usize,
}

impl<R: Read> Read for Utf16<R> {
    fn read(&mut self, to: &mut [u8]) -> std::io::Result<usize> {
        while self.used == self.characters.len() {
            let mut units = Vec::new();
            Read::by_ref(&mut self.units).take(1 << 14).read_to_end(&mut units)?;
            if units.is_empty() {
                return Ok(0);
            }
            let of =
                |pair: &[u8; 2]| if self.is_big_endian { u16::from_be_bytes(*pair) } else { u16::from_le_bytes(*pair) };
            let mut all: Vec<u16> =
                self.high.take().into_iter().chain(units.as_chunks::<2>().0.iter().map(of)).collect();
            self.high = all.pop_if(|last| (0xD800..0xDC00).contains(last) && units.len() == 1 << 14);
            let text: String =
                char::decode_utf16(all).map(|unit| unit.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
            self.characters = text.into_bytes();
            self.used = 0;
        }
        let count = to.len().min(self.characters.len() - self.used);
        to[..count].copy_from_slice(&self.characters[self.used..self.used + count]);
        self.used += count;
        Ok(count)
    }
}
