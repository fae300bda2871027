//! Synchronous average: every turn is resampled in angle; the turns are averaged and taken apart into harmonics.
//!
//! Each turn, from one index mark to the next or through one turn of the encoder, is interpolated on equal angles
//! ([`kernel`]), fine enough that nothing the recording can hold folds onto a kept order. Sums over the turns, for their
//! mean and its covariance across channels ([`slow`]), are accumulated in one pass ([`mean`]) and then transformed. Of the
//! harmonics, those that `samples_per_rev` equal angles can hold are kept: leaving out the rest is the anti-alias filter.
//! Some turns are transformed by themselves, for their scatter ([`scatter`]). Where the part's surface is interrupted,
//! readings are bridged before anything is interpolated between them ([`interruptions`]), and each turn once more
//! ([`bridge`]).

mod angle_scatter;
mod angle_unit;
mod bridge;
mod encoder;
mod kernel;
mod level;
mod low_orders;
mod marks;
mod mean;
mod outliers;
mod passed;
mod resample;
mod scatter;
mod size;
mod slow;
mod split;
mod spread;
mod turns;
mod window;

use runout_core::{
    Error, ErrorKind, Result,
    fault::Fault,
    measurement::{Block, Capture, Response, SampleStream},
    near_tone::NearTone,
    numerics::fourier,
    pipeline::{Context, StageConfig},
    profile::{Profile, TurnCount},
    rig::Rig,
    stage::{AverageRequest, Averager, Preprocessor},
};
use schemars::JsonSchema;
use serde::Deserialize;

use kernel::{Kernel, PASS_BAND};
use marks::{angle_std_rad, known_within, turn_angle_std_rad};
use resample::{CaptureAverage, Resampling};
use turns::Turn;

use self::angle_unit::AngleUnit;
use crate::{interruptions, low_pass::significant};

/// Averages whole turns, one harmonic at a time, with the covariance across channels.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SynchronousAverageConfig {
    /// Equal angles per turn of the average, 4 to 131072; it has the orders below half of them, as far as the recording
    /// has them. Above 4096, and far above the recording's own samples a turn (8 times, rounded up to a power of two), fewer are
    /// used, with a warning.
    pub samples_per_rev: usize,
    /// Fewest turns that make an average, at least 1; the covariance needs 2.
    #[serde(default = "default_min_turns")]
    pub min_turns: usize,
    /// Turns whose length is off the capture's median by more are left out, in percent, below 50.
    #[serde(default = "default_turn_tolerance")]
    pub turn_tolerance_percent: f64,
    /// Turns are left out whose distance (root mean square over the turn, any channel) from the median turn around them
    /// is more than this many times the usual distance; without it, none are.
    #[serde(default)]
    pub outlier_sigma: Option<f64>,
    /// A mean speed that differs from the stated one by more is a warning, in percent.
    #[serde(default = "default_speed_tolerance")]
    pub speed_tolerance_percent: f64,
}

fn default_min_turns() -> usize {
    5
}

fn default_turn_tolerance() -> f64 {
    5.0
}

fn default_speed_tolerance() -> f64 {
    2.0
}

impl StageConfig for SynchronousAverageConfig {
    type Stage = Preprocessor;

    const NAME: &'static str = "synchronous-average";
    const ABOUT: &'static str = "averages turns on equal angles, one harmonic at a time, with their covariance";

    fn check(self, context: &Context) -> std::result::Result<Preprocessor, Fault> {
        let expect = |good: bool, key: &str, expected: &str, found: &dyn std::fmt::Display| {
            if good { Ok(()) } else { Err(Fault::at(key, format!("expected {expected}, found {found}"))) }
        };
        let samples = self.samples_per_rev;
        expect((4..=MOST_SAMPLES_PER_REV).contains(&samples), "samples_per_rev", "4 to 131072", &samples)?;
        expect(self.min_turns >= 1, "min_turns", "at least 1", &self.min_turns)?;
        let percent = self.turn_tolerance_percent;
        expect(percent > 0.0 && percent < 50.0, "turn_tolerance_percent", "a percentage above 0, below 50", &percent)?;
        let percent = self.speed_tolerance_percent;
        expect(percent > 0.0 && percent.is_finite(), "speed_tolerance_percent", "a percentage above 0", &percent)?;
        if let Some(sigma) = self.outlier_sigma {
            expect(sigma > 1.0 && sigma.is_finite(), "outlier_sigma", "a factor above 1", &sigma)?;
        }
        let rig = interruptions::interrupted(context.rig);
        Ok(Preprocessor::Averager(Box::new(SynchronousAverage { config: self, kernel: Kernel::new(), rig })))
    }
}

