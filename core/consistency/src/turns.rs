//! The course of a recording's turns: whether their low orders stay what they are.
//!
//! A mean over turns, and the covariance that neighbouring frequencies give it, are right where nothing but asynchronous motion changes
//! from turn to turn. Four things are looked for that are none: a phase or a size that all orders share and that runs or
//! steps ([`common`]); one order that changes slowly, beyond all that asynchronous motion does at any other frequency
//! beside it ([`alone`]); an order 1 that only a steady turning against the mark makes coherent, and marks that come once in several turns or
//! several times a turn ([`marks`]); and single turns unlike the others ([`single`]). Asynchronous motion is made of lines, not of Gaussian noise: F tests of slow against fast turns find
//! something in every second sound recording, so a slow course is ranked against all other windows of the spectrum instead.

mod alone;
mod common;
mod marks;
mod parts;
mod single;
mod spectrum;
mod start;
#[cfg(test)]
mod tests;

use runout_numerics::Complex64;

use crate::check::Check;

/// Orders that are kept of every turn, from 1.
pub const ORDERS: usize = 10;
/// Rows of a table at most: beyond, neighbouring turns are averaged.
pub const MOST_ROWS: usize = 512;
/// Rows from which anything is said.
const FEWEST_ROWS: usize = 8;

/// Low orders of the turns of one recording, one row a turn or a mean of neighbouring turns.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TurnTable {
    /// The first turn of each row, counted from the recording's first mark.
    pub turns: Vec<usize>,
    /// Turns in a row.
    pub together: usize,
    /// Orders, from 1.
    pub orders: usize,
    /// Channels.
    pub channels: usize,
    /// Mean level, in µm, `[row][channel]`.
    pub levels_um: Vec<f64>,
    /// Coefficients of Re Σ cₙ e^{−inΦ}, in µm, `[row][order from 1][channel]`.
    pub coefficients: Vec<Complex64>,
}

/// What the turns of a recording say of themselves, and what the mean is uncertain by.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TurnCourse {
    /// The tests.
    pub checks: Vec<Check>,
    /// Standard deviation of a phase that all orders share, in rad of order 1: order n has n times as much. 0 where none changes.
    pub phase_std_rad: f64,
    /// Standard deviation of a size that all orders share, relative. 0 where none changes.
    pub size_std: f64,
    /// The phase that all orders share, where it is a step or a run of known size.
    pub phase: Option<PhaseCourse>,
    /// The run that they show, be it more than chance or not; nothing with too few orders.
    pub run: Option<PhaseCourse>,
    /// Orders that change by themselves, with the covariance of their course over the turns, in µm², `[channel][channel]`.
    pub orders: Vec<(usize, Vec<Complex64>)>,
}

/// A phase that all orders share, over the turns: that of order n is n times as much.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseCourse {
    /// The step, in rad, or the run, in rad a turn.
    pub by_rad: f64,
    /// Its standard uncertainty, from the scatter over the orders or that over the turns, whichever is larger.
    pub std_rad: f64,
    /// Turns from the recording's first mark to the step, and the standard uncertainty of their number; `None` for a run.
    pub step_at: Option<[f64; 2]>,
}

impl PhaseCourse {
    /// The phase at each row of a table, in rad, from that of the first turn.
    fn at(&self, table: &TurnTable) -> Vec<f64> {
        let together = table.together.max(1) as f64;
        let first = table.turns.first().copied().unwrap_or(0);
        let share = |turn: &usize| match self.step_at {
            // The row in which it steps is before it in part.
            Some([turns, _]) => ((*turn as f64 + together - turns) / together).clamp(0.0, 1.0),
            None => (turn - first) as f64,
        };
        table.turns.iter().map(|turn| self.by_rad * share(turn)).collect()
    }
}

impl TurnCourse {
    /// What the course adds to the covariance of an order's mean, `[channel][channel]`; `None` where nothing.
    ///
    /// The value of any turn was as likely asked for as that of any other: the mean square of the course, which is
    /// its peak-to-valley over √12 where it is a straight line.
    #[must_use]
    pub fn covariance(&self, order: usize, mean: &[Complex64]) -> Option<Vec<Complex64>> {
        let share = (order as f64 * self.phase_std_rad).powi(2).min(1.0) + self.size_std.powi(2);
        let own = self.orders.iter().find(|(number, _)| *number == order).map(|(_, covariance)| covariance);
        if share == 0.0 && own.is_none() {
            return None;
        }
        let mut covariance = own.cloned().unwrap_or_else(|| vec![Complex64::ZERO; mean.len() * mean.len()]);
        let products = mean.iter().flat_map(|one| mean.iter().map(move |other| one * other.conj()));
        covariance.iter_mut().zip(products).for_each(|(entry, product)| *entry += product * share);
        Some(covariance)
    }
}

