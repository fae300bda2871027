//! Heights on a plane: what an interferometer gives of a surface.

mod places;

pub use places::GridPlaces;

use runout_error::Result;
use runout_numerics::height_map::HeightMap;

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
    /// Names of the columns of its points; the last one is there where the uncertainty is known.
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
}
