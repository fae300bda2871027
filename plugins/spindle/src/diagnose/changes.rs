//! Changes within a setup: a probe that slips shows in the turns, from one of them on, and in no other sensor.
//!
//! The average of such a reading is that of no one state. Its change, as large as it is, goes into its uncertainty, so that
//! it is attributed to no effect.

use runout_core::{
    Complex64,
    closed_loop::diagnosis::Unexplained,
    level_step::{LevelStep, level_step},
    numerics::{
        least_squares::{cholesky, invert_lower},
        number::signed,
    },
    profile::{Profile, Turns, smooth},
    stage::Station,
};

use super::drift::{self, Creeping};
use crate::{selection::Selection, solve::Readings};

/// Turns that both sides of a change have at least, and the fewest in all.
const SIDE: usize = 4;
const FEWEST: usize = 4 * SIDE;
/// Neighbouring turns depend on each other: means over this many do not, nearly.
const BLOCK: usize = 6;
/// A change is one when the steps' squares are this many times what the turns wander.
const CERTAIN: f64 = 4.0;
/// Of a change in all channels, this share must be one sensor's.
const OWN: f64 = 0.5;
/// Between the blocks next to it, this share of the step must be there already: what wanders changes slowly.
const SUDDEN: f64 = 0.6;
/// A level jumps where it changes this many times more than it does from turn to turn (median).
const JUMP: f64 = 6.0;
/// The eccentricity has its own ways to change: form and motion begin here.
const FIRST_ORDER: usize = 2;

/// A reading that changed for good at some turn.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Change {
    /// Index of the setup and the sensor in the rig.
    pub setup: usize,
    pub sensor: usize,
    /// The first turn after it.
    pub turn: usize,
    /// By how much, by order from 0; 0 below order 2.
    pub by: Vec<Complex64>,
}

/// The changes in a station's turns.
pub(crate) fn changes(selection: &Selection, station: &Station, creeping: &[Option<Creeping>]) -> Vec<Change> {
    let in_setup = |(setup, id): (usize, &usize)| {
        let profile = station.profiles.iter().find(|profile| profile.setup == *id)?;
        let channel = |sensor: &usize| profile.sensors.iter().position(|found| found == sensor);
        let channels: Option<Vec<usize>> = selection.sensors.iter().map(channel).collect();
        in_capture(profile, setup, &channels?, creeping)
    };
    selection.setups.iter().enumerate().filter_map(in_setup).collect()
}

