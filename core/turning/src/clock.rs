//! The times of samples: the sampling rate, and whether it holds.

/// Times that are kept, to see at the end whether the rate held: at least half as many.
const MOST_PLACES: usize = 256;

/// Share of the duration by which a time may be off the line from the first to the last: clocks are better by far.
const LARGEST_DRIFT: f64 = 1e-3;

/// Finds the sampling rate and whether it holds.
#[derive(Debug, Clone)]
pub struct ClockScan {
    samples: u64,
    first_s: f64,
    last_s: f64,
    /// Of each so many samples one time is kept.
    stride: u64,
    /// Samples and their times.
    places: Vec<(u64, f64)>,
}

impl Default for ClockScan {
    fn default() -> Self {
        Self { samples: 0, first_s: 0.0, last_s: 0.0, stride: 1, places: Vec::with_capacity(MOST_PLACES) }
    }
}

impl ClockScan {
    /// Takes the time of the next sample, in s. It has to be where those before it lead, to half a step: rounding stays below, a lost
    /// sample does not.
    ///
    /// # Errors
    /// What was expected and found, where it is not.
    pub fn push(&mut self, time_s: f64) -> Result<(), String> {
        if self.samples == 0 {
            self.first_s = time_s;
        } else {
            if time_s <= self.last_s {
                return Err(format!("expected a time above {} s, found {time_s} s", self.last_s));
            }
            if self.samples > 1 {
                let step_s = (self.last_s - self.first_s) / (self.samples - 1) as f64;
                let expected_s = self.first_s + step_s * self.samples as f64;
                if (time_s - expected_s).abs() > 0.5 * step_s {
                    return Err(format!("expected even steps, the next at {expected_s} s, found {time_s} s"));
                }
            }
        }
        if self.samples.is_multiple_of(self.stride) {
            if self.places.len() == MOST_PLACES {
                self.stride *= 2;
                self.places.retain(|(sample, _)| sample.is_multiple_of(self.stride));
            }
            if self.samples.is_multiple_of(self.stride) {
                self.places.push((self.samples, time_s));
            }
        }
        self.last_s = time_s;
        self.samples += 1;
        Ok(())
    }

    /// The mean rate in Hz, where all times are where it leads: a rate that changes slowly has each time where those before it lead.
    ///
    /// # Errors
    /// What was expected and found, where the rate changes.
    pub fn rate_hz(&self) -> Result<Option<f64>, String> {
        if self.samples < 2 {
            return Ok(None);
        }
        let duration_s = self.last_s - self.first_s;
        let step_s = duration_s / (self.samples - 1) as f64;
        let drift_s = |(sample, time_s): &(u64, f64)| time_s - self.first_s - step_s * *sample as f64;
        let largest = self.places.iter().max_by(|one, other| drift_s(one).abs().total_cmp(&drift_s(other).abs()));
        match largest.map(|place| (place.0, drift_s(place))) {
            Some((sample, drift_s)) if drift_s.abs() > step_s.max(LARGEST_DRIFT * duration_s) => Err(format!(
                "expected even steps, found sample {sample} {} s {} where steps of {step_s:.6e} s lead: the sampling rate changes",
                (drift_s.abs() * 1e6).round() / 1e6,
                if drift_s > 0.0 { "after" } else { "before" },
            )),
            _ => Ok(Some(1.0 / step_s)),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    fn rate(times: impl IntoIterator<Item = f64>) -> Result<Option<f64>, String> {
        let mut scan = ClockScan::default();
        times.into_iter().try_for_each(|time_s| scan.push(time_s))?;
        scan.rate_hz()
    }

    #[test]
    fn even_times_give_a_rate() {
        let found = rate((0..5000).map(|sample| 2.0 + f64::from(sample) / 512.0)).unwrap().unwrap();
        assert!((found - 512.0).abs() < 1e-9, "{found}");
        // A tenth of a step to and fro, as a program's own time stamps have it.
        let jitter = |sample: i32| (f64::from(sample) + 0.1 * f64::from(sample % 3 - 1)) / 512.0;
        assert!((rate((0..5000).map(jitter)).unwrap().unwrap() / 512.0 - 1.0).abs() < 1e-4);
        assert_eq!(rate([0.0]), Ok(None));
    }

    #[test]
    fn uneven_times_are_refused() {
        assert!(rate([0.0, 1.0, 3.0]).unwrap_err().contains("even steps"));
        assert!(rate([0.0, 1.0, 1.0]).unwrap_err().contains("a time above 1 s"));
        let slower = |sample: i32| f64::from(sample) * (1.0 + 1e-5 * f64::from(sample));
        assert!(rate((0..5000).map(slower)).unwrap_err().contains("the sampling rate changes"));
    }
}
