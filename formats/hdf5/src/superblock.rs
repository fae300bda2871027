//! What a file says of its own length: the end of file in its superblock (HDF5 File Format Specification 3.0, II.A).

use std::io::{Read, Seek, SeekFrom};

use runout_core::{Error, Result, input_file::InputFile};

const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Bytes of a superblock that are examined.
const HEAD: usize = 64;
/// The signature stands at 0, or at a power of two from here on.
const FIRST: u64 = 512;

/// A remark where a file is longer than it says. One that is shorter the library refuses itself.
pub(crate) fn remark(input: &InputFile) -> Result<Option<String>> {
    let shown = input.path().display().to_string();
    let failure = |error: std::io::Error| Error::caused("read", &shown, error);
    let mut file = input.open()?;
    let places = std::iter::once(0).chain((0..).map(|power| FIRST << power).take_while(|place| *place < input.bytes()));
    for place in places.take(u64::BITS as usize) {
        let mut head = Vec::new();
        file.seek(SeekFrom::Start(place)).map_err(failure)?;
        (&mut file).take(HEAD as u64).read_to_end(&mut head).map_err(failure)?;
        if !head.starts_with(SIGNATURE) {
            continue;
        }
        let Some(end) = end_of_file(&head) else { return Ok(None) };
        let beyond = input.bytes().saturating_sub(place.saturating_add(end));
        return Ok((beyond > 0 && end > 0).then(|| {
            format!(
                "{shown}: the file is {beyond} bytes longer than it says: something was added to it, or it is damaged"
            )
        }));
    }
    Ok(None)
}

/// The end of file, counted from the signature, of the versions with addresses of eight bytes.
fn end_of_file(head: &[u8]) -> Option<u64> {
    let (width, base, end) = match *head.get(SIGNATURE.len())? {
        version @ 0..=1 => (*head.get(13)?, 24 + 4 * usize::from(version), 40 + 4 * usize::from(version)),
        2..=3 => (*head.get(9)?, 12, 28),
        _ => return None,
    };
    let number = |at: usize| Some(u64::from_le_bytes(*head.get(at..)?.first_chunk()?));
    let (base, end) = (number(base)?, number(end)?);
    (width == 8).then(|| end.saturating_sub(base))
}
