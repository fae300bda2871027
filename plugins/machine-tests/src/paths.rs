//! Turns of a recorded circular path at equal angles.

use runout_core::{Error, ErrorKind, Result, points::Points};

/// Equal angles of a path.
pub(crate) const ANGLES: usize = 720;
/// Longest stretch without readings that is bridged, in degrees.
const LONGEST_GAP_DEG: f64 = 10.0;

pub(crate) fn refused(points: &Points, problem: String) -> Error {
    Error::new("evaluate", points.input.display().to_string(), problem).of(ErrorKind::InsufficientData)
}

/// Radial deviations at equal angles, by direction and turn.
pub(crate) struct Paths {
    /// +1 counter-clockwise, −1 clockwise.
    pub signs: Vec<i8>,
    /// `[direction][turn][angle]`.
    pub turns: Vec<Vec<Vec<f64>>>,
}

impl Paths {
    /// Parts points into turns, and puts them at equal angles.
    ///
    /// # Errors
    /// When a direction is neither 1 nor −1, or no turn is whole.
    pub(crate) fn of(points: &Points) -> Result<Self> {
        let (angle_deg, deviation_um) = (points.column("angle_deg")?, points.column("deviation_um")?);
        let steps = |row: usize| {
            let (before, at) = (row.max(1) - 1, row.max(1).min(angle_deg.len().max(1) - 1));
            (angle_deg[at] - angle_deg[before] + 180.0).rem_euclid(360.0) - 180.0
        };
        let stated = points.column("direction").ok();
        let mut recorded: Vec<(i8, Vec<(f64, f64)>)> = Vec::new();
        let mut turned = 0.0;
        for row in 0..angle_deg.len() {
            let step = if row == 0 { 0.0 } else { steps(row) };
            let sign = match stated.map(|column| column[row]) {
                Some(1.0) => 1,
                Some(-1.0) => -1,
                Some(other) => {
                    let problem = format!("row {}: expected a direction of 1 or -1, found {other}", row + 1);
                    return Err(refused(points, problem).help("1 is counter-clockwise, -1 clockwise"));
                }
                None if steps(row) < 0.0 => -1,
                None => 1,
            };
            // A new turn begins where the direction changes, and where the last one is whole.
            let goes_on = recorded.last().is_some_and(|(last, _)| *last == sign) && turned < 360.0;
            if goes_on {
                turned += step.abs();
            } else {
                turned = 0.0;
                recorded.push((sign, Vec::new()));
            }
            if let Some((_, turn)) = recorded.last_mut() {
                turn.push((angle_deg[row].rem_euclid(360.0), deviation_um[row]));
            }
        }
        let mut signs: Vec<i8> = Vec::new();
        let mut turns: Vec<Vec<Vec<f64>>> = Vec::new();
        for (sign, turn) in recorded {
            let Some(path) = resampled(turn) else { continue };
            let at = signs.iter().position(|known| *known == sign).unwrap_or_else(|| {
                signs.push(sign);
                turns.push(Vec::new());
                signs.len() - 1
            });
            turns[at].push(path);
        }
        if turns.is_empty() {
            let problem = format!("expected a whole turn without a gap of more than {LONGEST_GAP_DEG}°, found none");
            return Err(refused(points, problem)
                .help("arcs are not evaluated: record whole circles, with the angle of each reading"));
        }
        Ok(Self { signs, turns })
    }
}

/// A turn at equal angles, between its readings along straight lines; nothing where it is not whole.
fn resampled(mut turn: Vec<(f64, f64)>) -> Option<Vec<f64>> {
    turn.sort_by(|a, b| a.0.total_cmp(&b.0));
    turn.dedup_by(|next, kept| next.0 <= kept.0);
    let (first, last) = (*turn.first()?, *turn.last()?);
    // The seam is between the last reading and the first one.
    let closed: Vec<(f64, f64)> = std::iter::once((last.0 - 360.0, last.1))
        .chain(turn.iter().copied())
        .chain([(first.0 + 360.0, first.1)])
        .collect();
    let widest = closed.windows(2).map(|pair| pair[1].0 - pair[0].0).fold(0.0, f64::max);
    if widest > LONGEST_GAP_DEG {
        return None;
    }
    let mut next = 1;
    let at = |angle: usize| {
        let angle = 360.0 * angle as f64 / ANGLES as f64;
        while closed[next].0 < angle {
            next += 1;
        }
        let [(from, low), (to, high)] = [closed[next - 1], closed[next]];
        low + (high - low) * (angle - from) / (to - from)
    };
    Some((0..ANGLES).map(at).collect())
}

/// The mean of turns.
pub(crate) fn mean_of(turns: &[Vec<f64>]) -> Vec<f64> {
    (0..ANGLES).map(|angle| turns.iter().map(|turn| turn[angle]).sum::<f64>() / turns.len() as f64).collect()
}
