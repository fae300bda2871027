//! From the encoder's angle to sample positions.

/// Sample positions of `count` equal angles through one turn, from where the encoder passes the whole turn nearest to
/// `start`; `end` is where that turn ends. All positions are in samples of `angle_rev`.
///
/// Between two samples the angle is a cubic through the four around; where they do not rise one after the other (an
/// encoder coarser than the samples), a straight line. False when the angle does not grow steadily by one turn.
pub(super) fn positions(angle_rev: &[f64], start: f64, end: f64, count: usize, positions: &mut Vec<f64>) -> bool {
    positions.clear();
    let (Some(first), Some(last)) = (angle_at(angle_rev, start), angle_at(angle_rev, end)) else { return false };
    let whole = first.round();
    let near = |angle: f64, turn: f64| (angle - turn).abs() <= OFF_MARK_REV;
    if !(near(first, whole) && near(last, whole + 1.0)) {
        return false;
    }
    let range = (start as usize).saturating_sub(1)..(end as usize + 2).min(angle_rev.len());
    // Also false for what is not a number.
    if !angle_rev[range].windows(2).all(|pair| pair[1] >= pair[0]) {
        return false;
    }
    let mut at = start as usize + 1;
    while at > 0 && angle_rev[at] > whole {
        at -= 1;
    }
    for step in 0..count {
        let target = whole + step as f64 / count as f64;
        while at + 2 < angle_rev.len() && angle_rev[at + 1] <= target {
            at += 1;
        }
        positions.push(at as f64 + crossing(angle_rev, at, target));
    }
    true
}

/// How far the encoder may be from a whole turn at a mark.
const OFF_MARK_REV: f64 = 0.01;

/// Linear between samples, and on beyond the last.
fn angle_at(angle_rev: &[f64], position: f64) -> Option<f64> {
    let at = (position as usize).min(angle_rev.len().checked_sub(2)?);
    let pair = angle_rev.get(at..at + 2)?;
    Some(pair[0] + (position - at as f64) * (pair[1] - pair[0]))
}

/// Where behind sample `at` the angle is `target`, in samples.
fn crossing(angle_rev: &[f64], at: usize, target: f64) -> f64 {
    let (here, next) = (angle_rev[at], angle_rev[at + 1]);
    if next <= here {
        return 0.0;
    }
    let straight = (target - here) / (next - here);
    let Some([before, _, _, after]) = at.checked_sub(1).and_then(|first| angle_rev[first..].first_chunk::<4>()) else {
        return straight;
    };
    if !(*before < here && next < *after) {
        return straight;
    }
    // Taken from the target, so that rounding is that of a step, not of the angle since the capture began.
    let (y0, y1, y2, y3) = (before - target, here - target, next - target, after - target);
    let c1 = y2 - y0 / 3.0 - 0.5 * y1 - y3 / 6.0;
    let c2 = 0.5 * (y0 + y2) - y1;
    let c3 = (y3 - y0) / 6.0 + 0.5 * (y1 - y2);
    let mut position = straight;
    // Newton from the straight line: an angle that bends by 1e-3 of a step is met to 1e-12 after two.
    for _ in 0..3 {
        let slope = c1 + position * (2.0 * c2 + position * 3.0 * c3);
        if slope <= 0.0 {
            return straight;
        }
        position -= (y1 + position * (c1 + position * (c2 + position * c3))) / slope;
    }
    if (0.0..=1.0).contains(&position) || !(0.0..=1.0).contains(&straight) { position } else { straight }
}
