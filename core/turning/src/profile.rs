//! The synchronous average of one capture, one harmonic at a time, with its covariance over the turns.

pub use crate::smoothing::{SMOOTHING, orders_beside};
use crate::{
    creep::Levels,
    measurement::{DefectKind, Response, Trim},
    near_tone::{NearTone, near_tones},
    neighbours::Neighbours,
    spread::Spread,
};
use runout_consistency::turns::{PhaseCourse, TurnCourse};
use runout_numerics::Complex64;
use std::f64::consts::FRAC_1_SQRT_2;

/// What the turns of one capture say together: Re Σ cₙ e^{−inΦ} for each channel, Φ the spindle angle.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Profile {
    /// Where it came from, for messages.
    pub object: String,
    /// Index into the rig's setups.
    pub setup: usize,
    /// The rig's sensor behind each channel.
    pub sensors: Vec<usize>,
    /// Equal angles per turn on which the turns were averaged.
    pub samples_per_rev: usize,
    /// Equal angles on which each turn was taken apart into harmonics: what does not close over the turn folds at half of
    /// them.
    pub turn_angles: usize,
    /// Mean over the turns, µm, `[order][channel]`, orders 0..=`max_order`.
    pub mean: Vec<Complex64>,
    /// Covariance of that mean across channels, µm², `[order][channel][channel]`, E[δ δᴴ]; `None` below two turns. It
    /// holds for turns that depend on each other, as those of a spindle do.
    pub covariance: Option<Vec<Complex64>>,
    /// The covariance of single turns over their number, likewise: what the covariance of the mean would be if turns
    /// were independent. It is the better known of the two, and serves for weights.
    pub scatter: Option<Vec<Complex64>>,
    /// The scatter without what `covariance` is taken from, likewise. A covariance does not show what weights from the same
    /// readings gain by fitting their noise; with these weights it is without bias. `None` where it is not known apart.
    pub scatter_beside: Option<Vec<Complex64>>,
    /// Tones so near to an order that the mean takes them for synchronous.
    pub near_tones: Vec<NearTone>,
    /// Mean level of each turn used.
    pub levels: TurnLevels,
    /// What the low orders of its turns say of their course.
    pub course: TurnCourse,
    /// What its marks were put right by, where they do not count the part's turns.
    pub recounted: Option<Recounted>,
    /// The turns used, in parts, where asked for.
    pub split: Option<Split>,
    /// How far the turns lie apart, where asked for and there are two.
    pub spread: Option<Spread>,
    /// How many turns there were, and what became of them.
    pub turns: TurnCount,
    /// Standard uncertainty of the spindle angle that the turns are counted from, in rad: of marks that are known to a part of a
    /// sample only. It turns all harmonics together.
    pub angle_std_rad: f64,
    /// Standard deviation by which marks, or a speed that changes between them, turn single turns, in rad. It turns the eccentricity of every turn.
    pub turn_angle_std_rad: f64,
    /// Mean speed over the turns used, where the sampling rate is known.
    pub speed_rpm: Option<f64>,
    /// Samples a second, where known.
    pub sample_rate_hz: Option<f64>,
    /// Filters that the signal went through.
    pub responses: Vec<Response>,
    /// By how much interruptions of the part's surface are bridged beyond what the rig declares, at each end, in rad.
    pub bridged_beyond_rad: f64,
    /// What the average leaves out above its highest order, beyond noise: root mean square in µm.
    pub absent_um: f64,
    /// What the user should know of this capture.
    pub warnings: Vec<String>,
}

/// Turns that are counted otherwise than by the recorded marks.
#[derive(Debug, Clone, PartialEq)]
pub struct Recounted {
    /// How the part turns against the marks: each against what the one before leaves.
    pub by: Vec<PhaseCourse>,
    /// The average by the marks as they are recorded.
    pub as_marked: Box<Profile>,
}

/// Mean levels of turns, as far as they are in an average.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TurnLevels {
    /// Each turn's number in the capture: those left out are missing.
    pub numbers: Vec<usize>,
    /// In µm, `[turn][channel]`.
    pub levels_um: Vec<f64>,
}

impl TurnLevels {
    /// Those of one of so many channels.
    #[must_use]
    pub fn of(&self, channel: usize, channels: usize) -> Levels {
        let levels = self.levels_um.iter().skip(channel).step_by(channels.max(1)).copied();
        Levels::new(self.numbers.iter().copied().zip(levels))
    }
}

/// The turns of a capture in parts: what a model is fitted to, and what it has not seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Split {
    /// The first turns.
    pub fit: Part,
    /// The last ones.
    pub held_out: Part,
    /// What the covariance of the mean over all turns is taken from; nothing below three turns.
    pub neighbours: Option<Neighbours>,
    /// Each turn by itself.
    pub turns: Turns,
}

/// Orders, from 0, that are kept of every turn: enough to see what changes from turn to turn.
pub const TURN_ORDERS: usize = 41;

