//! The turns of a capture as a whole, and in parts where asked for.

use runout_core::{
    Complex64,
    profile::{Part, Split, TURN_ORDERS, Turns},
    spread::Spread,
};

use super::{mean::Mean, spread::Extremes};

/// The mean of all turns, and of parts of them; how far turns lie apart.
pub(super) struct Means {
    pub whole: Mean,
    parts: Option<Parts>,
    extremes: Option<Extremes>,
}

struct Parts {
    /// How many turns are fitted.
    fitted: usize,
    fit: Mean,
    held_out: Mean,
    turns: Turns,
}

impl Means {
    /// For `planned` turns at most; the last ones of a share are held out.
    pub fn new(
        orders: usize,
        channels: usize,
        planned: usize,
        held_out: Option<f64>,
        extremes: Option<Extremes>,
    ) -> Self {
        let parts = held_out.filter(|_| planned >= 4).map(|share| {
            let last = ((share * planned as f64).round() as usize).clamp(2, planned - 2);
            let fitted = planned - last;
            let kept = orders.min(TURN_ORDERS);
            Parts {
                fitted,
                fit: Mean::new(orders, channels, fitted),
                held_out: Mean::new(orders, channels, last),
                turns: Turns {
                    numbers: Vec::with_capacity(planned),
                    orders: kept,
                    channels,
                    harmonics: Vec::with_capacity(planned * kept * channels),
                },
            }
        });
        Self { whole: Mean::new(orders, channels, planned), parts, extremes }
    }

    /// Takes the harmonics, `[order][channel]`, and the motion of the turn of this number.
    pub fn add(&mut self, number: usize, turn: &[Complex64], motion: &[f64]) {
        if let Some(Parts { fitted, fit, held_out, turns }) = &mut self.parts {
            let part = if self.whole.turns() < *fitted { fit } else { held_out };
            part.add(turn);
            turns.numbers.push(number);
            turns.harmonics.extend(&turn[..turns.orders * turns.channels]);
        }
        self.whole.add(turn);
        if let Some(extremes) = &mut self.extremes {
            extremes.add(motion);
        }
    }

    /// How far the turns lie apart, where wanted.
    pub fn spread(&mut self) -> Option<Spread> {
        self.extremes.take().and_then(Extremes::spread)
    }

    /// To be called after the last turn.
    pub fn sum_up(&mut self) {
        let parts = self.parts.iter_mut().flat_map(|parts| [&mut parts.fit, &mut parts.held_out]);
        parts.chain([&mut self.whole]).for_each(Mean::sum_up);
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
            turns: parts.turns.clone(),
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
    let turns = &mut split.turns;
    if orders < turns.orders {
        let kept = turns.harmonics.chunks(turns.orders * channels).flat_map(|turn| &turn[..orders * channels]);
        turns.harmonics = kept.copied().collect();
        turns.orders = orders;
    }
}