/// The checked synchronous average.
#[derive(Debug, Clone)]
pub struct SynchronousAverage {
    config: SynchronousAverageConfig,
    kernel: Kernel,
    /// Where the part's surface is interrupted somewhere.
    rig: Option<Rig>,
}

impl SynchronousAverage {
    /// That enough turns are left, or which were not and why.
    fn enough(&self, capture: &Capture, turns: &TurnCount, usable: usize) -> Result<()> {
        let wanted = self.config.min_turns;
        if usable >= wanted {
            return Ok(());
        }
        let mut problem = format!("{usable} of {} turns can be used, min_turns = {wanted}", turns.recorded);
        let reasons = turns::reasons(capture, turns);
        if !reasons.is_empty() {
            problem = format!("{problem}; {}", reasons.join("; "));
        }
        let help = if capture.encoder && turns.recorded < wanted {
            "record more turns, or lower min_turns; is the encoder's angle in degrees? In radians or in turns it grows too slowly"
        } else if turns.recorded == 0 {
            "record a once-per-turn mark or the encoder's angle: a turn is what lies between two marks"
        } else {
            "record more turns, mend what is named above, or lower min_turns"
        };
        Err(Error::new("average", &capture.object, problem).of(ErrorKind::InsufficientData).help(help))
    }

    /// That the marks make turns.
    fn are_turns(capture: &Capture) -> Result<()> {
        let Some(turn) = capture.median_turn_samples() else { return Ok(()) };
        let error = |problem| Error::new("average", &capture.object, problem);
        if turn < SHORTEST_TURN {
            let problem = format!("its median turn is {turn:.4} samples long, at least {SHORTEST_TURN} are needed");
            let help = "are the marks sample positions? Marks in seconds are to be multiplied by the sampling rate";
            return Err(error(problem).help(help));
        }
        Ok(())
    }

    fn warnings(&self, capture: &Capture, speed_rpm: Option<f64>, outcome: &CaptureAverage) -> Vec<String> {
        let mut warnings = Vec::new();
        if let (Some(measured), Some(stated)) = (speed_rpm, capture.stated_speed_rpm) {
            let tolerance_percent = self.config.speed_tolerance_percent;
            if (measured - stated).abs() > 0.01 * tolerance_percent * stated.abs() {
                warnings.push(format!(
                    "{}: the turns are {measured:.1} rpm, the recording states {stated:.1} rpm",
                    capture.object
                ));
            }
        }
        let Some(turn) = capture.median_turn_samples() else { return warnings };
        let angles = self.config.samples_per_rev.min(most_angles(turn));
        if angles < self.config.samples_per_rev {
            warnings.push(format!(
                "`samples_per_rev` = {} is far above the {turn:.0} samples of a turn: results are given on {angles} angles",
                self.config.samples_per_rev
            ));
        }
        if self.max_order() > orders_held(turn) {
            warnings.push(format!(
                "{turn:.0} samples a turn have no orders above {}: the average ends there, on {} angles",
                orders_held(turn),
                angles
            ));
        }
        warnings.extend(outcome.angle_scatter.and_then(|one| one.said(orders_held(turn) + 1, &capture.object)));
        if outcome.absent_um > 0.0 {
            warnings.push(format!(
                "{}: orders above {}, the highest of `samples_per_rev` = {}, have {} µm rms: they are in no value",
                capture.object,
                self.max_order(),
                self.config.samples_per_rev,
                significant(outcome.absent_um, 2)
            ));
        }
        let passed = outcome.passed.as_deref();
        if let Some(passed) = passed.and_then(|passed| passed[..passed::held(passed)].last()) {
            warnings.push(format!(
                "{}: {turn:.0} samples a turn carry orders to {} through the resampling in angle; those above are divided by what passes, \
                 {:.0} % of the highest one, and their noise with them",
                capture.object,
                (PASS_BAND * 0.5 * turn) as usize,
                100.0 * passed.norm()
            ));
        }
        warnings
    }

