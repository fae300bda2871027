//! What the strong orders of single turns have in common: a phase over n, or a relative size.

use runout_numerics::{Complex64, fourier::Fourier, statistics::f_tail};

use super::{TurnTable, mean};
use crate::check::FINDING;

/// Phase and size, run and step, and five times that: lines have a heavier tail than Student's t.
pub(super) const LOOKS: f64 = 20.0;
/// An order counts where its mean is this many standard errors.
const STRONG: f64 = 8.0;
/// Orders that have to agree.
const FEWEST_ORDERS: usize = 3;
/// Rows at each end that a step is not looked for in.
pub(super) const END_ROWS: usize = 3;
/// Steps at neighbouring turns are one step.
pub(super) const ALIKE_STEPS: f64 = 4.0;
/// Share of a weight that is no leverage, at least.
const LEAST_LEFT: f64 = 0.3;

/// A course that orders share.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shared {
    /// Change a row, or at the step.
    pub by: f64,
    /// First row behind the step; `None` for a run.
    pub step: Option<usize>,
    /// Student's t over the orders.
    pub t: f64,
    pub p: f64,
}

impl Shared {
    pub(super) fn refutes(&self) -> bool {
        LOOKS * self.p < FINDING
    }

    /// Standard deviation over the rows of a course that changes by one.
    pub(super) fn share(&self, rows: usize) -> f64 {
        let rows = rows as f64;
        self.step
            .map_or_else(|| ((rows * rows - 1.0) / 12.0).sqrt(), |row| (row as f64 * (rows - row as f64)).sqrt() / rows)
    }
}

/// A part of the coefficients beside their mean, of the strong ones: phase over n, or relative size.
pub(super) struct Parts {
    /// `[cell][row]`.
    values: Vec<Vec<f64>>,
    /// Order and weight of each cell.
    cells: Vec<(usize, f64)>,
}

impl Parts {
    /// Of phase and of size; `None` where fewer than three orders are strong.
    pub(super) fn of(table: &TurnTable) -> [Option<Self>; 2] {
        let rows = table.rows() as f64;
        let mut both = [Self { values: Vec::new(), cells: Vec::new() }, Self { values: Vec::new(), cells: Vec::new() }];
        for order in 1..=table.orders {
            for channel in 0..table.channels {
                let mean = mean(table.series(order, channel));
                let squares: f64 = table.series(order, channel).map(|value| (value - mean).norm_sqr()).sum();
                let error = squares / (rows - 1.0) / rows;
                let strength = mean.norm_sqr() / error.max(1e-18 * mean.norm_sqr()).max(f64::MIN_POSITIVE);
                if strength.is_nan() || strength <= STRONG * STRONG {
                    continue;
                }
                let relative = table.series(order, channel).map(|value| value * mean.conj() / mean.norm_sqr());
                let number = order as f64;
                both[0].values.push(relative.clone().map(|value: Complex64| value.im / number).collect());
                both[0].cells.push((order, strength * number * number));
                both[1].values.push(relative.map(|value| value.re - 1.0).collect());
                both[1].cells.push((order, strength));
            }
        }
        both.map(|parts| {
            let mut orders: Vec<usize> = parts.cells.iter().map(|(order, _)| *order).collect();
            orders.dedup();
            (orders.len() >= FEWEST_ORDERS).then_some(parts)
        })
    }

