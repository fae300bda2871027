//! The level of motion along the axis: it creeps as spindle and part grow warm, and is no motion.
//!
//! The slow course of the turns' levels is the straight line through those of the turns around each turn, by least squares. What
//! goes to and fro faster stays: within the record, a line at an order f keeps 1 − sin(πNf)/(N sin(πf)) of its amplitude, N the turns
//! of the window. That is all of it within a fifth from f = 0.06 on, and within 5 % from 0.3 on.

use std::collections::VecDeque;

/// Turns to each side.
const BESIDE: usize = 12;
/// Turns of a window.
const WINDOW: usize = 2 * BESIDE + 1;
/// Of fewer turns no course is known.
const FEWEST: usize = 5;

/// Turns that wait until the levels around them are known.
pub(super) struct Levelled {
    /// Rows of motion along the axis.
    rows: Vec<usize>,
    angles: usize,
    /// Of every turn, `[turn][row]`.
    levels: Vec<Vec<f64>>,
    /// The turns from number [`taken`](Self::taken) on, `[motion][angle]`.
    waiting: VecDeque<Vec<f64>>,
    taken: usize,
}

impl Levelled {
    /// For rows of motion on so many angles; `None` where there are none.
    pub(crate) fn new(rows: Vec<usize>, angles: usize) -> Option<Self> {
        let (levels, waiting) = (Vec::new(), VecDeque::new());
        (!rows.is_empty()).then_some(Self { rows, angles, levels, waiting, taken: 0 })
    }

    /// Takes the motion of a turn.
    pub(crate) fn add(&mut self, motion: &[f64]) {
        let level = |row: &usize| {
            let values = &motion[row * self.angles..(row + 1) * self.angles];
            values.iter().sum::<f64>() / self.angles.max(1) as f64
        };
        self.levels.push(self.rows.iter().map(level).collect());
        self.waiting.push_back(motion.to_vec());
    }

    /// The next turn without its level's slow course, where all turns around it are there, or at the `end`.
    pub(crate) fn next(&mut self, end: bool) -> Option<Vec<f64>> {
        let known = self.levels.len();
        if !end && (known < WINDOW || self.taken + BESIDE >= known) {
            return None;
        }
        let mut motion = self.waiting.pop_front()?;
        if known >= FEWEST {
            let from = self.taken.saturating_sub(BESIDE).min(known.saturating_sub(WINDOW));
            let window = from..(from + WINDOW).min(known);
            for (place, row) in self.rows.iter().enumerate() {
                let levels = self.levels[window.clone()].iter().map(|levels| levels[place]);
                let course = line_at(levels, (self.taken - from) as f64);
                motion[row * self.angles..(row + 1) * self.angles].iter_mut().for_each(|value| *value -= course);
            }
        }
        self.taken += 1;
        Some(motion)
    }
}

/// The least-squares line through values at 0, 1, 2, …, at a place.
fn line_at(values: impl ExactSizeIterator<Item = f64> + Clone, place: f64) -> f64 {
    let count = values.len() as f64;
    let middle = 0.5 * (count - 1.0);
    let mean = values.clone().sum::<f64>() / count;
    let (mut products, mut squares) = (0.0, 0.0);
    for (index, value) in values.enumerate() {
        let from_middle = index as f64 - middle;
        products += from_middle * (value - mean);
        squares += from_middle * from_middle;
    }
    mean + if squares > 0.0 { products / squares * (place - middle) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All turns of a course, in the order in which they come out.
    fn levelled(course: &[f64]) -> Vec<f64> {
        let mut levelled = Levelled::new(vec![1], 2).unwrap();
        let mut found = Vec::new();
        for level in course {
            levelled.add(&[7.0, 7.0, level - 0.5, level + 0.5]);
            found.extend(levelled.next(false));
        }
        found.extend(std::iter::from_fn(|| levelled.next(true)));
        assert!(
            found.iter().all(|turn| (turn[0] - 7.0).abs() < 1e-9 && (turn[3] - turn[2] - 1.0).abs() < 1e-9),
            "{found:?}"
        );
        found.iter().map(|turn| 0.5 * (turn[2] + turn[3])).collect()
    }

    #[test]
    fn a_ramp_is_taken_out_wholly_and_a_line_hardly() {
        for turns in [5, 9, 24, 25, 26, 60] {
            let ramp: Vec<f64> = (0..turns).map(|turn| 40.0 + 3.0 * f64::from(turn)).collect();
            let left = levelled(&ramp);
            assert_eq!(left.len(), ramp.len());
            assert!(left.iter().all(|level| level.abs() < 1e-9), "{turns}: {left:?}");
        }
        // 0.38 of a turn, as of a bearing's cage, on a slow exponential.
        let line = |turn: f64| (std::f64::consts::TAU * 0.38 * turn).cos();
        let course: Vec<f64> =
            (0..60).map(|turn| line(f64::from(turn)) + 9.0 * (-f64::from(turn) / 80.0).exp()).collect();
        for (turn, level) in levelled(&course).iter().enumerate() {
            assert!((level - line(turn as f64)).abs() < 0.35, "{turn}: {level}");
        }
    }

    #[test]
    fn few_turns_stay_as_they_are() {
        assert_eq!(levelled(&[1.0, 5.0]), [1.0, 5.0]);
    }
}
