//! What formats write: a wall around an axis, or a sheet on a plane.

use crate::{sheet::Sheet, vertices::Vertices, wall::Wall};

/// A surface to be drawn, in mm as measured.
#[derive(Debug)]
pub enum Mesh<'a> {
    /// Around the spindle's axis z.
    Wall(Wall<'a>),
    /// On a plane, z upwards.
    Sheet(Sheet<'a>),
}

impl Mesh<'_> {
    /// The wall, where it is one: only walls have caps.
    #[must_use]
    pub fn wall(&self) -> Option<&Wall<'_>> {
        match self {
            Self::Wall(wall) => Some(wall),
            Self::Sheet(_) => None,
        }
    }

    /// Rings of a wall, rows of a sheet: at least two.
    #[must_use]
    pub fn rows(&self) -> usize {
        match self {
            Self::Wall(wall) => wall.rings(),
            Self::Sheet(sheet) => sheet.rows(),
        }
    }

    /// Vertices of a row at most.
    #[must_use]
    pub fn columns(&self) -> usize {
        match self {
            Self::Wall(wall) => wall.angles(),
            Self::Sheet(sheet) => sheet.columns(),
        }
    }

    /// Vertices of all rows, without caps.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        match self {
            Self::Wall(wall) => wall.rings() * wall.angles(),
            Self::Sheet(sheet) => sheet.vertex_count(),
        }
    }

    /// Triangles between all rows, without caps.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        match self {
            Self::Wall(wall) => 2 * (wall.rings() - 1) * wall.angles(),
            Self::Sheet(sheet) => sheet.triangle_count(),
        }
    }

    /// How many times larger than they are the deviations are drawn.
    #[must_use]
    pub fn scale(&self) -> f64 {
        match self {
            Self::Wall(wall) => wall.scale(),
            Self::Sheet(sheet) => sheet.scale(),
        }
    }

    /// Deviation of the strongest colours, ± µm.
    #[must_use]
    pub fn range_um(&self) -> f64 {
        match self {
            Self::Wall(wall) => wall.range_um(),
            Self::Sheet(sheet) => sheet.range_um(),
        }
    }

    /// Smallest and largest x, y and z without caps, in mm.
    #[must_use]
    pub fn bounds_mm(&self) -> [[f64; 3]; 2] {
        match self {
            Self::Wall(wall) => wall.bounds_mm(),
            Self::Sheet(sheet) => sheet.bounds_mm(),
        }
    }

    /// Visits the vertices of one row, some at a time.
    pub fn row(&self, row: usize, visit: impl FnMut(&Vertices)) {
        match self {
            Self::Wall(wall) => wall.ring(row, visit),
            Self::Sheet(sheet) => sheet.row(row, visit),
        }
    }

    /// Visits the triangles between a row and the next, counter-clockwise seen from outside or from above.
    pub fn band(&self, row: usize, visit: impl FnMut([u32; 3])) {
        match self {
            Self::Wall(wall) => wall.band(row).flatten().for_each(visit),
            Self::Sheet(sheet) => sheet.band(row, visit),
        }
    }
}
