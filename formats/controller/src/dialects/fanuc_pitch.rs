//! FANUC: stored pitch error compensation, parameters 3620 to 3625.
//!
//! Parameter manual Series 0i-PB (B-63980EN), page 100: values count from point to point; the points are numbered from that of the reference
//! position on (3620), linear axes from 3621 to 3622 with −7 to 7 times the magnification (3623) in detection units; a rotary axis comes back to 0 over its turn, and the point of the reference position has the value of the last one. Parameter manual Series
//! 15i (B-63330EN), page 25: a file begins and ends with `%`, lines are `N… P…`. Not found in a public text: that a value belongs to the section before
//! its point, that pitch error data have the number of the point and 10000, and the limit of 1024 points.

use super::{Comments, Dialect, Written, few_enough, is_positioning, is_turn, name, positions};
use crate::{
    chain::{AxisCurves, Chain, LETTERS, index},
    config::{ControllerConfig, Moves},
};

/// Compensation points of an axis, and of the control.
const MOST_POINTS: usize = 128;
const MOST_NUMBERS: usize = 1024;
/// Largest value at a point.
const LARGEST: u32 = 7;
/// `N` of compensation point 0.
const FIRST_NUMBER: usize = 10_000;
/// Part of a step by which a reference position may be off its node.
const ON_NODE: f64 = 1e-6;

pub(super) struct FanucPitch(pub ControllerConfig);

/// An axis: what the control adds at its nodes, in steps of a value.
struct Steps {
    /// Index of the node that is the reference position.
    reference: usize,
    /// What a step is, in mm or °, with the sign of the control.
    step: f64,
    /// Sum of the values from the reference position to each node.
    sums: Vec<i64>,
}

/// Least step of a value of an axis, in mm or °, positive where a positive value moves the axis in its positive direction.
pub(super) fn value_step(config: &ControllerConfig, axis: &str) -> Result<f64, String> {
    let unit = config.detection_unit.get(axis).copied();
    let unit = unit.ok_or_else(|| {
        format!("the detection unit of {axis} is not stated: `detection_unit = {{ {axis} = 0.001 }}`, in mm or °")
    })?;
    let sign = if config.positive_moves == Some(Moves::Positive) { 1.0 } else { -1.0 };
    Ok(sign * unit * f64::from(config.magnification))
}

/// Refuses a value that does not fit.
pub(super) fn fits(config: &ControllerConfig, value: i64, usual: u32, place: &str) -> Result<(), String> {
    let largest = config.largest_value.unwrap_or(usual);
    if value.unsigned_abs() <= u64::from(largest) {
        return Ok(());
    }
    Err(format!(
        "{place} needs a value of {value}, and the control takes {largest}: take a narrower pitch of the component curves, or a larger `magnification`"
    ))
}

impl FanucPitch {
    fn steps(&self, chain: &Chain, axis: &AxisCurves) -> Result<Steps, String> {
        let letter = &axis.letter;
        let points = positions(&self.0, chain, letter).unwrap_or_default();
        let at = self.0.zero_at.get(letter).copied().unwrap_or(0.0);
        let place = (at - axis.ends()[0]) / axis.step();
        let last = points.len() - 1;
        let is_node = (place - place.round()).abs() < ON_NODE && (-0.5..last as f64 + 0.5).contains(&place);
        if !is_node {
            return Err(format!(
                "the reference position of {letter}, {at}, is no node: state it in `zero_at`, and take a pitch that it is a multiple of"
            ));
        }
        let reference = place.round() as usize;
        let turn = is_turn(axis.rotary, axis.ends());
        if turn && reference != 0 {
            return Err(format!(
                "a turn of {letter} is counted from its first node, {}: `zero_at` is {at}",
                axis.ends()[0]
            ));
        }
        let step = value_step(&self.0, letter)?;
        let of = |[_, error]: &[f64; 2]| ((points[reference][1] - error) / step).round() as i64;
        let mut sums: Vec<i64> = points.iter().map(of).collect();
        if turn {
            sums[last] = sums[0];
        }
        for (point, pair) in sums.windows(2).enumerate() {
            fits(&self.0, pair[1] - pair[0], LARGEST, &format!("{letter} before {}", points[point + 1][0]))?;
        }
        Ok(Steps { reference, step, sums })
    }
}

impl Dialect for FanucPitch {
    fn comments(&self) -> Comments {
        Comments::Last("(", ")")
    }

    fn holds(&self, symbol: &str) -> bool {
        is_positioning(symbol)
    }

    fn write(&self, chain: &Chain) -> Result<Written, String> {
        let moves = if self.0.positive_moves == Some(Moves::Positive) { "positive" } else { "negative" };
        let mut notes = vec![
            format!("values count from point to point, in detection units times the magnification; a positive value has to move the axis in its {moves} direction: `positive_moves`"),
            "forward and reverse are equal: the curves do not tell directions apart; leave bidirectional compensation off".to_owned(),
            "set by hand, then switch off and on, and return to the reference position:".to_owned(),
        ];
        let mut lines = vec!["%".to_owned()];
        let mut next = self.0.first_point;
        for axis in &chain.axes {
            let Steps { reference, sums, .. } = self.steps(chain, axis)?;
            few_enough(sums.len(), self.0.most_points.unwrap_or(MOST_POINTS), &axis.letter)?;
            few_enough(next + sums.len(), MOST_NUMBERS, "the file, with those before `first_point`,")?;
            let turn = is_turn(axis.rotary, axis.ends());
            let last = sums.len() - 1;
            // No section ends at the first point; on a turn it is the last one.
            let first = if turn { sums[last] - sums[last - 1] } else { 0 };
            let values = std::iter::once(first).chain(sums.windows(2).map(|pair| pair[1] - pair[0]));
            let line = |(point, value): (usize, i64)| format!("N{}P{value}", FIRST_NUMBER + next + point);
            lines.extend(values.enumerate().map(line));
            let own = name(&self.0, &axis.letter);
            let farthest = if turn { next } else { next + 1 };
            notes.push(format!(
                "{own}: 3620 = {}, 3621 = {farthest}, 3622 = {}, 3623 = {}, 3624 = {:.6}{}",
                next + reference,
                next + last,
                self.0.magnification,
                axis.step(),
                if axis.rotary { ", 3625 = 360.000000" } else { "" }
            ));
            next += sums.len();
        }
        lines.push("%".into());
        Ok(Written::one(lines, notes))
    }

    fn adds_um(&self, chain: &Chain, place_mm: [f64; 3]) -> [f64; 3] {
        LETTERS.map(|letter| {
            let own = index(letter).unwrap_or(0);
            let axis = chain.axis(letter);
            let steps = axis.and_then(|axis| Some((axis, self.steps(chain, axis).ok()?)));
            steps.map_or(0.0, |(axis, steps)| {
                let place = ((place_mm[own] - axis.ends()[0]) / axis.step()).clamp(0.0, steps.sums.len() as f64 - 1.0);
                let low = (place.floor() as usize).min(steps.sums.len() - 2);
                let (from, to) = (steps.sums[low] as f64, steps.sums[low + 1] as f64);
                1e3 * steps.step * (from + (to - from) * (place - low as f64))
            })
        })
    }
}
