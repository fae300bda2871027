//! Rows of a dataset: through the library, or, where they lie in the file as they are wanted, straight from there.

use std::{
    fs::File,
    io::{Read, Seek, SeekFrom},
    ops::Range,
};

use bytemuck::Pod;
use hdf5_metno::{Dataset, Datatype, H5Type, dataset::Layout};
use ndarray::s;
use runout_core::Result;

use crate::node::Place;

/// The rows of some neighbouring columns.
pub(super) struct Rows {
    dataset: Dataset,
    place: Place,
    columns: Range<usize>,
    /// The file and where the dataset begins in it.
    plain: Option<(File, u64)>,
}

impl Rows {
    /// `T` is what will be read.
    pub(super) fn new<T: H5Type + Pod + PartialEq>(
        dataset: Dataset,
        place: Place,
        columns: Range<usize>,
    ) -> Result<Self> {
        let mut rows = Self { dataset, place, columns, plain: None };
        rows.plain = rows.beginning::<T>().and_then(|start| Some((File::open(rows.dataset.filename()).ok()?, start)));
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
        (alike && whole && matches!(self.dataset.layout(), Layout::Contiguous)).then(|| self.dataset.offset())?
    }

    /// Whether first and last row are the same either way.
    fn agree<T: H5Type + Pod + PartialEq>(&mut self) -> Result<bool> {
        let last = self.dataset.shape().first().map_or(0, |rows| rows.saturating_sub(1));
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
        read.map_err(|error| self.place.error(format!("{}: {error}", named(rows))))
    }

    fn through<T: H5Type>(&self, rows: &Range<usize>) -> Result<Vec<T>> {
        let found = self.dataset.read_slice_2d::<T, _>(s![rows.clone(), self.columns.clone()]);
        let found = found.map_err(|error| self.place.error(format!("{}: {error}", named(rows))))?;
        // A fresh array in the order of rows begins where its memory does.
        let ordered = found.is_standard_layout();
        let (flat, _) = found.into_raw_vec_and_offset();
        if ordered { Ok(flat) } else { Err(self.place.error("the samples came in another order")) }
    }
}

fn named(rows: &Range<usize>) -> String {
    format!("samples {} to {}", rows.start, rows.end.saturating_sub(1))
}
