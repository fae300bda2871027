//! NPY of NumPy: a header that is a Python dictionary, and an array of numbers or records (NumPy enhancement proposal 1).

use std::sync::Arc;

use runout_core::{Result, input_file::InputFile};

use super::Format;
use crate::{
    bytes::Bytes,
    channel::{Channel, ChannelFile, Kind, Samples, checked},
    lines::lines,
    source::Source,
    strided::{Column, Linear, Run, StridedSamples},
};

pub(super) const FORMAT: Format = Format {
    name: "npy",
    about: "NPY (NumPy)",
    recognises: |head| head.starts_with(MAGIC),
    open: |input| open(input).map(|file| Box::new(file) as Box<dyn ChannelFile>),
};

const MAGIC: &[u8] = b"\x93NUMPY";
/// Longest header that is read.
const LONGEST_HEADER: u64 = 1 << 20;
/// What an array is named that has no name.
const ARRAY: &str = "data";

/// Channels of one or several arrays in the same bytes.
pub(super) struct Arrays {
    source: Source,
    channels: Vec<Channel>,
    data: Vec<(Run, Option<Linear>)>,
}

fn open(input: &InputFile) -> Result<Arrays> {
    let mut arrays = Arrays::of(input.into());
    arrays.add("", 0, input.bytes())?;
    Ok(arrays)
}

impl Arrays {
    pub(super) fn of(source: Source) -> Self {
        Self { source, channels: Vec::new(), data: Vec::new() }
    }

    /// Adds the channels of an array in some bytes of the source.
    pub(super) fn add(&mut self, name: &str, begin: u64, end: u64) -> Result<()> {
        let mut bytes = Bytes::open(&self.source)?;
        bytes.seek(begin)?;
        if bytes.array::<6>()? != *MAGIC {
            return Err(bytes.damaged("expected an array of NumPy"));
        }
        let [version, _] = bytes.array()?;
        let length = if version < 2 { u64::from(bytes.u16()?) } else { u64::from(bytes.u32()?) };
        let header = bytes.take(length.min(LONGEST_HEADER))?;
        // Up to version 2 it is Latin-1, whose bytes are the first 256 characters.
        let latin = || header.iter().map(|byte| char::from(*byte)).collect();
        let header = if version < 3 { latin() } else { String::from_utf8_lossy(&header).into_owned() };
        let Some(array) = Array::parsed(&header) else {
            return Err(bytes.damaged(format!("expected a header of NumPy with numbers, found `{}`", header.trim())));
        };
        let data = bytes.place();
        let elements = array.shape.iter().try_fold(1_u64, |product, extent| product.checked_mul(*extent));
        let stated = elements.and_then(|elements| elements.checked_mul(array.width));
        if stated.is_none_or(|stated| stated > end.saturating_sub(data)) {
            let problem = format!(
                "the shape {:?} was declared, the file has {} bytes for it",
                array.shape,
                end.saturating_sub(data)
            );
            return Err(bytes.damaged(problem));
        }
        self.channels_of(name, &array, data, &mut bytes)
    }

    fn channels_of(&mut self, name: &str, array: &Array, data: u64, bytes: &mut Bytes) -> Result<()> {
        let mut strides = vec![array.width; array.shape.len()];
        let inwards: Vec<usize> = if array.is_fortran {
            (1..strides.len()).collect()
        } else {
            (0..strides.len().saturating_sub(1)).rev().collect()
        };
        for dimension in inwards {
            let inner = if array.is_fortran { dimension - 1 } else { dimension + 1 };
            strides[dimension] = strides[inner] * array.shape[inner];
        }
        // Of an array of more dimensions nothing is a channel.
        for line in lines(&array.shape, &strides).unwrap_or_default() {
            for field in &array.fields {
                let (group, plain) = if field.name.is_empty() {
                    (String::new(), if name.is_empty() { ARRAY } else { name }.to_owned())
                } else {
                    (name.to_owned(), field.name.clone())
                };
                let mut channel = Channel::new(group, plain + &line.suffix, field.kind, line.samples);
                let place = data + line.offset + field.offset;
                let run =
                    Run::spaced(place, line.samples, line.stride.max(array.width), field.kind, field.is_big_endian);
                let mut scaling = None;
                if let (Kind::Time, Some(unit_s)) = (field.kind, field.unit_s) {
                    // Counted from the first, so that digits are left for the steps.
                    bytes.seek(run.offset)?;
                    bytes.is_big_endian = field.is_big_endian;
                    let first = if line.samples > 0 { bytes.i64()? } else { 0 };
                    scaling = Some(Linear { gain: unit_s, offset: -(first as f64) * unit_s });
                    channel.unit = Some("s".into());
                    channel.properties.push(("first_since_1970_s".into(), (first as f64 * unit_s).to_string()));
                }
                channel.limits = field.kind.codes();
                self.channels.push(channel);
                self.data.push((run, scaling));
            }
        }
        Ok(())
    }
}

