//! Universal files, dataset 58: functions at degrees of freedom, as text or binary (58b) (SDRC, Universal File Datasets).

use runout_core::{Result, clock::ClockScan, input_file::InputFile};
use runout_csv::parse_number;

use super::Format;
use crate::{
    bytes::{Bytes, text},
    channel::{Channel, ChannelFile, Kind, Samples, SideBySide, checked},
    strided::{Column, Run, StridedSamples},
    unit::{self, Known},
};

pub(super) const FORMAT: Format = Format {
    name: "uff",
    about: "UFF 58 (modal analysis, Testlab, B&K)",
    recognises: |head| {
        let mut lines = head.split(|byte| *byte == b'\n').filter(|line| !line.trim_ascii().is_empty());
        let is_number =
            |line: &[u8]| line.trim_ascii().iter().all(|byte| byte.is_ascii_digit() || matches!(byte, b'b' | b' '));
        lines.next().is_some_and(is_mark) && lines.next().is_some_and(is_number)
    },
    open: |input| Uff::open(input).map(|file| Box::new(file) as Box<dyn ChannelFile>),
};

/// Longest line of text.
const LONGEST_LINE: usize = 1 << 12;
/// Directions of a degree of freedom, from −6 on.
const DIRECTIONS: [&str; 13] = ["-RZ", "-RY", "-RX", "-Z", "-Y", "-X", "", "+X", "+Y", "+Z", "+RX", "+RY", "+RZ"];
/// What a dataset says of time: the type of its abscissa.
const TIME: i64 = 17;

/// The line before and behind a dataset.
fn is_mark(line: &[u8]) -> bool {
    line.starts_with(b"    -1") && line.trim_ascii() == b"-1"
}

struct Uff {
    input: InputFile,
    channels: Vec<Channel>,
    /// Function and number in a point of each channel.
    parts: Vec<(usize, usize)>,
    functions: Vec<Function>,
    remarks: Vec<String>,
}

/// A dataset 58.
#[derive(Debug, Clone)]
struct Function {
    layout: Layout,
    points: u64,
    data: u64,
}

/// How points are written.
#[derive(Debug, Clone)]
enum Layout {
    /// Columns of characters, of one point.
    Text(Vec<usize>),
    /// Numbers of one point.
    Binary { kinds: Vec<Kind>, is_big_endian: bool },
}

/// What the records before the data say.
struct Head {
    group: String,
    name: String,
    kind: i64,
    points: u64,
    is_even: bool,
    first: f64,
    step: f64,
    abscissa: i64,
    abscissa_unit: String,
    unit: String,
    properties: Vec<(String, String)>,
}

impl Uff {
    fn open(input: &InputFile) -> Result<Self> {
        let mut file = Self {
            input: input.clone(),
            channels: Vec::new(),
            parts: Vec::new(),
            functions: Vec::new(),
            remarks: Vec::new(),
        };
        let mut bytes = Bytes::open(&input.into())?;
        loop {
            // Between datasets there may be anything.
            match bytes.line(LONGEST_LINE)? {
                None => break,
                Some(line) if !is_mark(&line) => continue,
                Some(_) => {}
            }
            let Some(number) = bytes.line(LONGEST_LINE)? else { break };
            let number = text(&number);
            let mut words = number.split_whitespace();
            match words.next() {
                Some("58") => file.function(&mut bytes, None)?,
                Some("58b" | "58B") => {
                    let words: Vec<i64> = words.map_while(|word| word.parse().ok()).collect();
                    file.function(&mut bytes, Some(&words))?;
                }
                _ => while bytes.line(LONGEST_LINE)?.is_some_and(|line| !is_mark(&line)) {},
            }
        }
        Ok(file)
    }

