//! A phase that all orders share, of any size: where the linear fit of it begins.
//!
//! What a phase takes away from the mean of the turns is looked for in the products of turns, each cell as a share of its own power: a cell without a
//! coherent order has a small one, whatever its size.

use std::f64::consts::TAU;

use runout_numerics::Complex64;

use super::{ORDERS, TurnTable, parts::END_ROWS};

/// Phases that are tried in a period of the highest order.
const IN_A_PERIOD: usize = 8;

impl TurnTable {
    /// Power of a cell over all turns.
    fn power(&self, order: usize, channel: usize) -> f64 {
        self.series(order, channel).map(|value| value.norm_sqr()).sum::<f64>().max(f64::MIN_POSITIVE)
    }

    /// Sum over the channels of products of a turn and one `lag` turns before, as shares of their power, by order from 1.
    fn lag_products(&self, lag: usize) -> Vec<Complex64> {
        let of = |order: usize, channel: usize| {
            let later = self.series(order, channel).skip(lag);
            let sum: Complex64 = later.zip(self.series(order, channel)).map(|(later, now)| later * now.conj()).sum();
            sum / self.power(order, channel)
        };
        (1..=self.orders).map(|order| (0..self.channels).map(|channel| of(order, channel)).sum()).collect()
    }
}

/// Σ Re zₙe^{−inφ}.
fn along(products: &[Complex64], phase_rad: f64) -> f64 {
    let turned = Complex64::cis(-phase_rad);
    let mut power = Complex64::ONE;
    products
        .iter()
        .map(|product| {
            power *= turned;
            (product * power).re
        })
        .sum()
}

/// The phase, in rad, at which [`along`] is largest, of `2·reach + 1` about `middle`.
fn largest(products: &[Complex64], middle: f64, reach: usize, step: f64) -> (f64, f64) {
    let tried = (0..=2 * reach).map(|place| middle + step * (place as f64 - reach as f64));
    tried.map(|phase| (along(products, phase), phase)).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, middle))
}

/// The run, in rad a row: of turns beside each other, then of turns twice as far apart, and so on, each within what the one before leaves open.
pub(super) fn run(table: &TurnTable) -> f64 {
    let in_a_turn = ORDERS * IN_A_PERIOD;
    let step = TAU / in_a_turn as f64;
    let mut run = largest(&table.lag_products(1), 0.0, in_a_turn / 2, step).1;
    let mut lag = 2;
    while 2 * lag <= table.rows() {
        run = largest(&table.lag_products(lag), lag as f64 * run, IN_A_PERIOD, step).1 / lag as f64;
        lag *= 2;
    }
    run
}

/// The step, in rad, and the first row behind it.
pub(super) fn step(table: &TurnTable) -> (f64, usize) {
    let (rows, in_a_turn) = (table.rows(), ORDERS * IN_A_PERIOD);
    let cells = || (1..=table.orders).flat_map(|order| (0..table.channels).map(move |channel| (order, channel)));
    // Sums of the rows before and behind, of each cell, over the root of its power.
    let scales: Vec<f64> = cells().map(|(order, channel)| table.power(order, channel).sqrt().recip()).collect();
    let mut before = vec![Complex64::ZERO; scales.len()];
    let mut behind: Vec<Complex64> = cells().map(|(order, channel)| table.series(order, channel).sum()).collect();
    let mut best = (f64::MIN, 0.0, END_ROWS);
    for first in 1..=rows.saturating_sub(END_ROWS) {
        for ((before, behind), (order, channel)) in before.iter_mut().zip(&mut behind).zip(cells()) {
            let value = table.at(first - 1, order, channel);
            *before += value;
            *behind -= value;
        }
        if first < END_ROWS {
            continue;
        }
        let mut products = vec![Complex64::ZERO; table.orders];
        let mut apart = 0.0;
        for (((before, behind), scale), (order, _)) in before.iter().zip(&behind).zip(&scales).zip(cells()) {
            let (before, behind) = (before * scale, behind * scale);
            products[order - 1] += behind * before.conj();
            // Half of |b + a·e^{−inφ}|², which is the power of the mean: this share of it has no phase.
            apart += 0.5 * (before.norm_sqr() + behind.norm_sqr());
        }
        let (gain, phase) = largest(&products, 0.0, in_a_turn / 2, TAU / in_a_turn as f64);
        if apart + gain > best.0 {
            best = (apart + gain, phase, first);
        }
    }
    (best.1, best.2)
}
