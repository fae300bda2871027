//! From samples to the harmonics of each turn, block by block.

use std::{collections::VecDeque, f64::consts::TAU};

use runout_core::{
    Complex64,
    consistency::turns::TurnCourse,
    measurement::{Block, Capture, Defect},
    near_tone::{NearTone, near_tones},
    numerics::{fourier::max_order, lanes::fused},
    profile::{RejectedTurn, Rejection, Split, TurnLevels},
    spread::Spread,
    stage::AverageRequest,
};

use super::{
    SynchronousAverage,
    angle_scatter::AngleScatter,
    bridge::Bridges,
    encoder,
    kernel::{Interpolation, Kernel, REACH, on_sample},
    mean::{Analysis, beyond_noise},
    orders_held,
    outliers::{Outliers, PendingTurn, Verdict},
    passed::{self, Fractions},
    size::Size,
    split::{self, Means},
    spread::Motion,
    turns::{ROUNDING, Turn},
    window::{CONTINUED, Window},
};
use crate::interruptions::GUARD;

/// What the samples of a capture gave.
pub(super) struct CaptureAverage {
    /// Equal angles on which the turns were taken apart.
    pub turn_angles: usize,
    pub mean: Vec<Complex64>,
    pub covariance: Option<Vec<Complex64>>,
    pub scatter: Option<Vec<Complex64>>,
    pub scatter_beside: Option<Vec<Complex64>>,
    pub near_tones: Vec<NearTone>,
    pub levels: TurnLevels,
    pub course: TurnCourse,
    pub split: Option<Split>,
    pub spread: Option<Spread>,
    pub used: usize,
    /// Length of all turns used together.
    pub used_samples: f64,
    pub rejected: Vec<RejectedTurn>,
    /// What is not known where readings are bridged.
    pub bridged: Option<String>,
    /// By how much interruptions are wider at each end than the rig declares.
    pub bridged_beyond_rad: f64,
    /// What passes of each order where the interpolation weakens some that are kept.
    pub passed: Option<Vec<Complex64>>,
    /// What is above the orders that are kept, beyond noise.
    pub absent_um: f64,
    /// By how much turns are turned against each other, where that shows.
    pub angle_scatter: Option<AngleScatter>,
}

/// The resampling of one capture under way. All buffers live as long as it.
pub(super) struct Resampling<'a> {
    kernel: &'a Kernel,
    capture: &'a Capture,
    turns: VecDeque<Turn>,
    window: Window,
    defects: Vec<Defect>,
    positions: Vec<f64>,
    /// Equal angles of a turn.
    angles: usize,
    /// Their numbers: to make them anew for every turn takes longer than to read them.
    counted: Vec<f64>,
    /// Where channels look into an interruption of the surface.
    bridges: Bridges,
    /// By how much these are wider at each end than the rig declares.
    beyond_rad: f64,
    analysis: Analysis,
    /// One turn's harmonics, `[channel][order]`.
    harmonics: Vec<Complex64>,
    /// Motion of the axis in single turns, where wanted.
    motion: Option<Motion>,
    means: Means,
    outliers: Option<Outliers>,
    used_samples: f64,
    rejected: Vec<RejectedTurn>,
    /// Where positions lie between samples, where that weakens orders that are kept.
    fractions: Option<Fractions>,
}

