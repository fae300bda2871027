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
    let marks: [&[u8]; 2] = [&[0xFF, 0xFE], &[0xFE, 0xFF]];
    if marks.iter().any(|mark| file.fill_buf().is_ok_and(|bytes| bytes.starts_with(mark))) {
        return Err(Error::new("read", shown, "its text is UTF-16")
            .of(ErrorKind::UnsuitableData)
            .help("save it as UTF-8"));
    }
    let Start { separator, words: first, comment, skipped } =
        Start::of(&mut file).map_err(|error| failed(&shown, error))?;
    let are_numbers = !first.is_empty() && first.iter().all(|word| is_number(word));
    // NumPy writes names behind a `#`.
    let named = comment.filter(|names| are_numbers && names.len() == first.len());
    if given.is_none() && named.is_none() && are_numbers {
        let problem = format!("its first line has {} numbers and no names of columns", first.len());
        return Err(Error::new("read", format!("{shown}, line {}", skipped + 1), problem)
            .help("`names = [\"x_mm\", …]` in [load] names them in their order"));
    }
    let given = given.or(named.as_deref());
    let mut rows = Rows { columns: Vec::new(), lines: Vec::new(), names: Vec::new(), shown: &shown };
    rows.name(given.map_or(first, <[String]>::to_vec));
    match separator {
        Separator::Byte(delimiter) => {
            let mut reader = ReaderBuilder::new()
                .delimiter(delimiter)
                .trim(Trim::All)
                .has_headers(given.is_none())
                .comment(Some(COMMENT))
                .from_reader(file);
            if given.is_none() {
                let header = reader.byte_headers().map_err(|error| failed(&shown, error))?;
                rows.name(header.iter().map(|name| String::from_utf8_lossy(name).into_owned()).collect());
            }
            let mut record = ByteRecord::new();
            while reader.read_byte_record(&mut record).map_err(|error| failed(&shown, error))? {
                let line = record.position().map_or(0, csv::Position::line);
                rows.add(skipped + line, record.iter())?;
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
                let is_row = words.clone().next().is_some_and(|word| word[0] != COMMENT);
                if (line > 1 || given.is_some()) && is_row {
                    rows.add(skipped + line, words)?;
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

/// What begins a line that is no row.
const COMMENT: u8 = b'#';

fn is_number(word: &str) -> bool {
    word.trim().replace(',', ".").parse::<f64>().is_ok()
}

/// The first line that is no comment.
struct Start {
    /// It stands for the whole file.
    separator: Separator,
    words: Vec<String>,
    /// Words of the last comment before it.
    comment: Option<Vec<String>>,
    /// Lines before it.
    skipped: u64,
}

impl Start {
    /// Leaves the file at that line; skips a byte order mark.
    fn of(file: &mut BufReader<File>) -> std::io::Result<Self> {
        let (mut start, mut skipped, mut comment) = (0, 0, None);
        loop {
            let mut bytes = Vec::new();
            // A header is short; a file without line ends is no reason to read it all twice.
            let read = file.by_ref().take(65536).read_until(b'\n', &mut bytes)? as u64;
            if start == 0 && bytes.starts_with("\u{feff}".as_bytes()) {
                bytes.drain(..3);
                start = 3;
            }
            let mark = if start == 3 && skipped == 0 { 3 } else { 0 };
            let line = String::from_utf8_lossy(&bytes).trim().to_owned();
            let Some(said) = line.strip_prefix(char::from(COMMENT)) else {
                file.seek(std::io::SeekFrom::Start(start))?;
                let (separator, words) = separated(&line);
                let comment = comment.map(|comment: String| separated(&comment).1);
                return Ok(Self { separator, words, comment, skipped });
            };
            comment = Some(said.trim().to_owned());
            start += read - mark;
            skipped += 1;
        }
    }
}

/// The separator of a line, and its words.
fn separated(line: &str) -> (Separator, Vec<String>) {
    if let Some(byte) = line.bytes().find(|byte| b",;\t".contains(byte)) {
        let mut reader =
            ReaderBuilder::new().delimiter(byte).trim(Trim::All).has_headers(false).from_reader(line.as_bytes());
        let mut record = csv::StringRecord::new();
        let _ = reader.read_record(&mut record);
        return (Separator::Byte(byte), record.iter().map(str::to_owned).collect());
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
    (separator, words)
}
