//! The once-per-turn mark as an analogue trace: where it crosses a threshold, between two samples.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::rig::Rig;
use runout_error::fault::Fault;
use runout_numerics::statistics::median;

/// `marker = { channel = "MARK", threshold = 2.5, hysteresis = 0.5, edge = "rising" }` of a loader.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Marker {
    /// Name of the channel with the trace.
    pub channel: String,
    /// Where the trace crosses this value a turn begins, in the unit of the channel.
    pub threshold: f64,
    /// How far the trace must have been on the other side of the threshold before it counts again, in the unit of the
    /// channel: more than its noise, peak to valley.
    pub hysteresis: f64,
    /// Which of the two crossings of a pulse counts.
    #[serde(default)]
    pub edge: Edge,
}

/// A crossing's direction.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Edge {
    /// From below the threshold to above it.
    #[default]
    Rising,
    /// From above the threshold to below it.
    Falling,
}

impl Marker {
    /// Checks the values, and that the channel is no sensor of the rig.
    ///
    /// # Errors
    /// The first value that cannot be.
    pub fn check_with(&self, rig: Option<&Rig>) -> Result<(), Fault> {
        if rig.is_some_and(|rig| rig.sensor(&self.channel).is_some()) {
            let message = format!("`{}` is a sensor of the rig; expected the channel with the mark", self.channel);
            return Err(Fault::at("channel", message));
        }
        if self.channel.is_empty() {
            return Err(Fault::at("channel", "expected the name of the channel with the mark, found none"));
        }
        if !self.threshold.is_finite() {
            return Err(Fault::at("threshold", format!("expected a finite number, found {}", self.threshold)));
        }
        if !(self.hysteresis.is_finite() && self.hysteresis >= 0.0) {
            let message = format!("expected a number of at least 0, found {}", self.hysteresis);
            return Err(Fault::at("hysteresis", message).help("take more than the noise of the trace, peak to valley"));
        }
        Ok(())
    }
}

/// Where turns begin.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Marks {
    /// Sample positions, ascending.
    pub at: Vec<f64>,
    /// To how many samples each is known; 0 where it is timed between two samples.
    pub within_samples: f64,
}

/// Share of a pulse's height from which the step between two samples is a flank without a sample on it.
const WHOLE_FLANK: f64 = 0.9;
/// Such a flank is somewhere between a sample and the next.
const HALF_A_SAMPLE: f64 = 0.5;

/// Finds the marks of a trace, sample by sample.
#[derive(Debug, Clone)]
pub struct MarkerScan {
    marker: Marker,
    samples: u64,
    last: f64,
    /// Whether the trace has been far enough on the other side since the last mark.
    armed: bool,
    lowest: f64,
    highest: f64,
    marks: Vec<f64>,
    /// What the trace gains from the sample before each mark to the one behind it.
    steps: Vec<f64>,
}

impl MarkerScan {
    /// Before the first sample.
    #[must_use]
    pub fn new(marker: &Marker) -> Self {
        Self {
            marker: marker.clone(),
            samples: 0,
            last: f64::NAN,
            armed: false,
            lowest: f64::INFINITY,
            highest: f64::NEG_INFINITY,
            marks: Vec::new(),
            steps: Vec::new(),
        }
    }

    /// Takes the next sample.
    ///
    /// # Errors
    /// What was expected and what was found, where it is not a finite number.
    pub fn push(&mut self, value: f64) -> Result<(), String> {
        if !value.is_finite() {
            return Err(format!("expected a finite number in the trace of the mark, found {value}"));
        }
        let Marker { threshold, hysteresis, edge, .. } = self.marker;
        // How far beyond the threshold, in the direction that counts.
        let beyond = |value: f64| match edge {
            Edge::Rising => value - threshold,
            Edge::Falling => threshold - value,
        };
        let (before, now) = (beyond(self.last), beyond(value));
        if self.armed && now >= 0.0 {
            // Armed is only a trace that was below; NaN and a step of 0 cannot be here.
            self.marks.push((self.samples - 1) as f64 + before / (before - now));
            self.steps.push(now - before);
            self.armed = false;
        }
        self.armed |= now < 0.0 && now <= -hysteresis;
        (self.lowest, self.highest) = (self.lowest.min(value), self.highest.max(value));
        self.last = value;
        self.samples += 1;
        Ok(())
    }

