//! The loader `cylinder-traces`: a CSV file of traces measured on a cylinder.

use std::{
    fs::File,
    io::{BufRead, BufReader, Read, Seek},
    path::{Path, PathBuf},
};

use csv::{ByteRecord, ReaderBuilder, Trim};
use runout_core::{
    Error, Result,
    pipeline::{
        error::Fault,
        registry::{Context, StageConfig},
    },
    points::{Column, Points, Trace},
    rig::Rig,
    stage::{Loader, Source, SourceKind},
};
use schemars::JsonSchema;
use serde::Deserialize;

/// `[load] plugin = "cylinder-traces"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderTracesConfig {
    /// CSV file with the columns trace, kind, z_mm, angle_deg, deviation_um, in any order; the points of a trace follow
    /// one another. Separated by comma, semicolon or tab; the last two allow a decimal comma.
    pub path: PathBuf,
}

impl StageConfig for CylinderTracesConfig {
    type Stage = Box<dyn Loader>;

    const NAME: &'static str = "cylinder-traces";
    const ABOUT: &'static str = "circles and generatrices measured on a cylinder, from CSV";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        if self.path.as_os_str().is_empty() {
            return Err(Fault::at("path", "expected the name of a file"));
        }
        Ok(Box::new(CylinderTraces { path: context.path(&self.path) }))
    }
}

/// The loader `cylinder-traces`.
struct CylinderTraces {
    path: PathBuf,
}

impl Loader for CylinderTraces {
    fn kind(&self) -> SourceKind {
        SourceKind::Points
    }

    fn open(&self, _rig: Option<&Rig>) -> Result<Source> {
        read(&self.path).map(Source::Points)
    }
}

const NUMBERS: [&str; 3] = ["z_mm", "angle_deg", "deviation_um"];

/// Where the columns stand in the file.
struct Layout {
    trace: usize,
    kind: usize,
    numbers: [usize; 3],
}

fn read(path: &Path) -> Result<Points> {
    let shown = path.display().to_string();
    let failure = |problem: &dyn std::fmt::Display| Error::new("read", &shown, problem);
    let mut file = BufReader::new(File::open(path).map_err(|error| failure(&error))?);
    let delimiter = delimiter(&mut file).map_err(|error| failure(&error))?;
    let mut reader = ReaderBuilder::new().delimiter(delimiter).trim(Trim::All).from_reader(file);
    let layout = layout(reader.byte_headers().map_err(|error| failure(&error))?, &shown)?;
    let mut values: [Vec<f64>; 3] = Default::default();
    let mut traces: Vec<Trace> = Vec::new();
    let mut record = ByteRecord::new();
    while reader.read_byte_record(&mut record).map_err(|error| failure(&error))? {
        let cells = Cells { record: &record, file: &shown, decimal_comma: delimiter != b',' };
        let row = values[0].len();
        for (column, (place, name)) in values.iter_mut().zip(layout.numbers.into_iter().zip(NUMBERS)) {
            column.push(cells.number(place, name)?);
        }
        let (id, kind) = (cells.text(layout.trace, "trace")?, cells.text(layout.kind, "kind")?);
        let begins = traces.last().is_none_or(|last| last.id != id);
        if begins && traces.iter().any(|trace| trace.id == id) {
            let problem = format!("trace {id} has ended above; the points of a trace follow one another");
            return Err(cells.refuse(layout.trace, "trace", &problem));
        }
        match traces.last_mut() {
            Some(last) if !begins && last.kind == kind => last.points.end = row + 1,
            Some(last) if !begins => {
                let problem = format!("trace {id} began as a {}, not a {kind}", last.kind);
                return Err(cells.refuse(layout.kind, "kind", &problem));
            }
            _ => traces.push(Trace { id: id.to_owned(), kind: kind.to_owned(), points: row..row + 1 }),
        }
    }
    if traces.is_empty() {
        return Err(Error::new("read", shown, "it holds no points"));
    }
    let columns = NUMBERS.iter().zip(values).map(|(name, values)| Column { name: (*name).to_owned(), values });
    Ok(Points { input: path.to_path_buf(), columns: columns.collect(), traces })
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

fn layout(header: &ByteRecord, file: &str) -> Result<Layout> {
    let names: Vec<String> = header.iter().map(|name| String::from_utf8_lossy(name).into_owned()).collect();
    let wanted = ["trace", "kind", NUMBERS[0], NUMBERS[1], NUMBERS[2]];
    let refuse = |problem: String| {
        Error::new("read", format!("{file}, line 1"), problem).help(format!("the columns are {}", wanted.join(", ")))
    };
    for (index, name) in names.iter().enumerate() {
        if !wanted.contains(&name.as_str()) {
            return Err(refuse(format!("unknown column `{name}`")));
        }
        if names[..index].contains(name) {
            return Err(refuse(format!("the column `{name}` is there twice")));
        }
    }
    let place = |name: &str| {
        names.iter().position(|found| found == name).ok_or_else(|| refuse(format!("the column `{name}` is missing")))
    };
    let numbers = [place(NUMBERS[0])?, place(NUMBERS[1])?, place(NUMBERS[2])?];
    Ok(Layout { trace: place("trace")?, kind: place("kind")?, numbers })
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

    fn refuse(&self, place: usize, name: &str, problem: &str) -> Error {
        let line = self.record.position().map_or(0, csv::Position::line);
        Error::new("read", format!("{}, line {line}, column {} ({name})", self.file, place + 1), problem)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn from(text: &str) -> Result<Points> {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text.as_bytes()).unwrap();
        read(file.path())
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
    fn every_mistake_is_named_with_its_place() {
        let header = "trace,kind,z_mm,angle_deg,deviation_um\n";
        let cases = [
            ("A,circle,1,0,nan\n", "line 2, column 5 (deviation_um): expected a finite number, found `nan`"),
            ("A,circle,1,0,1\nA,circle,1,x,1\n", "line 3, column 4 (angle_deg): expected a finite number, found `x`"),
            ("A,circle,1,,1\n", "line 2, column 4 (angle_deg): it is empty"),
            ("A,circle,1,0,1\nB,circle,1,0,1\nA,circle,1,0,1\n", "line 4, column 1 (trace): trace A has ended above"),
            ("A,circle,1,0,1\nA,line,1,0,1\n", "line 3, column 2 (kind): trace A began as a circle, not a line"),
            ("A,circle,1,0\n", "line: 2"),
            ("", "it holds no points"),
        ];
        for (rows, expected) in cases {
            let message = from(&format!("{header}{rows}")).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
        let headers = [
            ("", "the column `z_mm` is missing"),
            ("trace,kind,z_mm,angle_deg,deviation\n", "unknown column `deviation`"),
            ("trace,kind,z_mm,z_mm,deviation_um\n", "the column `z_mm` is there twice"),
            ("trace,kind,z_mm,angle_deg\n", "the column `deviation_um` is missing"),
        ];
        for (header, expected) in headers {
            let message = from(header).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
        assert!(read(Path::new("/nonexistent/cylinder.csv")).is_err());
    }
}
