//! Noise of one reading from repeats: their scatter after a common smooth drift.

use nalgebra::{DVector, Vector3};
use runout_core::{consistency::repeats::FEWEST, numerics::least_squares::least_norm};

use crate::solve::{Column, Reading};

/// What the standard uncertainty of a reading comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Noise {
    /// The column `std_um`.
    Column,
    /// The key `std_um`.
    Stated(f64),
    /// Scatter of repeats.
    Repeats { std_um: f64, dof: usize },
    /// Nothing: only the fit's residual.
    Unknown,
}

/// Highest power of time in the drift.
const HIGHEST_POWER: usize = 6;
/// Functions of the drift that add less than this to the others, relative, are not fitted.
const DETERMINED: f64 = 1e-9;
/// Degrees of freedom a function of the drift.
const FREEDOM_A_FUNCTION: usize = 12;

/// Standard deviation of one coordinate from repeats of one ball at one command, which is the same in the same turn only.
///
/// Each ball and command, approached in one direction, has a level of its own; a drift common to all, a polynomial of time in each
/// coordinate, is fitted beside. Where no repeats share a direction, both directions share a level, and what depends on the direction
/// (`by_direction`, each of any size) is fitted, too.
pub(crate) fn of_repeats(
    readings: &[Reading],
    turn: &[usize],
    time: &[f64],
    direction: &[f64],
    by_direction: &[Column],
) -> Noise {
    let place = |index: usize| (readings[index].ball, readings[index].command, turn[index]);
    let in_one_direction = scatter(readings, time, &[], |index| (place(index), direction[index] > 0.0));
    let found = in_one_direction.or_else(|| scatter(readings, time, by_direction, place));
    found.unwrap_or(Noise::Unknown)
}

fn scatter<K: PartialEq>(
    readings: &[Reading],
    time: &[f64],
    others: &[Column],
    key: impl Fn(usize) -> K,
) -> Option<Noise> {
    let mut groups: Vec<(K, Vec<usize>)> = Vec::new();
    for index in 0..readings.len() {
        let own = key(index);
        match groups.iter_mut().find(|(known, _)| *known == own) {
            Some((_, members)) => members.push(index),
            None => groups.push((own, vec![index])),
        }
    }
    groups.retain(|(_, members)| members.len() > 1);
    let rows: usize = groups.iter().map(|(_, members)| members.len()).sum();
    let free = rows - groups.len();
    let powers = HIGHEST_POWER.min(free / FREEDOM_A_FUNCTION);
    let mut columns = vec![vec![0.0; 3 * rows]; 3 * powers + others.len()];
    let mut values = vec![0.0; 3 * rows];
    let mut row = 0;
    for (_, members) in &groups {
        let mean = |of: &dyn Fn(usize) -> Vector3<f64>| {
            members.iter().map(|member| of(*member)).sum::<Vector3<f64>>() / members.len() as f64
        };
        let reading = |member: usize| readings[member].value;
        let level = mean(&reading);
        let levels: Vec<Vector3<f64>> = others.iter().map(|other| mean(&|member| other[member])).collect();
        let functions = |member: &usize| legendre(2.0 * time[*member] - 1.0, powers);
        let drift_level = members.iter().map(functions).sum::<DVector<f64>>() / members.len() as f64;
        for member in members {
            let drift = functions(member) - &drift_level;
            for coordinate in 0..3 {
                values[row] = reading(*member)[coordinate] - level[coordinate];
                for (power, entry) in drift.iter().enumerate() {
                    columns[3 * power + coordinate][row] = *entry;
                }
                for (column, (other, level)) in columns[3 * powers..].iter_mut().zip(others.iter().zip(&levels)) {
                    column[row] = other[*member][coordinate] - level[coordinate];
                }
                row += 1;
            }
        }
    }
    let fitted = least_norm(&columns, &values, DETERMINED);
    let rank = values.len() - fitted.dof;
    let dof = (3 * free).saturating_sub(rank);
    let squares: f64 = fitted.residual.iter().map(|value| value * value).sum();
    let std_um = 1e3 * (squares / dof.max(1) as f64).sqrt();
    (dof as f64 >= FEWEST && std_um > 0.0).then_some(Noise::Repeats { std_um, dof })
}

/// Legendre polynomials of degree 1 to `count`.
fn legendre(u: f64, count: usize) -> DVector<f64> {
    let mut values = DVector::zeros(count);
    let (mut before, mut last) = (1.0, u);
    for degree in 1..=count {
        values[degree - 1] = last;
        let n = degree as f64;
        (before, last) = (last, ((2.0 * n + 1.0) * u * last - n * before) / (n + 1.0));
    }
    values
}
