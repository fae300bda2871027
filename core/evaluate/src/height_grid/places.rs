//! The grid that measured places are nodes of.

use super::HeightGrid;

/// Places are nodes where they are off them by less than this share of a step, or by the rounding of their decimals.
const SAME: f64 = 0.01;
/// Share of a step that rounding may move a place by, at most: beyond it two nodes are not distinguishable.
const ROUNDED: f64 = 0.25;
/// Most decimals of a rounded coordinate in mm: 1 nm and a digit.
const DECIMALS: i32 = 7;
/// Nodes for each place, at most: what fills less than a quarter of a rectangle is no map.
const NODES: usize = 4;
/// Places below which even a sparse grid is taken.
const FEW: usize = 1000;

/// The grid that places lie on, and the node of each.
#[derive(Debug, Clone, PartialEq)]
pub struct GridPlaces {
    /// Nodes along y.
    pub rows: usize,
    /// Nodes along x.
    pub columns: usize,
    /// Distance of columns, in mm.
    pub step_x_mm: f64,
    /// Distance of rows, in mm.
    pub step_y_mm: f64,
    /// x of the first column and y of the first row, in mm.
    pub origin_mm: [f64; 2],
    /// Node of each place, row · columns + column.
    pub node: Vec<u32>,
}

impl GridPlaces {
    /// The grid of these places, in any order. Coordinates that were rounded to some decimals are nodes of the grid whose steps fit them best.
    ///
    /// # Errors
    /// In words, where places lie on no grid, on one line, are too far from each other, or two are at one node.
    pub fn of(x_mm: &[f64], y_mm: &[f64]) -> Result<Self, String> {
        let [x, y] = [Line::of(x_mm, "x")?, Line::of(y_mm, "y")?];
        let (rows, columns) = (y.count, x.count);
        let nodes = rows.checked_mul(columns).filter(|nodes| u32::try_from(*nodes).is_ok());
        if nodes.is_none_or(|nodes| nodes > NODES * x_mm.len() + FEW) {
            return Err(format!(
                "its {} points fill less than a quarter of {rows} rows and {columns} columns",
                x_mm.len()
            ));
        }
        let mut taken = vec![false; nodes.unwrap_or_default()];
        let mut node = Vec::with_capacity(x_mm.len());
        for (x_mm, y_mm) in x_mm.iter().zip(y_mm) {
            let place = y.node(*y_mm) * columns + x.node(*x_mm);
            if std::mem::replace(&mut taken[place], true) {
                return Err(format!("two points are at x = {x_mm} mm, y = {y_mm} mm"));
            }
            node.push(place as u32);
        }
        let (step_x_mm, step_y_mm, origin_mm) = (x.step, y.step, [x.first, y.first]);
        Ok(Self { rows, columns, step_x_mm, step_y_mm, origin_mm, node })
    }

    /// The grid of one row of these places, at y.
    ///
    /// # Errors
    /// In words, where places are not at equal steps, or two are at one node.
    pub fn along(x_mm: &[f64], y_mm: f64) -> Result<Self, String> {
        let x = Line::of(x_mm, "x")?;
        let node: Vec<u32> = x_mm.iter().map(|x_mm| x.node(*x_mm) as u32).collect();
        let mut sorted = node.clone();
        sorted.sort_unstable();
        if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            let twice = node.iter().zip(x_mm).find(|(node, _)| **node == pair[0]).map_or(f64::NAN, |(_, x_mm)| *x_mm);
            return Err(format!("two points are at x = {twice} mm"));
        }
        let Line { count: columns, step: step_x_mm, first } = x;
        Ok(Self { rows: 1, columns, step_x_mm, step_y_mm: step_x_mm, origin_mm: [first, y_mm], node })
    }

    /// Values of the places at their nodes, row by row, NaN where there is no place.
    #[must_use]
    pub fn laid(&self, values: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut all = vec![f64::NAN; self.rows * self.columns];
        for (node, value) in self.node.iter().zip(values) {
            all[*node as usize] = value;
        }
        all
    }

    /// Nodes without a place.
    #[must_use]
    pub fn holes(&self) -> usize {
        self.rows * self.columns - self.node.len()
    }

    /// Heights of the places, in nm, on the whole grid.
    #[must_use]
    pub fn heights(&self, height_nm: impl Iterator<Item = f64>, std_nm: Option<f64>) -> HeightGrid {
        let &Self { columns, step_x_mm, step_y_mm, origin_mm: [origin_x_mm, origin_y_mm], .. } = self;
        let height_nm = self.laid(height_nm);
        HeightGrid { columns, step_x_mm, step_y_mm, origin_x_mm, origin_y_mm, std_nm, height_nm }
    }
}

/// Equal steps along one direction.
struct Line {
    count: usize,
    step: f64,
    first: f64,
}