    /// Whether interpolation between samples weakens orders that are to be kept, and nothing before it has.
    fn is_weakened(&self, capture: &Capture) -> bool {
        let Some(turn) = capture.median_turn_samples() else { return false };
        let filtered = |rate_hz: f64| {
            let band_hz = PASS_BAND * 0.5 * rate_hz;
            capture.responses.iter().any(|response| response.half_power_hz <= band_hz)
        };
        let highest = self.max_order().min(orders_held(turn));
        highest > (PASS_BAND * 0.5 * turn) as usize && !capture.sample_rate_hz.is_some_and(filtered)
    }
}

/// Asynchronous motion below this, in µm rms, is not said.
const SAID_UM: f64 = 0.01;

/// Says what marks add to asynchronous motion that turn single turns.
fn jitter_of_marks(profile: &Profile) -> Option<String> {
    (profile.jitter_um() >= SAID_UM).then(|| {
        format!(
            "{}: the marks turn single turns by {}° (std), which with an eccentricity of {} µm adds about {} µm rms to asynchronous motion; time the \
             marks between samples, record the encoder's angle, or centre the part",
            profile.object,
            significant(profile.turn_angle_std_rad.to_degrees(), 2),
            significant(profile.eccentricity_um(), 3),
            significant(profile.jitter_um(), 2)
        )
    })
}

/// Says which tones the average takes for synchronous.
fn near_synchronous(tones: &[NearTone], turns: usize, object: &str) -> Option<String> {
    let size = |tone: &NearTone| tone.leak.iter().map(|leak| leak.norm()).fold(0.0, f64::max);
    let largest = tones.iter().max_by(|a, b| size(a).total_cmp(&size(b)))?;
    let others = if tones.len() > 1 { format!(" (and {} more)", tones.len() - 1) } else { String::new() };
    Some(format!(
        "{object}: a tone at {:.4} of a turn is {:.2} periods over the record from order {}{others}: it puts up to {:.4} µm into the \
         average, which the stated uncertainties include; record more turns",
        largest.order as f64 + largest.off / turns as f64,
        largest.off.abs(),
        largest.order,
        size(largest),
    ))
}

/// Highest order that turns of this many samples hold, below Nyquist as for whole numbers of samples.
fn orders_held(turn_samples: f64) -> usize {
    (0.5 * (turn_samples - 1.0)) as usize
}

/// Equal angles on which results are given, at most: this many times the samples of a turn, rounded up to a power of two, or the
/// second number where that is larger. More show nothing else.
const MOST_ANGLES: (usize, usize) = (8, 4096);

/// That number for turns of this many samples.
fn most_angles(turn_samples: f64) -> usize {
    let (times, fewest) = MOST_ANGLES;
    let turn = (turn_samples.ceil() as usize).checked_next_power_of_two().unwrap_or(usize::MAX);
    turn.saturating_mul(times).max(fewest)
}

/// Most that are asked for: what a rig sees of each order below half of them is evaluated before anything is read, in 0.5 kB an order.
const MOST_SAMPLES_PER_REV: usize = 131_072;
/// Fewest samples that a turn may have: fewer come from marks in another unit.
const SHORTEST_TURN: f64 = 8.0;
/// A filter below this order weakens the form from its lowest order on.
const FORM_FROM_ORDER: f64 = 2.0;

/// Says of each filter at which order it is −3 dB, and warns of those that take the form away.
fn in_orders(responses: &mut [Response], speed_rpm: f64, object: &str, warnings: &mut Vec<String>) {
    for response in responses {
        let order = response.half_power_hz * 60.0 / speed_rpm;
        response.description = format!("{} = order {}", response.description, significant(order, 3));
        if order < FORM_FROM_ORDER {
            warnings.push(format!("{object}: the filter removes the form itself: {}", response.description));
        }
    }
}

