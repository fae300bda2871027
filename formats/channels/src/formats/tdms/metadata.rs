//! Types, properties and the index of raw data in a segment's metadata.

use std::fmt;

use runout_core::Result;

use crate::{
    bytes::{Bytes, text},
    channel::Kind,
};

/// Codes of types.
const STRING: u32 = 0x20;
const BOOLEAN: u32 = 0x21;
const TIME: u32 = 0x44;
/// Raw data of DAQmx, whose scalers have types of their own.
const RAW: u32 = 0xFFFF_FFFF;
/// What stands in place of the length of an index.
const NONE: u32 = 0xFFFF_FFFF;
const AS_BEFORE: u32 = 0;
const FORMAT_CHANGING_SCALERS: u32 = 0x1269;
const DIGITAL_LINES: u32 = 0x126A;
/// 1904-01-01 to 1970-01-01, in s.
const EPOCH_S: i64 = 2_082_844_800;

/// The value of a property.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    Number(f64),
    Text(String),
    /// Seconds since 1970.
    Time(f64),
}

impl Value {
    pub(super) fn read(bytes: &mut Bytes) -> Result<Self> {
        let code = bytes.u32()?;
        Ok(match code {
            STRING => {
                let length = bytes.u32()?;
                Self::Text(text(&bytes.take(length.into())?))
            }
            TIME => Self::Time(time_s(bytes)?),
            1 => Self::Number(f64::from(i8::from_le_bytes(bytes.array()?))),
            2 => Self::Number(f64::from(bytes.u16()?.cast_signed())),
            3 => Self::Number(f64::from(bytes.i32()?)),
            4 => Self::Number(bytes.i64()? as f64),
            5 | BOOLEAN => Self::Number(f64::from(bytes.u8()?)),
            6 => Self::Number(f64::from(bytes.u16()?)),
            7 => Self::Number(f64::from(bytes.u32()?)),
            8 => Self::Number(bytes.u64()? as f64),
            9 | 0x19 => Self::Number(f64::from(bytes.f32()?)),
            10 | 0x1A => Self::Number(bytes.f64()?),
            other => {
                let Some(width) = width_of(other) else {
                    return Err(bytes.damaged(format!("expected the type of a property, found the code {other:#x}")));
                };
                bytes.skip(width)?;
                Self::Text("not read".into())
            }
        })
    }

    pub(super) fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            _ => None,
        }
    }

    pub(super) fn text(&self) -> Option<String> {
        match self {
            Self::Text(text) => Some(text.clone()),
            _ => None,
        }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(formatter, "{number}"),
            Self::Text(text) => formatter.write_str(text),
            Self::Time(seconds) => write!(formatter, "{seconds} s since 1970"),
        }
    }
}

/// Fractions of 2⁻⁶⁴ s and seconds since 1904, the higher part last.
fn time_s(bytes: &mut Bytes) -> Result<f64> {
    let (fraction, seconds) = if bytes.is_big_endian {
        let seconds = bytes.i64()?;
        (bytes.u64()?, seconds)
    } else {
        (bytes.u64()?, bytes.i64()?)
    };
    Ok(seconds.saturating_sub(EPOCH_S) as f64 + fraction as f64 * 2f64.powi(-64))
}

/// Bytes of a value of a type that only counts as skipped.
fn width_of(code: u32) -> Option<u64> {
    match code {
        0x08_000C => Some(8),
        11 | 0x1B | TIME | 0x4F | 0x10_000D => Some(16),
        0 => Some(0),
        _ => None,
    }
}

/// The kind of a type's numbers, and their width in bytes; a text has none.
fn kind_of(code: u32) -> Option<(Kind, u64)> {
    let kind = match code {
        1 => Kind::I8,
        2 => Kind::I16,
        3 => Kind::I32,
        4 => Kind::I64,
        5 => Kind::U8,
        6 => Kind::U16,
        7 => Kind::U32,
        8 => Kind::U64,
        9 | 0x19 => Kind::F32,
        10 | 0x1A => Kind::F64,
        BOOLEAN => Kind::Bool,
        STRING => Kind::Text,
        other => return width_of(other).map(|width| (Kind::Other, width)),
    };
    Some((kind, kind.bytes() as u64))
}

/// What a segment says of an object's raw data.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Stated {
    None,
    AsBefore,
    Index(Index),
}

