//! Checks before a measurement: what else is known of the machine, compared with what is planned.

use runout_error::Result;
use runout_turning::{
    mains::Sampled,
    measurement::{Capture, Recording},
};

/// Compares a pipeline with knowledge of its own, for `check`. A pipeline names it in `[[check]]`; `run` does not ask it.
pub trait Check: Send + Sync {
    /// What the user should know before the measurement.
    ///
    /// # Errors
    /// When it cannot be computed.
    fn notes(&self, planned: &Planned) -> Result<Vec<String>>;
}

/// What is known of a campaign before it is evaluated.
#[derive(Debug, Clone, Copy, Default)]
pub struct Planned<'a> {
    /// Speeds at which the recording says that it was taken, in rpm; empty where there is none.
    pub speeds_rpm: &'a [f64],
}

/// Speeds nearer to each other than this are one, relative.
const SAME_SPEED: f64 = 0.005;

/// How each capture of a recording's first station is sampled that can be opened and says its speed.
pub fn captures_sampled(recording: &dyn Recording, setups: usize) -> Vec<Sampled> {
    let of = |setup| {
        let stream = recording.open(0, setup).ok()?;
        let capture = stream.capture();
        let turns = capture.marks.len().saturating_sub(1);
        Some(Sampled { speed_rpm: speed_rpm(capture)?, turns, rate_hz: capture.sample_rate_hz })
    };
    if recording.stations().is_empty() { Vec::new() } else { (0..setups).filter_map(of).collect() }
}

/// A capture's speed, in rpm: as stated, else from the marks and the sampling rate.
fn speed_rpm(capture: &Capture) -> Option<f64> {
    let turn = || Some(60.0 * capture.sample_rate_hz? / capture.median_turn_samples()?);
    capture.stated_speed_rpm.or_else(turn).map(f64::abs).filter(|speed| speed.is_finite() && *speed > 0.0)
}

/// The speeds of a recording, ascending: as stated, else from the marks and the sampling rate. Captures that cannot be opened or
/// say neither are left out.
pub fn speeds_of(recording: &dyn Recording, setups: usize) -> Vec<f64> {
    let places = (0..recording.stations().len()).flat_map(|station| (0..setups).map(move |setup| (station, setup)));
    let speed = |(station, setup)| {
        let stream = recording.open(station, setup).ok()?;
        speed_rpm(stream.capture())
    };
    let mut speeds: Vec<f64> = places.filter_map(speed).collect();
    speeds.sort_by(f64::total_cmp);
    speeds.dedup_by(|next, first| *next <= *first * (1.0 + SAME_SPEED));
    speeds
}
