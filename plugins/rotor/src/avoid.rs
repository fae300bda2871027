//! Speeds at which a mode is near a multiple of the speed.

use runout_core::{Result, fault::Fault};

use crate::crossings::Search;

/// Orders that matter where nothing else is said: unbalance, and what a bent, oval or three-jawed part does twice and thrice a turn.
pub(crate) const USUAL_ORDERS: [f64; 3] = [1.0, 2.0, 3.0];
/// How near a mode may not be, in percent of order times speed.
pub(crate) const USUAL_PERCENT: f64 = 15.0;

/// A range of speeds, in rad/s, where a mode is near an order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Range {
    /// Number of the mode in the order of speeds.
    pub mode: usize,
    /// Multiple of the speed.
    pub order: f64,
    /// Where it begins.
    pub from: f64,
    /// Where it ends; infinite where the frequency rises with the speed and stays near.
    pub to: f64,
}

/// Refuses orders and a nearness that cannot be.
///
/// # Errors
/// The first value that cannot be.
pub(crate) fn check(
    orders_key: &str,
    orders: &[f64],
    percent_key: &str,
    percent: f64,
) -> std::result::Result<(), Fault> {
    if let Some(order) = orders.iter().find(|order| !(order.is_finite() && **order > 0.0)) {
        return Err(Fault::at(orders_key, format!("expected orders above 0, found {order}")));
    }
    if !(percent > 0.0 && percent < 100.0) {
        return Err(Fault::at(percent_key, format!("expected more than 0 and less than 100 %, found {percent}")));
    }
    Ok(())
}

/// The ranges of speed in which |ω − n·Ω| ≤ share·n·Ω, of the lowest modes that meet each order n; by order, then mode.
///
/// # Errors
/// When eigenvalues do not converge.
pub(crate) fn ranges(search: &mut Search, orders: &[f64], share: f64, modes: usize) -> Result<Vec<Range>> {
    let mut found = Vec::new();
    for order in orders {
        let begins = search.speeds(order * (1.0 + share), modes)?;
        let ends = search.speeds(order * (1.0 - share), modes)?;
        found.extend(begins.iter().enumerate().map(|(index, from)| Range {
            mode: index + 1,
            order: *order,
            from: *from,
            to: ends.get(index).copied().unwrap_or(f64::INFINITY),
        }));
    }
    Ok(found)
}

/// Ranges joined where they overlap, ascending.
#[must_use]
pub(crate) fn joined(ranges: &[Range]) -> Vec<(f64, f64)> {
    let mut bounds: Vec<(f64, f64)> = ranges.iter().map(|range| (range.from, range.to)).collect();
    bounds.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut all: Vec<(f64, f64)> = Vec::new();
    for (from, to) in bounds {
        match all.last_mut() {
            Some(last) if from <= last.1 => last.1 = last.1.max(to),
            _ => all.push((from, to)),
        }
    }
    all
}
