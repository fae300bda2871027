//! The first line that is no comment: which column is what.

use runout_core::{Error, ErrorKind, Result, fault::known_names, input_file::InputFile, marker::Marker, rig::Rig};

use crate::lines::{Stretch, Stretches, cells};

/// Column of the once-per-turn mark.
pub(crate) const INDEX: &str = "index";
/// Column of the unwrapped spindle angle.
pub(crate) const ANGLE: &str = "angle_deg";
/// Column of the time.
pub(crate) const TIME: &str = "time_s";

/// What to do where the header lacks a sensor: it may be another line, or be delimited by what is no delimiter.
const HEADER_HELP: &str = "the header is the first line that does not begin with `#`: take out other lines before it. It has to name the rig's \
    sensors by their ids, delimited by comma, semicolon or tab";

/// What the header declares.
#[derive(Debug, Clone)]
pub(crate) struct Header {
    pub(crate) shown: String,
    pub(crate) delimiter: u8,
    pub(crate) names: Vec<String>,
    /// The column of each of the rig's sensors.
    pub(crate) sensors: Vec<usize>,
    pub(crate) phase: Phase,
    pub(crate) time: Option<usize>,
    /// What a reader should know.
    pub(crate) remarks: Vec<String>,
    /// Names of columns that are not used.
    pub(crate) unknown: Vec<String>,
}

/// The column that gives the turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Phase {
    Index(usize),
    Angle(usize),
    /// The mark as an analogue trace.
    Trace(usize),
}

/// What a header is split at: a decimal comma is no delimiter, so that semicolons and tabs come first.
pub(crate) fn delimiter_of(line: &[u8]) -> u8 {
    [b'\t', b';'].into_iter().find(|byte| line.contains(byte)).unwrap_or(b',')
}

impl Phase {
    pub(crate) fn column(self) -> usize {
        match self {
            Self::Index(column) | Self::Angle(column) | Self::Trace(column) => column,
        }
    }

    /// What to do where a value cannot be.
    pub(crate) fn help(self) -> &'static str {
        match self {
            Self::Index(_) => {
                "the mark is 1 while it is up, and 0 otherwise; of a trace in volts, name its column and threshold by `marker` in [load]"
            }
            Self::Angle(_) => "let the angle go on beyond 360° from turn to turn",
            Self::Trace(_) => "every sample of the mark is needed",
        }
    }
}

impl Header {
    /// Opens a file and reads its header; gives the stretch that it is in, from the first row on, and those behind.
    pub(crate) fn open(input: &InputFile, rig: &Rig, marker: Option<&Marker>) -> Result<(Self, Stretch, Stretches)> {
        let (mut stretches, mut stretch) = (Stretches::open(input)?, Stretch::default());
        let shown = input.path().display().to_string();
        while stretches.next(&mut stretch)? {
            let mut lines = stretch.lines();
            let length = lines.ahead().len();
            while let Some(line) = lines.next() {
                if !line.is_blank() && !line.bytes.starts_with(b"#") {
                    let header = Self::parse(line.bytes, line.number, shown, rig, marker)?;
                    let (passed, number) = (length - lines.ahead().len(), lines.number());
                    stretch.pass(passed, number);
                    return Ok((header, stretch, stretches));
                }
            }
        }
        Err(Error::new("read", shown, "expected a header that names the columns, found none")
            .of(ErrorKind::DamagedData))
    }

