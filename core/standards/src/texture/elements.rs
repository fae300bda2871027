//! Profile elements by crossings of the mean line.

use super::profile::Profile;

/// A stretch of a profile on one side of the mean line.
struct Side {
    /// Where it begins, in mm.
    start: f64,
    width: f64,
    above: bool,
    /// Largest distance from the mean line.
    height: f64,
}

/// Means over the profile elements; NaN where there is none.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mean {
    /// Width, in mm.
    pub(super) spacing_mm: f64,
    /// Height of the hill and depth of the dale together, in µm.
    pub(super) height_um: f64,
}

/// Means over the profile elements of both directions. `lowest` are the heights in µm that hills and dales need to count,
/// `narrowest` the width in mm.
pub(super) fn mean(profile: &Profile, lowest: [f64; 2], narrowest: f64) -> Mean {
    let counts = |side: &Side| side.width >= narrowest && side.height >= lowest[usize::from(!side.above)];
    let (mut width, mut height, mut count) = (0.0, 0.0, 0_usize);
    for run in [runs(profile, false), runs(profile, true)].iter().flatten() {
        let halves = halves(run, profile.turn_mm.is_some(), counts);
        // Every other half is one element further: hill and dale, and dale and hill.
        let turn = profile.turn_mm.filter(|_| run.whole);
        let count_of = halves.len();
        let elements = if turn.is_some() && count_of >= 2 { count_of } else { count_of.saturating_sub(2) };
        for element in 0..elements {
            let end = element + 2;
            let around = if end >= count_of { turn.unwrap_or(0.0) } else { 0.0 };
            width += halves[end % count_of].start + around - halves[element].start;
            height += halves[element].height + halves[(element + 1) % count_of].height;
            count += 1;
        }
    }
    Mean { spacing_mm: width / count as f64, height_um: height / count as f64 }
}

/// Half of an element: significant sides of one kind, and what of the other kind between them does not count.
struct Half {
    /// Where it begins, in mm.
    start: f64,
    /// Largest distance from the mean line.
    height: f64,
}

/// Sides of a stretch of measured points, in the order of going.
struct Run {
    sides: Vec<Side>,
    /// Whether it is a whole turn: the last side is the first one's neighbour.
    whole: bool,
}

/// The halves of elements that have a beginning; ascending in the direction of going.
fn halves(run: &Run, closed: bool, counts: impl Fn(&Side) -> bool) -> Vec<Half> {
    let significant: Vec<&Side> = run.sides.iter().filter(|side| counts(side)).collect();
    let Some(last) = significant.last() else { return Vec::new() };
    let changes = |place: usize| {
        let before = if place > 0 { significant[place - 1] } else { last };
        before.above != significant[place].above
    };
    // The first half of an open run has no beginning; that of a closed one may be the rest of its last.
    let whole = closed && run.whole;
    let Some(first) = (usize::from(!whole)..significant.len()).find(|place| changes(*place)) else { return Vec::new() };
    let wrapped = if whole { 0..first } else { 0..0 };
    let mut halves: Vec<Half> = Vec::new();
    for place in (first..significant.len()).chain(wrapped) {
        let side = significant[place];
        match halves.last_mut() {
            Some(half) if place != first && (place < first || !changes(place)) => {
                half.height = half.height.max(side.height);
            }
            _ => halves.push(Half { start: side.start, height: side.height }),
        }
    }
    halves
}

/// The profile's stretches without gaps, as sides of the mean line, forwards or backwards.
fn runs(profile: &Profile, backwards: bool) -> Vec<Run> {
    let sign = if backwards { -1.0 } else { 1.0 };
    let mut points: Vec<(f64, f64)> =
        profile.positions_mm.iter().map(|position| sign * position).zip(profile.heights_um.iter().copied()).collect();
    if backwards {
        points.reverse();
    }
    let gap = points.iter().position(|(_, height)| !height.is_finite());
    match (profile.turn_mm, gap) {
        (Some(turn), None) => {
            // Begin at a crossing, so that no side is cut in two; go round to it again.
            let crossing = (1..points.len()).find(|point| (points[*point].1 > 0.0) != (points[*point - 1].1 > 0.0));
            let Some(crossing) = crossing else { return Vec::new() };
            let (head, tail) = points.split_at(crossing - 1);
            let round = head.iter().chain(&tail[..2]).map(|(position, height)| (position + turn, *height));
            let round: Vec<_> = tail.iter().copied().chain(round).collect();
            let mut sides = sides(&round);
            // The stretch before the first crossing is the end of the last side, and the one after the last its start.
            sides.remove(0);
            sides.pop();
            vec![Run { sides, whole: true }]
        }
        (Some(turn), Some(gap)) => {
            // Begin in a gap.
            let (head, tail) = points.split_at(gap);
            let round = tail.iter().copied().chain(head.iter().map(|(position, height)| (position + turn, *height)));
            stretches(&round.collect::<Vec<_>>())
        }
        (None, _) => stretches(&points),
    }
}

fn stretches(points: &[(f64, f64)]) -> Vec<Run> {
    points
        .split(|(_, height)| !height.is_finite())
        .filter(|stretch| stretch.len() > 1)
        .map(|stretch| Run { sides: sides(stretch), whole: false })
        .collect()
}

/// Sides of the mean line along points, which cross it on straight lines.
fn sides(points: &[(f64, f64)]) -> Vec<Side> {
    let mut sides: Vec<Side> = Vec::new();
    let mut before: Option<(f64, f64)> = None;
    for &(position, height) in points {
        let above = height > 0.0;
        if let Some(side) = sides.last_mut().filter(|side| side.above == above) {
            side.height = side.height.max(height.abs());
        } else {
            let start = before.map_or(position, |(left, from)| left + (position - left) * from / (from - height));
            sides.push(Side { start, width: 0.0, above, height: height.abs() });
        }
        before = Some((position, height));
    }
    let ends = sides.iter().skip(1).map(|side| side.start).chain(before.map(|(position, _)| position));
    let ends: Vec<f64> = ends.collect();
    sides.iter_mut().zip(ends).for_each(|(side, end)| side.width = end - side.start);
    sides
}
