//! Ranges and root mean squares over the turns of setups.

use runout_draws::{IntervalKind, NORMAL_95, Uncertainty, student_95};
use runout_turning::spread::{Direction, Spread};

/// The directions that some setup gives, each once.
pub(super) fn directions(spreads: &[&Spread]) -> Vec<Direction> {
    let mut directions: Vec<Direction> = Vec::new();
    for direction in spreads.iter().flat_map(|spread| &spread.directions) {
        if !directions.contains(direction) {
            directions.push(*direction);
        }
    }
    // In the same order, whichever setup gives them.
    directions
        .sort_by_key(|direction| Direction::ALL.iter().position(|known| known == direction).unwrap_or(usize::MAX));
    directions
}

/// The largest spread of a setup's turns at one angle.
pub(super) fn widest(spread: &Spread, direction: Direction) -> f64 {
    let (low, high) = spread.in_direction(direction).unwrap_or_default();
    low.iter().zip(high).map(|(low, high)| high - low).fold(0.0, f64::max)
}

/// Lowest and highest of all turns about a plot, from the lowest and the highest turn less the mean: on as many angles as the plot or
/// on fewer, and then straight from one angle to the next.
pub(super) fn of_all_turns(plot: &[f64], (low, high): (&[f64], &[f64])) -> (f64, f64) {
    let finer = plot.len() / low.len().max(1);
    let (mut inner, mut outer) = (f64::INFINITY, f64::NEG_INFINITY);
    for (index, plot) in plot.chunks_exact(finer.max(1)).take(low.len()).enumerate() {
        let next = (index + 1) % low.len();
        let step = |turns: &[f64]| (turns[next] - turns[index]) / finer as f64;
        let (low_step, high_step) = (step(low), step(high));
        let (mut lowest, mut highest) = (low[index], high[index]);
        for value in plot {
            inner = inner.min(value + lowest);
            outer = outer.max(value + highest);
            (lowest, highest) = (lowest + low_step, highest + high_step);
        }
    }
    (inner, outer)
}

/// Root mean square of a setup's turns about their mean; 0 where it is not known.
pub(super) fn rms_across(spread: &Spread, direction: Direction) -> f64 {
    spread.rms(direction).unwrap_or(0.0)
}

/// Root mean square about the mean: that of a polar plot about the circle of its mean radius.
pub(super) fn rms_about_mean(plot: &[f64]) -> f64 {
    let count = plot.len().max(1) as f64;
    let mean = plot.iter().sum::<f64>() / count;
    (plot.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
}

pub(super) fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// What setups, each a capture of its own, say of a range over turns: the scatter of one of them, and where another one
/// would lie with 95 % probability; `std` is of what they share. `None` of one.
pub(super) fn between_setups(each: &[f64], std: f64) -> Option<Uncertainty> {
    let freedom = each.len().checked_sub(1).filter(|freedom| *freedom > 0)?;
    let count = each.len() as f64;
    let mean = each.iter().sum::<f64>() / count;
    let scatter = (each.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / freedom as f64).sqrt();
    let student = student_95(freedom as f64);
    let half = (student * scatter * (1.0 + 1.0 / count).sqrt()).hypot(NORMAL_95 * std);
    let known = Uncertainty::new(scatter.hypot(std), [(mean - half).max(0.0), mean + half], 0);
    Some(Uncertainty { kind: IntervalKind::Prediction, ..known })
}

/// The uncertainty of a value that a declared form may move by up to `bound` either way, as likely to anything within it; the
/// interval reaches as far.
pub(super) fn bounded(known: Option<Uncertainty>, bound: f64) -> Option<Uncertainty> {
    let mut known = known?;
    known.std = known.std.hypot(bound / 3.0_f64.sqrt());
    let [low, high] = known.interval_95;
    known.interval_95 = [(low - bound).max(0.0), high + bound];
    Some(known)
}
