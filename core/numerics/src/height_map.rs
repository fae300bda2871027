//! Heights over a rectangle, or around an unrolled cylinder.

use std::borrow::Cow;

use runout_error::{Error, ErrorKind, Result};

/// Distances of rings that differ by less than this share are equal.
const EVEN: f64 = 1e-6;

/// Heights in µm on a grid, `[row][column]`; on a cylinder a row is a ring and a column a generatrix. What is not finite
/// is missing.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap<'a> {
    heights_um: Cow<'a, [f64]>,
    columns: usize,
    dx_mm: f64,
    dy_mm: f64,
    closed: bool,
}

impl<'a> HeightMap<'a> {
    /// A map with columns `dx_mm` and rows `dy_mm` apart; `closed` where the last column is the first one's neighbour.
    ///
    /// # Errors
    /// Where it has fewer than two rows or columns, the heights do not fill it, a distance is none, or fewer than two
    /// points were measured.
    pub fn new(
        heights_um: impl Into<Cow<'a, [f64]>>,
        columns: usize,
        dx_mm: f64,
        dy_mm: f64,
        closed: bool,
    ) -> Result<Self> {
        let heights_um = heights_um.into();
        let failure = |problem: String| Err(Error::new("evaluate", "the height map", problem));
        if columns < 2 || heights_um.len() < 2 * columns || !heights_um.len().is_multiple_of(columns) {
            return failure(format!(
                "{} heights do not fill two or more rows of {columns} (two or more) columns",
                heights_um.len()
            ));
        }
        if ![dx_mm, dy_mm].iter().all(|distance| distance.is_finite() && *distance > 0.0) {
            return failure(format!("its points are {dx_mm} mm by {dy_mm} mm apart; both must be above 0"));
        }
        let map = Self { heights_um, columns, dx_mm, dy_mm, closed };
        match map.heights_um.len() - map.missing() {
            measured @ 0..2 => failure(format!("{measured} of its points were measured; two or more are needed"))
                .map_err(|error| error.of(ErrorKind::InsufficientData)),
            _ => Ok(map),
        }
    }

    /// A surface, unrolled at its nominal radius. A last ring that is nearer than the others (the rest of a length that
    /// is no whole number of steps) is left out.
    ///
    /// # Errors
    /// Where rings are not at equal distances, or fewer than two, or heights are missing.
    pub fn unrolled(radius_mm: f64, z_mm: &[f64], angles: usize, heights_um: &'a [f64]) -> Result<Self> {
        let [first, second, ..] = z_mm[..] else {
            return Err(
                Error::new("unroll", "the surface", "it has fewer than two rings").of(ErrorKind::InsufficientData)
            );
        };
        let step = second - first;
        let even = |pair: &[f64]| (pair[1] - pair[0] - step).abs() <= EVEN * step;
        let rows = 1 + z_mm.windows(2).take_while(|pair| even(pair)).count();
        let rest = &z_mm[rows - 1..];
        if rest.len() > 2 || rest.windows(2).any(|pair| pair[1] - pair[0] > step) {
            let problem = format!("its rings are not at equal distances: {step} mm first, then other ones");
            return Err(Error::new("unroll", "the surface", problem).help("set step_mm in [surface]"));
        }
        let heights_um = heights_um.get(..rows * angles).ok_or_else(|| {
            let problem = format!("it has {} heights for {rows} rings of {angles} angles", heights_um.len());
            Error::new("unroll", "the surface", problem).of(ErrorKind::InsufficientData)
        })?;
        let dx_mm = std::f64::consts::TAU * radius_mm / angles as f64;
        Self::new(heights_um, angles, dx_mm, step, true)
    }

    /// A map on this grid with other heights; as many of them are taken as it has, missing ones are NaN.
    #[must_use]
    pub fn with(&self, mut heights_um: Vec<f64>) -> HeightMap<'static> {
        heights_um.resize(self.heights_um.len(), f64::NAN);
        HeightMap { heights_um: heights_um.into(), ..*self }
    }

    /// The map without so many rows at each end; with all of them where fewer than two would be left.
    #[must_use]
    pub fn without_ends(&self, rows: usize) -> HeightMap<'static> {
        let rows = if self.rows() >= 2 * rows + 2 { rows } else { 0 };
        let kept = &self.heights_um[rows * self.columns..self.heights_um.len() - rows * self.columns];
        HeightMap { heights_um: kept.to_vec().into(), ..*self }
    }

    /// Heights in µm, `[row][column]`.
    #[must_use]
    pub fn heights_um(&self) -> &[f64] {
        &self.heights_um
    }

    /// Points around, or across.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Rings.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.heights_um.len() / self.columns
    }

    /// Distance of columns.
    #[must_use]
    pub fn dx_mm(&self) -> f64 {
        self.dx_mm
    }

    /// Distance of rows.
    #[must_use]
    pub fn dy_mm(&self) -> f64 {
        self.dy_mm
    }

    /// Whether the last column is the first one's neighbour.
    #[must_use]
    pub fn closed(&self) -> bool {
        self.closed
    }

    /// Points without a height.
    #[must_use]
    pub fn missing(&self) -> usize {
        self.heights_um.iter().filter(|height| !height.is_finite()).count()
    }

    /// Area between the outermost points (around a closed map: all of it), in mm².
    #[must_use]
    pub fn area_mm2(&self) -> f64 {
        let across = if self.closed { self.columns } else { self.columns - 1 };
        across as f64 * self.dx_mm * (self.rows() - 1) as f64 * self.dy_mm
    }
}
