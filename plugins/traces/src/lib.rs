//! CSV files of traces and points, and the loader of one, which the crates of measured points share.
//!
//! A row is a point: the trace that it belongs to, what tells the traces apart (their kind, their setup), and numbers.
//! The points of a trace follow one another. Columns come in any order, separated by comma, semicolon or tab; the last
//! two allow a decimal comma.

use std::{
    fs::File,
    io::{BufRead, BufReader, Read, Seek},
    path::{Path, PathBuf},
};

use csv::{ByteRecord, ReaderBuilder, Trim};
use runout_core::{
    Error, Result,
    pipeline::{error::Fault, registry::Context},
    points::{Column, Points, Trace},
    rig::Rig,
    stage::{Loader, Source, SourceKind},
};

/// A loader of the file that a configuration names by `path`.
///
/// # Errors
/// When it names none.
pub fn loader(
    path: &Path,
    context: &Context,
    read: fn(&Path) -> Result<Points>,
) -> std::result::Result<Box<dyn Loader>, Fault> {
    if path.as_os_str().is_empty() {
        return Err(Fault::at("path", "expected the name of a file"));
    }
    Ok(Box::new(PointFile { path: context.path(path), read }))
}

struct PointFile {
    path: PathBuf,
    read: fn(&Path) -> Result<Points>,
}

impl Loader for PointFile {
    fn kind(&self) -> SourceKind {
        SourceKind::Points
    }

    fn open(&self, _rig: Option<&Rig>) -> Result<Source> {
        (self.read)(&self.path).map(Source::Points)
    }
}

/// The column of the traces' ids.
const TRACE: &str = "trace";

/// The columns of a file besides `trace`.
#[derive(Debug, Clone, Copy)]
pub struct Columns<'a> {
    /// What is the same along a trace, and becomes its [`kind`](Trace::kind).
    pub kind: &'a str,
    /// Numbers, one a point; the unit is part of the name.
    pub numbers: &'a [&'a str],
    /// Columns that a file may have besides.
    pub optional: &'a [Optional<'a>],
}

/// A column that a file may have.
#[derive(Debug, Clone, Copy)]
pub enum Optional<'a> {
    /// Of numbers.
    Number(&'a str),
    /// Of 0 and 1.
    Flag(&'a str),
}

impl<'a> Optional<'a> {
    fn name(self) -> &'a str {
        match self {
            Self::Number(name) | Self::Flag(name) => name,
        }
    }
}

/// The columns of a file of points that belong to no trace: numbers, one a point.
#[derive(Debug, Clone, Copy)]
pub struct Numbers<'a> {
    /// Read.
    pub read: &'a [&'a str],
    /// Read where they are there.
    pub optional: &'a [&'a str],
    /// Known, and left alone.
    pub ignored: &'a [&'a str],
}

impl Numbers<'_> {
    /// Reads a file into one trace named `trace`.
    ///
    /// # Errors
    /// When it cannot be read, lacks a column or has another, or a cell is no number.
    pub fn read(&self, path: &Path, trace: &str) -> Result<Points> {
        let shown = path.display().to_string();
        let failure = |problem: &dyn std::fmt::Display| Error::new("read", &shown, problem);
        let (mut reader, decimal_comma) = open(path)?;
        let header = reader.byte_headers().map_err(|error| failure(&error))?;
        let there = self.optional.iter().filter(|name| header.iter().any(|found| found == name.as_bytes()));
        let read: Vec<&str> = self.read.iter().chain(there).copied().collect();
        let places = places(header, &read, &[], self.ignored, &shown)?;
        let mut values = vec![Vec::new(); read.len()];
        let mut record = ByteRecord::new();
        while reader.read_byte_record(&mut record).map_err(|error| failure(&error))? {
            let cells = Cells { record: &record, file: &shown, decimal_comma };
            for (column, (place, name)) in values.iter_mut().zip(places.iter().zip(&read)) {
                column.push(cells.number(*place, name)?);
            }
        }
        let points = 0..values.first().map_or(0, Vec::len);
        if points.is_empty() {
            return Err(Error::new("read", shown, "it holds no points"));
        }
        let columns = read.iter().zip(values);
        let columns = columns.map(|(name, values)| Column { name: (*name).to_owned(), values }).collect();
        let traces = vec![Trace { id: trace.to_owned(), kind: trace.to_owned(), points }];
        Ok(Points { input: path.to_path_buf(), columns, traces })
    }
}

