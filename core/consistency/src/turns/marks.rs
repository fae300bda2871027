//! Marks that are not once a turn of the part: on another shaft, once in several turns, several times a turn.

use std::f64::consts::TAU;

use runout_numerics::Complex64;

use super::{PhaseCourse, TurnCourse, TurnTable, common::turning, mean, spectrum::Spectrum};
use crate::check::{Check, FINDING, Test};

/// Coherence of order 1 below which a steady turning is looked for: where it takes away four fifths of what lacks, and where half.
const COHERENT: [f64; 2] = [0.998, 0.95];
/// Directions that are tried about the phase from row to row, to each side, and how far, in periods over the recording.
const TRIED: usize = 40;
const REACH: f64 = 1.0;
/// Turns between two marks that are looked for.
const MOST_TURNS: usize = 3;
/// Amplitude at orders that a part has not, beside those that it has.
const EMPTY: f64 = 0.02;
/// Amplitude at orders that a part has not, in standard errors, where these are larger.
const NOISE: f64 = 4.0;
/// Share of the power of the order that an eccentricity stands at.
const ECCENTRIC: f64 = 0.5;
/// Power of what alternates, over the largest other window, at [`AT_ORDERS`] orders.
const ALTERNATING: f64 = 30.0;
const AT_ORDERS: usize = 3;
/// Power of what alternates beside all that is synchronous.
const SHARE: f64 = 0.01;

pub(super) fn look(table: &TurnTable, spectrum: &Spectrum, course: &mut TurnCourse) {
    let found = [several_a_turn(table, spectrum), once_in_several(table), turns_against_the_mark(table)];
    for found in found {
        course.checks.push(found.check);
        course.phase_std_rad = found.phase_std_rad.max(course.phase_std_rad);
        course.phase = found.phase.or(course.phase);
        if found.is_open {
            course.orders = (1..=table.orders).map(|order| (order, scatter(table, order))).collect();
        }
        if !course.orders.is_empty() {
            return;
        }
    }
}

struct MarkFinding {
    check: Check,
    phase_std_rad: f64,
    phase: Option<PhaseCourse>,
    /// The mean is nothing that the part has.
    is_open: bool,
}

impl MarkFinding {
    fn new(of: &str, statistic: f64, words: Option<String>) -> Self {
        let p = if words.is_some() { 0.1 * FINDING } else { 1.0 };
        let is_open = words.is_some();
        let check = Check::new(Test::Turns, of, statistic, &[], p).finding(|| words.unwrap_or_default());
        Self { check, phase_std_rad: 0.0, phase: None, is_open }
    }

    /// With the turning that so many turns from one mark to the next are, where something was found.
    fn of_turns_per_mark(mut self, turns: f64) -> Self {
        let phase = PhaseCourse { by_rad: TAU * (1.0 - turns), std_rad: 0.0, step_at: None };
        self.phase = self.is_open.then_some(phase);
        self
    }
}

/// Order 1 falls apart over the turns, and a steady turning puts it together.
fn turns_against_the_mark(table: &TurnTable) -> MarkFinding {
    let rows = table.rows();
    let lag: Complex64 = (0..table.channels)
        .flat_map(|channel| table.series(1, channel).skip(1).zip(table.series(1, channel)))
        .map(|(now, before)| now * before.conj())
        .sum();
    let turned = |by_rad: f64, channel: usize| {
        // Rounding of a power of a few hundred is 1e-13.
        let step = Complex64::cis(-by_rad);
        let turns = std::iter::successors(Some(Complex64::ONE), move |turned| Some(turned * step));
        mean(table.series(1, channel).zip(turns).map(|(value, turned)| value * turned))
    };
    let power = |by_rad: f64| (0..table.channels).map(|channel| turned(by_rad, channel).norm_sqr()).sum::<f64>();
    let step = REACH * TAU / (TRIED * rows) as f64;
    let tried = (0..=2 * TRIED).map(|place| lag.arg() + step * (place as f64 - TRIED as f64));
    let by_rad = tried
        .map(|by_rad| (power(by_rad), by_rad))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(0.0, |(_, by_rad)| by_rad);
    let coherence = |by_rad: f64, channel: usize| {
        let rms = (table.series(1, channel).map(|value| value.norm_sqr()).sum::<f64>() / rows as f64).sqrt();
        if rms > 0.0 { turned(by_rad, channel).norm() / rms } else { 1.0 }
    };
    // The channel in which it is worst.
    let channels = 0..table.channels;
    let channel = channels.min_by(|a, b| coherence(0.0, *a).total_cmp(&coherence(0.0, *b))).unwrap_or(0);
    let [before, after] = [0.0, by_rad].map(|by_rad| coherence(by_rad, channel));
    let falls_apart = before < COHERENT[1] && after > (0.5 + 0.5 * before).max(0.5);
    let is_turning = falls_apart || (before < COHERENT[0] && 1.0 - before > 5.0 * (1.0 - after));
    // A part that turns against the mark turns order n by n times as much: where one is steadier than order 1, this is an asynchronous line.
    let is_turning = is_turning && !(2..=table.orders).any(|order| 1.0 - steady(table, order) < 0.5 * (1.0 - before));
    let by_turn = by_rad / table.together.max(1) as f64;
    let words = is_turning.then(|| turning(by_turn, "order 1 turns"));
    let mut found = MarkFinding::new("order 1 against the mark", before, words);
    if is_turning {
        found.phase_std_rad = by_rad.abs() * ((rows * rows - 1) as f64 / 12.0).sqrt();
        // How well it is known, all orders show.
        found.phase = Some(PhaseCourse { by_rad: by_turn, std_rad: f64::NAN, step_at: None });
    }
    found
}