impl Line {
    /// The steps that coordinates fit.
    fn of(values: &[f64], name: &str) -> Result<Self, String> {
        let mut known = values.to_vec();
        known.sort_unstable_by(f64::total_cmp);
        let span = known.last().zip(known.first()).map_or(0.0, |(last, first)| last - first);
        known.dedup_by(|next, kept| *next - *kept <= 1e-9 * span);
        if known.len() < 2 {
            return Err(format!("all its points have the same {name}: two or more are needed"));
        }
        let differences = || known.windows(2).map(|pair| pair[1] - pair[0]);
        let least = differences().fold(f64::INFINITY, f64::min);
        let beside: Vec<f64> = differences().filter(|step| *step < 1.5 * least).collect();
        let start = beside.iter().sum::<f64>() / beside.len() as f64;
        if span / start > 1e6 {
            return Err(format!(
                "its points are no grid: steps of {start} mm from {} to {} mm",
                known[0],
                known[known.len() - 1]
            ));
        }
        let mut places = Vec::with_capacity(known.len());
        let mut place = 0.0;
        for (index, value) in known.iter().enumerate() {
            place += if index > 0 { ((value - known[index - 1]) / start).round().max(1.0) } else { 0.0 };
            places.push(place);
        }
        let (first, step) = line(&places, &known);
        let near = (SAME * step).max(0.51 * rounding(&known)).min(ROUNDED * step);
        let off = known.iter().zip(&places).find(|(value, place)| (*value - first - step * *place).abs() > near);
        match off {
            Some((value, _)) => {
                Err(format!("{name} = {value} mm is not on a grid of steps of {step} mm from {first} mm"))
            }
            None => Ok(Self { count: place as usize + 1, step, first }),
        }
    }

    fn node(&self, value: f64) -> usize {
        (((value - self.first) / self.step).round().max(0.0) as usize).min(self.count - 1)
    }
}

/// First value and step of the least-squares line over the places.
fn line(places: &[f64], values: &[f64]) -> (f64, f64) {
    let count = places.len() as f64;
    let [middle, mean] = [places, values].map(|of| of.iter().sum::<f64>() / count);
    let pairs = || places.iter().map(|place| place - middle).zip(values.iter().map(|value| value - mean));
    let step =
        pairs().map(|(place, value)| place * value).sum::<f64>() / pairs().map(|(place, _)| place * place).sum::<f64>();
    (mean - step * middle, step)
}

/// The last decimal that all coordinates have, in mm; 0 where they have more than a file would write.
fn rounding(values: &[f64]) -> f64 {
    let decimals = (0..=DECIMALS).find(|decimals| {
        let scale = 10_f64.powi(*decimals);
        values.iter().all(|value| (value * scale - (value * scale).round()).abs() < 1e-6)
    });
    decimals.map_or(0.0, |decimals| 10_f64.powi(-decimals))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn places(count: usize, step: f64, decimals: i32) -> Vec<f64> {
        let scale = 10_f64.powi(decimals);
        (0..count).map(|index| (step * index as f64 * scale).round() / scale).collect()
    }

    /// A step of 0.024691 mm, written as 0, 0.025, 0.049, …
    #[test]
    fn rounded_coordinates_are_a_grid() {
        let (across, along) = (places(81, 0.024_691, 3), places(41, 0.024_691, 3));
        let (mut x, mut y) = (Vec::new(), Vec::new());
        for row in &along {
            for column in &across {
                x.push(*column);
                y.push(*row);
            }
        }
        let grid = GridPlaces::of(&x, &y).unwrap();
        assert_eq!((grid.rows, grid.columns, grid.holes()), (41, 81, 0));
        // Rounding by at most half a micrometre over 80 steps.
        assert!((grid.step_x_mm - 0.024_691).abs() < 2e-5 / 80.0, "{}", grid.step_x_mm);
        assert!(grid.node.iter().enumerate().all(|(index, node)| index == *node as usize));
    }

    #[test]
    fn missing_lines_are_holes_and_order_is_free() {
        let grid = GridPlaces::of(&[0.4, 0.0, 0.1, 0.4], &[1.0, 0.0, 1.0, 3.0]).unwrap();
        assert_eq!((grid.rows, grid.columns, grid.holes()), (4, 5, 16));
        assert_eq!(grid.node, [9, 0, 6, 19]);
        assert!((grid.step_x_mm - 0.1).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_grid_is_refused() {
        let refused = |x: &[f64], y: &[f64]| GridPlaces::of(x, y).unwrap_err();
        assert!(refused(&[0.0, 1.0, 2.37, 3.0], &[0.0, 1.0, 0.0, 1.0]).contains("not on a grid"));
        assert!(refused(&[0.0, 1.0, 1.0], &[0.0, 1.0, 1.0]).contains("two points"));
        assert!(refused(&[0.0, 1.0], &[2.0, 2.0]).contains("the same y"));
        let far: Vec<f64> = (0..40).map(|index| f64::from(index * index)).collect();
        assert!(refused(&far, &far).contains("less than a quarter"));
    }
}
