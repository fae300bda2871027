//! NPZ of NumPy: a ZIP archive of NPY arrays, stored or deflated.

use std::io::BufReader;

use runout_core::{Error, ErrorKind, Result, input_file::InputFile};
use zip::ZipArchive;

use super::{Format, npy::Arrays};
use crate::{channel::ChannelFile, source::Unpacking};

pub(super) const FORMAT: Format = Format {
    name: "npz",
    about: "NPZ (NumPy)",
    // The first member's name is behind 30 bytes.
    recognises: |head| {
        head.starts_with(b"PK\x03\x04")
            && head.iter().take(300).copied().collect::<Vec<u8>>().windows(4).any(|end| end == b".npy")
    },
    open: |input| open(input).map(|file| Box::new(file) as Box<dyn ChannelFile>),
};

/// Unpacks all arrays behind each other into a temporary file.
fn open(input: &InputFile) -> Result<Arrays> {
    let shown = input.path().display().to_string();
    let failed = |error: zip::result::ZipError| Error::caused("read", &shown, error).of(ErrorKind::DamagedData);
    let mut archive = ZipArchive::new(BufReader::new(input.open()?)).map_err(failed)?;
    let (mut unpacking, mut places) = (Unpacking::of(&shown)?, Vec::new());
    for number in 0..archive.len() {
        let mut member = archive.by_index(number).map_err(failed)?;
        let name = member.name().map_err(failed)?.into_owned();
        if let Some(name) = name.strip_suffix(".npy").map(str::to_owned) {
            let (begin, end) = unpacking.append(&mut member)?;
            places.push((name, begin, end));
        }
    }
    let mut arrays = Arrays::of(unpacking.finish()?);
    for (name, begin, end) in places {
        arrays.add(&name, begin, end)?;
    }
    Ok(arrays)
}
