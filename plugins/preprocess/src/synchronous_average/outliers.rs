//! Turns far from those around them.

use runout_core::{Complex64, numerics::statistics::upper_median, profile::Rejection};

use super::{split::Means, turns::Turn};

/// Turns that are evaluated together, at least: enough for a median, few enough to drift little and to be kept.
const TOGETHER: usize = 16;

/// Holds a few turns back until it can be said which of them are outliers.
///
/// The distance of a turn in a channel is the root mean square over the turn of what separates it from the median turn
/// (the median of real and of imaginary part, harmonic by harmonic). A turn is an outlier where this is more than
/// `sigma` times the median distance in that channel.
pub(super) struct Outliers {
    sigma: f64,
    channels: usize,
    held: Vec<PendingTurn>,
}

/// A turn that is not judged yet.
pub(super) struct PendingTurn {
    pub turn: Turn,
    /// `[channel][angle]`.
    pub readings: Vec<f64>,
    /// `[channel][order]`.
    pub harmonics: Vec<Complex64>,
    pub motion: Vec<f64>,
}

/// What became of one turn.
pub(super) struct Verdict {
    pub turn: Turn,
    /// The channel and its distance in µm, of an outlier.
    pub outlier: Option<(usize, f64)>,
}

impl Outliers {
    pub(super) fn new(sigma: f64, channels: usize) -> Self {
        Self { sigma, channels, held: Vec::new() }
    }

    /// Takes a turn; `judged` gets those that can now be judged.
    pub(super) fn add(&mut self, turn: PendingTurn, means: &mut Means, judged: &mut Vec<Verdict>) {
        self.held.push(turn);
        if self.held.len() >= 2 * TOGETHER {
            self.judge(TOGETHER, means, judged);
        }
    }

    /// Judges the first `count` turns held, or all that there are.
    pub(super) fn judge(&mut self, count: usize, means: &mut Means, judged: &mut Vec<Verdict>) {
        let together: Vec<_> = self.held.drain(..count.min(self.held.len())).collect();
        let channels = self.channels;
        let distances = distances_um(&together, channels);
        let usual: Vec<f64> = (0..channels)
            .map(|channel| {
                upper_median(&mut distances.iter().map(|turn| turn[channel]).collect::<Vec<_>>()).unwrap_or(0.0)
            })
            .collect();
        for (PendingTurn { turn, readings, harmonics, motion }, distances) in together.into_iter().zip(distances) {
            let farthest = distances.iter().zip(&usual).map(|(distance, usual)| distance - self.sigma * usual);
            let outlier =
                farthest.enumerate().filter(|(_, beyond)| *beyond > NOTHING_UM).max_by(|a, b| a.1.total_cmp(&b.1));
            if outlier.is_none() {
                means.next().copy_from_slice(&readings);
                means.add(&turn, &harmonics, &motion);
            }
            judged.push(Verdict { turn, outlier: outlier.map(|(channel, _)| (channel, distances[channel])) });
        }
    }

    /// All turns that are still held.
    pub(super) fn judge_rest(&mut self, means: &mut Means, judged: &mut Vec<Verdict>) {
        self.judge(usize::MAX, means, judged);
    }
}

/// Below, turns differ by rounding.
const NOTHING_UM: f64 = 1e-9;

/// `[turn][channel]`.
fn distances_um(turns: &[PendingTurn], channels: usize) -> Vec<Vec<f64>> {
    let mut squares = vec![vec![0.0; channels]; turns.len()];
    let length = turns.first().map_or(0, |turn| turn.harmonics.len());
    let orders = (length / channels.max(1)).max(1);
    let mut parts = vec![0.0; turns.len()];
    for at in 0..length {
        let mut middle = |part: fn(&Complex64) -> f64| {
            parts.clear();
            parts.extend(turns.iter().map(|turn| part(&turn.harmonics[at])));
            upper_median(&mut parts).unwrap_or(0.0)
        };
        let middle = Complex64::new(middle(|value| value.re), middle(|value| value.im));
        // A harmonic's mean square over the turn is half of its amplitude's square; that of the level is all of it.
        let share = if at % orders == 0 { 1.0 } else { 0.5 };
        for (turn, squares) in turns.iter().zip(&mut squares) {
            squares[at / orders] += share * (turn.harmonics[at] - middle).norm_sqr();
        }
    }
    squares.iter_mut().flatten().for_each(|square| *square = square.sqrt());
    squares
}

impl Verdict {
    /// Why the turn is not used, where it is not.
    pub(super) fn rejection(&self, sensors: &[usize]) -> Option<Rejection> {
        let (channel, distance_um) = self.outlier?;
        Some(Rejection::Outlier { sensor: sensors.get(channel).copied().unwrap_or(channel), distance_um })
    }
}
