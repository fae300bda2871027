//! Single turns that are not like the others: a knock, a chip below a sensor, the start of a filter. The covariance of the mean includes them, as it includes any
//! asynchronous motion; here they are named.

use super::{TurnCourse, TurnTable, mean};
use crate::{
    check::{Check, Test},
    rows::{self, MOST_NAMED},
};

/// A turn is named where it is so many times as far off as the farthest of the others: asynchronous motion swells over several turns.
const APART: f64 = 2.0;

/// Evaluates all low orders of each turn together. Means of neighbouring turns are left alone: no single turn stands out of them.
pub(super) fn look(table: &TurnTable, course: &mut TurnCourse) {
    // What all orders share is said already, and is larger in the turns at its ends.
    if table.together > 1 || !course.is_steady() {
        return;
    }
    let sizes = sizes(table);
    let level = sizes.iter().sum::<f64>() / sizes.len() as f64;
    let left: Vec<f64> = sizes.iter().map(|size| size - level).collect();
    let constant = vec![(sizes.len() as f64).sqrt().recip(); sizes.len()];
    let Some(found) = rows::unlike(&left, &[constant]) else { return };
    let check = Check::new(Test::Turns, "single turns", found.farthest, &[found.dof], found.p);
    let others = sizes.iter().enumerate().filter(|(row, _)| !found.rows.contains(row));
    let farthest = others.map(|(_, size)| *size).fold(0.0, f64::max);
    let apart = found.rows.iter().filter(|row| sizes[**row] > APART * farthest);
    let said: Vec<String> =
        apart.map(|row| format!("turn {} by {:.1} times", table.turns[*row] + 1, sizes[*row])).collect();
    // The variance of the mean includes them.
    course.checks.push(if said.is_empty() { check } else { check.finding(|| words(&said)).named() });
}

fn words(said: &[String]) -> String {
    let more = if said.len() > MOST_NAMED { format!(" and {} more", said.len() - MOST_NAMED) } else { String::new() };
    let named = said[..said.len().min(MOST_NAMED)].join(", ");
    format!(
        "single turns differ from the mean by more than the scatter of the others: {named}{more}; was there a knock, a chip, or a filter that had not settled?"
    )
}

/// How far each turn is from the mean of all, in units of the median of each order and channel: the root of the mean square.
fn sizes(table: &TurnTable) -> Vec<f64> {
    let mut squares = vec![0.0; table.rows()];
    let mut counted: f64 = 0.0;
    for order in 1..=table.orders {
        for channel in 0..table.channels {
            let middle = mean(table.series(order, channel));
            let off: Vec<f64> = table.series(order, channel).map(|value| (value - middle).norm_sqr()).collect();
            let mut sorted = off.clone();
            let half = sorted.len() / 2;
            let median = *sorted.select_nth_unstable_by(half, f64::total_cmp).1;
            if median > 0.0 {
                counted += 1.0;
                squares.iter_mut().zip(&off).for_each(|(sum, off)| *sum += off / median);
            }
        }
    }
    squares.iter().map(|sum| (sum / counted.max(1.0)).sqrt()).collect()
}
