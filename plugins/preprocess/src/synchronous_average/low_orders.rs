//! Low orders of every turn, from sums over sectors of it: enough to see what changes from turn to turn, at the cost of a few additions a
//! reading.

use std::f64::consts::TAU;

use runout_core::{
    Complex64,
    consistency::turns::{MOST_ROWS, ORDERS, TurnTable},
};

use super::size::Size;

/// Sectors of a turn: what their means fold onto an order is weakened at least as the order over their number.
const SECTORS: usize = 40;

/// The table of the turns of one capture under way.
pub(super) struct LowOrders {
    /// Equal angles of a turn.
    angles: usize,
    /// First angle of each sector, and of what follows.
    edges: Vec<usize>,
    /// What a sector's sum is taken times, `[sector][order from 1]`.
    waves: Vec<Complex64>,
    /// Coefficients of one turn of one channel, by order from 1.
    turn: Vec<Complex64>,
    table: TurnTable,
    /// Turns in the last row.
    filled: usize,
}

impl LowOrders {
    /// For `planned` turns at most.
    pub(super) fn new(size: Size, planned: usize) -> Self {
        let Size { channels, angles, orders } = size;
        let sectors = SECTORS.min(angles);
        let orders = ORDERS.min(orders - 1).min(sectors.saturating_sub(1) / 2);
        let edges: Vec<usize> = (0..=sectors).map(|sector| sector * angles / sectors).collect();
        let phases: Vec<Complex64> =
            (0..angles).map(|angle| Complex64::cis(TAU * angle as f64 / angles as f64)).collect();
        let mean = |order: usize, sector: &[usize]| {
            let phase = |angle: usize| phases[order * angle % angles];
            (sector[0]..sector[1]).map(phase).sum::<Complex64>() / (sector[1] - sector[0]).max(1) as f64
        };
        let waves = |order: usize| {
            let means: Vec<Complex64> = edges.windows(2).map(|sector| mean(order, sector)).collect();
            let lengths = edges.windows(2).map(|sector| (sector[1] - sector[0]) as f64);
            // A wave of this order keeps its size; a level has none of it.
            let kept: f64 = means.iter().zip(lengths).map(|(mean, length)| length * mean.norm_sqr()).sum();
            means.into_iter().map(move |mean| mean * (2.0 / kept)).collect::<Vec<_>>()
        };
        let waves: Vec<Vec<Complex64>> = (1..=orders).map(waves).collect();
        Self {
            angles,
            waves: (0..sectors).flat_map(|sector| waves.iter().map(move |wave| wave[sector])).collect(),
            turn: vec![Complex64::ZERO; orders],
            edges,
            table: TurnTable { together: planned.div_ceil(MOST_ROWS).max(1), orders, channels, ..TurnTable::default() },
            filled: 0,
        }
    }

    /// Takes the readings of a turn, `[channel][angle]`, and appends their mean levels.
    pub(super) fn take(&mut self, number: usize, readings: &[f64], levels_um: &mut Vec<f64>) {
        let Self { angles, edges, waves, turn, table, filled } = self;
        let row = table.orders * table.channels;
        if *filled == 0 {
            table.turns.push(number);
            table.levels_um.resize(table.levels_um.len() + table.channels, 0.0);
            table.coefficients.resize(table.coefficients.len() + row, Complex64::ZERO);
        }
        let share = 1.0 / table.together as f64;
        let start = table.coefficients.len() - row;
        let target = &mut table.coefficients[start..];
        let first = table.levels_um.len() - table.channels;
        for (channel, readings) in readings.chunks_exact(*angles).enumerate() {
            turn.fill(Complex64::ZERO);
            let mut whole = 0.0;
            // Orders side by side: none of them waits for the sum before it.
            for (number, sector) in edges.windows(2).enumerate() {
                let sum = sum_of(&readings[sector[0]..sector[1]]);
                whole += sum;
                turn.iter_mut().zip(&waves[number * table.orders..]).for_each(|(turn, wave)| *turn += wave * sum);
            }
            let level = whole / *angles as f64;
            levels_um.push(level);
            table.levels_um[first + channel] += share * level;
            let of_channel = target[channel..].iter_mut().step_by(table.channels);
            of_channel.zip(&*turn).for_each(|(target, turn)| *target += turn * share);
        }
        *filled = (*filled + 1) % table.together;
    }

    /// The table, without a last row that is not full.
    pub(super) fn table(&mut self) -> TurnTable {
        let mut table = std::mem::take(&mut self.table);
        if self.filled > 0 {
            table.turns.pop();
            table.levels_um.truncate(table.turns.len() * table.channels);
            table.coefficients.truncate(table.turns.len() * table.channels * table.orders);
        }
        table
    }
}

/// Sum of a few values: the compiler keeps the order of additions.
fn sum_of(values: &[f64]) -> f64 {
    const LANES: usize = 8;
    let mut sums = [0.0; LANES];
    let chunks = values.chunks_exact(LANES);
    let rest: f64 = chunks.remainder().iter().sum();
    for chunk in chunks {
        sums.iter_mut().zip(chunk).for_each(|(sum, value)| *sum += value);
    }
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waves_keep_their_size_and_their_turn() {
        for angles in [512, 100, 37, 24] {
            let size = Size { channels: 2, angles, orders: angles / 2 };
            let mut low = LowOrders::new(size, 3);
            let wave =
                |order: usize, angle: usize, phase: f64| (TAU * (order * angle) as f64 / angles as f64 - phase).cos();
            for turn in 0..3 {
                let amplitude = 1.0 + turn as f64;
                let readings: Vec<f64> = (0..angles)
                    .map(|angle| amplitude * wave(3, angle, 0.7))
                    .chain((0..angles).map(|angle| 5.0 + wave(4, angle, 0.2)))
                    .collect();
                low.take(turn, &readings, &mut Vec::new());
            }
            let table = low.table();
            assert_eq!(table.turns.len(), 3);
            assert!((table.levels_um[5] - 5.0).abs() < 1e-12, "{}", table.levels_um[5]);
            let at = |turn: usize, order: usize, channel: usize| {
                table.coefficients[(turn * table.orders + order - 1) * 2 + channel]
            };
            for turn in 0..3 {
                // Sectors that differ by one angle fold a little of one order onto others.
                let expected = Complex64::from_polar(1.0 + turn as f64, 0.7);
                assert!((at(turn, 3, 0) - expected).norm() < 0.02 * expected.norm(), "{angles}: {}", at(turn, 3, 0));
                assert!((at(turn, 4, 1) - Complex64::cis(0.2)).norm() < 0.02, "{angles}: {}", at(turn, 4, 1));
                for order in 1..=table.orders.min(3) {
                    assert!(at(turn, order, 1).norm() < 0.02, "{angles}: {order} {}", at(turn, order, 1));
                }
            }
        }
    }

    #[test]
    fn many_turns_are_averaged_by_neighbours() {
        let size = Size { channels: 1, angles: 64, orders: 20 };
        let mut low = LowOrders::new(size, 1200);
        for turn in 0..1200 {
            let value = |angle: usize| turn as f64 * (TAU * angle as f64 / 64.0).cos();
            low.take(turn, &(0..64).map(value).collect::<Vec<_>>(), &mut Vec::new());
        }
        let table = low.table();
        assert_eq!((table.together, table.turns.len(), table.turns[1]), (3, 400, 3));
        assert!((table.coefficients[ORDERS].re - 4.0).abs() < 0.05, "{}", table.coefficients[ORDERS]);
    }
}