fn in_capture(profile: &Profile, setup: usize, channels: &[usize], creeping: &[Option<Creeping>]) -> Option<Change> {
    let turns = &profile.split.as_ref()?.turns;
    let (count, width) = (turns.count(), channels.len());
    if count < FEWEST || turns.orders <= FIRST_ORDER {
        return None;
    }
    let series = Series::new(turns, channels, |channel, turn, order| {
        drift::in_turn(creeping.get(channel).and_then(Option::as_ref), setup, turn, order, profile.turn_angles)
    });
    let weights = series.weights()?;
    // Sums of squares between the turns before and after, and of what wanders: in units of the turns' scatter.
    let mut best: Option<(f64, usize)> = None;
    for turn in SIDE..=count - SIDE {
        let sum: f64 = (FIRST_ORDER..turns.orders).map(|order| norm_sqr(&weights.step(&series, order, turn))).sum();
        if best.is_none_or(|(most, _)| sum > most) {
            best = Some((sum, turn));
        }
    }
    let (whole, turn) = best?;
    let rows = |channel: usize| (FIRST_ORDER..turns.orders).map(move |order| (order, channel));
    let alone = |channel: usize| -> f64 {
        rows(channel).map(|(order, channel)| series.stepped(order, turn, &weights.conditional(order, channel))).sum()
    };
    let (sensor, step) = (0..width).map(|channel| (channel, alone(channel))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let (mut wander, mut sudden) = (0.0, 0.0);
    for (order, channel) in rows(sensor) {
        let row = weights.conditional(order, channel);
        wander += series.wandering(order, turn, &row);
        sudden += series.sudden(order, turn, &row);
    }
    if step < CERTAIN * wander || step < OWN * whole || sudden < SUDDEN * step || !series.level_jumps(turn, sensor) {
        return None;
    }
    let by = (0..turns.orders)
        .map(|order| if order < FIRST_ORDER { Complex64::ZERO } else { series.step(order, turn, sensor) });
    Some(Change { setup, sensor, turn: turns.numbers[turn], by: by.collect() })
}

/// Steps of the level of a sensor in a station's captures, but those of `known` changes.
pub(crate) fn level_steps(selection: &Selection, station: &Station, known: &[Change]) -> Vec<Unexplained> {
    let mut found = Vec::new();
    for (setup, id) in selection.setups.iter().enumerate() {
        let Some(profile) = station.profiles.iter().find(|profile| profile.setup == *id) else { continue };
        for (sensor, id) in selection.sensors.iter().enumerate() {
            let Some(channel) = profile.sensors.iter().position(|found| found == id) else { continue };
            let step = level_step(&profile.levels, channel, profile.channels());
            let Some(LevelStep { turn, by_um, .. }) = step else { continue };
            if known.iter().any(|change| (change.setup, change.sensor) == (setup, sensor)) {
                continue;
            }
            let numbers = &profile.levels.numbers;
            let share = numbers.iter().filter(|number| **number > turn).count() as f64 / numbers.len() as f64;
            found.push(Unexplained {
                rms_um: by_um.abs() * (share * (1.0 - share)).sqrt(),
                place: format!("the level steps by {} µm at turn {turn}", signed(by_um, 3)),
                ..reading(selection, setup, sensor)
            });
        }
    }
    found
}

/// A reading of which nothing is said yet.
fn reading(selection: &Selection, setup: usize, sensor: usize) -> Unexplained {
    let rig = &selection.rig;
    Unexplained {
        station: None,
        sensor: rig.sensors.get(sensor).map(|sensor| sensor.id.clone()),
        setup: rig.setups.get(setup).map(|setup| setup.id.clone()),
        orders: [0, 0],
        rms_um: 0.0,
        place: String::new(),
    }
}

/// The turns' harmonics about their mean, `[order][turn][channel]`, and their sums before each turn.
struct Series {
    turns: usize,
    width: usize,
    orders: usize,
    values: Vec<Complex64>,
    sums: Vec<Complex64>,
}

impl Series {
    /// `creep` gives what a channel's drift puts into a turn at an order.
    fn new(turns: &Turns, channels: &[usize], creep: impl Fn(usize, usize, usize) -> Complex64) -> Self {
        let (count, width) = (turns.count(), channels.len());
        let mut values = Vec::with_capacity(turns.orders * count * width);
        for order in 0..turns.orders {
            let start = values.len();
            for turn in 0..count {
                // A drift is no change for good.
                let steady =
                    |(index, channel): (usize, &usize)| turns.at(turn, order, *channel) - creep(index, turn, order);
                values.extend(channels.iter().enumerate().map(steady));
            }
            for channel in 0..width {
                let at = || (start + channel..start + count * width).step_by(width);
                let mean = at().map(|index| values[index]).sum::<Complex64>() / count as f64;
                at().for_each(|index| values[index] -= mean);
            }
        }
        let mut sums = vec![Complex64::ZERO; values.len()];
        for (sums, values) in sums.chunks_exact_mut(count * width).zip(values.chunks_exact(count * width)) {
            for at in width..sums.len() {
                sums[at] = sums[at - width] + values[at - width];
            }
        }
        Self { turns: count, width, orders: turns.orders, values, sums }
    }

    fn at(&self, order: usize, turn: usize) -> &[Complex64] {
        let start = (order * self.turns + turn) * self.width;
        &self.values[start..start + self.width]
    }

    /// Mean of a channel from a turn on, less that before it.
    fn step(&self, order: usize, turn: usize, channel: usize) -> Complex64 {
        // About the mean, the sum from there on is as large as that before.
        let before = self.sums[(order * self.turns + turn) * self.width + channel];
        -before * (1.0 / turn as f64 + 1.0 / (self.turns - turn) as f64)
    }

    /// The series of one combination of channels.
    fn combined<'a>(&'a self, order: usize, row: &'a [Complex64]) -> impl Iterator<Item = Complex64> + 'a {
        (0..self.turns).map(move |turn| self.at(order, turn).iter().zip(row).map(|(value, row)| row * value).sum())
    }

    /// Sum of squares between the turns before and after one.
    fn stepped(&self, order: usize, turn: usize, row: &[Complex64]) -> f64 {
        let before: Complex64 = self.combined(order, row).take(turn).sum();
        before.norm_sqr() * (1.0 / turn as f64 + 1.0 / (self.turns - turn) as f64)
    }

    /// Sum of squares between the turns before and after one, with the step between the blocks next to the turn for one of its factors.
    fn sudden(&self, order: usize, turn: usize, row: &[Complex64]) -> f64 {
        let values: Vec<Complex64> = self.combined(order, row).collect();
        let length = BLOCK.min(turn).min(self.turns - turn);
        let mean = |from: usize, to: usize| values[from..to].iter().sum::<Complex64>() / (to - from) as f64;
        let near = mean(turn, turn + length) - mean(turn - length, turn);
        let far = mean(turn, self.turns) - mean(0, turn);
        (near * far.conj()).re * (turn * (self.turns - turn)) as f64 / self.turns as f64
    }

    /// Whether a channel's level jumps at a turn, or in the one before or after: what slips comes to stand elsewhere.
    fn level_jumps(&self, turn: usize, channel: usize) -> bool {
        let mean = |from: usize| 0.5 * (self.at(0, from)[channel].re + self.at(0, from + 1)[channel].re);
        let jump = |turn: usize| (mean(turn) - mean(turn - 2)).abs();
        let mut all: Vec<f64> = (2..self.turns - 1).map(jump).collect();
        let here = all[turn - 3..turn].iter().copied().fold(0.0, f64::max);
        all.sort_by(f64::total_cmp);
        here > JUMP * all[all.len() / 2]
    }

    /// What that would be by wandering alone: from means over blocks, each about the mean of its side.
    fn wandering(&self, order: usize, turn: usize, row: &[Complex64]) -> f64 {
        let values: Vec<Complex64> = self.combined(order, row).collect();
        let (mut sum, mut degrees) = (0.0, 0.0);
        for side in [&values[..turn], &values[turn..]] {
            let mean = side.iter().sum::<Complex64>() / side.len() as f64;
            let length = BLOCK.min(side.len() / 2);
            for block in side.chunks_exact(length) {
                sum += length as f64 * (block.iter().sum::<Complex64>() / length as f64 - mean).norm_sqr();
                degrees += 1.0;
            }
            degrees -= 1.0;
        }
        sum / f64::max(degrees, 1.0)
    }

    /// Inverse factors of the scatter of successive turns, which a change leaves alone.
    fn weights(&self) -> Option<Weights> {
        let width = self.width;
        let mut scatter = vec![Complex64::ZERO; self.orders * width * width];
        for (order, matrix) in scatter.chunks_exact_mut(width * width).enumerate() {
            for turn in 1..self.turns {
                let (now, before) = (self.at(order, turn), self.at(order, turn - 1));
                for row in 0..width {
                    let of_row = now[row] - before[row];
                    for column in 0..width {
                        let square = of_row * (now[column] - before[column]).conj();
                        matrix[row * width + column] += square / (2 * (self.turns - 1)) as f64;
                    }
                }
            }
        }
        smooth(&mut scatter, width * width);
        let inverse = |matrix: &[Complex64]| Some(invert_lower(width, &cholesky(width, matrix)?));
        let inverses: Option<Vec<_>> = scatter.chunks_exact(width * width).skip(FIRST_ORDER).map(inverse).collect();
        Some(Weights { width, inverses: inverses? })
    }
}

/// L⁻¹ of the scatter L·Lᴴ of each order from 2.
struct Weights {
    width: usize,
    inverses: Vec<Vec<Complex64>>,
}

impl Weights {
    fn inverse(&self, order: usize) -> &[Complex64] {
        &self.inverses[order - FIRST_ORDER]
    }

    /// L⁻¹ times the step at a turn, in standard deviations.
    fn step(&self, series: &Series, order: usize, turn: usize) -> Vec<Complex64> {
        let scale = (turn as f64 * (series.turns - turn) as f64 / series.turns as f64).sqrt();
        let step: Vec<Complex64> = (0..self.width).map(|channel| series.step(order, turn, channel) * scale).collect();
        crate::solve::apply(self.inverse(order), &step)
    }

    /// The combination of channels that a change of one channel alone shows best in: eᶜᴴ Σ⁻¹, over its norm.
    fn conditional(&self, order: usize, channel: usize) -> Vec<Complex64> {
        let inverse = self.inverse(order);
        let column = |row: usize| inverse[row * self.width + channel];
        let square: f64 = (0..self.width).map(|row| column(row).norm_sqr()).sum();
        let entry = |other: usize| -> Complex64 {
            (0..self.width).map(|row| column(row).conj() * inverse[row * self.width + other]).sum()
        };
        (0..self.width).map(|other| entry(other) / square.sqrt()).collect()
    }
}

fn norm_sqr(values: &[Complex64]) -> f64 {
    values.iter().map(Complex64::norm_sqr).sum()
}

impl Change {
    /// Puts the change into the uncertainty of the reading.
    pub(crate) fn widen(&self, readings: &mut Readings) {
        let sensors = readings.count / readings.turns.len().max(1);
        for matrices in [&mut readings.covariance, &mut readings.scatter].into_iter().flatten() {
            let Some(matrix) = matrices.get_mut(self.setup) else { continue };
            let places = matrix.iter_mut().skip(self.sensor * (sensors + 1)).step_by(sensors * sensors);
            places.zip(&self.by).for_each(|(entry, by)| *entry += by.norm_sqr());
        }
    }

    /// What is said of it.
    pub(crate) fn said(&self, selection: &Selection) -> Unexplained {
        let squares: Vec<f64> = self.by.iter().map(Complex64::norm_sqr).collect();
        let sum: f64 = squares.iter().sum();
        // Orders that hold all but a twentieth of it.
        let mut orders: Vec<usize> = (0..squares.len()).collect();
        orders.sort_by(|a, b| squares[*b].total_cmp(&squares[*a]));
        let mut held = 0.0;
        orders.retain(|order| {
            let wanted = held < 0.95 * sum;
            held += squares[*order];
            wanted
        });
        Unexplained {
            orders: [orders.iter().copied().min().unwrap_or(0), orders.iter().copied().max().unwrap_or(0)],
            rms_um: (0.5 * sum).sqrt(),
            place: format!("from turn {} on", self.turn),
            ..reading(selection, self.setup, self.sensor)
        }
    }
}
