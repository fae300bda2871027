//! Rows of a dataset: through the library, or, where they lie in the file as they are wanted, straight from there and into the
//! file's checksum.

use std::{
    fs::File,
    io::{Read, Seek, SeekFrom},
    ops::Range,
};

use bytemuck::Pod;
use hdf5_metno::{Dataset, Datatype, H5Type, dataset::Layout};
use runout_core::{Result, checksum::Reader};

use super::orientation::Orientation;
use crate::node::Place;

/// The rows of some neighbouring columns.
pub(super) struct Rows {
    dataset: Dataset,
    place: Place,
    orientation: Orientation,
    columns: Range<usize>,
    /// The file and where the dataset begins in it.
    plain: Option<(File, u64)>,
    checksum: Reader,
}

impl Rows {
    /// `T` is what will be read.
    pub(super) fn new<T: H5Type + Pod + PartialEq>(
        dataset: Dataset,
        place: Place,
        orientation: Orientation,
        columns: Range<usize>,
        checksum: Reader,
    ) -> Result<Self> {
        let mut rows = Self { dataset, place, orientation, columns, plain: None, checksum };
        if let (Some(start), Some(links)) = (rows.beginning::<T>(), rows.place.links())
            && links.is_home_of(&rows.dataset)
        {
            rows.plain = Some((links.input().open()?, start));
        }
        if rows.plain.is_some() && !rows.agree::<T>()? {
            rows.plain = None;
        }
        Ok(rows)
    }

    /// Where the dataset begins in the file, if it lies there in one piece, as this program would hold it, and all of its
    /// columns are wanted.
    fn beginning<T: H5Type>(&self) -> Option<u64> {
        let [_, columns] = self.dataset.shape()[..] else { return None };
        let alike = self.dataset.dtype().ok()? == Datatype::from_type::<T>().ok()?;
        let whole = self.columns == (0..columns);
        (alike
            && whole
            && self.orientation == Orientation::SampleRows
            && matches!(self.dataset.layout(), Layout::Contiguous))
        .then(|| self.dataset.offset())?
    }

    /// Whether first and last row are the same either way.
    fn agree<T: H5Type + Pod + PartialEq>(&mut self) -> Result<bool> {
        let last = self.orientation.samples_of(&self.dataset.shape()).map_or(0, |rows| rows.saturating_sub(1));
        for row in [0, last] {
            let mut straight = Vec::<T>::new();
            let read = self.read(&(row..row + 1), &mut straight).is_ok();
            let through = self.through(&(row..row + 1))?;
            if !read || bytemuck::cast_slice::<T, u8>(&straight) != bytemuck::cast_slice::<T, u8>(&through) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Reads rows, `[row][column]`, in place of what `to` holds.
    pub(super) fn read<T: H5Type + Pod>(&mut self, rows: &Range<usize>, to: &mut Vec<T>) -> Result<()> {
        let width = self.columns.len();
        let Some((file, start)) = &mut self.plain else {
            *to = self.through(rows)?;
            return Ok(());
        };
        to.resize(rows.len() * width, T::zeroed());
        let first = *start + (rows.start * width * size_of::<T>()) as u64;
        let read = file.seek(SeekFrom::Start(first)).and_then(|_| file.read_exact(bytemuck::cast_slice_mut(to)));
        read.map_err(|error| self.place.error(format!("{}: {error}", named(rows))))?;
        self.checksum.take(first, bytemuck::cast_slice(to));
        Ok(())
    }

    fn through<T: H5Type + Copy>(&self, rows: &Range<usize>) -> Result<Vec<T>> {
        let found = self.orientation.rows(&self.dataset, rows, &self.columns);
        found.map_err(|error| self.place.error(format!("{}: {error}", named(rows))))
    }
}

fn named(rows: &Range<usize>) -> String {
    format!("samples {} to {}", rows.start, rows.end.saturating_sub(1))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use ndarray::s;
    use runout_core::checksum::Checksum;

    use super::*;

    const ROWS: usize = 500;
    const COLUMNS: usize = 3;

    /// Rows 7 to 432, and whether they came straight from the file.
    fn read(place: &Place, dataset: Dataset, orientation: Orientation, columns: Range<usize>) -> (Vec<f64>, bool) {
        let place = place.clone();
        let checksum = Checksum::of(place.links().unwrap().input()).reader();
        let mut rows = Rows::new::<f64>(dataset, place, orientation, columns, checksum).unwrap();
        let mut found = vec![9.0; 4];
        rows.read(&(7..433), &mut found).unwrap();
        (found, rows.plain.is_some())
    }

    #[test]
    fn rows_are_the_same_straight_from_the_file_and_through_the_library() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.h5");
        let values = ndarray::Array2::from_shape_fn((ROWS, COLUMNS), |(row, column)| (row * COLUMNS + column) as f64);
        {
            // What stands before the file's own beginning counts.
            let file =
                hdf5_metno::File::with_options().with_fcpl(|create| create.userblock(1024)).create(&path).unwrap();
            file.new_dataset_builder().with_data(&values).create("plain").unwrap();
            file.new_dataset_builder().with_data(&values).chunk((64, COLUMNS)).deflate(1).create("packed").unwrap();
            file.new_dataset_builder().with_data(&values.mapv(|value| value as f32)).create("single").unwrap();
            let elsewhere = folder.path().join("elsewhere.bin").display().to_string();
            let external = file.new_dataset_builder().external(&elsewhere, 0, ROWS * COLUMNS * size_of::<f64>());
            external.with_data(&values).create("external").unwrap();
            let turned = values.t().as_standard_layout().to_owned();
            file.new_dataset_builder().with_data(&turned).create("turned").unwrap();
            file.new_dataset_builder().with_data(&turned).chunk((1, 64)).deflate(1).create("turned, packed").unwrap();
        }
        let (file, place, _) = crate::node::open(&path, true).unwrap();
        let expected: Vec<f64> = values.slice(s![7..433, ..]).iter().copied().collect();
        for (name, straight) in [("plain", true), ("packed", false), ("single", false), ("external", false)] {
            let found = read(&place, file.dataset(name).unwrap(), Orientation::SampleRows, 0..COLUMNS);
            assert_eq!(found, (expected.clone(), straight), "{name}");
        }
        let some: Vec<f64> = values.slice(s![7..433, 1..3]).iter().copied().collect();
        assert_eq!(read(&place, file.dataset("plain").unwrap(), Orientation::SampleRows, 1..3), (some.clone(), false));
        for name in ["turned", "turned, packed"] {
            let dataset = || file.dataset(name).unwrap();
            assert_eq!(
                read(&place, dataset(), Orientation::ChannelRows, 0..COLUMNS),
                (expected.clone(), false),
                "{name}"
            );
            assert_eq!(read(&place, dataset(), Orientation::ChannelRows, 1..3), (some.clone(), false), "{name}");
        }
    }
}