/// The low harmonics of each turn used.
#[derive(Debug, Clone, PartialEq)]
pub struct Turns {
    /// Each turn's number in the capture: those left out are missing.
    pub numbers: Vec<usize>,
    /// Orders of each turn, from 0: [`TURN_ORDERS`] or what the average holds.
    pub orders: usize,
    /// Channels.
    pub channels: usize,
    /// Sample positions at which each turn begins and ends.
    pub spans: Vec<[f64; 2]>,
    /// Coefficients of Re Σ cₙ e^{−inΦ} in µm, `[turn][order][channel]`.
    pub harmonics: Vec<Complex64>,
}

impl Turns {
    /// How many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.numbers.len()
    }

    /// The coefficient of a turn (by position), order and channel; NaN where there is none.
    #[must_use]
    pub fn at(&self, turn: usize, order: usize, channel: usize) -> Complex64 {
        let is_kept = order < self.orders && channel < self.channels;
        let found = self.harmonics.get((turn * self.orders + order) * self.channels + channel).filter(|_| is_kept);
        found.copied().unwrap_or(Complex64::new(f64::NAN, f64::NAN))
    }

    /// Mean level of a channel in each turn, in µm.
    pub fn levels(&self, channel: usize) -> impl Iterator<Item = f64> + '_ {
        (0..self.count()).map(move |turn| self.at(turn, 0, channel).re)
    }
}

/// Consecutive turns, averaged: fields as in [`Profile`].
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Mean over the turns.
    pub mean: Vec<Complex64>,
    /// Covariance of that mean.
    pub covariance: Option<Vec<Complex64>>,
    /// Covariance of that mean if turns were independent.
    pub scatter: Option<Vec<Complex64>>,
    /// What that covariance is taken from; nothing below three turns.
    pub neighbours: Option<Neighbours>,
    /// First turn and number of turns, among those used.
    pub turns: std::ops::Range<usize>,
}

impl Split {
    /// A profile of one part only.
    #[must_use]
    pub fn profile(&self, whole: &Profile, part: &Part) -> Profile {
        Profile {
            mean: part.mean.clone(),
            covariance: part.covariance.clone(),
            scatter: part.scatter.clone(),
            scatter_beside: None,
            near_tones: part.neighbours.as_ref().map(near_tones).unwrap_or_default(),
            split: None,
            spread: None,
            turns: TurnCount { used: part.turns.len(), ..whole.turns.clone() },
            ..whole.clone()
        }
    }
}

impl Profile {
    /// The largest amplitude of order 1 of a reading, in µm.
    #[must_use]
    pub fn eccentricity_um(&self) -> f64 {
        let channels = self.sensors.len();
        self.mean.iter().skip(channels).take(channels).map(|value| value.norm()).fold(0.0, f64::max)
    }

    /// What marks that turn single turns add to them, in µm rms: they turn an eccentricity e by their scatter σ, which is eσ/√2 in every
    /// direction.
    #[must_use]
    pub fn jitter_um(&self) -> f64 {
        FRAC_1_SQRT_2 * self.turn_angle_std_rad * self.eccentricity_um()
    }

    /// Share of the amplitude of an order that the filters before it pass; 1 where the speed is not known.
    #[must_use]
    pub fn passed(&self, order: usize) -> f64 {
        let Some(speed_rpm) = self.speed_rpm else { return 1.0 };
        let frequency_hz = order as f64 * speed_rpm / 60.0;
        self.responses.iter().map(|response| response.amplitude(frequency_hz)).product()
    }

    /// Memory that its coefficients take, in bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let matrices = [&self.covariance, &self.scatter, &self.scatter_beside];
        let own = self.mean.len() + matrices.into_iter().flatten().map(Vec::len).sum::<usize>();
        let beside = self.split.as_ref().map_or(0, |split| {
            let part = |part: &Part| {
                let matrices = [&part.covariance, &part.scatter].into_iter().flatten().map(Vec::len).sum::<usize>();
                part.mean.len() + matrices + part.neighbours.as_ref().map_or(0, Neighbours::count)
            };
            let all = split.neighbours.as_ref().map_or(0, Neighbours::count);
            part(&split.fit) + part(&split.held_out) + all + split.turns.harmonics.len()
        });
        ((own + beside) * size_of::<Complex64>()) as u64
    }

    /// Number of channels.
    #[must_use]
    pub fn channels(&self) -> usize {
        self.sensors.len()
    }

    /// Highest order that the average holds.
    #[must_use]
    pub fn max_order(&self) -> usize {
        (self.mean.len() / self.channels().max(1)).saturating_sub(1)
    }

    /// The mean of one order, one coefficient a channel; nothing above [`max_order`](Self::max_order).
    #[must_use]
    pub fn order(&self, order: usize) -> &[Complex64] {
        let channels = self.channels();
        self.mean.get(order * channels..(order + 1) * channels).unwrap_or_default()
    }

    /// The covariance of one order's mean, `[channel][channel]`; `None` where it is not known.
    #[must_use]
    pub fn order_covariance(&self, order: usize) -> Option<&[Complex64]> {
        let size = self.channels() * self.channels();
        self.covariance.as_ref()?.get(order * size..(order + 1) * size)
    }
}

