//! LVM of LabVIEW: a header of the file, and before each segment one of its channels (National Instruments, Specification for the
//! LabVIEW Measurement File).

use runout_core::Result;

use super::{
    LONGEST_LINE,
    cells::{Dialect, cells, number},
    table::{Header, Line, Table, head},
};
use crate::bytes::{Bytes, text};

/// The line behind a header.
const END: &[u8] = b"***End_of_Header***";
/// Lines of a header.
const LONGEST_HEADER: usize = 200;
/// Rows in which a segment shows what its columns hold.
const SHOWN: usize = 30;
/// Segments of a file.
const MOST: usize = 4096;

pub(super) fn is_lvm(bytes: &mut Bytes) -> Result<bool> {
    bytes.seek(0)?;
    Ok(bytes.line(LONGEST_LINE)?.is_some_and(|line| is_beginning(&line)))
}

pub(super) fn is_beginning(line: &[u8]) -> bool {
    line.starts_with(b"LabVIEW Measurement")
}

/// Whether a line is the first of another segment.
fn is_next(line: &[u8]) -> bool {
    is_beginning(line) || line.starts_with(b"Channels\t") || line.starts_with(b"Channels,")
}

/// Entries of a header: a name and a value for each channel.
struct Entries(Vec<(String, Vec<String>)>);

impl Entries {
    /// The lines to the end of a header.
    fn read(bytes: &mut Bytes, delimiter: Option<u8>) -> Result<Self> {
        let mut entries = Vec::new();
        for _ in 0..LONGEST_HEADER {
            let Some(line) = bytes.line(LONGEST_LINE)? else { break };
            if line.starts_with(END) {
                return Ok(Self(entries));
            }
            let delimiter = delimiter.unwrap_or(if line.contains(&b'\t') { b'\t' } else { b',' });
            let mut cells = cells(&line, delimiter).into_iter().map(text);
            if let Some(name) = cells.next().filter(|name| !name.is_empty()) {
                entries.push((name, cells.collect()));
            }
        }
        Err(bytes.damaged("expected `***End_of_Header***`, found none"))
    }

    fn values(&self, name: &str) -> &[String] {
        self.0.iter().find(|(known, _)| known == name).map_or(&[], |(_, values)| values)
    }

    fn value(&self, name: &str) -> &str {
        self.values(name).first().map_or("", |value| value)
    }
}

/// The segments of a file.
pub(super) fn tables(bytes: &mut Bytes) -> Result<Vec<Table>> {
    bytes.seek(0)?;
    let mut file = Entries(Vec::new());
    let mut found = Vec::new();
    while found.len() < MOST {
        let place = bytes.place();
        let Some(line) = bytes.line(LONGEST_LINE)? else { break };
        if is_beginning(&line) {
            file = Entries::read(bytes, None)?;
        } else if is_next(&line) {
            bytes.seek(place)?;
            found.push(segment(bytes, &file)?);
        }
    }
    // A file without headers of its channels is one table.
    if found.is_empty() {
        return Ok(vec![Table::found(bytes)?]);
    }
    Ok(found)
}

fn segment(bytes: &mut Bytes, file: &Entries) -> Result<Table> {
    let delimiter = if file.value("Separator") == "Comma" { b',' } else { b'\t' };
    let entries = Entries::read(bytes, Some(delimiter))?;
    let names = bytes.line(LONGEST_LINE)?.unwrap_or_default();
    let names: Vec<String> = cells(&names, delimiter).into_iter().map(text).collect();
    let begin = bytes.place();
    // The rows end where another segment begins.
    let shown: Vec<Line> = head(bytes, SHOWN)?.into_iter().take_while(|line| !is_next(&line.text)).collect();
    // What is stated is that of the machine, which its numbers need not have.
    let held = |decimal: u8| {
        let of_line = |line: &Line| {
            cells(&line.text, delimiter)
                .iter()
                .filter(|cell| !cell.is_empty() && number(cell, decimal).is_some())
                .count()
        };
        shown.iter().map(of_line).sum::<usize>()
    };
    let stated = if file.value("Decimal_Separator") == "," { [b',', b'.'] } else { [b'.', b','] };
    let decimal = if held(stated[0]) >= held(stated[1]) { stated[0] } else { stated[1] };
    let dialect = Dialect { delimiter, decimal };
    let end = end_of(bytes, begin)?;
    let mut header = Header { names, ..Header::default() };
    let is_x = |name: &String| name.starts_with("X_Value");
    // Without columns of X, the first one is empty.
    let has_many_x = header.names.iter().filter(|name| is_x(name)).count() > 1;
    // Entries are above their columns.
    let units = entries.values("Y_Unit_Label");
    header.units =
        (0..header.names.len()).map(|column| units.get(column.wrapping_sub(1)).cloned().unwrap_or_default()).collect();
    let is_time = entries.value("X_Dimension").is_empty() || entries.value("X_Dimension") == "Time";
    for (column, name) in header.names.iter().enumerate() {
        if is_x(name) {
            header.units[column] = if is_time { "s".into() } else { String::new() };
        }
    }
    let mut table = Table::of(bytes, &shown, 0, dialect, &header, |bytes, line| {
        bytes.place() > end || line.trim_ascii().is_empty()
    })?;
    for (column, channel) in &mut table.channels {
        let value = |name: &str| {
            let values = entries.values(name);
            let value = values.get(column.wrapping_sub(1)).or(values.first())?;
            number(value.as_bytes(), decimal).filter(|value| value.is_finite())
        };
        // Times of the rows have more digits than the step; of several columns of X each is that of one channel.
        if has_many_x || channel.rate_hz.is_none() {
            channel.rate_hz = value("Delta_X").filter(|step| *step > 0.0 && is_time).map(f64::recip);
            channel.start_s = value("X0");
        }
    }
    bytes.seek(end)?;
    Ok(table)
}

/// Where the segment that begins here ends.
fn end_of(bytes: &mut Bytes, begin: u64) -> Result<u64> {
    bytes.seek(begin)?;
    loop {
        let place = bytes.place();
        match bytes.line(LONGEST_LINE)? {
            Some(line) if !is_next(&line) => {}
            _ => return Ok(place),
        }
    }
}
