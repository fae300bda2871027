//! Noise of one reading from repeats: their scatter after a common smooth drift.

use nalgebra::{DMatrix, DVector, Vector3};

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
/// coordinate, is fitted beside. Where no repeats share a direction, both directions share a level, and what lost motion of the
/// rotary axis adds (`lost_motion`, of any size) is fitted, too.
pub fn of_repeats(readings: &[Reading], time: &[f64], direction: &[f64], lost_motion: &[Vector3<f64>]) -> Noise {
    let place = |index: usize| (readings[index].ball, readings[index].command);
    let in_one_direction = scatter(readings, time, None, |index| (place(index), direction[index] > 0.0));
    let found = in_one_direction.or_else(|| scatter(readings, time, Some(lost_motion), place));
    found.unwrap_or(Noise::Unknown)
}

fn scatter<K: PartialEq>(
    readings: &[Reading],
    time: &[f64],
    lost_motion: Option<&[Vector3<f64>]>,
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
    let others = usize::from(lost_motion.is_some());
    let mut columns = DMatrix::zeros(3 * rows, 3 * powers + others);
    let mut values = DVector::zeros(3 * rows);
    let mut row = 0;
    for (_, members) in &groups {
        let mean = |of: &dyn Fn(usize) -> Vector3<f64>| {
            members.iter().map(|member| of(*member)).sum::<Vector3<f64>>() / members.len() as f64
        };
        let reading = |member: usize| readings[member].value;
        let lost = |member: usize| lost_motion.map_or_else(Vector3::zeros, |lost| lost[member]);
        let (level, lost_level) = (mean(&reading), mean(&lost));
        let functions = |member: &usize| legendre(2.0 * time[*member] - 1.0, powers);
        let drift_level = members.iter().map(functions).sum::<DVector<f64>>() / members.len() as f64;
        for member in members {
            let drift = functions(member) - &drift_level;
            for coordinate in 0..3 {
                values[row] = reading(*member)[coordinate] - level[coordinate];
                for (power, entry) in drift.iter().enumerate() {
                    columns[(row, 3 * power + coordinate)] = *entry;
                }
                if others > 0 {
                    columns[(row, 3 * powers)] = lost(*member)[coordinate] - lost_level[coordinate];
                }
                row += 1;
            }
        }
    }
    let mut rank = 0;
    if columns.ncols() > 0 && rows > 0 {
        for mut column in columns.column_iter_mut() {
            let size = column.norm();
            if size > 0.0 {
                column /= size;
            }
        }
        let svd = columns.svd(true, false);
        let kept: Vec<usize> =
            (0..svd.singular_values.len()).filter(|index| svd.singular_values[*index] > 1e-9).collect();
        rank = kept.len();
        if let Some(u) = svd.u {
            let basis = u.select_columns(&kept);
            values -= &basis * basis.tr_mul(&values);
        }
    }
    let dof = (3 * free).saturating_sub(rank);
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