/// How the raw data of an object lie in a chunk.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Index {
    pub(super) kind: Kind,
    pub(super) width: u64,
    /// Values in a chunk.
    pub(super) values: u64,
    /// Bytes in a chunk, of texts.
    pub(super) text_bytes: u64,
    pub(super) daqmx: Option<Daqmx>,
}

/// Raw data of DAQmx.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Daqmx {
    pub(super) scalers: Vec<Scaler>,
    /// Bytes of one instant in each raw buffer.
    pub(super) widths: Vec<u64>,
}

/// Where a DAQmx scaler reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scaler {
    pub(super) id: u32,
    pub(super) kind: Kind,
    pub(super) buffer: usize,
    /// In an instant of the buffer.
    pub(super) byte: u64,
    /// Of a digital line.
    pub(super) bit: Option<u32>,
}

impl Stated {
    pub(super) fn read(bytes: &mut Bytes) -> Result<Self> {
        match bytes.u32()? {
            NONE => Ok(Self::None),
            AS_BEFORE => Ok(Self::AsBefore),
            header @ (FORMAT_CHANGING_SCALERS | DIGITAL_LINES) => Index::daqmx(bytes, header).map(Self::Index),
            _ => Index::read(bytes).map(Self::Index),
        }
    }
}

impl Index {
    fn read(bytes: &mut Bytes) -> Result<Self> {
        let code = bytes.u32()?;
        let (dimension, values) = (bytes.u32()?, bytes.u64()?);
        let Some((kind, width)) = kind_of(code) else {
            return Err(bytes.damaged(format!("expected a type of raw data, found the code {code:#x}")));
        };
        if dimension != 1 {
            return Err(bytes.damaged(format!("expected arrays of 1 dimension, found {dimension}")));
        }
        let text_bytes = if kind == Kind::Text { bytes.u64()? } else { 0 };
        Ok(Self { kind, width, values, text_bytes, daqmx: None })
    }

    fn daqmx(bytes: &mut Bytes, header: u32) -> Result<Self> {
        let (code, _dimension, values) = (bytes.u32()?, bytes.u32()?, bytes.u64()?);
        let mut scalers = Vec::new();
        for _ in 0..bytes.u32()? {
            let (kind, buffer, place) = (bytes.u32()?, bytes.u32()? as usize, bytes.u32()?);
            let is_line = header == DIGITAL_LINES;
            bytes.skip(if is_line { 1 } else { 4 })?;
            let id = bytes.u32()?;
            let Some(kind) = scaler_kind(kind) else {
                return Err(bytes.damaged(format!("expected a type of a DAQmx scaler, found the code {kind:#x}")));
            };
            let (byte, bit) = if is_line { (place / 8, Some(place % 8)) } else { (place, None) };
            scalers.push(Scaler { id, kind, buffer, byte: byte.into(), bit });
        }
        let count = bytes.u32()?;
        let widths = (0..count).map(|_| bytes.u32().map(u64::from)).collect::<Result<Vec<u64>>>()?;
        let outside = |scaler: &Scaler| {
            let width = widths.get(scaler.buffer).copied().unwrap_or(0);
            scaler.byte.saturating_add(scaler.kind.bytes() as u64) > width
        };
        if scalers.is_empty() || scalers.iter().any(outside) {
            return Err(bytes.damaged("expected DAQmx scalers inside their raw buffers"));
        }
        if code != RAW && scalers.len() != 1 {
            return Err(bytes.damaged(format!("expected one DAQmx scaler of a typed channel, found {}", scalers.len())));
        }
        let kind = scalers[0].kind;
        Ok(Self { kind, width: 0, values, text_bytes: 0, daqmx: Some(Daqmx { scalers, widths }) })
    }

    /// Bytes in a chunk, of data that are no DAQmx data.
    pub(super) fn chunk_bytes(&self) -> Option<u64> {
        if self.kind == Kind::Text { Some(self.text_bytes) } else { self.values.checked_mul(self.width) }
    }
}

fn scaler_kind(code: u32) -> Option<Kind> {
    Some(match code {
        0 => Kind::U8,
        1 => Kind::I8,
        2 => Kind::U16,
        3 => Kind::I16,
        4 => Kind::U32,
        5 => Kind::I32,
        6 => Kind::U64,
        7 => Kind::I64,
        8 => Kind::F32,
        9 => Kind::F64,
        _ => return None,
    })
}
