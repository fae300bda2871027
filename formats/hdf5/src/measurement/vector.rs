//! A vector of numbers: one value a mark or a sample, also where a program has written it as a matrix of one row or column.

use std::ops::Range;

use hdf5_metno::{Dataset, Group};
use ndarray::s;
use runout_core::Result;

use crate::{
    measurement::extent::Extent,
    node::{self, Place},
    type_name::type_name,
};

/// Elements that are read at a time where they pass through once.
const SCAN: usize = 65_536;

/// A dataset with one dimension that counts.
#[derive(Debug)]
pub(crate) struct Vector {
    dataset: Dataset,
    place: Place,
    length: usize,
    shape: Shape,
}

/// How the file holds it.
#[derive(Debug, Clone, Copy)]
enum Shape {
    /// `[n]`.
    Plain,
    /// `[n, 1]`.
    Column,
    /// `[1, n]`.
    Row,
}

impl Vector {
    /// Opens a dataset of the group.
    pub(crate) fn open(group: &Group, place: &Place, name: &str) -> Result<Self> {
        let (dataset, place) = node::dataset(group, place, name)?;
        let found = node::element_type(&dataset, &place)?;
        if !node::is_number(&found) {
            return Err(place.error(format!("expected f64, found {}", type_name(&found))));
        }
        let (length, shape) = match node::written_shape(&dataset, &place)?.as_slice() {
            [length] => (*length, Shape::Plain),
            [length, 1] => (*length, Shape::Column),
            [1, length] => (*length, Shape::Row),
            other => return Err(place.error(format!("expected one dimension, found the shape {other:?}"))),
        };
        Ok(Self { dataset, place, length, shape })
    }

    pub(crate) fn place(&self) -> &Place {
        &self.place
    }

    /// The bytes of the file that it takes, in chunks `with_chunks` only.
    pub(crate) fn extents(&self, with_chunks: bool) -> Vec<Extent> {
        Extent::of(&self.dataset, &self.place, with_chunks)
    }

    pub(crate) fn length(&self) -> usize {
        self.length
    }

    /// Some of its values.
    pub(crate) fn read(&self, range: Range<usize>) -> Result<Vec<f64>> {
        let values = match self.shape {
            Shape::Plain => self.dataset.read_slice_1d::<f64, _>(s![range]).map(|found| found.to_vec()),
            Shape::Column => {
                self.dataset.read_slice_2d::<f64, _>(s![range, 0..1]).map(|found| found.into_iter().collect())
            }
            Shape::Row => {
                self.dataset.read_slice_2d::<f64, _>(s![0..1, range]).map(|found| found.into_iter().collect())
            }
        };
        values.map_err(|error| self.place.error(error))
    }

    /// Passes all of its values through once, in blocks.
    pub(crate) fn each(&self, take: impl FnMut(f64) -> Result<()>) -> Result<()> {
        each(self.length, |range| self.read(range), take)
    }
}

/// Passes values through once, read in blocks.
pub(crate) fn each(
    length: usize,
    read: impl Fn(Range<usize>) -> Result<Vec<f64>>,
    mut take: impl FnMut(f64) -> Result<()>,
) -> Result<()> {
    for start in (0..length).step_by(SCAN) {
        read(start..length.min(start + SCAN))?.into_iter().try_for_each(&mut take)?;
    }
    Ok(())
}
