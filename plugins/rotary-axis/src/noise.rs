//! Noise of one reading from repeats: their scatter after a common smooth drift.

use nalgebra::{DMatrix, DVector};

use crate::solve::Reading;

/// What the standard uncertainty of a reading comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Noise {
    /// The column `std_um`.
    Column,
    /// The key `std_um`.
    Stated(f64),
    /// Scatter of repeats.
    Repeats { std_um: f64, dof: usize },
    /// Nothing: only the fit's residual.
    Unknown,
}

/// Fewer degrees of freedom give no standard deviation.
const FEWEST: usize = 3;
/// Highest power of time in the drift.
const HIGHEST_POWER: usize = 6;
/// Degrees of freedom a function of the drift.
const FREEDOM_A_FUNCTION: usize = 12;

/// Standard deviation of one coordinate from repeats of one ball at one command.
///
/// Each ball and command, approached in one direction, has a level of its own; a drift common to all, a polynomial of time in each
/// coordinate, is fitted beside.
pub fn of_repeats(readings: &[Reading], time: &[f64], direction: &[f64]) -> Noise {
    let found =
        scatter(readings, time, |index| (readings[index].ball, readings[index].command, direction[index] > 0.0));
    found.unwrap_or(Noise::Unknown)
}

fn scatter<K: PartialEq>(readings: &[Reading], time: &[f64], key: impl Fn(usize) -> K) -> Option<Noise> {
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
    let mut columns = DMatrix::zeros(rows, powers);
    let mut values = DMatrix::zeros(rows, 3);
    let mut row = 0;
    for (_, members) in &groups {
        let count = members.len() as f64;
        let level = members.iter().map(|member| readings[*member].value).sum::<nalgebra::Vector3<f64>>() / count;
        let functions = |member: &usize| legendre(2.0 * time[*member] - 1.0, powers);
        let mean = members.iter().map(functions).sum::<DVector<f64>>() / count;
        for member in members {
            columns.row_mut(row).copy_from(&(functions(member) - &mean).transpose());
            values.row_mut(row).copy_from(&(readings[*member].value - level).transpose());
            row += 1;
        }
    }
    let mut rank = 0;
    if powers > 0 {
        let svd = columns.svd(true, false);
        let most = svd.singular_values.max();
        let kept: Vec<usize> =
            (0..powers).filter(|index| svd.singular_values[*index] > 1e-9 * most.max(1e-9)).collect();
        rank = kept.len();
        if let Some(u) = svd.u {
            let basis = u.select_columns(&kept);
            values -= &basis * basis.tr_mul(&values);
        }
    }
    let dof = 3 * free.saturating_sub(rank);
    let std_um = 1e3 * (values.norm_squared() / dof.max(1) as f64).sqrt();
    (dof >= FEWEST && std_um > 0.0).then_some(Noise::Repeats { std_um, dof })
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
