//! Turns from marks, and what the marks alone say against them.

use runout_core::{
    measurement::Capture,
    profile::{RejectedTurn, Rejection, TurnCount, TurnLength},
};

/// Below this share of the median, a turn is certainly two marks of one.
const PIECE: f64 = 0.5;
/// Room for rounding where the last mark stands just behind the last sample, in samples.
pub(super) const ROUNDING: f64 = 1e-6;

/// A turn, in sample positions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Turn {
    /// Counted from 0 at the capture's first mark.
    pub number: usize,
    pub start: f64,
    pub end: f64,
}

impl Turn {
    pub(super) fn samples(&self) -> f64 {
        self.end - self.start
    }

    pub(super) fn rejected(&self, number: usize, reason: Rejection) -> RejectedTurn {
        RejectedTurn { turn: number, start_sample: self.start.max(0.0) as u64, reason }
    }
}

/// The turns between the capture's marks, each with the reason why it cannot be used. `tolerance` is a share of the
/// median turn.
pub(super) fn cut(capture: &Capture, tolerance: f64) -> Vec<(Turn, Option<Rejection>)> {
    let Some(median) = capture.median_turn_samples() else { return Vec::new() };
    let marks = capture.marks.windows(2).enumerate();
    let turns: Vec<Turn> = marks.map(|(number, pair)| Turn { number, start: pair[0], end: pair[1] }).collect();
    let lengths: Vec<f64> = turns.iter().map(|turn| turn.samples() / median).collect();
    let doubled = doubled(&lengths, tolerance);
    let judge = |(index, turn): (usize, Turn)| {
        let length = TurnLength { samples: turn.samples(), median_samples: median };
        let relative = lengths[index];
        let whole = relative.round();
        let rejection = if doubled[index] {
            Some(Rejection::DoubledMark(length))
        } else if (relative - 1.0).abs() <= tolerance {
            let covered = turn.start >= 0.0 && turn.end <= capture.samples as f64 + ROUNDING;
            (!covered).then_some(Rejection::Incomplete)
        } else if whole >= 2.0 && (relative - whole).abs() <= tolerance * whole {
            Some(Rejection::MissingMark(length))
        } else {
            Some(Rejection::Speed(length))
        };
        (turn, rejection)
    };
    turns.into_iter().enumerate().map(judge).collect()
}

/// Which of the turns, given in medians, come from a mark that was counted twice.
///
/// A piece much shorter than a turn is one. Together with the neighbour that completes it to a turn it was one turn, so
/// that this neighbour does not begin or end where a turn does, however near to the right length it is. Where both
/// neighbours complete it about equally well, neither can be trusted.
fn doubled(lengths: &[f64], tolerance: f64) -> Vec<bool> {
    let mut doubled: Vec<bool> = lengths.iter().map(|length| *length < PIECE).collect();
    for (index, length) in lengths.iter().enumerate() {
        let neighbours = [index.checked_sub(1), Some(index + 1)].map(|neighbour| {
            let neighbour =
                neighbour.filter(|neighbour| lengths.get(*neighbour).is_some_and(|other| *other >= PIECE))?;
            let off = (length + lengths[neighbour] - 1.0).abs();
            (off <= tolerance).then_some((neighbour, off))
        });
        let nearest = neighbours.iter().flatten().map(|(_, off)| *off).fold(f64::INFINITY, f64::min);
        // In 0.5 + 0.5 no piece is below the limit, so that any piece too short for a turn may have a partner.
        if *length < 1.0 - tolerance {
            for (neighbour, _) in neighbours.into_iter().flatten().filter(|(_, off)| *off <= nearest + 0.1 * tolerance)
            {
                doubled[neighbour] = true;
                doubled[index] = true;
            }
        }
    }
    doubled
}

/// What became of the turns that were not used, for messages: reason, number, and the first few turns.
pub(super) fn reasons(capture: &Capture, turns: &TurnCount) -> Vec<String> {
    let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
    for rejected in &turns.rejected {
        let reason = reason(capture, &rejected.reason);
        match groups.iter_mut().find(|(known, _)| *known == reason) {
            Some((_, numbers)) => numbers.push(rejected.turn),
            None => groups.push((reason, vec![rejected.turn])),
        }
    }
    let trimmed = turns.trimmed.iter().map(|trim| format!("{} set aside: {}", trim.turns, trim.reason));
    let rejected = groups.into_iter().map(|(reason, numbers)| {
        let listed: Vec<String> = numbers.iter().take(LISTED).map(ToString::to_string).collect();
        let more = if numbers.len() > LISTED { ", …" } else { "" };
        format!("{} × {reason} (turn {}{more})", numbers.len(), listed.join(", "))
    });
    trimmed.chain(rejected).collect()
}

/// Turns that a message names one by one.
const LISTED: usize = 5;

fn reason(capture: &Capture, rejection: &Rejection) -> String {
    let sensor = |index: &usize| {
        let channel = capture.sensors.iter().position(|sensor| sensor == index);
        let id = channel.and_then(|channel| capture.sensor_ids.get(channel));
        id.map_or_else(|| format!("sensor {index}"), |id| format!("sensor {id}"))
    };
    match rejection {
        Rejection::MissingMark(_) => "a mark is missing".into(),
        Rejection::DoubledMark(_) => "cut by or next to a mark that was counted twice".into(),
        Rejection::Speed(_) => "off speed".into(),
        Rejection::Defect { sensor: index, kind } => format!("{} is {kind}", sensor(index)),
        Rejection::Outlier { sensor: index, .. } => format!("{} is far from the other turns", sensor(index)),
        Rejection::Incomplete => "not wholly covered by samples".into(),
        Rejection::Angle => "the encoder's angle does not grow steadily by one turn".into(),
    }
}