    /// Where turns begin. A rectangular pulse has no sample on its flank: it crosses anywhere between two samples, whatever the threshold.
    ///
    /// # Errors
    /// Where no two crossings were found; the message says what the trace holds.
    pub fn marks(self) -> Result<Marks, String> {
        let Marker { threshold, hysteresis, .. } = self.marker;
        if self.marks.len() < 2 {
            return Err(format!(
                "expected a mark each turn in the trace `{}`, found {}: it lies from {} to {}, the threshold is {threshold} with a \
                 hysteresis of {hysteresis}",
                self.marker.channel,
                self.marks.len(),
                self.lowest,
                self.highest,
            ));
        }
        if median(self.steps) < WHOLE_FLANK * (self.highest - self.lowest) {
            return Ok(Marks { at: self.marks, within_samples: 0.0 });
        }
        // On the threshold itself the crossing is the later sample.
        let halfway = |mark: f64| (mark.ceil() - HALF_A_SAMPLE).max(0.0);
        Ok(Marks { at: self.marks.into_iter().map(halfway).collect(), within_samples: HALF_A_SAMPLE })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::float_cmp, reason = "tests of small exact numbers")]

    use super::*;

    fn marks(edge: Edge, hysteresis: f64, trace: &[f64]) -> Result<Vec<f64>, String> {
        let marker = Marker { channel: "MARK".into(), threshold: 2.0, hysteresis, edge };
        marker.check_with(None).unwrap();
        let mut scan = MarkerScan::new(&marker);
        trace.iter().try_for_each(|value| scan.push(*value))?;
        scan.marks().map(|marks| marks.at)
    }

    #[test]
    fn crossings_lie_between_samples() {
        let pulses = [0.0, 4.0, 4.0, 1.0, 0.0, 1.0, 5.0, 0.0];
        assert_eq!(marks(Edge::Rising, 0.5, &pulses).unwrap(), [0.5, 5.25]);
        // From 4 to 1, and from 5 to 0.
        assert_eq!(marks(Edge::Falling, 0.5, &pulses).unwrap(), [2.0 + 2.0 / 3.0, 6.6]);
        // On the threshold itself.
        assert_eq!(marks(Edge::Rising, 0.0, &[0.0, 2.0, 2.0, 0.0, 3.0]).unwrap(), [1.0, 3.0 + 2.0 / 3.0]);
    }

    /// Rectangular pulses, also with noise on them, are known to half a sample; pulses with samples on their flanks are timed.
    #[test]
    fn a_flank_without_a_sample_is_known_to_half_a_sample() {
        let within = |trace: &dyn Fn(usize) -> f64| {
            let marker = Marker { channel: "MARK".into(), threshold: 2.5, hysteresis: 0.5, edge: Edge::Rising };
            let mut scan = MarkerScan::new(&marker);
            (0..2000).try_for_each(|sample| scan.push(trace(sample))).unwrap();
            scan.marks().unwrap()
        };
        let noise = |sample: usize| 0.02 * ((sample * 7919 % 101) as f64 / 50.0 - 1.0);
        let rectangular = within(&|sample| if sample % 500 > 480 { 5.0 } else { 0.0 } + noise(sample));
        assert_eq!((rectangular.within_samples, rectangular.at[..2].to_vec()), (0.5, vec![480.5, 980.5]));
        let rounded =
            within(&|sample| (2.5 + 0.9 * ((sample as f64 * 1.002) % 500.0 - 480.0)).clamp(0.0, 5.0) + noise(sample));
        assert_eq!((rounded.within_samples, rounded.at.len()), (0.0, 4));
    }

    #[test]
    fn noise_on_a_slope_counts_once() {
        let noisy = [0.0, 1.8, 2.1, 1.9, 2.2, 4.0, 2.1, 1.9, 2.1, 0.0, 4.0];
        assert_eq!(marks(Edge::Rising, 0.5, &noisy).unwrap().len(), 2);
        assert_eq!(marks(Edge::Rising, 0.0, &noisy).unwrap().len(), 4);
    }

    /// A pulse that is up from the start began nobody knows when.
    #[test]
    fn the_first_pulse_needs_its_beginning() {
        assert_eq!(marks(Edge::Rising, 0.5, &[4.0, 4.0, 0.0, 4.0, 0.0, 4.0]).unwrap(), [2.5, 4.5]);
        assert_eq!(marks(Edge::Falling, 0.5, &[0.0, 0.0, 4.0, 0.0, 4.0, 0.0]).unwrap(), [2.5, 4.5]);
    }

    #[test]
    fn what_the_trace_holds_is_said_where_it_has_no_marks() {
        let found = marks(Edge::Rising, 0.5, &[0.1, 0.4, 0.1, 0.4]).unwrap_err();
        assert!(found.contains("`MARK`, found 0: it lies from 0.1 to 0.4, the threshold is 2"), "{found}");
        assert!(marks(Edge::Rising, 0.5, &[]).is_err());
        assert!(marks(Edge::Rising, 0.5, &[0.0, f64::NAN]).unwrap_err().contains("finite"));
        assert!(marks(Edge::Rising, 0.5, &[0.0, f64::INFINITY]).is_err());
        // A hysteresis larger than the pulse.
        assert!(marks(Edge::Rising, 3.0, &[0.0, 4.0, 0.0, 4.0]).unwrap_err().contains("hysteresis of 3"));
        let wrong = Marker { channel: "M".into(), threshold: f64::NAN, hysteresis: 0.0, edge: Edge::Rising };
        assert!(wrong.check_with(None).is_err());
        assert!(Marker { threshold: 1.0, hysteresis: -1.0, ..wrong.clone() }.check_with(None).is_err());
        assert!(Marker { threshold: 1.0, channel: String::new(), ..wrong }.check_with(None).is_err());
    }
}