impl ChannelFile for Arrays {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn read(&self, channels: &[usize]) -> Result<Box<dyn Samples>> {
        checked(&self.source.shown(), &self.channels, channels)?;
        let column = |channel: &usize| {
            let (run, scaling) = self.data[*channel];
            Column { runs: vec![run], scaling: scaling.map(|scaling| Arc::new(scaling) as _) }
        };
        Ok(Box::new(StridedSamples::open(&self.source, channels.iter().map(column).collect())?))
    }
}

/// What a header says.
struct Array {
    shape: Vec<u64>,
    is_fortran: bool,
    /// Bytes of an element.
    width: u64,
    fields: Vec<Field>,
}

/// A number in each element.
struct Field {
    name: String,
    kind: Kind,
    is_big_endian: bool,
    offset: u64,
    /// Seconds of a unit of time.
    unit_s: Option<f64>,
}

impl Array {
    /// From `{'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }`.
    fn parsed(header: &str) -> Option<Self> {
        let Literal::Table(entries) = Literal::parsed(header)? else { return None };
        let entry = |wanted: &str| entries.iter().find(|(name, _)| name == wanted).map(|(_, value)| value);
        let Literal::List(shape) = entry("shape")? else { return None };
        let shape = shape.iter().map(|extent| extent.word()?.parse().ok()).collect::<Option<Vec<u64>>>()?;
        let (mut fields, mut width) = (Vec::new(), 0);
        match entry("descr")? {
            Literal::List(records) => {
                for record in records {
                    add_fields(record, &mut fields, &mut width)?;
                }
            }
            descr => add("", descr.word()?, 1, &mut fields, &mut width)?,
        }
        let is_fortran = entry("fortran_order")?.word() == Some("True");
        Some(Self { shape, is_fortran, width, fields })
    }
}

/// Fields of `('name', '<f8')` or `('name', '<f8', (2,))`; a name may be a pair of title and name.
fn add_fields(record: &Literal, fields: &mut Vec<Field>, width: &mut u64) -> Option<()> {
    let Literal::List(parts) = record else { return None };
    let name = match parts.first()? {
        Literal::List(names) => names.last()?.word()?,
        name => name.word()?,
    };
    let count = match parts.get(2) {
        None => 1,
        Some(Literal::List(shape)) => {
            let extents = shape.iter().map(|extent| extent.word()?.parse::<u64>().ok()).collect::<Option<Vec<_>>>()?;
            extents.iter().try_fold(1_u64, |product, extent| product.checked_mul(*extent))?
        }
        Some(count) => count.word()?.parse().ok()?,
    };
    add(name, parts.get(1)?.word()?, count, fields, width)
}

/// More numbers of one element are no channels.
const MOST_FIELDS: u64 = 4096;

