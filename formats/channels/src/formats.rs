//! The formats: the one list. A format is a module that recognises a file by its first bytes and opens it as channels.

mod arrow;
mod hdf5;
mod mat;
mod npy;
mod npz;
mod tdms;
mod text;
mod uff;
mod wav;

use std::io::Read;

use runout_core::{Error, ErrorKind, Result, input_file::InputFile};

use crate::{channel::ChannelFile, hints};

/// A format of files.
pub struct Format {
    /// Its name in `[load] format`.
    pub name: &'static str,
    /// Who writes it, for messages and lists.
    pub about: &'static str,
    /// Whether a file is of this format, by its first bytes.
    pub recognises: fn(&[u8]) -> bool,
    /// Opens a file.
    pub open: fn(&InputFile) -> Result<Box<dyn ChannelFile>>,
}

/// Every format, in the order in which they are asked.
pub const FORMATS: [Format; 10] = [
    tdms::FORMAT,
    mat::FORMAT,
    hdf5::FORMAT,
    npy::FORMAT,
    npz::FORMAT,
    arrow::PARQUET,
    arrow::FORMAT,
    uff::FORMAT,
    wav::FORMAT,
    text::FORMAT,
];

/// The format without a signature.
pub(crate) const TEXT: &str = text::FORMAT.name;
/// First bytes that formats examine.
const HEAD: u64 = 4096;

/// The format of a file, by its name or by the file's first bytes.
///
/// # Errors
/// When the file cannot be read, or is of none of the formats.
pub fn format_of(input: &InputFile, name: Option<&str>) -> Result<&'static Format> {
    let shown = || input.path().display().to_string();
    if let Some(name) = name {
        return FORMATS.iter().find(|format| format.name == name).ok_or_else(|| {
            Error::new("open", shown(), format!("there is no format `{name}`")).of(ErrorKind::Configuration)
        });
    }
    let mut head = Vec::new();
    let read = input.open()?.take(HEAD).read_to_end(&mut head);
    read.map_err(|error| Error::caused("read", shown(), error))?;
    FORMATS.iter().find(|format| (format.recognises)(&head)).ok_or_else(|| {
        let names: Vec<&str> = FORMATS.iter().map(|format| format.about).collect();
        Error::new("open", shown(), "its first bytes are of no format that is known here")
            .of(ErrorKind::DamagedData)
            .help(format!(
                "known: {}. The programs of closed formats (Lion SEA, ADRE, Dewesoft) export text, MAT or UFF",
                names.join("; ")
            ))
    })
}

/// Opens a file of named channels; `format` overrides what its first bytes say.
///
/// # Errors
/// When it cannot be read, is of no known format, or is damaged.
pub fn open(input: &InputFile, format: Option<&str>) -> Result<Box<dyn ChannelFile>> {
    (format_of(input, format)?.open)(input).map(hints::hinted)
}