impl<'a> Resampling<'a> {
    /// `turns` are those that the marks allow, in order.
    pub(super) fn new(
        average: &'a SynchronousAverage,
        capture: &'a Capture,
        turns: Vec<Turn>,
        wanted: AverageRequest,
    ) -> Self {
        let config = &average.config;
        let (angles, on_samples) = angles(&turns, config.samples_per_rev, capture.encoder);
        // Angles that the recording does not have hold no further orders.
        let (channels, orders) = (capture.channels().max(1), max_order(config.samples_per_rev.min(angles)) + 1);
        // The samples that are bridged with the interruption, and what is interpolated between one of them and the next.
        let beyond = GUARD + usize::from(!on_samples);
        let beyond_rad = capture.median_turn_samples().map_or(0.0, |turn| TAU * beyond as f64 / turn);
        let (size, planned) = (Size { channels, angles, orders }, turns.len());
        let motion = wanted.projection.and_then(|wanted| Motion::new(wanted, &capture.sensors, angles));
        Self {
            kernel: &average.kernel,
            capture,
            turns: turns.into(),
            window: Window::new(channels),
            defects: Vec::new(),
            positions: Vec::with_capacity(angles),
            angles,
            counted: (0..angles).map(|angle| angle as f64).collect(),
            bridges: Bridges::new(average.rig.as_ref(), capture, angles, beyond_rad),
            beyond_rad,
            analysis: Analysis::new(angles, orders),
            harmonics: vec![Complex64::ZERO; orders * channels],
            means: Means::new(size, planned, wanted.hold_out, motion.as_ref().map(Motion::spread)),
            motion,
            outliers: config.outlier_sigma.map(|sigma| Outliers::new(sigma, channels)),
            used_samples: 0.0,
            rejected: Vec::new(),
            fractions: (!on_samples && average.is_weakened(capture)).then_some(Fractions::NONE),
        }
    }

    /// Takes a block and works on every turn that is now complete.
    pub(super) fn take(&mut self, block: &mut Block) {
        let Some(turn) = self.turns.front() else { return };
        self.window.take(block, before(turn));
        self.defects.append(&mut block.defects);
        self.work();
    }

    fn work(&mut self) {
        while let Some(turn) = self.turns.pop_front() {
            if self.window.end() < behind(&turn) {
                self.turns.push_front(turn);
                return;
            }
            if before(&turn) < self.window.start() {
                self.window.continue_before();
            }
            if before(&turn) < self.window.start() {
                self.rejected.push(turn.rejected(turn.number, Rejection::Incomplete));
            } else {
                self.turn(turn);
            }
            self.defects.retain(|defect| defect.samples.end as f64 > turn.end - REACH as f64 - 1.0);
        }
    }

    /// Works on what only the end of the capture completes.
    pub(super) fn finish(mut self) -> CaptureAverage {
        let recorded = self.window.end() as f64 - CONTINUED as f64;
        self.window.continue_behind();
        let (covered, cut): (Vec<Turn>, Vec<Turn>) =
            self.turns.drain(..).partition(|turn| turn.end <= recorded + ROUNDING);
        self.turns.extend(covered);
        self.work();
        for turn in self.turns.iter().chain(&cut) {
            self.rejected.push(turn.rejected(turn.number, Rejection::Incomplete));
        }
        if let Some(mut outliers) = self.outliers.take() {
            let mut judged = Vec::new();
            outliers.judge_rest(&mut self.means, &mut judged);
            self.sort(judged);
        }
        self.means.sum_up();
        let neighbours = self.means.whole.neighbours();
        let mean = self.means.whole.mean();
        let covariance = self.means.whole.covariance(neighbours.as_ref());
        let held = self.capture.median_turn_samples().map_or(0, |turn| orders_held(turn) + 1);
        CaptureAverage {
            absent_um: self.means.whole.absent_um(covariance.as_deref(), held),
            turn_angles: self.angles,
            angle_scatter: self.means.whole.angle_scatter(&mean, !self.capture.encoder),
            mean,
            covariance,
            near_tones: neighbours.as_ref().map(near_tones).unwrap_or_default(),
            scatter: self.means.whole.scatter(),
            scatter_beside: self.means.scatter_beside(),
            used: self.means.whole.turns(),
            levels: self.means.levels(),
            course: self.means.low_orders().course(),
            split: self.means.split(neighbours.as_ref()),
            spread: self.means.spread(),
            used_samples: self.used_samples,
            rejected: self.rejected,
            bridged_beyond_rad: if self.bridges.any() { self.beyond_rad } else { 0.0 },
            bridged: self.bridges.warning(),
            passed: self.fractions.zip(self.capture.median_turn_samples()).map(|(fractions, turn_samples)| {
                fractions.passed(self.kernel, turn_samples, self.harmonics.len() / self.capture.channels().max(1))
            }),
        }
    }

