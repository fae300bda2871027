//! Measured points that belong to no turn: a coordinate measuring machine's circles, an R-test's ball positions.

use std::{collections::HashMap, ops::Range, path::PathBuf};

use runout_error::{Error, Result};
use runout_evaluate::height_grid::HeightGrid;
use runout_turning::{input_file::InputFile, provenance::Input};

mod coarse;
pub mod measured;
pub mod mistakes;

/// Numbers of a row without time and repeat from which on equal rows are no chance.
const FEWEST_FOR_COPIES: usize = 4;

/// Points in named columns, grouped into traces.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Points {
    /// The file behind them; empty where they come from the configuration alone.
    pub input: PathBuf,
    /// Further files behind them.
    pub besides: Vec<PathBuf>,
    /// These files as they were when they were first opened, where the loader remembers them.
    pub opened: Vec<InputFile>,
    /// Columns of equal length; the unit is part of the name (`angle_deg`).
    pub columns: Vec<Column>,
    /// Columns of texts: names of balls, of setups.
    pub labels: Vec<Labels>,
    /// Consecutive points that were measured in one go.
    pub traces: Vec<Trace>,
    /// What the user should know of the file.
    pub remarks: Vec<String>,
}

/// One named column of texts.
#[derive(Debug, Clone, PartialEq)]
pub struct Labels {
    /// Its name.
    pub name: String,
    /// One text a point.
    pub values: Vec<String>,
}

/// A column that a method needs of points, or can use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PointColumn {
    /// Its name, with the unit where it has one.
    pub name: &'static str,
    /// Its unit; empty for what has none.
    pub unit: &'static str,
    /// What it is.
    pub about: &'static str,
    /// What it holds.
    pub kind: PointKind,
    /// Whether points may lack it.
    pub optional: bool,
    /// Whether it holds readings: what a sensor gave, and no command, place or time.
    pub measured: bool,
}

/// What a column of points holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PointKind {
    /// Finite numbers.
    Number,
    /// 0 (used) and 1 (left out).
    Flag,
    /// Texts, which become [`Labels`].
    Label,
    /// The id of the [`Trace`] that a point belongs to; the points of a trace follow one another.
    Trace,
    /// What is the same along a trace, and becomes its [`kind`](Trace::kind).
    TraceKind,
}

impl PointColumn {
    /// A column that the method needs.
    #[must_use]
    pub const fn needed(name: &'static str, kind: PointKind, unit: &'static str, about: &'static str) -> Self {
        Self { name, unit, about, kind, optional: false, measured: false }
    }

    /// A column that the method can use.
    #[must_use]
    pub const fn optional(name: &'static str, kind: PointKind, unit: &'static str, about: &'static str) -> Self {
        Self { name, unit, about, kind, optional: true, measured: false }
    }

    /// Marks the column as one of readings.
    #[must_use]
    pub const fn measured(self) -> Self {
        Self { measured: true, ..self }
    }
}

/// One named column.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name with unit.
    pub name: String,
    /// One value a point.
    pub values: Vec<f64>,
}

/// A run of points measured in one go.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Its name in the file.
    pub id: String,
    /// What it runs along ("circle", "generatrix"), or the setup that it was measured in ("initial").
    pub kind: String,
    /// Its points.
    pub points: Range<usize>,
}

impl Points {
    /// The nodes of a grid that have a height, row by row, as points of a file.
    #[must_use]
    pub fn of_grid(grid: HeightGrid, input: PathBuf) -> Self {
        let count = grid.height_nm.len() - grid.holes();
        let [mut x, mut y] = [Vec::with_capacity(count), Vec::with_capacity(count)];
        for (row, heights) in grid.height_nm.chunks(grid.columns.max(1)).enumerate() {
            let row_y_mm = grid.origin_y_mm + grid.step_y_mm * row as f64;
            for (column, _) in heights.iter().enumerate().filter(|(_, height)| height.is_finite()) {
                x.push(grid.origin_x_mm + grid.step_x_mm * column as f64);
                y.push(row_y_mm);
            }
        }
        let mut heights = grid.height_nm;
        heights.retain(|height| height.is_finite());
        let std = grid.std_nm.map(|std| vec![std; heights.len()]);
        let values = [Some(x), Some(y), Some(heights), std];
        let columns = HeightGrid::COLUMNS.iter().zip(values);
        let columns = columns.filter_map(|(name, values)| Some(Column { name: (*name).into(), values: values? }));
        Self { input, columns: columns.collect(), ..Self::default() }
    }

