//! Sets start-up and run-down aside.

use runout_core::{
    Result,
    fault::Fault,
    measurement::{Block, Capture, SampleStream, Trim},
    pipeline::{Context, StageConfig},
    stage::{Conditioner, Preprocessor},
};
use schemars::JsonSchema;
use serde::Deserialize;

/// Sets turns at both ends aside: a fixed number, then those that are not yet or no longer at speed.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrimConfig {
    /// Turns at the ends whose length is off the capture's median by more than this are start-up and run-down, in
    /// percent.
    #[serde(default = "default_tolerance")]
    pub speed_tolerance_percent: f64,
    /// Turns that are set aside at the start in any case.
    #[serde(default)]
    pub start_turns: usize,
    /// Turns that are set aside at the end in any case.
    #[serde(default)]
    pub end_turns: usize,
}

fn default_tolerance() -> f64 {
    1.0
}

impl StageConfig for TrimConfig {
    type Stage = Preprocessor;

    const NAME: &'static str = "trim";
    const ABOUT: &'static str = "sets start-up and run-down aside";

    fn check(self, _context: &Context) -> std::result::Result<Preprocessor, Fault> {
        let percent = self.speed_tolerance_percent;
        if !(percent > 0.0 && percent.is_finite()) {
            let problem = format!("expected a percentage above 0, found {percent}");
            return Err(Fault::at("speed_tolerance_percent", problem));
        }
        Ok(Preprocessor::Conditioner(Box::new(EndTrim {
            tolerance: 0.01 * percent,
            start_turns: self.start_turns,
            end_turns: self.end_turns,
        })))
    }
}

/// The checked trim.
#[derive(Debug, Clone, PartialEq)]
pub struct EndTrim {
    /// Share of the median turn.
    tolerance: f64,
    start_turns: usize,
    end_turns: usize,
}

impl EndTrim {
    /// Takes marks away from both ends of a capture, and says so in it.
    fn apply(&self, capture: &mut Capture) {
        let Some(median) = capture.median_turn_samples() else { return };
        let first_turn = capture.first_turn();
        let turns = capture.marks.len() - 1;
        let lengths: Vec<f64> = capture.marks.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let off_speed = |length: &f64| (length - median).abs() > self.tolerance * median || length.is_nan();

        let mut start = self.start_turns.min(turns);
        let mut end = turns - self.end_turns.min(turns - start);
        let (fixed_start, fixed_end) = (start, end);
        start += lengths[start..end].iter().take_while(|length| off_speed(length)).count();
        end -= lengths[start..end].iter().rev().take_while(|length| off_speed(length)).count();

        let percent = 100.0 * self.tolerance;
        let parts = [
            (0..fixed_start, "start_turns".to_owned()),
            (fixed_start..start, format!("start-up, more than {percent} % off the median turn")),
            (end..fixed_end, format!("run-down, more than {percent} % off the median turn")),
            (fixed_end..turns, "end_turns".to_owned()),
        ];
        for (part, reason) in parts.into_iter().filter(|(part, _)| !part.is_empty()) {
            capture.trimmed.push(Trim { first_turn: first_turn + part.start, turns: part.len(), reason });
        }
        capture.marks.truncate(end + 1);
        capture.marks.drain(..start);
    }
}

impl Conditioner for EndTrim {
    fn attach<'a>(&'a self, input: Box<dyn SampleStream + 'a>) -> Result<Box<dyn SampleStream + 'a>> {
        let mut capture = input.capture().clone();
        self.apply(&mut capture);
        Ok(Box::new(Trimmed { input, capture }))
    }
}

/// The samples stay: filters and resampling settle in those beside the turns that are kept.
struct Trimmed<'a> {
    input: Box<dyn SampleStream + 'a>,
    capture: Capture,
}

impl SampleStream for Trimmed<'_> {
    fn capture(&self) -> &Capture {
        &self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        self.input.next_block(block)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;
    use crate::testing::{conditioner, stream};

    fn trimmed(lengths: &[f64], config: TrimConfig) -> Capture {
        let mut marks = vec![12.5];
        marks.extend(lengths.iter().scan(12.5, |end, length| {
            *end += length;
            Some(*end)
        }));
        let trim = conditioner(config);
        trim.attach(Box::new(stream(&[vec![0.0; 100]], marks))).unwrap().capture().clone()
    }

    fn set_aside(capture: &Capture) -> Vec<(usize, usize, &str)> {
        capture
            .trimmed
            .iter()
            .map(|trim| (trim.first_turn, trim.turns, trim.reason.split(',').next().unwrap_or_default()))
            .collect()
    }

    #[test]
    fn start_up_and_run_down_go_and_the_middle_stays() {
        let lengths = [400.0, 150.0, 102.0, 100.5, 100.0, 130.0, 100.0, 100.0, 100.0, 99.5, 103.0];
        let config = TrimConfig { speed_tolerance_percent: 1.0, start_turns: 0, end_turns: 0 };
        let capture = trimmed(&lengths, config);
        assert_eq!(set_aside(&capture), [(0, 3, "start-up"), (10, 1, "run-down")]);
        assert_eq!(capture.first_turn(), 3);
        assert_eq!(capture.marks.len(), 8);
        assert!((capture.marks[0] - 664.5).abs() < 1e-9);
    }

    #[test]
    fn fixed_turns_go_first() {
        let config = TrimConfig { speed_tolerance_percent: 1.0, start_turns: 2, end_turns: 1 };
        let capture = trimmed(&[100.0, 100.0, 90.0, 100.0, 100.0, 100.0, 90.0, 100.0], config);
        let expected = [(0, 2, "start_turns"), (2, 1, "start-up"), (6, 1, "run-down"), (7, 1, "end_turns")];
        assert_eq!(set_aside(&capture), expected);
        assert_eq!((capture.first_turn(), capture.marks.len()), (3, 4));
    }

    #[test]
    fn more_turns_than_there_are_leave_none() {
        let config = TrimConfig { speed_tolerance_percent: 1.0, start_turns: 2, end_turns: 9 };
        let capture = trimmed(&[100.0, 100.0, 100.0], config);
        assert_eq!(set_aside(&capture), [(0, 2, "start_turns"), (2, 1, "end_turns")]);
        assert_eq!(capture.marks.len(), 1);
    }
}