    fn parse(line: &[u8], number: u64, shown: String, rig: &Rig, marker: Option<&Marker>) -> Result<Self> {
        let delimiter = delimiter_of(line);
        let names: Vec<String> = cells(line, delimiter).map(decode).collect();
        let object = format!("{shown}, line {number}");
        let error = |problem: String| Error::new("read", &object, problem);
        if line.trim_ascii_end().contains(&b'\r') {
            let problem = "expected lines that end with a line feed, found carriage returns alone".to_owned();
            return Err(error(problem).help("save the file with the line ends of Unix or Windows"));
        }
        let find = |name: &str| -> Result<Option<usize>> {
            let mut found = names.iter().enumerate().filter(|(_, known)| *known == name).map(|(column, _)| column);
            match (found.next(), found.next()) {
                (_, Some(_)) => Err(error(format!("the column `{name}` is there twice"))),
                (first, None) => Ok(first),
            }
        };
        let mut sensors = Vec::with_capacity(rig.sensors.len());
        for sensor in &rig.sensors {
            sensors.push(find(&sensor.id)?.ok_or_else(|| {
                error(format!("expected a column for the sensor `{}`, found {}", sensor.id, listed(&names)))
                    .help(HEADER_HELP)
            })?);
        }
        let trace = match marker {
            None => None,
            Some(marker) => Some(find(&marker.channel)?.ok_or_else(|| {
                let problem = format!("expected a column `{}` with the mark, found {}", marker.channel, listed(&names));
                error(problem).help(known_names(&marker.channel, names.iter().map(String::as_str)))
            })?),
        };
        let (index, angle, time) = (find(INDEX)?, find(ANGLE)?, find(TIME)?);
        let mut remarks = Vec::new();
        if trace.is_some() && trace == time {
            return Err(error(format!("the column `{TIME}` cannot be the trace of the mark")));
        }
        let phase = match (trace, index, angle) {
            (Some(column), ..) => {
                for (name, other) in [(INDEX, index), (ANGLE, angle)] {
                    if other.is_some_and(|other| other != column) {
                        remarks
                            .push(format!("{shown}: the trace `{}` was used, not the column `{name}`", names[column]));
                    }
                }
                Phase::Trace(column)
            }
            (None, None, None) => {
                let problem = format!("expected a column `{INDEX}` or `{ANGLE}`, found {}", listed(&names));
                let help = "name the column with the once-per-turn mark (0 or 1), or with the encoder's unwrapped angle; of a mark \
                            in volts, state marker = { channel, threshold, hysteresis } in [load]";
                return Err(error(problem).help(help));
            }
            (None, Some(column), None) => Phase::Index(column),
            (None, index, Some(column)) => {
                if index.is_some() {
                    remarks.push(format!("{shown}: the encoder's angle was used, not the index"));
                }
                Phase::Angle(column)
            }
        };
        let known = |name: &&String| {
            let named = marker.is_some_and(|marker| marker.channel == **name);
            name.is_empty() || named || [INDEX, ANGLE, TIME].contains(&name.as_str()) || rig.sensor(name).is_some()
        };
        let unknown = names.iter().filter(|name| !known(name)).cloned().collect();
        Ok(Self { shown, delimiter, names, sensors, phase, time, remarks, unknown })
    }

    /// An error at a cell; both numbers as people count, from 1.
    pub(crate) fn error(&self, line: u64, column: usize, problem: impl ToString) -> Error {
        let name = self.names.get(column).map_or("", String::as_str);
        Error::new("read", format!("{}, line {line}, column {} (`{name}`)", self.shown, column + 1), problem)
            .of(ErrorKind::DamagedData)
    }

    /// An error of a whole line.
    pub(crate) fn line_error(&self, line: u64, problem: impl ToString) -> Error {
        Error::new("read", format!("{}, line {line}", self.shown), problem).of(ErrorKind::DamagedData)
    }

    /// An error of a cell that holds no number.
    pub(crate) fn no_number(&self, line: u64, column: usize, cell: &[u8], decimal: u8) -> Error {
        let shown = shown(&decode(cell));
        let kind = if decimal == b',' { "a number with a decimal comma" } else { "a number" };
        // A spreadsheet's "#DIV/0!" stands among readings, a comment at the beginning of its line.
        let marked = cell.starts_with(b"#");
        let help = if marked && column == 0 {
            "comments are understood above the header only"
        } else if cell.trim_ascii().is_empty() {
            "only readings may be missing: each row needs a number in this column"
        } else if !marked && cell.iter().any(u8::is_ascii_digit) {
            if decimal == b',' {
                "the numbers of this file have a decimal comma, as in 1,5 or 1,5e-3: without units, and without marks between thousands"
            } else {
                "the numbers of this file have a decimal point, as in 1.5 or 1.5e-3: without units, and without marks between thousands"
            }
        } else if self.sensors.contains(&column) {
            "take out rows of units; where a reading is missing, leave its cell empty or write NaN"
        } else {
            "take out rows of units; only readings may be missing: each row needs a number in this column"
        };
        self.error(line, column, format!("expected {kind}, found `{shown}`")).help(help)
    }
}

/// Names for a message, which a strange file is not to fill.
fn listed(names: &[String]) -> String {
    const SHOWN: usize = 12;
    let mut shown: Vec<String> = names.iter().take(SHOWN).map(|name| shown(name)).collect();
    if names.len() > SHOWN {
        shown.push(format!("and {} more", names.len() - SHOWN));
    }
    shown.join(", ")
}

/// The beginning of a text, which is not to write over the terminal: control characters as `\u{1b}`.
fn shown(text: &str) -> String {
    let escaped = |shown: String, character: char| {
        if character.is_control() {
            shown + &character.escape_unicode().to_string()
        } else {
            shown + character.encode_utf8(&mut [0; 4])
        }
    };
    text.chars().take(40).fold(String::new(), escaped)
}

/// UTF-8, or else Latin-1, whose bytes are the first 256 characters.
pub(crate) fn decode(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|byte| char::from(*byte)).collect(),
    }
}