    fn function(&mut self, bytes: &mut Bytes, binary: Option<&[i64]>) -> Result<()> {
        let head = Head::read(bytes)?;
        let is_double = matches!(head.kind, 4 | 6);
        let numbers = if matches!(head.kind, 5 | 6) { 2 } else { 1 };
        let (layout, points, data) = match binary {
            None => {
                let width = if is_double { 20 } else { 13 };
                // An abscissa is of single precision, whatever the ordinate is.
                let mut widths = if head.is_even { Vec::new() } else { vec![13] };
                widths.extend(vec![width; numbers]);
                let (data, points) = (bytes.place(), count(bytes, &widths)?);
                (Layout::Text(widths), points, data)
            }
            Some(words) => {
                let [order, float, _, stated] = *words.first_chunk().unwrap_or(&[0; 4]);
                if !matches!(order, 1 | 2) || float != 2 {
                    let problem =
                        format!("expected IEEE numbers (2) in an order of 1 or 2, found the codes {float} and {order}");
                    return Err(bytes.damaged(problem));
                }
                let kind = if is_double { Kind::F64 } else { Kind::F32 };
                let mut kinds = vec![kind; numbers];
                if !head.is_even {
                    // Programs differ in whether the abscissa is as precise as the ordinate.
                    let narrow = head.points.saturating_mul(4 + 8 * numbers as u64);
                    kinds.insert(0, if is_double && stated as u64 != narrow { Kind::F64 } else { Kind::F32 });
                }
                let width: u64 = kinds.iter().map(|kind| kind.bytes() as u64).sum();
                let data = begin_of_data(bytes, head.points.saturating_mul(width))?;
                let present = (bytes.length() - data) / width;
                if head.points > present {
                    return Err(bytes.damaged(format!("{} points were declared, the file has {present}", head.points)));
                }
                bytes.seek(data + head.points * width)?;
                // The mark is behind the last number, or in one of the next lines.
                while bytes.line(LONGEST_LINE)?.is_some_and(|line| line.trim_ascii().is_empty()) {}
                (Layout::Binary { kinds, is_big_endian: order == 2 }, head.points, data)
            }
        };
        if points != head.points {
            let shown = self.input.path().display();
            self.remarks.push(format!("{shown}: `{}` has {points} points, {} were declared", head.name, head.points));
        }
        self.functions.push(Function { layout, points, data });
        self.add(&head, numbers, points)
    }

    /// The channels of a function.
    fn add(&mut self, head: &Head, numbers: usize, points: u64) -> Result<()> {
        let function = self.functions.len() - 1;
        let before = usize::from(!head.is_even);
        let kind = if matches!(head.kind, 4 | 6) { Kind::F64 } else { Kind::F32 };
        let is_time = head.abscissa == TIME || matches!(unit::known(&head.abscissa_unit), Some(Known::Seconds(_)));
        let (mut rate_hz, mut start_s) = (None, None);
        if is_time && head.is_even {
            rate_hz = (head.step > 0.0).then(|| head.step.recip());
            start_s = Some(head.first);
        } else if is_time {
            (rate_hz, start_s) = self.clock(function)?;
        }
        let same = |channel: &Channel| channel.group == head.group && channel.name == head.name;
        let again = self.channels.iter().filter(|channel| same(channel)).count();
        let name = if again == 0 { head.name.clone() } else { format!("{} #{}", head.name, again + 1) };
        let names = [name.clone(), format!("{name} (imaginary)")];
        for (number, name) in names.into_iter().take(numbers).enumerate() {
            let mut channel = Channel::new(head.group.clone(), name, kind, points);
            channel.unit = Some(head.unit.clone()).filter(|unit| !matches!(unit.as_str(), "" | "NONE"));
            (channel.rate_hz, channel.start_s) = (rate_hz, start_s);
            channel.properties.clone_from(&head.properties);
            self.channels.push(channel);
            self.parts.push((function, before + number));
        }
        if !head.is_even {
            let mut abscissa = Channel::new(head.group.clone(), format!("{name} (abscissa)"), kind, points);
            abscissa.unit = Some(head.abscissa_unit.clone()).filter(|unit| !matches!(unit.as_str(), "" | "NONE"));
            self.channels.push(abscissa);
            self.parts.push((function, 0));
        }
        Ok(())
    }