/// A reader behind the header's separator, and whether it allows a decimal comma.
fn open(path: &Path) -> Result<(csv::Reader<BufReader<File>>, bool)> {
    let failure = |error: std::io::Error| Error::new("read", path.display().to_string(), error);
    let mut file = BufReader::new(File::open(path).map_err(failure)?);
    let delimiter = delimiter(&mut file).map_err(failure)?;
    Ok((ReaderBuilder::new().delimiter(delimiter).trim(Trim::All).from_reader(file), delimiter != b','))
}

/// Where the wanted columns stand; refuses those that are neither wanted, optional nor ignored.
fn places(header: &ByteRecord, wanted: &[&str], optional: &[&str], ignored: &[&str], file: &str) -> Result<Vec<usize>> {
    let names: Vec<String> = header.iter().map(|name| String::from_utf8_lossy(name).into_owned()).collect();
    let refuse = |problem: String| {
        let besides = if optional.is_empty() { String::new() } else { format!("; optional: {}", optional.join(", ")) };
        let help = format!("the columns are {}{besides}", wanted.join(", "));
        Error::new("read", format!("{file}, line 1"), problem).help(help)
    };
    for (index, name) in names.iter().enumerate() {
        if [wanted, optional, ignored].iter().all(|known| !known.contains(&name.as_str())) {
            return Err(refuse(format!("unknown column `{name}`")));
        }
        if names[..index].contains(name) {
            return Err(refuse(format!("the column `{name}` is there twice")));
        }
    }
    let place = |name: &&str| {
        let found = names.iter().position(|found| found == name);
        found.ok_or_else(|| refuse(format!("the column `{name}` is missing")))
    };
    wanted.iter().map(place).collect()
}

/// Where the columns stand in the file.
struct Layout<'a> {
    trace: usize,
    kind: usize,
    /// Place, name, and whether it is a flag.
    numbers: Vec<(usize, &'a str, bool)>,
}

impl Columns<'_> {
    /// Reads a file.
    ///
    /// # Errors
    /// When it cannot be read, lacks a column or has another, or a row is not what its columns say.
    pub fn read(&self, path: &Path) -> Result<Points> {
        let shown = path.display().to_string();
        let failure = |problem: &dyn std::fmt::Display| Error::new("read", &shown, problem);
        let (mut reader, decimal_comma) = open(path)?;
        let layout = self.layout(reader.byte_headers().map_err(|error| failure(&error))?, &shown)?;
        let mut values = vec![Vec::new(); layout.numbers.len()];
        let mut traces: Vec<Trace> = Vec::new();
        let mut record = ByteRecord::new();
        let mut row = 0;
        while reader.read_byte_record(&mut record).map_err(|error| failure(&error))? {
            let cells = Cells { record: &record, file: &shown, decimal_comma };
            for (column, (place, name, is_flag)) in values.iter_mut().zip(&layout.numbers) {
                column.push(if *is_flag { cells.flag(*place, name)? } else { cells.number(*place, name)? });
            }
            let (id, kind) = (cells.text(layout.trace, TRACE)?, cells.text(layout.kind, self.kind)?);
            match traces.last_mut() {
                Some(last) if last.id == id && last.kind == kind => last.points.end = row + 1,
                _ => {
                    if let Some(known) = traces.iter().find(|trace| trace.id == id) {
                        return Err(self.again(known, kind, &cells, &layout));
                    }
                    traces.push(Trace { id: id.to_owned(), kind: kind.to_owned(), points: row..row + 1 });
                }
            }
            row += 1;
        }
        if traces.is_empty() {
            return Err(Error::new("read", shown, "it holds no points"));
        }
        let columns = layout.numbers.iter().zip(values);
        let columns = columns.map(|((_, name, _), values)| Column { name: (*name).to_owned(), values }).collect();
        Ok(Points { input: path.to_path_buf(), columns, traces })
    }

    /// Why a trace cannot come back.
    fn again(&self, known: &Trace, kind: &str, cells: &Cells, layout: &Layout<'_>) -> Error {
        let id = &known.id;
        if known.kind == kind {
            let problem = format!("trace {id} has ended above; the points of a trace follow one another");
            return cells.refuse(layout.trace, TRACE, &problem);
        }
        let problem = format!("trace {id} is of {} {} above, not {kind}", self.kind, known.kind);
        cells.refuse(layout.kind, self.kind, &problem).help("give each trace a name of its own")
    }

    fn layout(&self, header: &ByteRecord, file: &str) -> Result<Layout<'_>> {
        let wanted = [&[TRACE, self.kind], self.numbers].concat();
        let optional: Vec<&str> = self.optional.iter().map(|column| column.name()).collect();
        let mut places = places(header, &wanted, &optional, &[], file)?;
        let numbers = places.split_off(2).into_iter().zip(self.numbers).map(|(place, name)| (place, *name, false));
        let besides = self.optional.iter().filter_map(|column| {
            let place = header.iter().position(|found| found == column.name().as_bytes())?;
            Some((place, column.name(), matches!(column, Optional::Flag(_))))
        });
        Ok(Layout { trace: places[0], kind: places[1], numbers: numbers.chain(besides).collect() })
    }
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