    /// Takes note of judged turns.
    fn sort(&mut self, judged: Vec<Verdict>) {
        for verdict in judged {
            match verdict.rejection(&self.capture.sensors) {
                None => self.used_samples += verdict.turn.samples(),
                Some(reason) => self.rejected.push(verdict.turn.rejected(verdict.turn.number, reason)),
            }
        }
    }

    /// Works on one turn, whose frames are all in the window.
    fn turn(&mut self, turn: Turn) {
        let length = self.angles;
        let (start, end) = (self.window.position(turn.start), self.window.position(turn.end));
        if self.capture.encoder {
            let steady = self.window.angle_rev.len() == self.window.len()
                && encoder::positions(&self.window.angle_rev, start, end, length, &mut self.positions);
            let inside = REACH as f64..(self.window.len() - REACH) as f64;
            if !(steady && self.positions.iter().all(|position| inside.contains(position))) {
                self.rejected.push(turn.rejected(turn.number, Rejection::Angle));
                return;
            }
        } else {
            let step = (end - start) / length as f64;
            self.positions.clear();
            self.positions.extend(self.counted.iter().map(|angle| start + angle * step));
        }
        let exact = self.positions.iter().all(|position| on_sample(*position).is_some());
        if let Some(defect) = self.defect(&turn, exact) {
            let sensor = self.capture.sensors.get(defect.channel).copied().unwrap_or(defect.channel);
            let reason = Rejection::Defect { sensor, kind: defect.kind };
            self.rejected.push(turn.rejected(turn.number, reason));
            return;
        }
        if let Some(fractions) = &mut self.fractions {
            fractions.note(&self.positions);
        }
        let looked_at = self.outliers.is_some() || self.means.looks_at_next();
        let readings = self.means.next();
        fused(Interpolation {
            kernel: self.kernel,
            samples: &self.window.channels(),
            positions: &self.positions,
            exact,
            values: readings,
        });
        self.bridges.cross(readings);
        let motion = self.motion.as_mut().map_or(&[][..], |motion| motion.of_turn(readings));
        if looked_at {
            self.analysis.take_apart(readings, &mut self.harmonics);
        }
        match &mut self.outliers {
            None => {
                self.means.add(&turn, &self.harmonics, motion);
                self.used_samples += turn.samples();
            }
            Some(outliers) => {
                let held = PendingTurn {
                    turn,
                    readings: readings.to_vec(),
                    harmonics: self.harmonics.clone(),
                    motion: motion.to_vec(),
                };
                let mut judged = Vec::new();
                outliers.add(held, &mut self.means, &mut judged);
                self.sort(judged);
            }
        }
    }

    /// The first bad run among the samples that the turn is made of.
    fn defect(&self, turn: &Turn, exact: bool) -> Option<&Defect> {
        let reach = if exact { 0.0 } else { REACH as f64 };
        let (first, last) = (turn.start.round() - reach, turn.end.round() + reach);
        let matters = |defect: &&Defect| {
            let samples = [defect.samples.start, defect.samples.end].map(|sample| sample as f64);
            let [from, to] = samples.map(|sample| (sample - turn.start) / turn.samples());
            samples[1] > first && samples[0] < last && !self.bridges.span(defect.channel, from, to)
        };
        self.defects.iter().find(matters)
    }
}

/// Place in the window of the first frame that a turn needs.
fn before(turn: &Turn) -> usize {
    (turn.start.floor() as usize).saturating_add(CONTINUED - REACH - 1)
}

/// Place behind the last frame that a turn needs; at least as many as the continuation reflects.
fn behind(turn: &Turn) -> usize {
    (turn.end.ceil() as usize).saturating_add(CONTINUED + REACH + 1).max(2 * CONTINUED + 1)
}

