//! One order that changes slowly: the power of its slow window against the largest of all other windows of its neighbours.

use runout_numerics::Complex64;

use super::{TurnCourse, TurnTable, mean, spectrum::Spectrum};
use crate::check::{Check, FINDING, Test};

/// Times the largest other window from which on a slow course is a finding, with [`MANY`] windows or more.
const TIMES: f64 = 6.0;
/// Windows that make the largest of them well known; with fewer, the limit grows as the heavy tail of lines asks for.
const MANY: f64 = 100.0;
const TAIL: f64 = 1.5;
/// Orders to each side that are compared with.
const BESIDE: usize = 2;
/// Share of the turns at each end that a change is stated from.
const ENDS: usize = 8;

/// Evaluates every order that no change of the whole explains.
pub(super) fn look(table: &TurnTable, spectrum: &Spectrum, course: &mut TurnCourse) {
    let (ratios, limit) = ratios(spectrum);
    let explained = !course.orders.is_empty() || course.phase_std_rad > 0.0 || course.size_std > 0.0;
    let most = ratios.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    for (index, ratio) in ratios.iter().copied().enumerate() {
        let order = index + 1;
        let of = format!("order {order}");
        // A number that ranks as a chance does: the power of lines falls off with its square.
        let p = (FINDING * (limit / ratio.max(f64::MIN_POSITIVE)).powi(2)).min(1.0);
        let check = Check::new(Test::Turns, of, ratio, &[], p);
        if ratio <= limit || explained {
            if most.is_some_and(|(largest, _)| largest == index) {
                course.checks.push(check);
            }
            continue;
        }
        course.checks.push(check.finding(|| words(table, spectrum, order)));
        course.orders.push((order, covariance(table, spectrum, order)));
    }
}

/// The slow window of each order over the largest other one beside it, and its limit.
fn ratios(spectrum: &Spectrum) -> (Vec<f64>, f64) {
    let count = spectrum.windows.first().map_or(0, Vec::len);
    let ratios = (0..spectrum.windows.len()).map(|order| {
        let beside = order.saturating_sub(BESIDE)..=(order + BESIDE).min(spectrum.windows.len() - 1);
        // A fade is in the next window too: those of the same order count from the third on, of the others all but the slow one.
        let others = beside.flat_map(|near| {
            let first = if near == order { 3 } else { 1 };
            spectrum.windows[near].get(first..).unwrap_or_default()
        });
        let largest = others.copied().fold(0.0, f64::max);
        if largest > 0.0 { spectrum.windows[order][0] / largest } else { 0.0 }
    });
    let compared = (2 * BESIDE * count.saturating_sub(1)) as f64;
    (ratios.collect(), TIMES * (MANY / compared.max(1.0)).powf(TAIL).max(1.0))
}

/// Covariance of the slow course, `[channel][channel]`.
fn covariance(table: &TurnTable, spectrum: &Spectrum, order: usize) -> Vec<Complex64> {
    let (rows, channels) = (table.rows(), table.channels);
    let slow = &spectrum.slow[order - 1];
    let entry = |row: usize, column: usize| -> Complex64 {
        slow.iter().map(|component| component[row] * component[column].conj()).sum::<Complex64>() / rows as f64
    };
    (0..channels).flat_map(|row| (0..channels).map(move |column| entry(row, column))).collect()
}

fn words(table: &TurnTable, spectrum: &Spectrum, order: usize) -> String {
    let rows = table.rows();
    let length = (rows / ENDS).max(2);
    let ends = |channel: usize| {
        let at = |from: usize| mean(table.series(order, channel).skip(from).take(length));
        [at(0), at(rows - length)]
    };
    let changed = |channel: &usize| {
        let [first, last] = ends(*channel);
        (last - first).norm()
    };
    let channel = (0..table.channels).max_by(|a, b| changed(a).total_cmp(&changed(b))).unwrap_or(0);
    let [first, last] = ends(channel).map(Complex64::norm);
    let most = spectrum.course(order, channel, rows).map(Complex64::norm).fold(0.0, f64::max);
    if (last - first).abs() > 0.5 * changed(&channel) {
        let how = if last < first { "fades" } else { "grows" };
        format!("order {order} {how} from {first:.3} to {last:.3} µm during the recording")
    } else {
        format!("order {order} changes by {:.3} µm during the recording", 2.0 * most)
    }
}
