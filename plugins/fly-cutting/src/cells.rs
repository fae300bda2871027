//! Means of passes over their width, bin by bin along y: what tests of independence are made on. Material has a texture: neighbouring
//! points are not independent, means of a pass depend on each other along it, and passes are independent.

use std::f64::consts::TAU;

use runout_core::{
    Complex64,
    consistency::{Kind, Partition, Structure},
};

use crate::{heights::Heights, passes::Surface};

/// Means at most, over all passes; of each pass at least and at most.
const MOST: usize = 6000;
const OF_PASS: [usize; 2] = [8, 200];
/// Groups of neighbouring passes that have to agree on an effect, at most.
const MOST_GROUPS: usize = 12;

/// One mean.
#[derive(Debug, Clone, Copy)]
struct Cell {
    /// Its pass, counted from the first.
    pass: usize,
    bin: usize,
    y_mm: f64,
    /// Angle of the tool, in radians.
    angle: f64,
    points: f64,
}

/// Means of a map.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cells {
    all: Vec<Cell>,
    /// The mean that each point is in; beyond the end where it is in none.
    of: Vec<usize>,
    first: i32,
    passes: usize,
    bins: usize,
    /// Whether each bin is one row.
    is_by_row: bool,
}

impl Cells {
    pub(crate) fn of(heights: &Heights, surface: &Surface) -> Self {
        let ends = surface.pass.iter().min().zip(surface.pass.iter().max());
        let Some((first, last)) = ends.map(|(first, last)| (*first, *last)) else { return Self::default() };
        let passes = (last - first) as usize + 1;
        let rows = heights.rows.len();
        let bins = (MOST / passes).clamp(OF_PASS[0], OF_PASS[1]).min(rows);
        let empty = |index: usize| Cell { pass: index / bins, bin: index % bins, y_mm: 0.0, angle: 0.0, points: 0.0 };
        let mut all: Vec<Cell> = (0..passes * bins).map(empty).collect();
        let mut of = vec![0; heights.len()];
        for (number, row) in heights.rows.iter().enumerate() {
            for point in row.points.clone() {
                let index = (surface.pass[point] - first) as usize * bins + number * bins / rows;
                let cell = &mut all[index];
                cell.points += 1.0;
                cell.y_mm += row.y_mm;
                cell.angle += row.angle;
                of[point] = index;
            }
        }
        // Passes at the edge of the map are not measured over their width.
        let mut counts: Vec<f64> = all.iter().map(|cell| cell.points).filter(|points| *points > 0.0).collect();
        counts.sort_by(f64::total_cmp);
        let least = 0.5 * counts.get(counts.len() / 2).copied().unwrap_or(0.0);
        let mut place = vec![usize::MAX; all.len()];
        let mut cells = Vec::new();
        for (index, cell) in all.into_iter().enumerate().filter(|(_, cell)| cell.points > least) {
            place[index] = cells.len();
            cells.push(Cell { y_mm: cell.y_mm / cell.points, angle: cell.angle / cell.points, ..cell });
        }
        of.iter_mut().for_each(|index| *index = place[*index]);
        Self { all: cells, of, first, passes, bins, is_by_row: bins == rows }
    }

    /// Passes from the first to the last.
    pub(crate) fn passes(&self) -> usize {
        self.passes
    }

    /// Points of a mean, harmonic: by which its variance is smaller.
    pub(crate) fn averaged(&self) -> f64 {
        self.all.len() as f64 / self.all.iter().map(|cell| cell.points.recip()).sum::<f64>().max(f64::MIN_POSITIVE)
    }

    /// Means of values at the points.
    pub(crate) fn means(&self, values: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; self.all.len()];
        for (index, value) in self.of.iter().zip(values) {
            if let Some(sum) = sums.get_mut(*index) {
                *sum += value;
            }
        }
        sums.iter().zip(&self.all).map(|(sum, cell)| sum / cell.points).collect()
    }

    /// The group of passes that a pass is in.
    fn group(&self, pass: usize) -> usize {
        pass * self.groups() / self.passes.max(1)
    }

    fn groups(&self) -> usize {
        self.passes.min(MOST_GROUPS)
    }

    fn groups_name(&self) -> &'static str {
        if self.passes > MOST_GROUPS { "groups of passes" } else { "passes" }
    }

    /// What is declared of the means. Passes have unequal numbers of points: their scatter is not compared.
    pub(crate) fn structure(&self) -> Structure {
        let groups = self.all.iter().map(|cell| self.group(cell.pass)).collect();
        let names = (1..=self.groups()).map(|number| format!("pass {number}")).collect();
        // Material repeats no row, an instrument that reads row after row may.
        let rows = self.all.iter().map(|cell| cell.bin).collect();
        let row_names = (1..=self.bins).map(|number| format!("row {number}")).collect();
        let halves: Vec<usize> = self.all.iter().map(|cell| usize::from(2 * cell.bin >= self.bins)).collect();
        Structure::default()
            .along(
                "y",
                self.all.iter().map(|cell| cell.pass).collect(),
                self.all.iter().map(|cell| cell.y_mm).collect(),
            )
            .divided(self.groups_name(), Kind::Blocks, groups, names)
            .divided(if self.is_by_row { "rows" } else { "groups of rows" }, Kind::Independent, rows, row_names)
            .shifting("halves", &halves, &["lower", "upper"].map(|half| format!("the {half} half of the map")))
    }

    /// The group of passes of each point, for effects that change no mean of a pass.
    pub(crate) fn groups_of_points(&self) -> Partition {
        let group = |index: &usize| self.all.get(*index).map_or(usize::MAX, |cell| self.group(cell.pass));
        Partition {
            name: self.groups_name().into(),
            level: self.of.iter().map(group).collect(),
            levels: (1..=self.groups()).map(|group| group.to_string()).collect(),
            kind: Kind::Blocks,
        }
    }

    /// What lines explain of the means at a ratio and at others that passes resolve, with the place of the ratio among them: up to a factor, in
    /// the order of the ratios. They have at least `fewest` periods over the map.
    pub(crate) fn spectrum(&self, means: &[f64], ratio: f64, tilts: bool, fewest: f64) -> (Vec<f64>, usize) {
        let step = 1.0 / self.passes.max(1) as f64;
        let whole = ratio.floor();
        let own = ratio - whole;
        let below = ((own - fewest * step) / step).floor().max(0.0);
        let above = ((1.0 - fewest * step - own) / step).floor().max(0.0);
        let at = |offset: f64| {
            let ratio = ratio + offset * step;
            let term = |(cell, mean): (&Cell, &f64)| {
                let pass = f64::from(self.first) + cell.pass as f64;
                let lever = if tilts { cell.y_mm } else { 1.0 };
                Complex64::from_polar(lever * mean, -ratio * (TAU * pass + cell.angle))
            };
            self.all.iter().zip(means).map(term).sum::<Complex64>().norm_sqr()
        };
        let offsets = (0..=(below + above) as usize).map(|index| index as f64 - below);
        (offsets.map(at).collect(), below as usize)
    }
}
