//! Where numbers lie in a file. In the old format, whose structures have no checksum, a damaged address leads to other numbers.

use std::ops::Range;

use hdf5_metno::Dataset;
use runout_core::Result;

use crate::node::Place;

/// Bytes of a dataset that lie in one piece: all of them, or a chunk.
pub(crate) struct Extent {
    bytes: Range<u64>,
    place: Place,
}

impl Extent {
    /// Where a dataset lies; its chunks `with_chunks` only.
    pub(crate) fn of(dataset: &Dataset, place: &Place, with_chunks: bool) -> Vec<Self> {
        let extent =
            |start: u64, length: u64| Self { bytes: start..start.saturating_add(length), place: place.clone() };
        if let Some(start) = dataset.offset() {
            return vec![extent(start, dataset.storage_size())];
        }
        let mut chunks = Vec::new();
        if with_chunks {
            // What the library cannot say it says when the chunks are read.
            let _ = dataset.chunks_visit(|chunk| {
                chunks.push(extent(chunk.addr, chunk.size));
                0
            });
        }
        chunks
    }
}

/// Refuses numbers that lie beyond the end of a file of so many bytes, over others, or over the file's structures.
pub(super) fn check(mut extents: Vec<Extent>, mut structures: Vec<Range<u64>>, end: u64) -> Result<()> {
    extents.sort_by_key(|extent| (extent.bytes.start, extent.bytes.end));
    structures.sort_by_key(|bytes| bytes.start);
    // Structures do not lie over each other: the last one that begins before the end of an extent reaches furthest.
    let over = |extent: &Extent| {
        let before = structures.partition_point(|bytes| bytes.start < extent.bytes.end);
        let last = structures[..before].iter().rev().take(2);
        !extent.bytes.is_empty() && last.into_iter().any(|bytes| bytes.end > extent.bytes.start)
    };
    let help = "the file is damaged: copy it again from where it was recorded";
    if let Some(extent) = extents.iter().find(|extent| over(extent)) {
        return Err(extent.place.error("its numbers lie over the file's own structures").help(help));
    }
    for (one, next) in extents.iter().zip(extents.iter().skip(1).map(Some).chain([None])) {
        if one.bytes.end > end {
            return Err(one.place.error("its numbers lie beyond the end of the file").help(help));
        }
        // Two names of one dataset take the same bytes.
        if let Some(next) = next
            && next.bytes.start < one.bytes.end
            && next.bytes != one.bytes
        {
            return Err(next.place.error(format!("its numbers lie over those of {}", one.place)).help(help));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn numbers_lie_beside_each_other_and_in_the_file() {
        let words = |ranges: &[Range<u64>]| {
            let extent = |bytes: &Range<u64>| Extent { bytes: bytes.clone(), place: Place::root(Path::new("x.h5")) };
            check(ranges.iter().map(extent).collect(), vec![10..20, 100..110], 100)
                .err()
                .map(|error| error.to_string())
                .unwrap_or_default()
        };
        assert_eq!(words(&[50..100, 20..50, 20..50, 0..10, 15..15]), "");
        assert!(words(&[50..100, 20..51]).contains("lie over those of"));
        assert!(words(&[0..10, 60..101]).contains("the file's own structures"));
        assert!(words(&[0..11, 30..40]).contains("the file's own structures"));
        assert!(words(&[19..30, 40..50]).contains("the file's own structures"));
        assert!(words(&[0..10, 120..130]).contains("beyond the end"));
    }
}