/// Equal angles on which turns are interpolated, and whether they are the samples themselves.
///
/// Where every turn is the same whole number of samples and begins at a sample, the samples themselves. Otherwise about as
/// many as a turn has samples: neighbouring angles then lie alike between the samples around them, which interpolation is
/// quick for. And enough that the highest order that a turn's samples can hold, half of them, folds to above the highest
/// order that is kept.
fn angles(turns: &[Turn], samples_per_rev: usize, encoder: bool) -> (usize, bool) {
    let longest = turns.iter().map(Turn::samples).fold(0.0, f64::max);
    if let Some(length) = on_sample(longest).filter(|length| *length > 0) {
        let whole = |turn: &Turn| on_sample(turn.start).is_some() && on_sample(turn.samples()) == Some(length);
        if turns.iter().all(whole) {
            return (length, true);
        }
    }
    // Within a turn the encoder shows faster and slower stretches: where it is slow, samples lie closer.
    let densest = if encoder { 1.25 * longest } else { longest };
    let needed = (0.5 * densest) as usize + max_order(samples_per_rev).min(orders_held(densest)) + 1;
    let fewest = needed.max(longest as usize).next_multiple_of(2);
    // Within a thousandth for the sake of a transform's good length.
    let smooth = (fewest..=fewest + fewest / 1000).step_by(2).find(|length| is_smooth(*length));
    (smooth.unwrap_or(fewest), false)
}

/// Whether 2, 3 and 5 are its only prime factors, which transforms are quick for.
fn is_smooth(mut number: usize) -> bool {
    for factor in [2, 3, 5] {
        while number > 0 && number.is_multiple_of(factor) {
            number /= factor;
        }
    }
    number == 1
}

/// Gives the orders, of so many that a turn holds, what did not pass of them, and leaves out those of which next to nothing did: they are not found to
/// be 0, they are not there.
///
/// Gives the root mean square in µm of what turns that are turned against each other leave out.
pub(super) fn restore(outcome: &mut CaptureAverage, mut orders: usize, channels: usize) -> f64 {
    let turned = outcome.angle_scatter.map(|scatter| scatter.passed(outcome.mean.len() / channels.max(1)));
    let left_out = turned.as_deref().map_or(0.0, |turned| left_out(outcome, passed::held(turned), channels));
    let passed: Vec<Vec<Complex64>> = outcome.passed.iter().cloned().chain(turned).collect();
    for passed in passed {
        undo(outcome, &passed, channels);
        orders = orders.min(passed::held(&passed));
    }
    if let (Some(scatter), Some(covariance)) = (outcome.angle_scatter, &mut outcome.covariance) {
        scatter.add_to(covariance, &outcome.mean, channels);
    }
    outcome.mean.truncate(orders * channels);
    for matrices in [&mut outcome.covariance, &mut outcome.scatter, &mut outcome.scatter_beside].into_iter().flatten() {
        matrices.truncate(orders * channels * channels);
    }
    if let Some(split) = &mut outcome.split {
        split::truncate(split, orders, channels);
    }
    left_out
}

/// Root mean square of the orders of an average from one on beyond their noise, in µm of the channel that has most.
fn left_out(outcome: &CaptureAverage, from: usize, channels: usize) -> f64 {
    let Some(covariance) = &outcome.covariance else { return 0.0 };
    let of_channel = |channel: usize| {
        let power = |orders: &[Complex64]| -> f64 {
            orders.iter().skip(channel).step_by(channels).map(Complex64::norm_sqr).sum()
        };
        let (kept, above) = outcome.mean.split_at((from * channels).min(outcome.mean.len()));
        let noise =
            covariance.chunks_exact(channels * channels).skip(from).map(|matrix| matrix[channel * (channels + 1)].re);
        beyond_noise(power(above), noise.sum(), power(kept.get(2 * channels..).unwrap_or_default()))
    };
    (0..channels).map(of_channel).fold(0.0, f64::max)
}

/// Gives an average, and everything about it order by order, what did not pass.
fn undo(outcome: &mut CaptureAverage, passed: &[Complex64], channels: usize) {
    passed::harmonics(&mut outcome.mean, passed, channels);
    for matrices in [&mut outcome.covariance, &mut outcome.scatter, &mut outcome.scatter_beside].into_iter().flatten() {
        passed::squares(matrices, passed, channels);
    }
    for tone in &mut outcome.near_tones {
        if let Some(passed) = passed.get(tone.order) {
            tone.leak.iter_mut().for_each(|leak| *leak /= passed);
        }
    }
    if let Some(split) = &mut outcome.split {
        passed::undo_split(split, passed, channels);
    }
}