impl TurnCourse {
    /// That of some of the channels.
    #[must_use]
    pub fn of_channels(&self, channels: &[usize], all: usize) -> Self {
        let select = |matrix: &Vec<Complex64>| {
            channels.iter().flat_map(|row| channels.iter().map(move |column| matrix[row * all + column])).collect()
        };
        let orders = self.orders.iter().map(|(order, matrix)| (*order, select(matrix))).collect();
        Self { orders, ..self.clone() }
    }

    /// Whether anything changes.
    #[must_use]
    pub fn is_steady(&self) -> bool {
        self.orders.is_empty() && self.phase_std_rad == 0.0 && self.size_std == 0.0
    }
}

impl TurnTable {
    /// Tests the turns against each other. Nothing with too few of them.
    #[must_use]
    pub fn course(&self) -> TurnCourse {
        let mut course = TurnCourse::default();
        if self.rows() < FEWEST_ROWS || self.channels == 0 || self.orders == 0 {
            return course;
        }
        let steady = self.without_creep();
        let spectrum = spectrum::Spectrum::of(&steady);
        marks::look(&steady, &spectrum, &mut course);
        common::look(&steady, &mut course);
        alone::look(&steady, &spectrum, &mut course);
        single::look(&steady, &mut course);
        course
    }

    /// Rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.turns.len()
    }

    fn at(&self, row: usize, order: usize, channel: usize) -> Complex64 {
        self.coefficients[(row * self.orders + order - 1) * self.channels + channel]
    }

    /// The coefficient of an order and channel in every row.
    fn series(&self, order: usize, channel: usize) -> impl Iterator<Item = Complex64> + Clone + '_ {
        (0..self.rows()).map(move |row| self.at(row, order, channel))
    }

    /// Without the rows in which a phase may step.
    fn beside(&self, phase: &PhaseCourse) -> Self {
        let Some([step, _]) = phase.step_at else { return self.clone() };
        let is_within =
            |row: &usize| (self.turns[*row] as f64 - step + 0.5 * self.together as f64).abs() <= self.together as f64;
        let rows: Vec<usize> = (0..self.rows()).filter(|row| !is_within(row)).collect();
        let of = |width: usize| rows.iter().flat_map(move |row| row * width..(row + 1) * width);
        Self {
            turns: rows.iter().map(|row| self.turns[*row]).collect(),
            levels_um: of(self.channels).map(|place| self.levels_um[place]).collect(),
            coefficients: of(self.orders * self.channels).map(|place| self.coefficients[place]).collect(),
            ..*self
        }
    }

    /// With the phase of order 1 in each row taken out of it, and n times as much of order n.
    fn turned_back(&self, phase_rad: &[f64]) -> Self {
        let mut turned = self.clone();
        let of_row = turned.coefficients.chunks_exact_mut((self.orders * self.channels).max(1));
        for (row, phase_rad) in of_row.zip(phase_rad) {
            for (index, orders) in row.chunks_exact_mut(self.channels).enumerate() {
                let back = Complex64::cis(-phase_rad * (index + 1) as f64);
                orders.iter_mut().for_each(|value| *value *= back);
            }
        }
        turned
    }

    /// Without what a level that creeps leaves in each turn: a saw-tooth of −i·rise/πn at order n.
    fn without_creep(&self) -> Self {
        let mut steady = self.clone();
        let last = self.rows() - 1;
        for row in 0..=last {
            for channel in 0..self.channels {
                let rise = |from: usize, to: usize| {
                    let level = |row: usize| self.levels_um[row * self.channels + channel];
                    (level(to) - level(from)) / (self.turns[to] - self.turns[from]).max(1) as f64
                };
                // At the ends, of a parabola.
                let rise = match row {
                    0 => 2.0 * rise(0, 1) - rise(0, 2),
                    row if row == last => 2.0 * rise(last - 1, last) - rise(last - 2, last),
                    row => rise(row - 1, row + 1),
                };
                for order in 1..=self.orders {
                    let place = (row * self.orders + order - 1) * self.channels + channel;
                    steady.coefficients[place].im += rise / (std::f64::consts::PI * order as f64);
                }
            }
        }
        steady
    }
}

/// Mean of values.
fn mean(values: impl Iterator<Item = Complex64>) -> Complex64 {
    let (mut sum, mut count) = (Complex64::ZERO, 0.0);
    for value in values {
        sum += value;
        count += 1.0;
    }
    sum / f64::max(count, 1.0)
}