/// Coherence of an order with the mark, of all channels together.
fn steady(table: &TurnTable, order: usize) -> f64 {
    let channels = || 0..table.channels;
    let kept: f64 = channels().map(|channel| mean(table.series(order, channel)).norm_sqr()).sum();
    let all: f64 = channels().flat_map(|channel| table.series(order, channel)).map(|value| value.norm_sqr()).sum();
    if all > 0.0 { (kept * table.rows() as f64 / all).sqrt() } else { 0.0 }
}

/// Orders that are no multiples of 2, or of 3, are empty, and an eccentricity stands at order 2, or 3.
fn once_in_several(table: &TurnTable) -> MarkFinding {
    let rows = table.rows() as f64;
    let squares: Vec<[f64; 2]> = (1..=table.orders)
        .map(|order| {
            let of = |channel: usize| {
                let mean = mean(table.series(order, channel));
                let scatter: f64 = table.series(order, channel).map(|value| (value - mean).norm_sqr()).sum();
                [mean.norm_sqr(), scatter / (rows - 1.0) / rows]
            };
            (0..table.channels).map(of).fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]])
        })
        .collect();
    let all: f64 = squares.iter().map(|[mean, _]| mean).sum();
    let turns = (2..=MOST_TURNS).find(|turns| {
        let [first, error] = squares.get(turns - 1).copied().unwrap_or_default();
        let is_empty =
            |[mean, error]: &[f64; 2]| *mean < (EMPTY * EMPTY * first).min(0.25 * all).max(NOISE * NOISE * error);
        let is_there = |[mean, error]: &[f64; 2]| *mean > 4.0 * NOISE * NOISE * error && *mean > 1e-12 * all;
        let [others, own]: [Vec<_>; 2] = [false, true].map(|multiple| {
            let of = |(index, _): &(usize, &[f64; 2])| (index + 1).is_multiple_of(*turns) == multiple;
            squares.iter().enumerate().filter(of).map(|(_, squares)| *squares).collect()
        });
        first > ECCENTRIC * all
            && first > 100.0 * NOISE * NOISE * error
            && others.iter().all(is_empty)
            && own.iter().filter(|squares| is_there(squares)).count() > 1
    });
    let words = turns.map(|turns| {
        let others = if turns == 2 { "odd orders are empty" } else { "orders that are no multiples of 3 are empty" };
        format!("{others} and order {turns} is the largest: the mark comes once in {turns} turns of the part")
    });
    let turns = turns.unwrap_or(1) as f64;
    MarkFinding::new("empty orders", turns, words).of_turns_per_mark(turns)
}

/// Every second turn is another one, at several orders at once.
fn several_a_turn(table: &TurnTable, spectrum: &Spectrum) -> MarkFinding {
    let at = |order: usize| -> [f64; 2] {
        let of = |channel: usize| {
            let signed = table.series(order, channel).enumerate();
            let odd = mean(signed.map(|(row, value)| if row % 2 == 0 { value } else { -value }));
            [odd.norm_sqr(), mean(table.series(order, channel)).norm_sqr()]
        };
        (0..table.channels).map(of).fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]])
    };
    let alternating = spectrum.alternating.iter().filter(|ratio| **ratio > ALTERNATING).count();
    let [odd, even] = (1..=table.orders).map(at).fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
    let differs = table.together <= 1 && alternating >= AT_ORDERS && odd > SHARE * even;
    let words = differs.then(|| {
        let size = (odd / table.channels as f64).sqrt();
        format!("even and odd turns differ by {:.3} µm: two marks a turn, or motion at half of the speed", 2.0 * size)
    });
    MarkFinding::new("even and odd turns", alternating as f64, words).of_turns_per_mark(0.5)
}

/// Covariance of single turns, `[channel][channel]`.
fn scatter(table: &TurnTable, order: usize) -> Vec<Complex64> {
    let channels = table.channels;
    let means: Vec<Complex64> = (0..channels).map(|channel| mean(table.series(order, channel))).collect();
    let entry = |row: usize, column: usize| {
        let both = table.series(order, row).zip(table.series(order, column));
        mean(both.map(|(one, other)| (one - means[row]) * (other - means[column]).conj()))
    };
    (0..channels).flat_map(|row| (0..channels).map(move |column| entry(row, column))).collect()
}
