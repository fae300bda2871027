//! What a file of named channels is: what every format gives, and all that it gives.

use runout_core::{Error, Result};
use serde::Serialize;

/// An opened file.
pub trait ChannelFile: Send + Sync {
    /// The channels, in the file's order.
    fn channels(&self) -> &[Channel];

    /// Reads some channels side by side from their first sample on; each ends where its own samples do.
    ///
    /// # Errors
    /// When a channel holds text, or the file cannot be opened again.
    fn read(&self, channels: &[usize]) -> Result<Box<dyn Samples>>;

    /// What a reader should know of the file: what is missing at its end, what is not read.
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }
}

/// Samples of some channels, block after block.
pub trait Samples: Send {
    /// Appends up to `most` samples to the column of each channel, `most` at least 1, and gives how many the longest got: 0 at the end.
    ///
    /// # Errors
    /// When the file cannot be read.
    fn next(&mut self, most: usize, columns: &mut [Vec<f64>]) -> Result<usize>;
}

/// A named sequence of numbers.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Channel {
    /// The group, variable or folder in the file that it belongs to, levels separated by `/`; empty where the format has none.
    pub group: String,
    /// Its name in the group.
    pub name: String,
    /// Unit of the numbers as the file has it.
    pub unit: Option<String>,
    /// How the numbers are stored: `i16`, `f64`, `text`.
    pub kind: Kind,
    /// Number of samples.
    pub samples: u64,
    /// Sampling rate, where the file states it.
    pub rate_hz: Option<f64>,
    /// Time of the first sample from the trigger or the beginning of the recording, in s.
    pub start_s: Option<f64>,
    /// Lowest and highest number that the converter can give, where it is known.
    pub limits: Option<[f64; 2]>,
    /// What else the file says of it.
    pub properties: Vec<(String, String)>,
}

impl Channel {
    /// A channel of a group.
    #[must_use]
    pub fn new(group: impl Into<String>, name: impl Into<String>, kind: Kind, samples: u64) -> Self {
        Self { group: group.into(), name: name.into(), kind, samples, ..Self::default() }
    }

    /// Group and name: `Run 0/Displ X1`.
    #[must_use]
    pub fn path(&self) -> String {
        if self.group.is_empty() { self.name.clone() } else { format!("{}/{}", self.group, self.name) }
    }
}

/// How the numbers of a channel are stored.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs, reason = "their names are their meanings")]
pub enum Kind {
    U8,
    I8,
    U16,
    I16,
    /// 24 bits, as sound cards have it.
    I24,
    U32,
    I32,
    U64,
    I64,
    F16,
    F32,
    #[default]
    F64,
    Bool,
    /// Digits as text, or decimals.
    Decimal,
    /// A point of time.
    Time,
    /// Not numbers.
    Text,
    /// Numbers of a kind that is not read: complex, extended precision.
    Other,
}

impl Kind {
    /// Its name: `i16`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::U8 => "u8",
            Self::I8 => "i8",
            Self::U16 => "u16",
            Self::I16 => "i16",
            Self::I24 => "i24",
            Self::U32 => "u32",
            Self::I32 => "i32",
            Self::U64 => "u64",
            Self::I64 => "i64",
            Self::F16 => "f16",
            Self::F32 => "f32",
            Self::F64 => "f64",
            Self::Bool => "bool",
            Self::Decimal => "decimal",
            Self::Time => "time",
            Self::Text => "text",
            Self::Other => "other",
        }
    }

    /// Bytes of a stored number; 0 where it has no fixed length.
    #[must_use]
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 | Self::Bool => 1,
            Self::U16 | Self::I16 | Self::F16 => 2,
            Self::I24 => 3,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 | Self::Time => 8,
            Self::Decimal | Self::Text | Self::Other => 0,
        }
    }

    /// Whether its samples can be read.
    #[must_use]
    pub fn is_number(self) -> bool {
        !matches!(self, Self::Text | Self::Other)
    }

    /// Lowest and highest code of the whole numbers that converters give.
    #[must_use]
    pub fn codes(self) -> Option<[f64; 2]> {
        match self {
            Self::U8 => Some([0.0, 255.0]),
            Self::I8 => Some([-128.0, 127.0]),
            Self::U16 => Some([0.0, 65535.0]),
            Self::I16 => Some([-32768.0, 32767.0]),
            Self::I24 => Some([-8_388_608.0, 8_388_607.0]),
            Self::U32 => Some([0.0, 4_294_967_295.0]),
            Self::I32 => Some([-2_147_483_648.0, 2_147_483_647.0]),
            _ => None,
        }
    }
}

/// Channels of a file by their indices; each has to be there and to hold numbers.
pub(crate) fn checked<'a>(shown: &str, all: &'a [Channel], wanted: &[usize]) -> Result<Vec<&'a Channel>> {
    let of = |index: &usize| {
        let error = |problem: String| Err(Error::new("read", shown, problem));
        match all.get(*index) {
            None => error(format!("there is no channel {index}, the file has {}", all.len())),
            Some(channel) if !channel.kind.is_number() => {
                error(format!("expected numbers in the channel `{}`, found {}", channel.path(), channel.kind.name()))
            }
            Some(channel) => Ok(channel),
        }
    };
    wanted.iter().map(of).collect()
}

/// Readers of one channel each.
pub(crate) struct SideBySide(pub(crate) Vec<Box<dyn Samples>>);

impl Samples for SideBySide {
    fn next(&mut self, most: usize, columns: &mut [Vec<f64>]) -> Result<usize> {
        let mut longest = 0;
        for (samples, column) in self.0.iter_mut().zip(columns) {
            let before = column.len();
            while column.len() - before < most
                && samples.next(most - (column.len() - before), std::slice::from_mut(column))? > 0
            {}
            longest = longest.max(column.len() - before);
        }
        Ok(longest)
    }
}
