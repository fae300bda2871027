//! Turns of a recorded circular path at equal angles.

use runout_core::{Error, ErrorKind, Result, points::Points};

/// Equal angles of a path at most, and at least: as many as its turns have readings. More would repeat the noise of one reading at all angles beside it.
const MOST_ANGLES: usize = 7200;
const FEWEST_ANGLES: usize = 8;
/// Net angle from which on the side that a path runs to is known, in degrees: below, readings may go to and fro.
const RUNS_DEG: f64 = 5.0;
/// Readings of a part of a turn that is worth a remark.
const FEW: usize = 10;
/// Share of the rows that may run against the direction stated.
const AGAINST: f64 = 0.1;
/// Longest stretch without readings that is bridged, in degrees.
const LONGEST_GAP_DEG: f64 = 10.0;

pub(crate) fn refused(points: &Points, problem: String) -> Error {
    Error::new("evaluate", points.input.display().to_string(), problem).of(ErrorKind::InsufficientData)
}

/// Radial deviations at equal angles, by direction and turn.
pub(crate) struct Paths {
    /// Equal angles of each path.
    pub angles: usize,
    /// +1 counter-clockwise, −1 clockwise.
    pub signs: Vec<i8>,
    /// `[direction][turn][angle]`.
    pub turns: Vec<Vec<Vec<f64>>>,
    /// What the user should know.
    pub remarks: Vec<String>,
}

impl Paths {
    /// Parts points into turns, and puts them at equal angles.
    ///
    /// # Errors
    /// When a direction is neither 1 nor −1, or no turn is whole.
    pub(crate) fn of(points: &Points) -> Result<Self> {
        let (angle_deg, deviation_um) = (points.column("angle_deg")?, points.column("deviation_um")?);
        let along_deg = unwrapped(angle_deg);
        let runs = sides(&along_deg);
        let mut remarks = Vec::new();
        let side: Vec<i8> = match points.column("direction") {
            Ok(column) => {
                let stated = crate::runs::stated(column);
                let stated =
                    stated.map_err(|problem| refused(points, problem).help("1 is counter-clockwise, -1 clockwise"))?;
                let against = stated.iter().zip(&runs).filter(|(stated, runs)| stated != runs).count();
                if against as f64 > AGAINST * stated.len() as f64 {
                    remarks.push(format!(
                        "in {against} of {} rows the angle runs against `direction`: are the two directions exchanged?",
                        stated.len()
                    ));
                }
                stated
            }
            Err(_) => runs,
        };
        let mut recorded: Vec<(i8, Vec<(f64, f64)>)> = Vec::new();
        let mut begins_deg = 0.0;
        for (row, (along, side)) in along_deg.iter().zip(&side).enumerate() {
            // A new turn begins where the direction changes, and with the reading a whole turn behind its first one.
            let runs = recorded.last().filter(|(last, _)| last == side).map(|_| (along - begins_deg).abs());
            match runs {
                Some(deg) if deg < 360.0 - 1e-6 => {}
                Some(_) => {
                    begins_deg += 360.0_f64.copysign(along - begins_deg);
                    recorded.push((*side, Vec::new()));
                }
                None => {
                    begins_deg = *along;
                    recorded.push((*side, Vec::new()));
                }
            }
            if let Some((_, turn)) = recorded.last_mut() {
                turn.push((angle_deg[row].rem_euclid(360.0), deviation_um[row]));
            }
        }
        let most = recorded.iter().map(|(_, turn)| turn.len()).max().unwrap_or(0);
        let angles = (2 * most.div_ceil(2)).clamp(FEWEST_ANGLES, MOST_ANGLES);
        let (mut signs, mut turns): (Vec<i8>, Vec<Vec<Vec<f64>>>) = (Vec::new(), Vec::new());
        let mut left_out = 0;
        for (sign, turn) in recorded {
            let readings = turn.len();
            let Some(path) = resampled(turn, angles) else {
                left_out += usize::from(readings >= FEW);
                continue;
            };
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
        if left_out > 0 {
            remarks.push(format!("{left_out} turns that are not whole are left out"));
        }
        Ok(Self { angles, signs, turns, remarks })
    }
}

/// Angles that go on over the turns.
fn unwrapped(angle_deg: &[f64]) -> Vec<f64> {
    let mut along = 0.0;
    let mut last = angle_deg.first().copied().unwrap_or(0.0);
    let next = |angle: &f64| {
        along += (angle - last + 180.0).rem_euclid(360.0) - 180.0;
        last = *angle;
        along
    };
    angle_deg.iter().map(next).collect()
}

/// The side that a path runs to at each row: by the nearest row that is far enough before or behind.
fn sides(along_deg: &[f64]) -> Vec<i8> {
    let far = |row: usize, other: usize| (along_deg[other] - along_deg[row]).abs() >= RUNS_DEG;
    let side = |row: usize| {
        let ahead = (row + 1..along_deg.len()).find(|other| far(row, *other));
        let before = (0..row).rev().find(|other| far(row, *other));
        let up = match (ahead, before) {
            (Some(ahead), Some(before)) if row - before < ahead - row => along_deg[row] > along_deg[before],
            (Some(ahead), _) => along_deg[ahead] > along_deg[row],
            (None, Some(before)) => along_deg[row] > along_deg[before],
            (None, None) => true,
        };
        if up { 1 } else { -1 }
    };
    (0..along_deg.len()).map(side).collect()
}

/// A turn at equal angles, between its readings along straight lines; nothing where it is not whole.
fn resampled(mut turn: Vec<(f64, f64)>, angles: usize) -> Option<Vec<f64>> {
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
        let angle = 360.0 * angle as f64 / angles as f64;
        while closed[next].0 < angle {
            next += 1;
        }
        let [(from, low), (to, high)] = [closed[next - 1], closed[next]];
        low + (high - low) * (angle - from) / (to - from)
    };
    Some((0..angles).map(at).collect())
}

/// The mean of turns.
pub(crate) fn mean_of(turns: &[Vec<f64>]) -> Vec<f64> {
    let angles = turns.first().map_or(0, Vec::len);
    (0..angles).map(|angle| turns.iter().map(|turn| turn[angle]).sum::<f64>() / turns.len() as f64).collect()
}