    /// Rate and start by an uneven abscissa that is even all the same.
    fn clock(&self, function: usize) -> Result<(Option<f64>, Option<f64>)> {
        let mut samples = self.samples_of(function, &[0])?;
        let (mut scan, mut column, mut first) = (ClockScan::default(), [Vec::new()], None);
        while samples.next(1 << 12, &mut column)? > 0 {
            for time in column[0].drain(..) {
                first = first.or(Some(time));
                if !time.is_finite() || scan.push(time).is_err() {
                    return Ok((None, first));
                }
            }
        }
        Ok((scan.rate_hz().unwrap_or(None), first))
    }

    /// Reads some numbers of each point of a function.
    fn samples_of(&self, function: usize, numbers: &[usize]) -> Result<Box<dyn Samples>> {
        let Function { layout, points, data } = &self.functions[function];
        match layout {
            Layout::Text(widths) => {
                let mut bytes = Bytes::open(&(&self.input).into())?;
                bytes.seek(*data)?;
                let (widths, numbers) = (widths.clone(), numbers.to_vec());
                let (line, found, rest) = (Vec::new(), Vec::new(), Vec::new());
                Ok(Box::new(TextSamples { bytes, widths, numbers, left: *points, line, found, rest }))
            }
            Layout::Binary { kinds, is_big_endian } => {
                let width: usize = kinds.iter().map(|kind| kind.bytes()).sum();
                let column = |number: &usize| {
                    let before: usize = kinds[..*number].iter().map(|kind| kind.bytes()).sum();
                    let run = Run::spaced(data + before as u64, *points, width as u64, kinds[*number], *is_big_endian);
                    Column { runs: vec![run], scaling: None }
                };
                let columns = numbers.iter().map(column).collect();
                Ok(Box::new(StridedSamples::open(&(&self.input).into(), columns)?))
            }
        }
    }
}

impl ChannelFile for Uff {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn read(&self, channels: &[usize]) -> Result<Box<dyn Samples>> {
        checked(&self.input.path().display().to_string(), &self.channels, channels)?;
        let part = |channel: &usize| {
            let (function, number) = self.parts[*channel];
            self.samples_of(function, &[number])
        };
        Ok(Box::new(SideBySide(channels.iter().map(part).collect::<Result<_>>()?)))
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }
}

impl Head {
    fn read(bytes: &mut Bytes) -> Result<Self> {
        let mut lines = Vec::with_capacity(11);
        for _ in 0..11 {
            let line = bytes.line(LONGEST_LINE)?;
            lines.push(line.ok_or_else(|| bytes.damaged("expected eleven records before the data, the file ends"))?);
        }
        let field = |line: usize, from: usize, width: usize| {
            let line: &[u8] = &lines[line];
            text(line.get(from.min(line.len())..(from + width).min(line.len())).unwrap_or_default())
        };
        let whole = |line, from, width| field(line, from, width).parse::<i64>();
        let real = |from| number(field(6, from, 13).as_bytes()).unwrap_or(0.0);
        let (Ok(kind), Ok(points)) = (whole(6, 0, 10), whole(6, 10, 10)) else {
            return Err(bytes.damaged("expected the form of the data in record 7"));
        };
        if !matches!(kind, 2 | 4 | 5 | 6) {
            return Err(bytes.damaged(format!("expected ordinates of type 2, 4, 5 or 6, found {kind}")));
        }
        let entity = field(5, 31, 10);
        let node = whole(5, 41, 10).unwrap_or(0);
        let direction = whole(5, 51, 4).unwrap_or(0);
        let place = if node == 0 {
            String::new()
        } else {
            format!("{node}{}", DIRECTIONS.get((direction + 6) as usize).unwrap_or(&""))
        };
        let entity = if entity == "NONE" { String::new() } else { entity };
        let name = match (entity.is_empty(), place.is_empty()) {
            (false, true) => entity,
            (false, false) => format!("{entity} {place}"),
            (true, false) => place,
            (true, true) => field(0, 0, 80),
        };
        let group = field(0, 0, 80);
        let properties = (0..5).map(|line| (format!("id{}", line + 1), field(line, 0, 80)));
        Ok(Self {
            group: if group == "NONE" { String::new() } else { group },
            name,
            kind,
            points: points.max(0) as u64,
            is_even: whole(6, 20, 10).unwrap_or(1) == 1,
            first: real(30),
            step: real(43),
            abscissa: whole(7, 0, 10).unwrap_or(0),
            abscissa_unit: field(7, 46, 21),
            unit: field(8, 46, 21),
            properties: properties.filter(|(_, value)| !matches!(value.as_str(), "" | "NONE")).collect(),
        })
    }
}

