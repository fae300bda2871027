//! Marks that count the part's turns, made of marks that do not: where the mark is on another shaft, comes several times a turn or once in several
//! turns, or where samples were lost.
//!
//! With τ the turns counted by the marks, from the recording's first, the part has turned by τ·(1 − δ/2π) where it turns against the mark by δ every
//! turn, and by τ − δ/2π from a step of δ on.

use std::{f64::consts::TAU, ops::Range};

use runout_consistency::turns::PhaseCourse;
use runout_error::Result;

use crate::measurement::{Block, Capture, Defect, DefectKind, SampleStream};

/// A stream whose marks are one turn of the part apart. The turn in which a phase steps is unusable.
#[must_use]
pub fn counted<'a>(input: Box<dyn SampleStream + 'a>, phase: &PhaseCourse) -> Box<dyn SampleStream + 'a> {
    let mut capture = input.capture().clone();
    capture.marks = marks(&capture.marks, phase);
    let broken = phase.step_at.map(|[turn, std]| {
        let place = |turn: f64| position(&input.capture().marks, turn).unwrap_or(0.0).max(0.0);
        place(turn - std) as u64..place(turn + std) as u64 + 1
    });
    Box::new(Counted { input, capture, phase: *phase, broken, first_rev: None })
}

/// A stream whose marks are one turn of the part apart, for a part that turns so many times from one mark to the next; the stream
/// itself where that is once.
#[must_use]
#[allow(clippy::float_cmp, reason = "1 as it was written")]
pub fn declared<'a>(input: Box<dyn SampleStream + 'a>, turns_per_mark: f64) -> Box<dyn SampleStream + 'a> {
    if turns_per_mark == 1.0 {
        return input;
    }
    counted(input, &PhaseCourse { by_rad: TAU * (1.0 - turns_per_mark), std_rad: 0.0, step_at: None })
}

/// How far the part has turned, in turns, where the marks count so many.
fn turned(marked: f64, phase: &PhaseCourse) -> f64 {
    let by = phase.by_rad / TAU;
    match phase.step_at {
        None => marked * (1.0 - by),
        Some([step, _]) if marked >= step => marked - by,
        Some(_) => marked,
    }
}

/// Sample position after so many marked turns; `None` behind the last mark.
fn position(marks: &[f64], marked: f64) -> Option<f64> {
    let last = marks.len().checked_sub(1)?;
    if marked >= last as f64 {
        return (marked < last as f64 + ROUNDING).then(|| marks[last]);
    }
    let at = marked.max(0.0) as usize;
    Some(marks[at] + (marked - at as f64) * (marks[at + 1] - marks[at]))
}

/// A part of a turn that is rounding.
const ROUNDING: f64 = 1e-9;

/// Sample positions at which the part begins a turn.
fn marks(marked: &[f64], phase: &PhaseCourse) -> Vec<f64> {
    let by = phase.by_rad / TAU;
    let whole = |turn: usize| match phase.step_at {
        None => turn as f64 / (1.0 - by),
        Some([step, _]) if (turn as f64) < step => turn as f64,
        Some([step, _]) => (turn as f64 + by).max(step),
    };
    let mut marks: Vec<f64> = (0..).map_while(|turn| position(marked, whole(turn))).collect();
    marks.dedup();
    marks
}

struct Counted<'a> {
    input: Box<dyn SampleStream + 'a>,
    capture: Capture,
    phase: PhaseCourse,
    /// Samples among which the phase steps, until they are said.
    broken: Option<Range<u64>>,
    /// The encoder's angle at its first zero, once it is known.
    first_rev: Option<f64>,
}

impl SampleStream for Counted<'_> {
    fn capture(&self) -> &Capture {
        &self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        let more = self.input.next_block(block)?;
        if let Some(samples) = self.broken.take() {
            block.defects.push(Defect { samples, channel: 0, kind: DefectKind::Lost });
        }
        if let Some(first) = block.angle_rev.first() {
            let first = *self.first_rev.get_or_insert(first.ceil());
            block.angle_rev.iter_mut().for_each(|angle| *angle = first + turned(*angle - first, &self.phase));
        }
        Ok(more)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(turns_per_mark: f64) -> PhaseCourse {
        PhaseCourse { by_rad: TAU * (1.0 - turns_per_mark), std_rad: 0.0, step_at: None }
    }

    #[test]
    fn marks_of_a_run_are_turns_of_the_part() {
        let marked: Vec<f64> = (0..11).map(|mark| 5.0 + 100.0 * f64::from(mark)).collect();
        // Two marks a turn, a mark in two turns, and a shaft that turns a little faster.
        assert_eq!(marks(&marked, &run(0.5)), (0..6).map(|turn| 5.0 + 200.0 * f64::from(turn)).collect::<Vec<_>>());
        assert_eq!(marks(&marked, &run(2.0)), (0..21).map(|turn| 5.0 + 50.0 * f64::from(turn)).collect::<Vec<_>>());
        let slower = marks(&marked, &run(1.25));
        assert_eq!(slower.len(), 13);
        assert!(slower.iter().enumerate().all(|(turn, mark)| (mark - 5.0 - 80.0 * turn as f64).abs() < 1e-9));
    }

    #[test]
    fn a_step_moves_the_marks_behind_it() {
        let marked: Vec<f64> = (0..11).map(|mark| 100.0 * f64::from(mark)).collect();
        let step = |by: f64| PhaseCourse { by_rad: by * TAU, std_rad: 0.0, step_at: Some([4.5, 0.5]) };
        let behind = marks(&marked, &step(0.1));
        assert_eq!(behind[..5], marked[..5]);
        assert!(behind[5..].iter().enumerate().all(|(turn, mark)| (mark - 510.0 - 100.0 * turn as f64).abs() < 1e-9));
        assert_eq!(behind.len(), 10);
        let before = marks(&marked, &step(-0.9));
        assert!(before.windows(2).all(|pair| pair[0] < pair[1]), "{before:?}");
        assert!((before[before.len() - 1] - 910.0).abs() < 100.0, "{before:?}");
    }
}
