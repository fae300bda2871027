//! Heights in rows along the feed.

use std::ops::Range;

use runout_core::{Error, Result, height_grid::GridPlaces, numerics::least_squares::dot, points::Points};

use crate::config::FlyCuttingConfig;

/// A row of the map.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Row {
    pub y_mm: f64,
    /// Angle of the tool where it crosses the row, in radians; its cosine.
    pub angle: f64,
    pub cosine: f64,
    /// Its points.
    pub points: Range<usize>,
}

/// A map, or a part of one: points ordered by y and then by x.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Heights {
    pub rows: Vec<Row>,
    pub x_mm: Vec<f64>,
    pub height_nm: Vec<f64>,
    pub std_nm: Option<f64>,
}

impl Heights {
    /// Reads the columns of points.
    pub(crate) fn new(points: &Points, config: &FlyCuttingConfig) -> Result<(Self, GridPlaces)> {
        let object = || points.input.display().to_string();
        let failure = |problem: String| Error::new("read the surface from", object(), problem);
        let [x, y, z] = [points.column("x_mm")?, points.column("y_mm")?, points.column("height_nm")?];
        if x.len() != y.len() || x.len() != z.len() {
            return Err(failure("its columns have different lengths".into()));
        }
        if let Some(row) =
            x.iter().zip(y).zip(z).position(|((x, y), z)| !(x.is_finite() && y.is_finite() && z.is_finite()))
        {
            return Err(failure(format!("point {row} has a number that is not finite")));
        }
        let mut order: Vec<u32> =
            (0..u32::try_from(x.len()).map_err(|_| failure("it has too many points".into()))?).collect();
        let before = |one: u32, other: u32| {
            let [one, other] = [one as usize, other as usize];
            y[one].total_cmp(&y[other]).then(x[one].total_cmp(&x[other]))
        };
        if !order.is_sorted_by(|one, other| before(*one, *other).is_lt()) {
            order.sort_by(|one, other| before(*one, *other));
        }
        let sorted = |values: &[f64]| -> Vec<f64> { order.iter().map(|index| values[*index as usize]).collect() };
        let [x, y, z] = [sorted(x), sorted(y), sorted(z)];
        let grid = GridPlaces::of(&x, &y).map_err(failure)?;
        let radius_mm = config.cutter_radius_mm;
        if let Some(y_mm) = y.first().into_iter().chain(y.last()).find(|y| y.abs() >= radius_mm) {
            let problem =
                format!("y reaches {y_mm} mm, and `cutter_radius_mm` is {radius_mm}: the tool does not come there");
            return Err(failure(problem).help("`origin_y_mm` of the map counts from below the spindle's axis"));
        }
        let column = points.columns.iter().find(|column| column.name == "std_nm");
        let of_file = column.map(|std| {
            if std.values.iter().any(|value| !(value.is_finite() && *value > 0.0)) {
                return Err(failure("`std_nm` is not above 0 nm everywhere".into()));
            }
            Ok((std.values.iter().map(|std| std * std).sum::<f64>() / std.values.len() as f64).sqrt())
        });
        let std_nm = config.std_nm.or(of_file.transpose()?);
        let mut rows: Vec<Row> = Vec::new();
        let mut start = 0;
        for row in 0..grid.rows {
            let of_row = |node: &u32| *node as usize / grid.columns == row;
            let length = grid.node[start..].iter().take_while(|node| of_row(node)).count();
            if length > 0 {
                rows.push(Row::new(y[start], radius_mm, start..start + length));
            }
            start += length;
        }
        Ok((Self { rows, x_mm: x, height_nm: z, std_nm }, grid))
    }

    /// Points.
    pub(crate) fn len(&self) -> usize {
        self.x_mm.len()
    }

    /// The points that are wanted, by row and place.
    pub(crate) fn part(&self, is_wanted: impl Fn(usize, usize) -> bool) -> Self {
        let mut part = Self { rows: Vec::new(), x_mm: Vec::new(), height_nm: Vec::new(), std_nm: self.std_nm };
        for (number, row) in self.rows.iter().enumerate() {
            let start = part.x_mm.len();
            for point in row.points.clone().filter(|point| is_wanted(number, *point)) {
                part.x_mm.push(self.x_mm[point]);
                part.height_nm.push(self.height_nm[point]);
            }
            if part.x_mm.len() > start {
                part.rows.push(Row { points: start..part.x_mm.len(), ..row.clone() });
            }
        }
        part
    }

    /// At most about so many points, of rows evenly over the map. A row stays whole unless too few rows would be left.
    pub(crate) fn thinned(&self, most: usize) -> Self {
        if self.len() <= most {
            return self.clone();
        }
        let every = self.len().div_ceil(most).min(self.rows.len().div_ceil(FEWEST_ROWS)).max(1);
        let left = self.len() / every;
        let keep = (most as f64 / left as f64).min(1.0);
        self.part(|row, point| {
            // Scattered places: even ones would add an alias of their own.
            let scattered = (point as u32).wrapping_mul(2_654_435_761) >> 8;
            row % every == every / 2 && f64::from(scattered) < keep * f64::from(1 << 24)
        })
    }

    /// First and last x, and first and last y, in mm.
    pub(crate) fn extent_mm(&self) -> [[f64; 2]; 2] {
        let fold = |start: f64, pick: fn(f64, f64) -> f64| self.x_mm.iter().copied().fold(start, pick);
        let ends = [self.rows.first(), self.rows.last()];
        [
            [fold(f64::INFINITY, f64::min), fold(f64::NEG_INFINITY, f64::max)],
            ends.map(|row| row.map_or(0.0, |row| row.y_mm)),
        ]
    }

    /// Heights without the plane that fits them best, in nm.
    pub(crate) fn levelled_nm(&self) -> Vec<f64> {
        let mut columns = [vec![1.0; self.len()], self.x_mm.clone(), self.y_mm().collect()];
        for place in 0..columns.len() {
            let (known, rest) = columns.split_at_mut(place);
            for column in known.iter() {
                let share = dot(column, &rest[0]);
                rest[0].iter_mut().zip(column).for_each(|(entry, column)| *entry -= share * column);
            }
            let size = dot(&rest[0], &rest[0]).sqrt().max(f64::MIN_POSITIVE);
            rest[0].iter_mut().for_each(|entry| *entry /= size);
        }
        let mut left = self.height_nm.clone();
        for column in &columns {
            let share = dot(column, &left);
            left.iter_mut().zip(column).for_each(|(entry, column)| *entry -= share * column);
        }
        left
    }

    /// y of each point.
    pub(crate) fn y_mm(&self) -> impl Iterator<Item = f64> + '_ {
        self.rows.iter().flat_map(|row| row.points.clone().map(|_| row.y_mm))
    }
}

/// Rows that are kept at least.
const FEWEST_ROWS: usize = 48;

impl Row {
    fn new(y_mm: f64, radius_mm: f64, points: Range<usize>) -> Self {
        let sine = y_mm / radius_mm;
        Self { y_mm, angle: sine.asin(), cosine: (1.0 - sine * sine).sqrt(), points }
    }
}