/// Where binary data begin: some programs put a line end before them, which the mark behind them shows.
fn begin_of_data(bytes: &mut Bytes, length: u64) -> Result<u64> {
    let data = bytes.place();
    for skipped in 0..3 {
        let end = data.saturating_add(skipped + length);
        if end <= bytes.length() {
            bytes.seek(end)?;
            let behind = bytes.take(bytes.rest().min(10))?;
            let start = behind.iter().position(|byte| !matches!(byte, b'\r' | b'\n')).unwrap_or(0);
            if behind[start..].starts_with(b"    -1") {
                bytes.seek(data)?;
                let before = bytes.take(skipped)?;
                if before.iter().all(|byte| matches!(byte, b'\r' | b'\n')) {
                    return Ok(data + skipped);
                }
            }
        }
    }
    Err(bytes.damaged(format!("expected {length} bytes of numbers and the mark `-1` behind them")))
}

/// Counts the points of data as text, and goes behind the mark at their end.
fn count(bytes: &mut Bytes, widths: &[usize]) -> Result<u64> {
    let (mut values, mut line, mut numbers) = (0, Vec::new(), Vec::new());
    while bytes.line_into(&mut line, LONGEST_LINE)? && !is_mark(&line) {
        if !parsed(&line, widths, &mut numbers) {
            return Err(bytes.damaged(format!("expected numbers, found `{}`", text(&line))));
        }
        values += numbers.len() as u64;
    }
    Ok(values / widths.len() as u64)
}

/// The numbers of a line: words, or else columns of fixed widths, whose numbers may touch each other.
fn parsed(line: &[u8], widths: &[usize], numbers: &mut Vec<f64>) -> bool {
    numbers.clear();
    let words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    let by_words = words.map(number).try_for_each(|value| value.map(|value| numbers.push(value)));
    if by_words.is_some() {
        return true;
    }
    numbers.clear();
    let (mut rest, mut column) = (line.trim_ascii_end(), 0);
    while !rest.is_empty() {
        let (cell, behind) = rest.split_at(widths[column % widths.len()].min(rest.len()));
        let Some(value) = number(cell.trim_ascii()) else { return false };
        numbers.push(value);
        (rest, column) = (behind, column + 1);
    }
    true
}

/// A number, also with the exponent of double precision of Fortran.
fn number(word: &[u8]) -> Option<f64> {
    let with_e = || String::from_utf8_lossy(word).replace(['D', 'd'], "E");
    let value = parse_number(word, b'.').or_else(|| parse_number(with_e().as_bytes(), b'.'));
    value.filter(|_| !word.is_empty())
}

/// Points as text.
struct TextSamples {
    bytes: Bytes,
    widths: Vec<usize>,
    numbers: Vec<usize>,
    /// Points that are still to be read.
    left: u64,
    line: Vec<u8>,
    found: Vec<f64>,
    /// Numbers of a point that goes on in the next line.
    rest: Vec<f64>,
}

impl Samples for TextSamples {
    fn next(&mut self, most: usize, columns: &mut [Vec<f64>]) -> Result<usize> {
        let (width, mut taken) = (self.widths.len(), 0);
        loop {
            let whole = (self.rest.len() / width).min(most - taken).min(self.left as usize);
            for point in self.rest.chunks_exact(width).take(whole) {
                for (number, column) in self.numbers.iter().zip(columns.iter_mut()) {
                    column.push(point[*number]);
                }
            }
            self.rest.drain(..whole * width);
            taken += whole;
            self.left -= whole as u64;
            if taken == most || self.left == 0 {
                return Ok(taken);
            }
            if !self.bytes.line_into(&mut self.line, LONGEST_LINE)? || is_mark(&self.line) {
                return Ok(taken);
            }
            if !parsed(&self.line, &self.widths, &mut self.found) {
                return Err(self.bytes.damaged("expected numbers"));
            }
            self.rest.extend_from_slice(&self.found);
        }
    }
}