/// A record, with its place for messages.
struct Cells<'a> {
    record: &'a ByteRecord,
    file: &'a str,
    decimal_comma: bool,
}

impl Cells<'_> {
    fn text(&self, place: usize, name: &str) -> Result<&str> {
        let bytes = self.record.get(place).unwrap_or_default();
        match std::str::from_utf8(bytes) {
            Ok("") => Err(self.refuse(place, name, "it is empty")),
            Ok(text) => Ok(text),
            Err(_) => Err(self.refuse(place, name, "it is not UTF-8")),
        }
    }

    fn number(&self, place: usize, name: &str) -> Result<f64> {
        let text = self.text(place, name)?;
        let parsed = if self.decimal_comma { text.replace(',', ".").parse() } else { text.parse() };
        match parsed {
            Ok(number) if f64::is_finite(number) => Ok(number),
            _ => Err(self.refuse(place, name, &format!("expected a finite number, found `{text}`"))),
        }
    }

    fn flag(&self, place: usize, name: &str) -> Result<f64> {
        match self.text(place, name)? {
            "0" => Ok(0.0),
            "1" => Ok(1.0),
            other => {
                let problem = format!("expected 0 (used) or 1 (left out), found `{other}`");
                Err(self.refuse(place, name, &problem))
            }
        }
    }

    fn refuse(&self, place: usize, name: &str, problem: &str) -> Error {
        let line = self.record.position().map_or(0, csv::Position::line);
        Error::new("read", format!("{}, line {line}, column {} ({name})", self.file, place + 1), problem)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    const COLUMNS: Columns =
        Columns { kind: "kind", numbers: &["z_mm", "angle_deg", "deviation_um"], optional: &[Optional::Flag("flag")] };

    fn from(text: &str) -> Result<Points> {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text.as_bytes()).unwrap();
        COLUMNS.read(file.path())
    }

    #[test]
    fn traces_with_either_decimal_mark() {
        let dots = from("trace,kind,z_mm,angle_deg,deviation_um\nA,circle,1.5,0,-2\nA,circle,1.5,90,3\nB,line,2,0,1\n");
        let commas = from(
            "\u{feff}kind;trace;deviation_um;z_mm;angle_deg\r\ncircle;A;-2;1,5;0\r\ncircle;A;3;1,5;90\r\nline;B;1;2;0",
        );
        let (dots, commas) = (dots.unwrap(), commas.unwrap());
        assert_eq!(dots.columns, commas.columns);
        assert_eq!(dots.traces, commas.traces);
        assert_eq!(dots.column("z_mm").unwrap(), [1.5, 1.5, 2.0]);
        assert_eq!(dots.traces[0], Trace { id: "A".into(), kind: "circle".into(), points: 0..2 });
    }

    #[test]
    fn a_column_of_flags_may_be_there() {
        let points =
            from("flag,trace,kind,z_mm,angle_deg,deviation_um\n0,A,circle,1,0,-2\n1,A,circle,1,90,3\n").unwrap();
        assert_eq!(points.column("flag").unwrap(), [0.0, 1.0]);
        assert_eq!(points.column("deviation_um").unwrap(), [-2.0, 3.0]);
        for cell in ["2", "true", "0.0", "-1", "nan"] {
            let text = format!("trace,kind,z_mm,angle_deg,deviation_um,flag\nA,circle,1,0,-2,{cell}\n");
            let message = from(&text).unwrap_err().to_string();
            let expected = format!("line 2, column 6 (flag): expected 0 (used) or 1 (left out), found `{cell}`");
            assert!(message.contains(&expected), "{message}");
        }
    }

    #[test]
    fn points_without_traces() {
        let numbers = Numbers { read: &["phase_deg", "radius_counts"], optional: &["time_s"], ignored: &["note"] };
        let read = |text: &str| {
            let mut file = tempfile::NamedTempFile::new().unwrap();
            file.write_all(text.as_bytes()).unwrap();
            numbers.read(file.path(), "signal")
        };
        let points = read("note;radius_counts;phase_deg\nhum;500,5;0\n;501;90,25\n").unwrap();
        assert_eq!(points.column("phase_deg").unwrap(), [0.0, 90.25]);
        assert_eq!(points.column("radius_counts").unwrap(), [500.5, 501.0]);
        assert_eq!(points.traces, [Trace { id: "signal".into(), kind: "signal".into(), points: 0..2 }]);
        assert!(points.column("time_s").is_err());
        let timed = read("time_s,phase_deg,radius_counts\n0.5,1,2\n").unwrap();
        assert_eq!(timed.column("time_s").unwrap(), [0.5]);
        assert!(read("phase_deg\n1\n").unwrap_err().to_string().contains("`radius_counts` is missing"));
        assert!(read("phase_deg,radius_counts\n").unwrap_err().to_string().contains("no points"));
        assert!(read("phase_deg,radius_counts\n1,x\n").unwrap_err().to_string().contains("line 2, column 2"));
    }

    #[test]
    fn every_mistake_is_named_with_its_place() {
        let header = "trace,kind,z_mm,angle_deg,deviation_um\n";
        let cases = [
            ("A,circle,1,0,nan\n", "line 2, column 5 (deviation_um): expected a finite number, found `nan`"),
            ("A,circle,1,0,1\nA,circle,1,x,1\n", "line 3, column 4 (angle_deg): expected a finite number, found `x`"),
            ("A,circle,1,,1\n", "line 2, column 4 (angle_deg): it is empty"),
            ("A,circle,1,0,1\nB,circle,1,0,1\nA,circle,1,0,1\n", "line 4, column 1 (trace): trace A has ended above"),
            ("A,circle,1,0,1\nA,line,1,0,1\n", "line 3, column 2 (kind): trace A is of kind circle above, not line"),
            ("A,circle,1,0\n", "line: 2"),
            ("", "it holds no points"),
        ];
        for (rows, expected) in cases {
            let message = from(&format!("{header}{rows}")).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
        let headers = [
            ("", "the column `trace` is missing"),
            ("trace,kind,z_mm,angle_deg,deviation\n", "unknown column `deviation`"),
            ("trace,kind,z_mm,z_mm,deviation_um\n", "the column `z_mm` is there twice"),
            ("trace,kind,z_mm,angle_deg\n", "the column `deviation_um` is missing"),
        ];
        for (header, expected) in headers {
            let message = from(header).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
        assert!(COLUMNS.read(Path::new("/nonexistent/cylinder.csv")).is_err());
    }
}