    /// Every file behind them.
    #[must_use]
    pub fn inputs(&self) -> Vec<PathBuf> {
        let files = std::iter::once(&self.input).chain(&self.besides);
        files.filter(|file| !file.as_os_str().is_empty()).cloned().collect()
    }

    /// The files with their checksums, for the provenance of a result.
    ///
    /// # Errors
    /// When one cannot be read, or changed since it was first opened.
    pub fn provenance(&self) -> Result<Vec<Input>> {
        let checksum = |path: &PathBuf| match self.opened.iter().find(|file| file.path() == path) {
            Some(file) => file.checksum(),
            None => Input::of(path),
        };
        self.inputs().iter().map(checksum).collect()
    }

    /// A column by name.
    ///
    /// # Errors
    /// When there is none of that name.
    pub fn column(&self, name: &str) -> Result<&[f64]> {
        self.columns.iter().find(|column| column.name == name).map(|column| column.values.as_slice()).ok_or_else(|| {
            let known: Vec<&str> = self.columns.iter().map(|column| column.name.as_str()).collect();
            Error::new("find the column", name, format!("{} has {}", self.input.display(), known.join(", ")))
        })
    }

    /// A column of texts by name; `None` where there is none.
    #[must_use]
    pub fn labels(&self, name: &str) -> Option<&[String]> {
        self.labels.iter().find(|labels| labels.name == name).map(|labels| labels.values.as_slice())
    }

    /// Rows that are equal to an earlier one in every column, in words. A row of few numbers without time and repeat may be equal to
    /// another one by the resolution alone.
    #[must_use]
    pub fn copies(&self) -> Option<String> {
        let has_key = self.columns.iter().any(|column| ["time_s", "repeat"].contains(&column.name.as_str()));
        if !has_key && self.columns.len() < FEWEST_FOR_COPIES {
            return None;
        }
        let count = self.columns.first().map_or(0, |column| column.values.len());
        let mut known: HashMap<(Vec<u64>, Vec<&str>), usize> = HashMap::with_capacity(count);
        let mut first = None;
        let mut copies = 0;
        for row in 0..count {
            let numbers = self.columns.iter().filter_map(|column| column.values.get(row)).map(|value| value.to_bits());
            let texts = self.labels.iter().filter_map(|labels| labels.values.get(row)).map(String::as_str);
            let earlier = *known.entry((numbers.collect(), texts.collect())).or_insert(row);
            if earlier < row {
                copies += 1;
                first.get_or_insert([earlier + 1, row + 1]);
            }
        }
        let [earlier, later] = first?;
        Some(format!(
            "{copies} of {count} rows are equal to another row in every column, row {later} to row {earlier} first: are they copies? Each \
             counts as a reading of its own, which makes noise and standard uncertainties too small"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(columns: &[(&str, &[f64])], ball: &[&str]) -> Points {
        let columns = columns.iter().map(|(name, values)| Column { name: (*name).into(), values: values.to_vec() });
        let labels = Labels { name: "ball".into(), values: ball.iter().map(|id| (*id).into()).collect() };
        Points { columns: columns.collect(), labels: vec![labels], ..Points::default() }
    }

    #[test]
    fn copies_are_equal_in_every_column() {
        let readings = [0.5, 0.5, 0.5, 0.5];
        let of = |repeat: &[f64], ball: &[&str]| points(&[("repeat", repeat), ("dx_mm", &readings)], ball).copies();
        let found = of(&[1.0, 1.0, 2.0, 1.0], &["P1", "P2", "P1", "P1"]).unwrap_or_default();
        assert!(found.starts_with("1 of 4 rows") && found.contains("row 4 to row 1"), "{found}");
        assert_eq!(of(&[1.0, 1.0, 2.0, 2.0], &["P1", "P2", "P1", "P2"]), None);
        // Two numbers that a coarse resolution makes equal.
        assert_eq!(points(&[("radius_mm", &readings), ("direction_deg", &readings)], &["a"; 4]).copies(), None);
    }
}