impl Averager for SynchronousAverage {
    fn max_order(&self) -> usize {
        fourier::max_order(self.config.samples_per_rev)
    }

    fn average_requested(&self, input: Box<dyn SampleStream + '_>, wanted: AverageRequest) -> Result<Profile> {
        let mut input = interruptions::bridged(input, self.rig.as_ref());
        let mut capture = input.capture().clone();
        Self::are_turns(&capture)?;
        let first_turn = capture.first_turn();
        let turns = turns::cut(&capture, 0.01 * self.config.turn_tolerance_percent);
        let mut count = TurnCount {
            recorded: turns.len() + capture.trimmed.iter().map(|trim| trim.turns).sum::<usize>(),
            trimmed: capture.trimmed.clone(),
            ..TurnCount::default()
        };
        let mut usable: Vec<Turn> = Vec::with_capacity(turns.len());
        for (index, (turn, rejection)) in turns.into_iter().enumerate() {
            match rejection {
                None => usable.push(Turn { number: first_turn + index, ..turn }),
                Some(reason) => count.rejected.push(turn.rejected(first_turn + index, reason)),
            }
        }
        // Before anything is read: with too few marks a single turn could be larger than memory.
        self.enough(&capture, &count, usable.len())?;

        let mut resampling = Resampling::new(self, &capture, usable, wanted);
        let mut block = Block::default();
        let mut angle_unit = AngleUnit::new(&capture);
        while input.next_block(&mut block)? {
            angle_unit.take(&block);
            resampling.take(&mut block);
        }
        let of_angle = angle_unit.check(&capture.object)?;
        let mut outcome = resampling.finish();
        count.used = outcome.used;
        count.rejected.append(&mut outcome.rejected);
        count.rejected.sort_by_key(|turn| turn.turn);
        self.enough(&capture, &count, count.used)?;

        let left_out_um = capture
            .median_turn_samples()
            .map_or(0.0, |turn| resample::restore(&mut outcome, orders_held(turn) + 1, capture.channels()));
        let most_angles = capture.median_turn_samples().map_or(usize::MAX, most_angles);
        let mean_turn = outcome.used_samples / outcome.used as f64;
        let speed_rpm = capture.sample_rate_hz.map(|rate_hz| 60.0 * rate_hz / mean_turn);
        let mut warnings = self.warnings(&capture, speed_rpm, &outcome);
        warnings.extend(of_angle);
        warnings.extend(near_synchronous(&outcome.near_tones, count.used, &capture.object));
        warnings.extend(outcome.bridged.map(|bridged| format!("{}: {bridged}", capture.object)));
        if let Some(speed_rpm) = speed_rpm {
            in_orders(&mut capture.responses, speed_rpm, &capture.object, &mut warnings);
        }
        let marks_within = known_within(&capture);
        let by_marks = || turn_angle_std_rad(&capture.marks, marks_within);
        let mut profile = Profile {
            object: capture.object,
            setup: capture.setup,
            sensors: capture.sensors,
            samples_per_rev: self.config.samples_per_rev.min(most_angles),
            turn_angles: outcome.turn_angles,
            mean: outcome.mean,
            covariance: outcome.covariance,
            scatter: outcome.scatter,
            scatter_beside: outcome.scatter_beside,
            near_tones: outcome.near_tones,
            levels: outcome.levels,
            course: outcome.course,
            recounted: None,
            split: outcome.split,
            spread: outcome.spread,
            turns: count,
            angle_std_rad: angle_std_rad(&capture.marks, marks_within),
            turn_angle_std_rad: outcome.angle_scatter.map_or_else(by_marks, |scatter| scatter.std_rad()),
            speed_rpm,
            sample_rate_hz: capture.sample_rate_hz,
            responses: capture.responses,
            bridged_beyond_rad: outcome.bridged_beyond_rad,
            absent_um: outcome.absent_um.max(left_out_um),
            warnings,
        };
        if profile.spread.is_some() {
            let said = jitter_of_marks(&profile);
            profile.warnings.extend(said);
        }
        Ok(profile)
    }
}

#[cfg(test)]
mod tests;
