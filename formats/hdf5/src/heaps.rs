//! Damage that the HDF5 library would go round in for ever.
//!
//! Texts of any length lie in global heaps: collections of objects, one after the other (HDF5 File Format Specification 3.0, III.E).
//! libhdf5 2.2 goes from object to object by their stated lengths, and stays at one that leads nowhere: an object 0 of length 0, or a
//! length that overflows. So they are examined before it reads texts; what else may be wrong with them it finds itself.

use std::{
    collections::HashSet,
    io::{Read, Seek, SeekFrom},
    ops::Range,
};

use hdf5_metno::{Dataset, File, Group, LinkType, LocationType};
use memchr::memmem;
use runout_core::{Error, ErrorKind, Result, input_file::InputFile};

/// What a collection begins with: its signature, and the one version that there is.
const SIGNATURE: &[u8] = b"GCOL\x01\0\0\0";
/// Bytes of a collection's header, its length the last eight; and of an object's.
const HEADER: usize = 16;
/// Bytes that are looked through at once.
const PIECE: usize = 1 << 20;
/// Most bytes of a collection that are examined: the library makes them of 4 to 64 kB, or for one longer text. A damaged length
/// is not to fill the memory.
const LONGEST: u64 = 1 << 24;
/// In larger files, data are passed over, which takes an examination of every dataset.
const SMALL: u64 = 1 << 24;
/// Groups in groups that data are looked for in, and objects that are examined. What lies in others is looked through.
const DEEPEST: usize = 6;
const MOST_OBJECTS: usize = 20_000;

/// Refuses a file with a heap that has no end.
pub(crate) fn check(file: &File, input: &InputFile) -> Result<()> {
    let shown = input.path().display().to_string();
    let failure = |error: std::io::Error| Error::caused("read", &shown, error);
    let (mut source, end) = (input.open()?, input.bytes());
    let mut data = Vec::new();
    if end > SMALL {
        Objects::default().extents(file, DEEPEST, &mut data);
        data.sort_unstable_by_key(|extent| extent.start);
    }
    let mut from = 0;
    for extent in data.into_iter().chain(std::iter::once(end..end)) {
        let endless = find(&mut source, from..extent.start.min(end)).map_err(&failure)?;
        if let Some(place) = endless {
            let problem = format!("it is damaged: the texts at byte {place} have no end");
            let error = Error::new("read", &shown, problem).of(ErrorKind::DamagedData);
            return Err(error.help("copy the file again from where it was recorded"));
        }
        from = from.max(extent.end);
    }
    Ok(())
}

/// Objects on a walk through a file, each of which is visited once.
#[derive(Default)]
struct Objects {
    /// Those with several links, which may lead in a circle, by their tokens' text: tokens cannot be hashed.
    known: HashSet<String>,
    visited: usize,
    /// Whether some were left out.
    cut: bool,
}

impl Objects {
    /// Where the numbers of the datasets lie.
    fn extents(&mut self, group: &Group, deepest: usize, found: &mut Vec<Range<u64>>) {
        let mut groups = Vec::new();
        // What the library cannot say is looked through.
        let _ = group.iter_visit_default(|name, link| {
            self.visited += 1;
            self.cut |= self.visited > MOST_OBJECTS;
            if link.link_type != LinkType::Hard || self.visited > MOST_OBJECTS {
                return Ok(());
            }
            let Ok(info) = group.loc_info_by_name(name) else { return Ok(()) };
            if info.num_links > 1 && !self.known.insert(format!("{:?}", info.token)) {
                return Ok(());
            }
            match info.loc_type {
                LocationType::Group => groups.push(name.to_owned()),
                LocationType::Dataset => group.dataset(name).iter().for_each(|dataset| extent(dataset, found)),
                _ => {}
            }
            Ok(())
        });
        self.cut |= deepest == 0 && !groups.is_empty();
        if deepest > 0 {
            for group in groups.iter().filter_map(|name| group.group(name).ok()) {
                self.extents(&group, deepest - 1, found);
            }
        }
    }
}

