//! Heights on a plane: what an interferometer gives of a surface.

mod places;

use std::path::PathBuf;

pub use places::GridPlaces;

use runout_error::Result;
use runout_numerics::height_map::HeightMap;

use crate::points::{Column, Points};

/// Heights at the nodes of a rectangular grid.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightGrid {
    /// Nodes along x.
    pub columns: usize,
    /// Distance of columns, in mm.
    pub step_x_mm: f64,
    /// Distance of rows, in mm.
    pub step_y_mm: f64,
    /// x of the first column, in mm.
    pub origin_x_mm: f64,
    /// y of the first row, in mm.
    pub origin_y_mm: f64,
    /// Standard uncertainty of a height, in nm, where it is known.
    pub std_nm: Option<f64>,
    /// Heights in nm, row by row; NaN where there is none.
    pub height_nm: Vec<f64>,
}

impl HeightGrid {
    /// Names of the columns of [`points`](Self::points); the last one is there where the uncertainty is known.
    pub const COLUMNS: [&'static str; 4] = ["x_mm", "y_mm", "height_nm", "std_nm"];

    /// Nodes along y.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.height_nm.len() / self.columns.max(1)
    }

    /// Nodes without a height.
    #[must_use]
    pub fn holes(&self) -> usize {
        self.height_nm.iter().filter(|height| !height.is_finite()).count()
    }

    /// Its heights in µm as a map on a plane.
    ///
    /// # Errors
    /// Where it has fewer than two rows, columns or heights.
    pub fn height_map(&self) -> Result<HeightMap<'static>> {
        let heights_um: Vec<f64> = self.height_nm.iter().map(|height_nm| 1e-3 * height_nm).collect();
        HeightMap::new(heights_um, self.columns, self.step_x_mm, self.step_y_mm, false)
    }

    /// BLAKE3 in hexadecimal of its numbers as little-endian f64, one after the other: `origin_x_mm`, `origin_y_mm`, `step_x_mm`,
    /// `step_y_mm`, `height_nm`.
    #[must_use]
    pub fn checksum(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        let places = [self.origin_x_mm, self.origin_y_mm, self.step_x_mm, self.step_y_mm];
        for numbers in std::iter::once(&places[..]).chain(self.height_nm.chunks(self.columns.max(1))) {
            let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
            hasher.update(&bytes);
        }
        hasher.finalize().to_hex().to_string()
    }

    /// The nodes with a height, row by row, as points of a file.
    #[must_use]
    pub fn points(self, input: PathBuf) -> Points {
        let count = self.height_nm.len() - self.holes();
        let [mut x, mut y] = [Vec::with_capacity(count), Vec::with_capacity(count)];
        for (row, heights) in self.height_nm.chunks(self.columns.max(1)).enumerate() {
            let row_y_mm = self.origin_y_mm + self.step_y_mm * row as f64;
            for (column, _) in heights.iter().enumerate().filter(|(_, height)| height.is_finite()) {
                x.push(self.origin_x_mm + self.step_x_mm * column as f64);
                y.push(row_y_mm);
            }
        }
        let mut heights = self.height_nm;
        heights.retain(|height| height.is_finite());
        let std = self.std_nm.map(|std| vec![std; heights.len()]);
        let values = [Some(x), Some(y), Some(heights), std];
        let columns = Self::COLUMNS.iter().zip(values);
        let columns = columns.filter_map(|(name, values)| Some(Column { name: (*name).into(), values: values? }));
        Points { input, columns: columns.collect(), ..Points::default() }
    }
}