fn add(name: &str, code: &str, count: u64, fields: &mut Vec<Field>, width: &mut u64) -> Option<()> {
    let mut characters = code.chars();
    let is_big_endian = characters.next()? == '>';
    let letter = characters.next()?;
    let rest = characters.as_str();
    let (size, unit) = rest.split_once('[').map_or((rest, None), |(size, unit)| (size, unit.strip_suffix(']')));
    let size: u64 = size.parse().ok()?;
    let kind = match (letter, size) {
        ('b', 1) => Kind::Bool,
        ('i', 1) => Kind::I8,
        ('i', 2) => Kind::I16,
        ('i', 4) => Kind::I32,
        ('i', 8) => Kind::I64,
        ('u', 1) => Kind::U8,
        ('u', 2) => Kind::U16,
        ('u', 4) => Kind::U32,
        ('u', 8) => Kind::U64,
        ('f', 2) => Kind::F16,
        ('f', 4) => Kind::F32,
        ('f', 8) => Kind::F64,
        ('M' | 'm', 8) => Kind::Time,
        ('S' | 'U' | 'a', _) => Kind::Text,
        ('O', _) => return None,
        _ => Kind::Other,
    };
    let unit_s = unit.and_then(|unit| match unit {
        "s" => Some(1.0),
        "ms" => Some(1e-3),
        "us" => Some(1e-6),
        "ns" => Some(1e-9),
        _ => None,
    });
    let kind = if kind == Kind::Time && unit_s.is_none() { Kind::Other } else { kind };
    let bytes = if letter == 'U' { size.checked_mul(4)? } else { size };
    for number in 0..count {
        if fields.len() as u64 >= MOST_FIELDS {
            return None;
        }
        let name = if count == 1 { name.to_owned() } else { format!("{name}[{number}]") };
        // An empty name is padding.
        if count == 1 || !name.is_empty() {
            fields.push(Field { name, kind, is_big_endian, offset: *width, unit_s });
        }
        *width = width.checked_add(bytes)?;
    }
    Some(())
}

/// A literal of Python.
#[derive(Debug)]
enum Literal {
    /// A text, a number or a name.
    Word(String),
    List(Vec<Literal>),
    Table(Vec<(String, Literal)>),
}

/// Lists in lists of a header.
const DEEPEST: usize = 8;

impl Literal {
    fn parsed(text: &str) -> Option<Self> {
        Self::next(&mut text.trim_start(), 0)
    }

    fn word(&self) -> Option<&str> {
        match self {
            Self::Word(word) => Some(word),
            _ => None,
        }
    }

    fn next(rest: &mut &str, depth: usize) -> Option<Self> {
        let first = rest.chars().next().filter(|_| depth < DEEPEST)?;
        match first {
            '\'' | '"' => {
                let (word, behind) = rest[1..].split_once(first)?;
                *rest = behind.trim_start();
                Some(Self::Word(word.to_owned()))
            }
            '(' | '[' | '{' => {
                let end = ")]}".chars().nth("([{".find(first)?)?;
                *rest = rest[1..].trim_start();
                let (mut items, mut entries) = (Vec::new(), Vec::new());
                while !rest.starts_with(end) {
                    let item = Self::next(rest, depth + 1)?;
                    if first == '{' {
                        *rest = rest.strip_prefix(':')?.trim_start();
                        entries.push((item.word()?.to_owned(), Self::next(rest, depth + 1)?));
                    } else {
                        items.push(item);
                    }
                    match rest.strip_prefix(',') {
                        Some(behind) => *rest = behind.trim_start(),
                        None if rest.starts_with(end) => {}
                        None => return None,
                    }
                }
                *rest = rest[1..].trim_start();
                Some(if first == '{' { Self::Table(entries) } else { Self::List(items) })
            }
            _ => {
                let end =
                    rest.find(|character: char| !(character.is_ascii_alphanumeric() || "_.-+".contains(character)));
                let (word, behind) = rest.split_at(end.filter(|end| *end > 0)?);
                *rest = behind.trim_start();
                // Python 2 wrote long numbers as 3L.
                Some(Self::Word(word.trim_end_matches('L').to_owned()))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    #[test]
    fn headers_are_literals_of_python() {
        let array = Array::parsed(
            "{'descr': [('a', '<f8'), ('', '|V3'), ('b', '>i2', (2,))], 'fortran_order': True, 'shape': (3L,), }",
        )
        .unwrap();
        assert_eq!((array.width, array.shape, array.is_fortran), (15, vec![3], true));
        let fields: Vec<(&str, u64)> = array.fields.iter().map(|field| (field.name.as_str(), field.offset)).collect();
        assert_eq!(fields, [("a", 0), ("", 8), ("b[0]", 11), ("b[1]", 13)]);
        for text in [
            "",
            "{",
            "{'descr': '<f8'}",
            "[[[[[[[[[[",
            "{'descr': '|O', 'fortran_order': False, 'shape': (3,)}",
            "{'descr': '<f8', 'shape': (-1,)}",
        ] {
            assert!(Array::parsed(text).is_none(), "{text}");
        }
    }
}