/// Where the numbers of all datasets lie; `None` where these are too many to be examined.
pub(crate) fn all_data(file: &File) -> Option<Vec<Range<u64>>> {
    let (mut objects, mut found) = (Objects::default(), Vec::new());
    objects.extents(file, DEEPEST, &mut found);
    (!objects.cut).then_some(found)
}

/// Where the numbers of a dataset lie.
fn extent(dataset: &Dataset, found: &mut Vec<Range<u64>>) {
    match dataset.offset() {
        Some(start) => found.push(start..start.saturating_add(dataset.storage_size())),
        // Where no offset is known, the chunks are visited.
        None => {
            let _ = dataset.chunks_visit(|chunk| {
                found.push(chunk.addr..chunk.addr.saturating_add(chunk.size));
                0
            });
        }
    }
}

/// The first collection without an end that begins in a range.
fn find(source: &mut (impl Read + Seek), range: Range<u64>) -> std::io::Result<Option<u64>> {
    let mut bytes = Vec::new();
    let mut from = range.start;
    while from < range.end {
        let length = (range.end - from).min(PIECE as u64);
        // A signature may reach into the next piece.
        read(source, from, length + SIGNATURE.len() as u64 - 1, &mut bytes)?;
        let places: Vec<u64> = memmem::find_iter(&bytes, SIGNATURE).map(|place| from + place as u64).collect();
        for place in places {
            read(source, place, HEADER as u64, &mut bytes)?;
            let length = number(&bytes, 8).unwrap_or(0).min(LONGEST);
            read(source, place, length, &mut bytes)?;
            if is_endless(&bytes) {
                return Ok(Some(place));
            }
        }
        from += length;
    }
    Ok(None)
}

/// Reads as many bytes as are there, `length` at most.
fn read(source: &mut (impl Read + Seek), from: u64, length: u64, bytes: &mut Vec<u8>) -> std::io::Result<()> {
    bytes.clear();
    source.seek(SeekFrom::Start(from))?;
    source.take(length).read_to_end(bytes).map(|_| ())
}

/// Whether going through a collection never ends.
fn is_endless(collection: &[u8]) -> bool {
    let mut at = HEADER;
    while let (Some(index), Some(length)) = (collection.get(at..at + 2), number(collection, at + 8)) {
        let step = match index {
            [0, 0] => Some(length),
            _ => length.checked_next_multiple_of(8).and_then(|length| length.checked_add(HEADER as u64)),
        };
        match step.and_then(|step| usize::try_from(step).ok()) {
            None | Some(0) => return true,
            Some(step) => at = at.saturating_add(step).min(collection.len()),
        }
    }
    false
}

/// A little-endian number of eight bytes.
fn number(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use std::io::Cursor;

    use super::*;

    /// A collection of objects (index, length).
    fn collection(objects: &[(u16, u64)]) -> Vec<u8> {
        let mut bytes = [SIGNATURE, &0_u64.to_le_bytes()].concat();
        for (index, length) in objects {
            bytes.extend([&index.to_le_bytes()[..], &[1, 0, 0, 0, 0, 0], &length.to_le_bytes()].concat());
            if *index > 0 && *length < 1000 {
                bytes.resize(bytes.len() + length.next_multiple_of(8) as usize, 7);
            }
        }
        let length = bytes.len() as u64;
        bytes[8..16].copy_from_slice(&length.to_le_bytes());
        bytes
    }

    #[test]
    fn a_length_that_leads_nowhere_is_found_wherever_it_lies() {
        for (objects, endless) in [
            (&[(1, 2), (2, 13), (0, 16)][..], false),
            (&[], false),
            (&[(1, 2), (0, 0)], true),
            (&[(0, 0), (1, 2)], true),
            (&[(1, u64::MAX)], true),
            (&[(1, u64::MAX - 20)], true),
            (&[(1, 1 << 40)], false),
        ] {
            for before in [0, 5, PIECE - 3, PIECE, 3 * PIECE + 1] {
                let bytes = [vec![b'G'; before], collection(objects), vec![0; 100]].concat();
                let whole = 0..bytes.len() as u64;
                let found = find(&mut Cursor::new(&bytes), whole).unwrap();
                assert_eq!(found, endless.then_some(before as u64), "{objects:?} behind {before}");
            }
        }
    }
}