    /// What the cells have in common, by their weights, about its mean, `[row]`.
    pub(super) fn common(&self) -> Vec<f64> {
        let whole: f64 = self.cells.iter().map(|(_, weight)| weight).sum();
        let mut series = vec![0.0; self.values.first().map_or(0, Vec::len)];
        for (values, (_, weight)) in self.values.iter().zip(&self.cells) {
            series.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight / whole * value);
        }
        let level = series.iter().sum::<f64>() / series.len().max(1) as f64;
        series.iter_mut().for_each(|value| *value -= level);
        series
    }

    /// The run, or the step at the best turn, whichever is less likely chance.
    pub(super) fn shared(&self, rows: usize) -> Option<Shared> {
        let middle = 0.5 * (rows as f64 - 1.0);
        let run: Vec<f64> = (0..rows).map(|row| row as f64 - middle).collect();
        let series = self.common();
        let step = |first: usize| -> Vec<f64> {
            let share = first as f64 / rows as f64;
            (0..rows).map(|row| if row < first { share - 1.0 } else { share }).collect()
        };
        let mut before: f64 = series[..END_ROWS].iter().sum();
        let mut best = (0.0, END_ROWS);
        for first in END_ROWS..=rows - END_ROWS {
            let size = before.powi(2) / (first * (rows - first)) as f64;
            if size > best.0 {
                best = (size, first);
            }
            before += series[first.min(rows - 1)];
        }
        let steps = (rows as f64 / ALIKE_STEPS).max(1.0);
        let candidates = [(run, None, 1.0), (step(best.1), Some(best.1), steps)];
        let tested = candidates.into_iter().filter_map(|(shape, step, count)| {
            let (by, std, freedom) = self.over_orders(&shape)?;
            let t = by / std;
            let over_orders = f_tail(t * t, 1.0, freedom);
            Some(Shared { by, step, t, p: over_orders.max(over_turns(&series, &shape).1 * count) })
        });
        tested.min_by(|a, b| a.p.total_cmp(&b.p))
    }

    /// Size of a shape in the mean over orders, its standard uncertainty by their scatter, and the degrees of freedom of that. No order
    /// decides alone: three at least share the weight.
    pub(super) fn over_orders(&self, shape: &[f64]) -> Option<(f64, f64, f64)> {
        let square: f64 = shape.iter().map(|value| value * value).sum();
        let mut orders: Vec<(usize, f64, f64)> = Vec::new();
        for (values, (order, weight)) in self.values.iter().zip(&self.cells) {
            let size = values.iter().zip(shape).map(|(value, shape)| value * shape).sum::<f64>() / square;
            match orders.last_mut().filter(|(number, ..)| number == order) {
                Some((_, sum, all)) => (*sum, *all) = (*sum + weight * size, *all + weight),
                None => orders.push((*order, weight * size, *weight)),
            }
        }
        let mut largest: Vec<f64> = orders.iter().map(|(.., weight)| *weight).collect();
        largest.sort_by(|a, b| b.total_cmp(a));
        let most = 2.0 * largest.get(FEWEST_ORDERS - 1)?;
        let shares: Vec<(f64, f64)> = orders.iter().map(|(_, sum, weight)| (sum / weight, weight.min(most))).collect();
        let whole: f64 = shares.iter().map(|(_, weight)| weight).sum();
        let size = shares.iter().map(|(size, weight)| size * weight).sum::<f64>() / whole;
        let (mut variance, mut squares) = (0.0, 0.0);
        for (own, weight) in &shares {
            let leverage = weight / whole;
            variance += leverage * leverage * (own - size).powi(2) / (1.0 - leverage).max(LEAST_LEFT);
            squares += leverage * leverage;
        }
        let freedom = (1.0 / squares - 1.0).max(1.0);
        let std = variance.sqrt().max(f64::MIN_POSITIVE);
        Some((size, std, freedom))
    }
}

/// Standard uncertainty of a shape's size in the common course, and the chance that it has as much of it, from the scatter of its turns: at
/// least that of the slow part of their spectrum.
pub(super) fn over_turns(series: &[f64], shape: &[f64]) -> (f64, f64) {
    let rows = series.len();
    let norm = shape.iter().map(|value| value * value).sum::<f64>().sqrt();
    let size = series.iter().zip(shape).map(|(value, shape)| value * shape / norm).sum::<f64>();
    let left: Vec<f64> = series.iter().zip(shape).map(|(value, shape)| value - size * shape / norm).collect();
    let mut mirrored: Vec<f64> = left.iter().chain(left.iter().rev()).copied().collect();
    let mut harmonics = vec![Complex64::ZERO; rows];
    Fourier::new(2 * rows).analyse_in_place(&mut mirrored, &mut harmonics);
    let slow = (rows / 8).max(4);
    let power = |component: usize| {
        let turned = Complex64::cis(-std::f64::consts::PI * component as f64 / (2 * rows) as f64);
        0.5 * rows as f64 * (turned * harmonics[component]).re.powi(2)
    };
    let all: f64 = left.iter().map(|value| value * value).sum::<f64>() / (rows as f64 - 2.0);
    let of_slow = (1..=slow.min(rows - 1)).map(power).sum::<f64>() / slow as f64;
    let (variance, freedom) = if of_slow > all { (of_slow, slow as f64) } else { (all, rows as f64 - 2.0) };
    (variance.sqrt() / norm, f_tail(size * size / variance.max(f64::MIN_POSITIVE), 1.0, freedom))
}