/// Neighbours to each side of an order that the covariance of a mean is taken from. With covariances averaged over five
/// orders they make 20 complex degrees of freedom.
pub const NEIGHBOURS: usize = 2;

/// Replaces the covariance of each order, `[order][entry]` with `size` entries, by the mean over its neighbours. Order 1
/// is not pooled with the others: a disturbance of the eccentricity affects order 1 only.
pub fn smooth(covariance: &mut [Complex64], size: usize) {
    smooth_over(covariance, size, |order, max_order| {
        order.saturating_sub(SMOOTHING).max(2)..=(order + SMOOTHING).min(max_order)
    });
}

/// Replaces the covariance of each order, `[order][entry]` with `size` entries, by the mean over [`orders_beside`] to each side:
/// what the variance of a result is taken from.
///
/// At low orders the density of asynchronous motion differs from order to order, by slow motion and by single tones:
/// there an order is evaluated by itself.
pub fn smooth_by_order(covariance: &mut [Complex64], size: usize) {
    smooth_over(covariance, size, |order, max_order| {
        let beside = orders_beside(order);
        order - beside..=(order + beside).min(max_order)
    });
}

/// Means over windows of orders, by order and highest order.
fn smooth_over(
    covariance: &mut [Complex64],
    size: usize,
    window: impl Fn(usize, usize) -> std::ops::RangeInclusive<usize>,
) {
    const WINDOW: usize = 2 * SMOOTHING + 1;
    let raw = covariance.to_vec();
    let max_order = (raw.len() / size.max(1)).saturating_sub(1);
    for order in 2..=max_order {
        let window = window(order, max_order);
        let count = window.end() + 1 - window.start();
        let near = &raw[window.start() * size..(window.end() + 1) * size];
        let target = &mut covariance[order * size..(order + 1) * size];
        // Where all are there, their sums need not be kept in memory.
        if count == WINDOW {
            let near: [&[Complex64]; WINDOW] = std::array::from_fn(|index| &near[index * size..(index + 1) * size]);
            for (entry, target) in target.iter_mut().enumerate() {
                *target = near.iter().map(|near| near[entry]).sum::<Complex64>() / WINDOW as f64;
            }
        } else {
            for (entry, target) in target.iter_mut().enumerate() {
                *target = near.iter().skip(entry).step_by(size).sum::<Complex64>() / count as f64;
            }
        }
    }
}

/// Every turn of a capture is either used or listed here.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TurnCount {
    /// Whole turns between the first and the last mark.
    pub recorded: usize,
    /// Turns in the average.
    pub used: usize,
    /// Turns set aside at the ends.
    pub trimmed: Vec<Trim>,
    /// Turns left out of the average.
    pub rejected: Vec<RejectedTurn>,
}

/// A turn that was left out, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct RejectedTurn {
    /// Counted from 0 at the capture's first mark.
    pub turn: usize,
    /// Sample at which it begins.
    pub start_sample: u64,
    /// Why.
    pub reason: Rejection,
}

/// Why a turn was left out.
#[derive(Debug, Clone, PartialEq)]
pub enum Rejection {
    /// About twice as long as the others: a mark is missing.
    MissingMark(TurnLength),
    /// A piece of a turn, or next to one: a mark was counted twice.
    DoubledMark(TurnLength),
    /// Its length is off by more than the tolerance.
    Speed(TurnLength),
    /// A channel holds samples that cannot be trusted.
    Defect {
        /// The rig's sensor.
        sensor: usize,
        /// What is wrong with them.
        kind: DefectKind,
    },
    /// A channel is far from the other turns.
    Outlier {
        /// The rig's sensor.
        sensor: usize,
        /// Root mean square distance from the other turns, in µm.
        distance_um: f64,
    },
    /// The turn is not wholly covered by samples.
    Incomplete,
    /// The encoder's angle does not grow steadily by one turn.
    Angle,
}

/// A turn's length beside the others'.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnLength {
    /// Its own, in samples.
    pub samples: f64,
    /// The capture's median, in samples.
    pub median_samples: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn low_orders_are_evaluated_by_themselves() {
        // A line at order 2 of a spectrum that is 1 elsewhere.
        let mut covariance: Vec<Complex64> =
            (0..20).map(|order| Complex64::from(if order == 2 { 61.0 } else { 1.0 })).collect();
        let mut over_five = covariance.clone();
        smooth_by_order(&mut covariance, 1);
        smooth(&mut over_five, 1);
        let rounded = |all: &[Complex64]| all[..8].iter().map(|entry| entry.re.round() as i64).collect::<Vec<_>>();
        assert_eq!(rounded(&covariance), [1, 1, 61, 1, 1, 1, 1, 1]);
        assert_eq!(rounded(&over_five), [1, 1, 21, 16, 13, 1, 1, 1]);
        assert_eq!([1, 3, 4, 7, 8, 100].map(orders_beside), [0, 0, 1, 1, 2, 2]);
    }
}
