//! Heights on a plane as vertices and triangles.

use runout_core::{Error, Result, height_grid::HeightGrid};

use crate::{
    colour::ColourScale,
    vertices::{LANES, Vertices},
};

/// A sheet to be drawn: rows of vertices along x, at the heights that are there. It is open: it has no thickness and no caps.
///
/// Vertices count along the rows and leave out places without a height. Four neighbouring heights make two triangles, three of them
/// one; a hole stays a hole.
#[derive(Debug)]
pub struct Sheet<'a> {
    grid: &'a HeightGrid,
    scale: f64,
    colours: ColourScale,
    range_um: f64,
    /// Number of the first vertex of each row, and of the one behind the last row.
    first: Vec<u32>,
    triangles: usize,
    bounds_mm: [[f64; 3]; 2],
}

/// A place in the grid.
type Node = [usize; 2];

impl<'a> Sheet<'a> {
    /// Heights drawn `scale` times larger than they are, coloured up to ±`range_um` or else to the largest height.
    ///
    /// # Errors
    /// When the grid is none, or no three neighbouring heights are there.
    pub fn new(grid: &'a HeightGrid, scale: f64, range_um: Option<f64>) -> Result<Self> {
        let failure = |problem: &str| Error::new("draw", "the height map", problem);
        let rows = grid.rows();
        if grid.columns < 2 || rows < 2 || grid.height_nm.len() != rows * grid.columns {
            return Err(failure("it needs two or more rows of two or more columns"));
        }
        let is_step = |step: f64| step.is_finite() && step > 0.0;
        if !(is_step(grid.step_x_mm) && is_step(grid.step_y_mm)) {
            return Err(failure("the distances of its rows and columns must be above 0 mm"));
        }
        if u32::try_from(grid.height_nm.len()).is_err() {
            return Err(failure("it has more points than 32 bits can count").help("measure with larger steps"));
        }
        let mut first = vec![0];
        let mut count = 0;
        for row in grid.height_nm.chunks(grid.columns) {
            count += row.iter().filter(|height| height.is_finite()).count() as u32;
            first.push(count);
        }
        let mut sheet = Self {
            grid,
            scale,
            colours: ColourScale::new(0.0),
            range_um: 0.0,
            first,
            triangles: 0,
            bounds_mm: [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]],
        };
        for row in 0..rows - 1 {
            let mut triangles = 0;
            sheet.band(row, |_| triangles += 1);
            sheet.triangles += triangles;
        }
        if sheet.triangles == 0 {
            return Err(failure("no three neighbouring points have a height"));
        }
        let mut bounds_mm = sheet.bounds_mm;
        let mut largest_um: f64 = 0.0;
        for row in 0..rows {
            for column in (0..grid.columns).filter(|column| sheet.height_um([row, *column]).is_finite()) {
                for (axis, place) in sheet.position_mm([row, column]).into_iter().enumerate() {
                    bounds_mm[0][axis] = bounds_mm[0][axis].min(place);
                    bounds_mm[1][axis] = bounds_mm[1][axis].max(place);
                }
                largest_um = largest_um.max(sheet.height_um([row, column]).abs());
            }
        }
        let range_um = range_um.unwrap_or(largest_um);
        Ok(Self { bounds_mm, range_um, colours: ColourScale::new(range_um), ..sheet })
    }

    /// Rows along y, at least two.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.first.len() - 1
    }

    /// Places of a row, with a height or without.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.grid.columns
    }

    /// How many times larger than they are the heights are drawn.
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Deviation of the strongest colours, ± µm.
    #[must_use]
    pub fn range_um(&self) -> f64 {
        self.range_um
    }

    /// Vertices of all rows.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.first.last().map_or(0, |count| *count as usize)
    }

    /// Triangles of all bands.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.triangles
    }

    /// Smallest and largest x, y and z, in mm.
    #[must_use]
    pub fn bounds_mm(&self) -> [[f64; 3]; 2] {
        self.bounds_mm
    }

    /// NaN where there is none, also beyond the grid.
    fn height_um(&self, [row, column]: Node) -> f64 {
        let inside = column < self.grid.columns;
        let height = inside.then(|| self.grid.height_nm.get(row * self.grid.columns + column)).flatten();
        height.map_or(f64::NAN, |height| 1e-3 * height)
    }

    fn position_mm(&self, [row, column]: Node) -> [f64; 3] {
        let grid = self.grid;
        [
            grid.origin_x_mm + grid.step_x_mm * column as f64,
            grid.origin_y_mm + grid.step_y_mm * row as f64,
            1e-3 * self.scale * self.height_um([row, column]),
        ]
    }

    /// Slope as drawn, of the line through the neighbours before and behind; of the one that is there where one has no height.
    fn slope(&self, here: Node, before: Option<Node>, behind: Node, step_mm: f64) -> f64 {
        let height = |node: Node| self.height_um(node);
        let centre = height(here);
        let [before, behind] = [before.map_or(f64::NAN, height), height(behind)];
        let per_step = match (before.is_finite(), behind.is_finite()) {
            (true, true) => 0.5 * (behind - before),
            (true, false) => centre - before,
            (false, true) => behind - centre,
            (false, false) => 0.0,
        };
        1e-3 * self.scale * per_step / step_mm
    }

    /// Visits the vertices of one row, some at a time; normals point upwards.
    pub fn row(&self, row: usize, mut visit: impl FnMut(&Vertices)) {
        let mut found = Vertices::one([0.0; 3], [0.0; 3]);
        found.count = 0;
        for column in 0..self.grid.columns {
            let here = [row, column];
            let height_um = self.height_um(here);
            if !height_um.is_finite() {
                continue;
            }
            let before = column.checked_sub(1).map(|column| [row, column]);
            let along = self.slope(here, before, [row, column + 1], self.grid.step_x_mm);
            let below = row.checked_sub(1).map(|row| [row, column]);
            let across = self.slope(here, below, [row + 1, column], self.grid.step_y_mm);
            let length = (1.0 + along * along + across * across).sqrt().recip();
            let normal = [-along * length, -across * length, length];
            let lane = found.count;
            for (axis, place) in self.position_mm(here).into_iter().enumerate() {
                found.position_mm[axis][lane] = place;
                found.normal[axis][lane] = normal[axis];
            }
            found.deviation_um[lane] = height_um;
            found.colour[lane] = self.colours.index(height_um);
            found.count += 1;
            if found.count == LANES {
                visit(&found);
                found.count = 0;
            }
        }
        if found.count > 0 {
            visit(&found);
        }
    }

    /// Visits the triangles between a row and the next, counter-clockwise seen from above.
    pub fn band(&self, row: usize, mut visit: impl FnMut([u32; 3])) {
        let mut number = [self.first[row], self.first[row + 1]];
        // Vertices at the column before, of this row and of the next.
        let mut left = [None; 2];
        for column in 0..self.grid.columns {
            let mut right = [None; 2];
            for (side, vertex) in right.iter_mut().enumerate() {
                if self.height_um([row + side, column]).is_finite() {
                    *vertex = Some(number[side]);
                    number[side] += 1;
                }
            }
            match (left, right) {
                ([Some(a), Some(d)], [Some(b), Some(c)]) => {
                    visit([a, b, c]);
                    visit([a, c, d]);
                }
                ([Some(a), None], [Some(b), Some(c)]) => visit([a, b, c]),
                ([Some(a), Some(d)], [None, Some(c)]) => visit([a, c, d]),
                ([Some(a), Some(d)], [Some(b), None]) => visit([a, b, d]),
                ([None, Some(d)], [Some(b), Some(c)]) => visit([b, c, d]),
                _ => {}
            }
            left = right;
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn grid(columns: usize, rows: usize, height_nm: impl Fn(f64, f64) -> f64) -> HeightGrid {
        let node = |index: usize| [0.5 * (index % columns) as f64, 0.25 * (index / columns) as f64];
        HeightGrid {
            columns,
            step_x_mm: 0.5,
            step_y_mm: 0.25,
            origin_x_mm: 0.0,
            origin_y_mm: 0.0,
            std_nm: None,
            height_nm: (0..columns * rows).map(node).map(|[x, y]| height_nm(x, y)).collect(),
        }
    }

    fn triangles(sheet: &Sheet) -> Vec<[u32; 3]> {
        let mut all = Vec::new();
        (0..sheet.rows() - 1).for_each(|row| sheet.band(row, |triangle| all.push(triangle)));
        all
    }

    #[test]
    fn normals_are_those_of_a_slope_and_triangles_face_upwards() {
        // 2 µm a mm along x and −1 µm a mm along y, drawn 100 times larger.
        let grid = grid(9, 4, |x, y| 2000.0 * x - 1000.0 * y);
        let sheet = Sheet::new(&grid, 100.0, None).unwrap();
        let length = (1.0_f64 + 0.2 * 0.2 + 0.1 * 0.1).sqrt();
        let mut places = Vec::new();
        for row in 0..4 {
            sheet.row(row, |vertices| {
                for lane in 0..vertices.count {
                    places.push([0, 1, 2].map(|axis: usize| vertices.position_mm[axis][lane]));
                    for (axis, expected) in [-0.2, 0.1, 1.0].into_iter().enumerate() {
                        assert!((vertices.normal[axis][lane] - expected / length).abs() < 1e-12);
                    }
                }
            });
        }
        assert_eq!([places.len(), sheet.vertex_count()], [36; 2]);
        assert_eq!(triangles(&sheet).len(), 2 * 8 * 3);
        for triangle in triangles(&sheet) {
            let [a, b, c] = triangle.map(|vertex| places[vertex as usize]);
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            assert!((area - 0.125).abs() < 1e-12);
        }
        let [low, high] = sheet.bounds_mm();
        assert!((high[2] - 0.8).abs() < 1e-12 && (low[2] + 0.075).abs() < 1e-12 && (high[0] - 4.0).abs() < 1e-12);
    }

    #[test]
    fn a_hole_stays_a_hole() {
        // One place in the middle of 3 × 3: four corners of one triangle each.
        let hole = |x: f64, y: f64| if (x - 0.5).abs() + (y - 0.25).abs() < 0.01 { f64::NAN } else { 1.0 };
        let grid = grid(3, 3, hole);
        let sheet = Sheet::new(&grid, 1.0, None).unwrap();
        let found = triangles(&sheet);
        assert_eq!([sheet.vertex_count(), found.len(), sheet.triangle_count()], [8, 4, 4]);
        assert!(found.iter().flatten().all(|vertex| *vertex < 8));
        let nothing = self::grid(3, 3, |x, _| if x > 0.4 { f64::NAN } else { 1.0 });
        let error = Sheet::new(&nothing, 1.0, None).unwrap_err().to_string();
        assert!(error.contains("three neighbouring"), "{error}");
    }

    #[test]
    fn what_is_no_grid_is_refused() {
        let good = grid(3, 3, |_, _| 1.0);
        let refused = |change: fn(&mut HeightGrid)| {
            let mut bad = good.clone();
            change(&mut bad);
            Sheet::new(&bad, 1.0, None).is_err()
        };
        assert!(refused(|bad| bad.columns = 0));
        assert!(refused(|bad| bad.columns = 1));
        assert!(refused(|bad| bad.height_nm.truncate(8)));
        assert!(refused(|bad| bad.height_nm.clear()));
        assert!(refused(|bad| bad.step_x_mm = 0.0));
        assert!(refused(|bad| bad.step_y_mm = f64::NAN));
        assert!(refused(|bad| bad.height_nm.fill(f64::NAN)));
    }
}
