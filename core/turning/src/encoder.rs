//! An encoder's angle, sample by sample: which way it counts, and where turns begin.

/// Follows an unwrapped angle through a capture.
///
/// An encoder may count either way; the direction of its first movement holds for the whole capture, and a falling
/// angle is turned round, so that the angle in turns always rises. Standing still is no fault: an encoder's steps can be
/// coarser than the samples.
#[derive(Debug, Clone, Default)]
pub struct EncoderScan {
    samples: u64,
    last_deg: f64,
    direction: f64,
    longest_step_deg: f64,
    marks: Vec<f64>,
}

/// An angle that no encoder on a turning spindle gives.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{problem}")]
#[non_exhaustive]
pub struct EncoderFault {
    /// The sample, counted from 0.
    pub sample: u64,
    /// What was expected and what was found.
    pub problem: String,
    /// What to do, where that is known.
    pub help: Option<&'static str>,
}

/// What to do with a recording in which the angle jumps.
const CUT: &str = "cut the recording there and use the longer part: a jump of whole turns is a gap in the recording, any other jump is a \
                   zero that moved";

/// An angle that begins at 0 again goes back by less than this.
const WRAPPED_DEG: f64 = 360.0;
/// What to do about an angle that begins anew with each turn.
const UNWRAP: &str =
    "an angle that begins at 0 again with each turn is to be unwrapped (`numpy.unwrap(angle_deg, period=360)`)";
/// A longer step between two samples leaves open which way the spindle went.
const LONGEST_STEP_DEG: f64 = 180.0;
/// A step longer than twice the longest before it by more than this is a jump: twice, as an encoder coarser than the
/// samples may pass one line or two.
const JUMP_DEG: f64 = 0.05 * 360.0;

impl EncoderScan {
    /// Takes the next sample's angle.
    ///
    /// # Errors
    /// When it is not finite, jumps by half a turn or by 0.05 turn beyond twice the longest step before, or goes back.
    pub fn push(&mut self, angle_deg: f64) -> Result<(), EncoderFault> {
        let fault = |problem| Err(EncoderFault { sample: self.samples, problem, help: None });
        if !angle_deg.is_finite() {
            return fault(format!("expected a finite angle in degrees, found {angle_deg}"));
        }
        if self.samples == 0 {
            if (angle_deg / 360.0).fract() == 0.0 {
                self.marks.push(0.0);
            }
        } else {
            let step_deg = angle_deg - self.last_deg;
            if step_deg.abs() >= LONGEST_STEP_DEG {
                let problem =
                    format!("expected an unwrapped angle, found a step from {}° to {angle_deg}°", self.last_deg);
                // One beyond a turn is none of an angle that begins at 0 again.
                let help = match step_deg.abs() {
                    step_deg if step_deg > WRAPPED_DEG => (self.samples > 1).then_some(CUT),
                    _ => Some(UNWRAP),
                };
                return Err(EncoderFault { sample: self.samples, problem, help });
            }
            if self.direction == 0.0 && step_deg != 0.0 {
                self.direction = step_deg.signum();
            }
            if step_deg * self.direction < 0.0 {
                let way = if self.direction > 0.0 { "rising" } else { "falling" };
                return fault(format!(
                    "expected the angle to go on {way}, found a step from {}° to {angle_deg}°",
                    self.last_deg
                ));
            }
            // Before the first movement nothing is known of its steps.
            if self.longest_step_deg > 0.0 && step_deg.abs() > 2.0 * self.longest_step_deg + JUMP_DEG {
                let problem = format!(
                    "expected steps like those before (up to {:.3}°), found a jump of {:.3} turns from {}° to \
                     {angle_deg}°; a recording whose zero moved cannot be averaged as one",
                    self.longest_step_deg,
                    step_deg / 360.0,
                    self.last_deg
                );
                return Err(EncoderFault { sample: self.samples, problem, help: Some(CUT) });
            }
            self.longest_step_deg = self.longest_step_deg.max(step_deg.abs());
            let (before, now) = (self.turns(self.last_deg), self.turns(angle_deg));
            let whole = before.floor() + 1.0;
            if whole <= now {
                let share = (whole - before) / (now - before);
                self.marks.push((self.samples - 1) as f64 + share);
            }
        }
        self.last_deg = angle_deg;
        self.samples += 1;
        Ok(())
    }

    /// An angle in turns, rising with time.
    #[must_use]
    pub fn turns(&self, angle_deg: f64) -> f64 {
        angle_deg / 360.0 * if self.direction < 0.0 { -1.0 } else { 1.0 }
    }

    /// Samples taken so far.
    #[must_use]
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Sample positions (fractional, ascending) at which the angle is a whole number of turns, linear between samples.
    #[must_use]
    pub fn marks(&self) -> &[f64] {
        &self.marks
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    fn scan(angles_deg: impl IntoIterator<Item = f64>) -> Result<EncoderScan, EncoderFault> {
        let mut scan = EncoderScan::default();
        angles_deg.into_iter().try_for_each(|angle| scan.push(angle))?;
        Ok(scan)
    }

    #[test]
    fn whole_turns_lie_between_samples() {
        let scan = scan([190.0, 330.0, 450.0, 540.0, 700.0, 720.0, 720.0, 721.0]).unwrap();
        assert_eq!(scan.marks(), [1.25, 5.0]);
    }

    #[test]
    fn a_falling_angle_is_turned_round() {
        let scan = scan((0..100).map(|sample| -f64::from(sample) * 7.0)).unwrap();
        assert_eq!(scan.marks().len(), 2);
        // −360° lies between samples 51 and 52, at 360/7.
        assert!((scan.marks()[1] - 360.0 / 7.0).abs() < 1e-12, "{:?}", scan.marks());
        assert!((scan.turns(-720.0) - 2.0).abs() < 1e-15);
    }

    #[test]
    fn a_jump_is_a_fault_that_names_sample_and_jump() {
        for way in [1.0, -1.0] {
            let jumping = |size_deg: f64| {
                scan(
                    (0..2000).map(|sample| way * (f64::from(sample) * 0.7 + if sample < 900 { 0.0 } else { size_deg })),
                )
            };
            let fault = jumping(108.0).unwrap_err();
            assert_eq!(fault.sample, 900);
            // 0.3 turn, and the 0.7° of the step itself.
            let expected = format!("jump of {:.3} turns", way * 108.7 / 360.0);
            assert!(fault.problem.contains(&expected), "{fault}");
            assert!(fault.help.is_some_and(|help| help.contains("cut the recording there")), "{fault}");
            // A turn that is missing.
            assert_eq!(jumping(360.0).unwrap_err().help, fault.help);
            assert!(jumping(20.0).is_err());
            assert!(jumping(1.0).is_ok(), "a line passed over is no jump");
        }
        // A start-up from rest, and an encoder of ten lines at nearly as many samples a turn.
        scan((0..2000).map(|sample| 0.01 * f64::from(sample * sample))).unwrap();
        scan((0..500).map(|sample| 36.0 * (f64::from(sample) * 10.0 / 9.5).floor())).unwrap();
    }

    #[test]
    fn wrapped_missing_and_backward_angles_are_faults() {
        let wrapped = scan([0.0, 120.0, 240.0, 0.0]).unwrap_err();
        assert_eq!((wrapped.sample, wrapped.help), (3, Some(UNWRAP)));
        assert_eq!(scan([0.0, 1.0, f64::NAN]).unwrap_err().sample, 2);
        assert_eq!(scan([5.0, 5.0, 4.0, 4.5]).unwrap_err().sample, 3);
    }
}
