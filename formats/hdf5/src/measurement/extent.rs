//! Where numbers lie in a file. In the old format, whose structures have no checksum, a damaged address leads to other numbers.

use std::ops::Range;

use hdf5_metno::Dataset;
use runout_core::Result;

use crate::node::Place;

/// The bytes of a dataset that lies in one piece.
pub(crate) struct Extent {
    bytes: Range<u64>,
    place: Place,
}

impl Extent {
    pub(crate) fn of(dataset: &Dataset, place: &Place) -> Option<Self> {
        let start = dataset.offset()?;
        Some(Self { bytes: start..start.saturating_add(dataset.storage_size()), place: place.clone() })
    }
}

/// Refuses numbers that lie beyond the end of a file of so many bytes, or over others.
pub(super) fn check(mut extents: Vec<Extent>, end: u64) -> Result<()> {
    extents.sort_by_key(|extent| (extent.bytes.start, extent.bytes.end));
    let help = "the file is damaged: copy it again from where it was recorded";
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
            check(ranges.iter().map(extent).collect(), 100).err().map(|error| error.to_string()).unwrap_or_default()
        };
        assert_eq!(words(&[50..100, 0..50, 0..50]), "");
        assert!(words(&[50..100, 0..51]).contains("lie over those of"));
        assert!(words(&[0..10, 60..101]).contains("beyond the end"));
    }
}
