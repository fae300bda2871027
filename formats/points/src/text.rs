//! CSV: separated by comma, semicolon or tab; the last two allow a decimal comma.

use std::{
    fs::File,
    io::{BufRead, BufReader, Read, Seek},
};

use csv::{ByteRecord, ReaderBuilder, Trim};
use runout_core::{Error, ErrorKind, Result, input_file::InputFile};

use crate::{RawColumn, RawTable, failed};

pub(crate) fn read(input: &InputFile) -> Result<RawTable> {
    let shown = input.path().display().to_string();
    let mut file = BufReader::new(input.open()?);
    let delimiter = delimiter(&mut file).map_err(|error| failed(&shown, error))?;
    let mut reader = ReaderBuilder::new().delimiter(delimiter).trim(Trim::All).from_reader(file);
    let header = reader.byte_headers().map_err(|error| failed(&shown, error))?;
    let names: Vec<String> = header.iter().map(|name| String::from_utf8_lossy(name).into_owned()).collect();
    let mut columns = vec![Vec::new(); names.len()];
    let (mut record, mut lines) = (ByteRecord::new(), Vec::new());
    while reader.read_byte_record(&mut record).map_err(|error| failed(&shown, error))? {
        let line = record.position().map_or(0, csv::Position::line);
        for (place, (column, name)) in columns.iter_mut().zip(&names).enumerate() {
            let text = std::str::from_utf8(record.get(place).unwrap_or_default()).map_err(|_| {
                let object = format!("{shown}, line {line}, column {} ({name})", place + 1);
                Error::new("read", object, "it is not UTF-8").of(ErrorKind::DamagedData)
            })?;
            column.push(text.to_owned());
        }
        lines.push(line);
    }
    let columns = columns.into_iter().map(RawColumn::Texts).collect();
    Ok(RawTable { names, columns, rows: lines.len(), lines, decimal_comma: delimiter != b',' })
}

/// The separator of the header, which then stands for the whole file; skips a byte order mark.
fn delimiter(file: &mut BufReader<File>) -> std::io::Result<u8> {
    let mut header = Vec::new();
    // A header is short; a file without line ends is no reason to read it all twice.
    file.by_ref().take(4096).read_until(b'\n', &mut header)?;
    let mark = if header.starts_with("\u{feff}".as_bytes()) { 3 } else { 0 };
    file.seek(std::io::SeekFrom::Start(mark))?;
    Ok(*header.iter().find(|byte| b",;\t".contains(byte)).unwrap_or(&b','))
}
