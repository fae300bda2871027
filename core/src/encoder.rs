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
    marks: Vec<f64>,
}

/// An angle that no encoder on a turning spindle gives.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{problem}")]
pub struct EncoderFault {
    /// The sample, counted from 0.
    pub sample: u64,
    /// What was expected and what was found.
    pub problem: String,
}

/// A longer step between two samples leaves open which way the spindle went.
const LONGEST_STEP_DEG: f64 = 180.0;

impl EncoderScan {
    /// Takes the next sample's angle.
    ///
    /// # Errors
    /// When it is not finite, jumps by half a turn or more, or goes back.
    pub fn push(&mut self, angle_deg: f64) -> Result<(), EncoderFault> {
        let fault = |problem| Err(EncoderFault { sample: self.samples, problem });
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
                return fault(format!(
                    "expected an unwrapped angle, found a step from {}° to {angle_deg}°",
                    self.last_deg
                ));
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
        let scan = scan([350.0, 358.0, 366.0, 540.0, 700.0, 720.0, 720.0, 721.0]).unwrap();
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
    fn wrapped_missing_and_backward_angles_are_faults() {
        assert_eq!(scan([0.0, 120.0, 240.0, 0.0]).unwrap_err().sample, 3);
        assert_eq!(scan([0.0, 1.0, f64::NAN]).unwrap_err().sample, 2);
        assert_eq!(scan([5.0, 5.0, 4.0, 4.5]).unwrap_err().sample, 3);
    }
}
