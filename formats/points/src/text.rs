//! Text: separated by comma, semicolon, tab or blanks; all but the first allow a decimal comma. The first line names the columns, unless the
//! configuration does.

use std::{
    fs::File,
    io::{BufRead, BufReader, Read, Seek},
};

use csv::{ByteRecord, ReaderBuilder, Trim};
use runout_core::{Error, ErrorKind, Result, input_file::InputFile};

use crate::{RawColumn, RawTable, failed};

/// What separates columns.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Separator {
    Byte(u8),
    Blanks,
}

pub(crate) fn read(input: &InputFile, given: Option<&[String]>) -> Result<RawTable> {
    let shown = input.path().display().to_string();
    let mut file = BufReader::new(input.open()?);
    let (separator, first) = separator(&mut file).map_err(|error| failed(&shown, error))?;
    let is_number = |word: &str| word.trim().replace(',', ".").parse::<f64>().is_ok();
    if given.is_none() && !first.is_empty() && first.iter().all(|word| is_number(word)) {
        let problem = format!("its first line has {} numbers and no names of columns", first.len());
        return Err(Error::new("read", format!("{shown}, line 1"), problem)
            .help("`names = [\"x_mm\", …]` in [load] names them in their order"));
    }
    let mut rows = Rows { columns: Vec::new(), lines: Vec::new(), names: Vec::new(), shown: &shown };
    rows.name(given.map_or(first, <[String]>::to_vec));
    match separator {
        Separator::Byte(delimiter) => {
            let mut reader = ReaderBuilder::new()
                .delimiter(delimiter)
                .trim(Trim::All)
                .has_headers(given.is_none())
                .from_reader(file);
            if given.is_none() {
                let header = reader.byte_headers().map_err(|error| failed(&shown, error))?;
                rows.name(header.iter().map(|name| String::from_utf8_lossy(name).into_owned()).collect());
            }
            let mut record = ByteRecord::new();
            while reader.read_byte_record(&mut record).map_err(|error| failed(&shown, error))? {
                let line = record.position().map_or(0, csv::Position::line);
                rows.add(line, record.iter())?;
            }
        }
        Separator::Blanks => {
            let mut bytes = Vec::new();
            for line in 1.. {
                bytes.clear();
                if file.read_until(b'\n', &mut bytes).map_err(|error| failed(&shown, error))? == 0 {
                    break;
                }
                let words = bytes.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
                if (line > 1 || given.is_some()) && words.clone().next().is_some() {
                    rows.add(line, words)?;
                }
            }
        }
    }
    let Rows { columns, lines, names, .. } = rows;
    let columns = columns.into_iter().map(RawColumn::Texts).collect();
    Ok(RawTable { names, columns, rows: lines.len(), lines, decimal_comma: separator != Separator::Byte(b',') })
}

/// Rows as they come.
struct Rows<'a> {
    names: Vec<String>,
    columns: Vec<Vec<String>>,
    lines: Vec<u64>,
    shown: &'a str,
}

impl Rows<'_> {
    /// Names the columns.
    fn name(&mut self, names: Vec<String>) {
        self.columns = vec![Vec::new(); names.len()];
        self.names = names;
    }

    fn add<'b>(&mut self, line: u64, cells: impl Iterator<Item = &'b [u8]>) -> Result<()> {
        let refuse = |object: String, problem: String| Error::new("read", object, problem).of(ErrorKind::DamagedData);
        let mut found = 0;
        for (place, cell) in cells.enumerate() {
            found = place + 1;
            let (Some(column), Some(name)) = (self.columns.get_mut(place), self.names.get(place)) else { continue };
            let text = std::str::from_utf8(cell).map_err(|_| {
                refuse(format!("{}, line {line}, column {found} ({name})", self.shown), "it is not UTF-8".into())
            })?;
            column.push(text.to_owned());
        }
        if found != self.names.len() {
            let problem = format!("it has {found} columns; expected {} ({})", self.names.len(), self.names.join(", "));
            return Err(refuse(format!("{}, line {line}", self.shown), problem));
        }
        self.lines.push(line);
        Ok(())
    }
}

/// The separator of the first line, which then stands for the whole file, and the words of that line; skips a byte order mark.
fn separator(file: &mut BufReader<File>) -> std::io::Result<(Separator, Vec<String>)> {
    let mut header = Vec::new();
    // A header is short; a file without line ends is no reason to read it all twice.
    file.by_ref().take(4096).read_until(b'\n', &mut header)?;
    let mark = if header.starts_with("\u{feff}".as_bytes()) { 3 } else { 0 };
    file.seek(std::io::SeekFrom::Start(mark))?;
    let line = String::from_utf8_lossy(&header[mark as usize..]).trim().to_owned();
    if let Some(byte) = line.bytes().find(|byte| b",;\t".contains(byte)) {
        let mut reader =
            ReaderBuilder::new().delimiter(byte).trim(Trim::All).has_headers(false).from_reader(line.as_bytes());
        let mut record = csv::StringRecord::new();
        let _ = reader.read_record(&mut record);
        return Ok((Separator::Byte(byte), record.iter().map(str::to_owned).collect()));
    }
    let mut words: Vec<String> = Vec::new();
    for word in line.split_whitespace() {
        match words.last_mut() {
            // `dx [µm]` is one name.
            Some(last) if word.starts_with(['[', '(']) => *last = format!("{last} {word}"),
            _ => words.push(word.to_owned()),
        }
    }
    let separator = if words.len() > 1 { Separator::Blanks } else { Separator::Byte(b',') };
    Ok((separator, words))
}
