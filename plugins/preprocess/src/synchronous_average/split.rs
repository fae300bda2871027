//! The turns of a capture as a whole, and in parts where asked for.

use runout_core::{
    Complex64,
    profile::{Part, Split},
};

use super::mean::Mean;

/// Groups of consecutive turns: enough to see when something changed.
const GROUPS: usize = 5;

/// The mean of all turns, and of parts of them.
pub(super) struct Means {
    pub whole: Mean,
    parts: Option<Parts>,
}

struct Parts {
    /// Turns that can be expected, and how many of them are fitted.
    planned: usize,
    fitted: usize,
    fit: Mean,
    held_out: Mean,
    groups: Vec<Mean>,
    levels: Vec<f64>,
}

impl Means {
    /// For `planned` turns at most; the last ones of a share are held out.
    pub fn new(orders: usize, channels: usize, planned: usize, held_out: Option<f64>) -> Self {
        let parts = held_out.filter(|_| planned >= 4).map(|share| {
            let last = ((share * planned as f64).round() as usize).clamp(2, planned - 2);
            let fitted = planned - last;
            let groups = GROUPS.min(planned);
            let size = planned.div_ceil(groups);
            Parts {
                planned,
                fitted,
                fit: Mean::new(orders, channels, fitted),
                held_out: Mean::new(orders, channels, last),
                groups: (0..groups).map(|_| Mean::new(orders, channels, size)).collect(),
                levels: Vec::with_capacity(planned * channels),
            }
        });
        Self { whole: Mean::new(orders, channels, planned), parts }
    }

    /// Takes one turn's harmonics, `[order][channel]`.
    pub fn add(&mut self, turn: &[Complex64]) {
        if let Some(parts) = &mut self.parts {
            let number = self.whole.turns();
            let part = if number < parts.fitted { &mut parts.fit } else { &mut parts.held_out };
            part.add(turn);
            let groups = parts.groups.len();
            parts.groups[(number * groups / parts.planned).min(groups - 1)].add(turn);
            parts.levels.extend(turn[..self.whole.channels()].iter().map(|level| level.re));
        }
        self.whole.add(turn);
    }

    /// The parts; `None` where too few turns are left to fill them.
    pub fn split(&self) -> Option<Split> {
        let parts = self.parts.as_ref().filter(|parts| parts.held_out.turns() > 0)?;
        let fitted = parts.fit.turns();
        let part = |mean: &Mean, turns| Part {
            mean: mean.mean(),
            covariance: mean.covariance(),
            scatter: mean.scatter(),
            turns,
        };
        Some(Split {
            fit: part(&parts.fit, 0..fitted),
            held_out: part(&parts.held_out, fitted..fitted + parts.held_out.turns()),
            groups: parts.groups.iter().filter(|group| group.turns() > 0).map(Mean::mean).collect(),
            levels: parts.levels.clone(),
        })
    }
}

/// Leaves out the orders from `orders` on.
pub(super) fn truncate(split: &mut Split, orders: usize, channels: usize) {
    for part in [&mut split.fit, &mut split.held_out] {
        part.mean.truncate(orders * channels);
        for matrices in [&mut part.covariance, &mut part.scatter].into_iter().flatten() {
            matrices.truncate(orders * channels * channels);
        }
    }
    split.groups.iter_mut().for_each(|group| group.truncate(orders * channels));
}
